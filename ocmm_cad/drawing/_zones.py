"""Import of geometrical tolerances as characteristics with a zone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Literal

import msgspec

from ocmm_cad.drawing._context import AccountItem, Context, Found, RefusedError, plan_name
from ocmm_cad.drawing._frames import DatumFrames
from ocmm_cad.drawing._sizes import Sizes
from ocmm_cad.pmi import Tolerance
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.tolerances.zones import Characteristic

Zone = Literal["", "planes", "cylinder", "sphere"]
_ZONES: dict[str, Zone] = {
    "": "", "cylindrical or circular": "cylinder", "spherical": "sphere",
}  # fmt: skip
_MATERIAL: dict[str, Literal["maximum material", "least material"]] = {
    "maximum material requirement": "maximum material",
    "least material requirement": "least material",
}
_ORIENTATION = ("parallelism", "perpendicularity", "angularity")
_FORM = ("flatness", "roundness", "cylindricity", "straightness")
_RUNOUT = ("circular runout", "total runout")
_IN_DATUMS = ("position", "line profile", "surface profile")
"""Kinds whose zones are located by datums; those of one system must be met simultaneously."""


class Zones:
    def __init__(
        self, context: Context, frames: DatumFrames, sizes: Sizes, tolerances: Sequence[Tolerance]
    ) -> None:
        self._context, self._frames, self._sizes = context, frames, sizes
        self._shared = Counter(
            _system(item) for item in tolerances if item.word in _IN_DATUMS and item.datums
        )

    def import_item(self, item: Tolerance) -> AccountItem:
        """Import a tolerance, and return its result."""
        said = AccountItem(
            group="tolerance", name=item.name, kind=_text(item), entity=item.entity,
            status="refused",
        )  # fmt: skip
        try:
            self._refuse(item)
            found = self._context.surfaces.all_of(item.faces, item.odd)
            datums = self._frames.names_of(item.datums)
            wanted = self._context.checked(self._characteristics(item, found, datums))
            remark = self._remark(item, found, datums)
            names = self._context.add(wanted)
        except RefusedError as error:
            return msgspec.structs.replace(said, why=str(error))
        return msgspec.structs.replace(
            said, status="partly" if found.missing else "taken", became=names,
            why="; ".join(found.missing), remark=remark,
        )  # fmt: skip

    def _refuse(self, item: Tolerance) -> None:
        if item.fault:
            raise RefusedError(item.fault)
        if item.extras:
            raise RefusedError(f"it is {', '.join(item.extras)}, which is not supported")
        if item.zone not in _ZONES:
            raise RefusedError(f"a zone of the form '{item.zone}' is not supported")
        for word in item.modifiers:
            if word not in _MATERIAL:
                raise RefusedError(f"its modifier '{word}' is not supported")
        if item.modifiers and item.word != "position":
            raise RefusedError(f"a {item.word} with '{item.modifiers[0]}' is not supported")
        if len(item.modifiers) > 1:
            raise RefusedError(f"it has {len(item.modifiers)} modifiers at once")
        if item.size is None or item.size <= 0.0:
            raise RefusedError("a tolerance of zero is not supported")

    def _characteristics(
        self, item: Tolerance, found: Found, datums: list[str]
    ) -> list[Characteristic]:
        features = found.features
        if item.segment == "lower":
            item = self._lower(item, features, datums)
        if item.word in ("surface profile", "line profile"):
            self._refuse_shared(item, 1, datums)
            return [_characteristic(item, features, datums)]
        if item.word == "symmetry":
            return [_characteristic(item, features, datums)]
        if item.word == "position":
            self._refuse_shared(item, len(features), datums)
        makers = {"position": self._position, **dict.fromkeys(_ORIENTATION, _orientation)}
        made = makers.get(item.word, _plain)
        several = len(features) > 1
        flat = all(feature.shape is Shape.PLANE for feature in features)
        if several and flat and item.word in _ORIENTATION:
            raise RefusedError("the orientation of the middle plane of two faces is not supported")
        return [made(item, one, datums, several) for one in features]

    def _lower(
        self, item: Tolerance, features: Sequence[NominalFeature], datums: list[str]
    ) -> Tolerance:
        """Return the lower segment of a composite tolerance on its own (ASME Y14.5).

        It leaves the location to the upper one. A profile without datums is one; for one face or
        axis the rest is an orientation. Locations within a pattern are neither.
        """
        if item.word == "surface profile" and not datums:
            return item
        is_round = _ZONES[item.zone] == "cylinder"
        one = features[0]
        if len(features) > 1 or not datums or is_round == (one.shape is Shape.PLANE):
            raise RefusedError(
                "the lower segment of a composite tolerance holds several features to each other, "
                "which is not supported; tolerance the distances between them by hand"
            )
        if item.modifiers:
            raise RefusedError(
                f"a lower segment with '{item.modifiers[0]}' is not supported; add the orientation "
                "by hand without it, which is on the safe side"
            )
        for word in _ORIENTATION[:-1]:
            turned = msgspec.structs.replace(item, word=word)
            try:
                self._context.checked([_orientation(turned, one, datums, several=False)])
            except RefusedError:
                continue
            return turned
        return msgspec.structs.replace(item, word=_ORIENTATION[-1])

    def _position(
        self, item: Tolerance, feature: NominalFeature, datums: list[str], several: bool
    ) -> Characteristic:
        zone = _ZONES[item.zone]
        flat = feature.shape is Shape.PLANE
        if not flat and not zone:
            raise RefusedError(
                f"the file does not say which way the zone of {feature.name} lies (it has no Ø)"
            )
        if flat and several:
            raise RefusedError("the position of the middle plane of two faces is not supported")
        if flat and zone:
            raise RefusedError(f"{feature.name} is a plane, and its zone is {item.zone}")
        found = _characteristic(item, (feature,), datums, several=several)
        found = msgspec.structs.replace(found, zone=zone)
        if not item.modifiers:
            return found
        modifier = _MATERIAL[item.modifiers[0]]
        return msgspec.structs.replace(
            found, modifier=modifier, material_size=self._material_size(feature, modifier)
        )

    def _material_size(self, feature: NominalFeature, modifier: str) -> float:
        limits = self._sizes.limits.get(feature.name, [])
        if len(limits) != 1:
            count = "no" if not limits else f"{len(limits)}"
            raise RefusedError(
                f"it has '{modifier}', and {feature.name} {count} toleranced sizes in the plan"
            )
        # At maximum material a bore is at its smallest, a shaft at its largest.
        small = (feature.side == "inner") == (modifier == "maximum material")
        return round(limits[0].low if small else limits[0].high, 6)

    def _refuse_shared(self, item: Tolerance, count: int, datums: list[str]) -> None:
        """Refuse zones that share an open datum system: each alone would be too lenient."""
        if not datums:
            return
        free = self._frames.open_motions(datums)
        sharing = max(count, self._shared[_system(item)])
        if free and sharing > 1:
            raise RefusedError(
                f"its datums leave {' and '.join(free)} open, and {sharing} zones must be met at "
                "once, which is not supported"
            )

    def _remark(self, item: Tolerance, found: Found, datums: list[str]) -> str:
        said = []
        if item.segment == "upper":
            said.append("the upper segment of a composite tolerance alone")
        if item.segment == "lower":
            said.append("the lower segment of a composite tolerance: form and orientation alone")
        if item.word in _IN_DATUMS and datums and item.segment != "lower":
            free = self._frames.open_motions(datums)
            if free:
                said.append(f"the datums leave {' and '.join(free)} open; the zone follows")
        said += [f"the file names some of the faces of {name} only" for name in found.part_of]
        return "; ".join(said)


def _plain(
    item: Tolerance, feature: NominalFeature, datums: list[str], several: bool
) -> Characteristic:
    if item.word in _FORM:
        if datums:
            raise RefusedError(f"a {item.word} has no datums")
        round_zone = _ZONES[item.zone] == "cylinder"
        if item.word == "straightness" and not (round_zone and feature.shape is Shape.CYLINDER):
            raise RefusedError("the straightness of lines on a surface is not supported")
        if item.word != "straightness" and item.zone:
            raise RefusedError(f"a {item.word} in a zone of the form '{item.zone}' is unknown")
    elif item.word == "concentricity" and feature.shape is not Shape.SPHERE:
        raise RefusedError("the concentricity of median points is not supported")
    elif item.word not in (*_RUNOUT, "coaxiality", "concentricity"):
        raise RefusedError(f"a {item.word} is not supported")
    return _characteristic(item, (feature,), datums, several=several)


def _orientation(
    item: Tolerance, feature: NominalFeature, datums: list[str], several: bool
) -> Characteristic:
    zone = _ZONES[item.zone]
    flat = feature.shape is Shape.PLANE
    if flat and zone:
        raise RefusedError(f"{feature.name} is a plane, and its zone is {item.zone}")
    if not flat and zone != "cylinder":
        raise RefusedError(
            f"the file does not say which way the zone of {feature.name} lies (it has no Ø)"
        )
    found = _characteristic(item, (feature,), datums, several=several)
    return found if flat else msgspec.structs.replace(found, zone=zone)


def _characteristic(
    item: Tolerance, features: Sequence[NominalFeature], datums: list[str], *, several: bool = False
) -> Characteristic:
    if item.size is None:
        raise RefusedError("the file gives it no size")
    return Characteristic(
        name=plan_name(item.name, features[0] if several else None), kind=item.word,
        features=[feature.name for feature in features], upper=item.size, datums=datums,
    )  # fmt: skip


def _system(item: Tolerance) -> tuple[tuple[str, ...], ...]:
    return tuple(reference.labels for reference in item.datums)


def _text(item: Tolerance) -> str:
    sign = {"cylinder": "Ø", "sphere": "SØ"}.get(_ZONES.get(item.zone, ""), "")
    said = item.word
    if item.size is not None:
        said += f" {sign}{item.size:g} mm"
    for word in item.modifiers:
        said += {"maximum material": " (M)", "least material": " (L)"}.get(
            _MATERIAL.get(word, ""), f" ({word})"
        )
    for reference in item.datums:
        said += "|" + "-".join(reference.labels)
        said += "".join(f" ({word})" for word in reference.modifiers)
    return said + (f", {item.segment} segment" if item.segment else "")
