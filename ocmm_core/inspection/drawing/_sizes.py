"""Dimensions of a model become sizes, distances and angles with limits."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.drawing._account import AccountItem, RefusedError
from ocmm_core.inspection.drawing._context import Context, plan_name
from ocmm_core.inspection.drawing._fits import fit_limits
from ocmm_core.inspection.drawing._general import General
from ocmm_core.inspection.drawing._surfaces import Found
from ocmm_core.inspection.pmi import Dimension
from ocmm_core.tolerances.zones import Characteristic

THEORETICAL = "theoretical"
"""Word of the file for a theoretically exact (basic) dimension."""
_BASIC = (THEORETICAL, "basic", "theoretically exact")
_REFERENCE = ("auxiliary", "reference")
_SIZES = {
    "diameter": ("diameter", (Shape.CYLINDER, Shape.SPHERE)),
    "spherical diameter": ("diameter", (Shape.SPHERE,)),
    "radius": ("radius", (Shape.CYLINDER, Shape.SPHERE)),
    "spherical radius": ("radius", (Shape.SPHERE,)),
}
_BETWEEN_FACES = ("size", "width", "thickness", "linear distance", "distance")


@dataclass(frozen=True, slots=True)
class SizeLimits:
    """Limits of the diameter of a feature, mm."""

    low: float
    high: float


class Sizes:
    """Takes dimensions into a plan, and knows the limits of the sizes that it took.

    Attributes
    ----------
    limits
        Of diameters, by the name of the feature; of a feature with several sizes all.
    """

    def __init__(self, context: Context, general: General | None) -> None:
        self._context, self._general = context, general
        self.limits: dict[str, list[SizeLimits]] = {}

    def take(self, item: Dimension) -> AccountItem:
        """Take a dimension, and return what became of it."""
        said = AccountItem(
            group="dimension", name=item.name, kind=_words(item), entity=item.entity,
            status="refused",
        )  # fmt: skip
        try:
            if item.fault:
                raise RefusedError(item.fault)
            found = self._found(item)
            item, general = self._with_limits(item, found)
            if item.lower is None:
                return self._as_nominal(item, found, said)
            wanted = self._context.checked(self._characteristics(item, found))
            names = self._context.add(wanted)
            if not item.is_location:
                self._remember(wanted)
        except RefusedError as error:
            return msgspec.structs.replace(said, why=str(error))
        remarks = [general] if general else []
        remarks += [f"the file names some of the faces of {name} only" for name in found.part_of]
        return msgspec.structs.replace(
            said, status="partly" if found.missing else "taken", became=names,
            why="; ".join(found.missing), remark="; ".join(remarks),
        )  # fmt: skip

    def _found(self, item: Dimension) -> Found:
        surfaces = self._context.surfaces
        if not item.is_location:
            return surfaces.all_of(item.faces, item.odd)
        both = [surfaces.one(faces, item.odd) for faces in (item.faces, item.other_faces)]
        if both[0].name == both[1].name:
            raise RefusedError(f"both of its ends are {both[0].name}")
        return Found(tuple(both), (), ())

    def _with_limits(self, item: Dimension, found: Found) -> tuple[Dimension, str]:
        """Return a dimension with limits, its own or general ones, and what is said of those."""
        for note in item.notes:
            if note in _REFERENCE:
                raise RefusedError("it is a reference dimension, which has no tolerance")
            if note not in _BASIC:
                raise RefusedError(f"its note '{note}' is not supported")
        if item.fit:
            return self._with_fit(item, found)
        if item.nominal is None:
            raise RefusedError("the file gives it no value")
        basic = any(note in _BASIC for note in item.notes)
        if basic and item.lower is not None:
            raise RefusedError("it is theoretically exact and has limits at once")
        if basic or item.lower is not None:
            return item, ""
        if self._general is None:
            raise RefusedError("it has no tolerance, and no general tolerance was asked for")
        if item.of != "length":
            raise RefusedError(f"{self._general.words} is taken for lengths only")
        off = self._general.deviation(item.nominal)
        if off is None:
            raise RefusedError(f"{self._general.words} has no value for {item.nominal:g} mm")
        words = f"by the general tolerance {self._general.words}: ±{off:g} mm"
        return msgspec.structs.replace(item, lower=-off, upper=off), words

    def _with_fit(self, item: Dimension, found: Found) -> tuple[Dimension, str]:
        """Return a diameter with the limits of its fit, and what is said of them."""
        if item.nominal is None:
            raise RefusedError(f"its limits are the fit {item.fit}, and the file gives it no value")
        if item.word != "diameter" or item.of != "length" or item.lower is not None or item.notes:
            raise RefusedError(
                f"its limits are the fit {item.fit}, which is taken for a diameter without notes "
                "or limits as numbers"
            )
        lower, upper, is_hole = fit_limits(item.fit, item.nominal)
        for feature in found.features:
            if (feature.side == "inner") != is_hole:
                what = "hole" if is_hole else "shaft"
                raise RefusedError(
                    f"its limits are the fit {item.fit} of a {what}, and {feature.name} is none"
                )
        words = f"{item.fit} by ISO 286-1: {1e3 * upper:+g} {1e3 * lower:+g} \u00b5m"
        return msgspec.structs.replace(item, lower=lower, upper=upper), words

    def _as_nominal(self, item: Dimension, found: Found, said: AccountItem) -> AccountItem:
        """Return what became of a theoretically exact dimension: the model must have it."""
        exact = msgspec.structs.replace(item, lower=0.0, upper=0.0)
        wanted = self._context.checked(self._characteristics(exact, found))
        names = tuple(dict.fromkeys(name for one in wanted for name in one.features))
        return msgspec.structs.replace(
            said, status="partly" if found.missing else "taken",
            became=tuple(f"nominal of {name}" for name in names), why="; ".join(found.missing),
        )  # fmt: skip

    def _characteristics(self, item: Dimension, found: Found) -> list[Characteristic]:
        features = found.features
        if item.of == "angle":
            return self._angles(item, features)
        if item.is_location:
            if item.word != "linear distance":
                raise RefusedError(f"a distance of the kind '{item.word}' is not supported")
            return [_of(item, "distance", features)]
        if item.word in _SIZES:
            kind, shapes = _SIZES[item.word]
            for feature in features:
                if feature.shape not in shapes:
                    word = feature.shape.value.lower()
                    raise RefusedError(f"{feature.name} is a {word}, which has no {item.word}")
            return [_of(item, kind, (one,), several=len(features) > 1) for one in features]
        if item.word in _BETWEEN_FACES:
            flat = [one for one in features if one.shape is Shape.PLANE]
            if len(flat) != 2 or len(features) != 2 or found.missing:
                raise RefusedError(f"a {item.word} is taken of two opposite faces only")
            return [_of(item, "distance", features)]
        raise RefusedError(f"a size of the kind '{item.word}' is not supported")

    def _angles(
        self, item: Dimension, features: tuple[NominalFeature, ...]
    ) -> list[Characteristic]:
        if item.is_location:
            return [_of(item, "angle", features)]
        for feature in features:
            if feature.shape is not Shape.CONE:
                raise RefusedError(f"{feature.name} is no cone, which has an angle")
        return [_of(item, "angle", (one,), several=len(features) > 1) for one in features]

    def _remember(self, taken: list[Characteristic]) -> None:
        for item in taken:
            factor = {"diameter": 1.0, "radius": 2.0}.get(item.kind)
            if factor is not None:
                low, high = (factor * (item.nominal + off) for off in (item.lower, item.upper))
                self.limits.setdefault(item.features[0], []).append(SizeLimits(low, high))


def _of(
    item: Dimension, kind: str, features: tuple[NominalFeature, ...], *, several: bool = False
) -> Characteristic:
    if item.nominal is None or item.lower is None or item.upper is None:
        raise RefusedError("the file gives it no value")
    return Characteristic(
        name=plan_name(item.name, features[0] if several else None), kind=kind,
        features=[feature.name for feature in features], nominal=item.nominal, lower=item.lower,
        upper=item.upper,
    )  # fmt: skip


def _words(item: Dimension) -> str:
    """Return what a dimension says, as on a drawing."""
    said = item.word
    unit = {"length": " mm", "angle": "°"}.get(item.of, "")
    if item.nominal is not None:
        said += f" {item.nominal:g}"
        if item.lower is not None and item.upper is not None:
            if item.lower == -item.upper:
                said += f" ±{item.upper:g}"
            else:
                said += f" {item.upper:+g} {item.lower:+g}"
        said += unit
    if item.fit:
        said += f" {item.fit}"
    return said + "".join(f", {note}" for note in item.notes)
