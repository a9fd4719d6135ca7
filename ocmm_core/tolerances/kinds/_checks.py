"""Whether a plan asks for a characteristic that can be: what each kind names and needs."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from ocmm_core.features.shapes import DIRECTION, Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.kinds._orientation import meant_direction
from ocmm_core.tolerances.kinds._symmetry import SLOTS
from ocmm_core.tolerances.zones import (
    AXES,
    CENTRES,
    COAXIAL,
    FORMS,
    ORIENTATIONS,
    PROFILES,
    RUNOUTS,
    TWO_POINT,
    ZONES,
    Characteristic,
)

Fault = tuple[str, str]
"""The field of the characteristic, and what is wrong with it."""

_MODIFIED = re.compile(r"(?P<name>.+?)\s*(?:[ⓂⓁ]|\((?:M|L|MMB|LMB|MMC|LMC)\))", re.IGNORECASE)
"""A datum as drawings write it with a modifier of material: ``A (M)``, ``A Ⓜ``."""

_ALL = tuple(Shape)
_WITH_RADIUS = (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)
_WITH_SIZE = (*_WITH_RADIUS, *SLOTS)
_OUTLINES = (Shape.ELLIPSE, *SLOTS)
_DIRECTED = (Shape.PLANE, *AXES)
_ROUND_AXES = (*AXES, Shape.CIRCLE)


@dataclass(frozen=True, slots=True)
class _Needs:
    """What one kind names.

    Attributes
    ----------
    shapes
        That its features may have.
    features, datums
        Least and greatest number of them.
    datum_shapes
        That its first datum may have.
    """

    shapes: tuple[Shape, ...]
    features: tuple[int, int] = (1, 1)
    datums: tuple[int, int] = (0, 0)
    datum_shapes: tuple[Shape, ...] = _ALL


_NEEDS = {
    "diameter": _Needs((*_WITH_RADIUS, Shape.CONE, Shape.TORUS), datums=(0, 1),
                       datum_shapes=(Shape.PLANE,)),
    "radius": _Needs((*_WITH_RADIUS, Shape.TORUS)),
    "length": _Needs(_OUTLINES),
    "width": _Needs((*_OUTLINES, Shape.TORUS)),
    "distance": _Needs(_ALL, features=(2, 2)),
    "coordinate": _Needs(CENTRES),
    "angle": _Needs(_DIRECTED, features=(1, 2)),
    "form": _Needs(tuple(shape for shape in Shape if shape is not Shape.POINT)),
    "straightness": _Needs((Shape.LINE, Shape.CYLINDER)),
    "flatness": _Needs((Shape.PLANE,)),
    "roundness": _Needs((Shape.CIRCLE, Shape.CYLINDER)),
    "cylindricity": _Needs((Shape.CYLINDER,)),
    "parallelism": _Needs(_DIRECTED, datums=(1, 3), datum_shapes=_DIRECTED),
    "perpendicularity": _Needs(_DIRECTED, datums=(1, 3), datum_shapes=_DIRECTED),
    "angularity": _Needs(_DIRECTED, datums=(1, 3), datum_shapes=_DIRECTED),
    "position": _Needs(_ALL, datums=(0, 3)),
    "concentricity": _Needs((Shape.CIRCLE, Shape.SPHERE), datums=(1, 1),
                            datum_shapes=(*_ROUND_AXES, Shape.SPHERE)),
    "coaxiality": _Needs((*_ROUND_AXES, Shape.SPHERE), datums=(1, 1), datum_shapes=_ROUND_AXES),
    "symmetry": _Needs((Shape.PLANE, *SLOTS), features=(1, 2), datums=(1, 1),
                       datum_shapes=_DIRECTED),
    "line profile": _Needs((Shape.POINT, Shape.LINE, Shape.CIRCLE, *_OUTLINES),
                           features=(1, 1000), datums=(0, 3)),
    "surface profile": _Needs((Shape.POINT, Shape.PLANE, Shape.SPHERE, Shape.CYLINDER, Shape.CONE,
                               Shape.TORUS), features=(1, 1000), datums=(0, 3)),
    "circular runout": _Needs((Shape.CIRCLE, Shape.CYLINDER, Shape.CONE, Shape.PLANE),
                              datums=(1, 1), datum_shapes=_ROUND_AXES),
    "total runout": _Needs((Shape.CYLINDER, Shape.PLANE), datums=(1, 1), datum_shapes=_ROUND_AXES),
}  # fmt: skip


def characteristic_fault(
    item: Characteristic,
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
    probed: Collection[str],
    *,
    aligned: bool,
) -> Fault | None:
    """Return the field and the fault of a characteristic that cannot be, else None.

    Parameters
    ----------
    shapes
        Of all features of the plan, probed and constructed, by name.
    nominals
        Geometry vectors (12,) of those of which they are known, part frame.
    probed
        Names of the features that are probed.
    aligned
        The plan has an alignment.
    """
    return (
        _names_fault(item, shapes)
        or _limits_fault(item)
        or _association_fault(item, shapes)
        or _axis_fault(item, shapes, aligned=aligned)
        or _zone_fault(item, shapes)
        or _number_fault(item, shapes)
        or _known_fault(item, shapes, nominals, probed)
        or _direction_fault(item, shapes, nominals)
    )


def _names_fault(item: Characteristic, shapes: Mapping[str, Shape]) -> Fault | None:
    needs = _NEEDS[item.kind]
    for field, names, (least, most), wanted in (
        ("features", item.features, needs.features, needs.shapes),
        ("datums", item.datums, needs.datums, needs.datum_shapes),
    ):
        if not least <= len(names) <= most:
            count = f"{least}" if least == most else f"{least} to {most}"
            article = "an" if item.kind[0] in "aeiou" else "a"
            return field, f"names {len(names)} feature(s); {article} {item.kind} needs {count}"
        for place, name in enumerate(names):
            allowed = wanted if field == "features" or place == 0 else _ALL
            if name not in shapes:
                asked = _MODIFIED.fullmatch(name) if field == "datums" else None
                if asked and asked["name"] in shapes:
                    return field, (
                        f"asks for {asked['name']!r} with a modifier of material; datums are taken "
                        "regardless of their size. Leave the modifier out: what conforms then "
                        "conforms with it too"
                    )
                return field, f"names {name!r}, which is not a feature of the plan"
            if shapes[name] not in allowed:
                words = ", ".join(shape.value.lower() for shape in allowed)
                return field, f"names {name!r}, but needs one of: {words}"
        if len(set(names)) < len(names):
            return field, "names one feature twice"
    for name in item.datums:
        if name in item.features:
            return "datums", f"names {name!r}, which is toleranced itself"
    first = shapes[item.features[0]]
    if item.kind == "angle" and len(item.features) == 1 and first is not Shape.CONE:
        return "features", "names one feature; an angle needs two, or one cone"
    if item.kind == "symmetry" and (len(item.features) == 1) != (first in SLOTS):
        return "features", "needs one slot or rectangle, or two opposite planes"
    if item.kind == "symmetry" and first is Shape.PLANE:
        if shapes[item.features[1]] is not Shape.PLANE:
            return "features", "needs two opposite planes"
        if shapes[item.datums[0]] is not Shape.PLANE:
            return "datums", "needs a plane: two faces are symmetrical about one"
    if item.kind == "diameter" and (first is Shape.CONE) != bool(item.datums):
        return "datums", "goes with the diameter of a cone, which needs the plane it is taken from"
    return None


def _limits_fault(item: Characteristic) -> Fault | None:
    if item.kind in ZONES:
        if item.nominal != 0.0:
            return "nominal", f"is {item.nominal:g}; a {item.kind} tolerance has none"
        if item.lower != 0.0:
            return "lower", f"is {item.lower:g}; a {item.kind} tolerance has an upper limit only"
        if not item.upper > 0.0:
            return "upper", f"is {item.upper:g}; a tolerance is greater than zero"
    if item.upper < item.lower:
        return "upper", "is below 'lower'"
    return None


def _association_fault(item: Characteristic, shapes: Mapping[str, Shape]) -> Fault | None:
    if not item.association:
        return None
    if item.kind in FORMS and item.association in ("minimum zone", "least squares"):
        return None
    if item.kind in ("diameter", "radius"):
        if shapes[item.features[0]] in _WITH_RADIUS:
            return None
        return "association", "is only for circle, sphere and cylinder"
    if item.kind in FORMS:
        return "association", "of form is 'minimum zone' or 'least squares'"
    if item.kind in ("length", "width", "distance"):
        return _two_point_fault(item, shapes)
    return "association", "goes with sizes, distances of faces and form only"


def _two_point_fault(item: Characteristic, shapes: Mapping[str, Shape]) -> Fault | None:
    if item.kind == "distance":
        if item.axis or any(shapes[name] is not Shape.PLANE for name in item.features):
            return "association", "of a distance needs two opposite planes, and no 'axis'"
    elif shapes[item.features[0]] not in SLOTS:
        return "association", f"of a {item.kind} is only for slots and rectangles"
    elif item.kind == "length" and shapes[item.features[0]] is Shape.ROUND_SLOT:
        return "association", "of a length needs straight ends; those of a round slot are not"
    if item.association not in TWO_POINT:
        words = ", ".join(repr(word) for word in TWO_POINT)
        return "association", f"of a {item.kind} is left out, or one of: {words}"
    return None


def _axis_fault(
    item: Characteristic, shapes: Mapping[str, Shape], *, aligned: bool
) -> Fault | None:
    of_planes = item.zone == "planes" and shapes[item.features[0]] is not Shape.PLANE
    may = item.kind in ("coordinate", "distance") or (
        of_planes and item.kind in ORIENTATIONS | {"position"}
    )
    if item.axis and not may:
        return "axis", (
            "goes with coordinates, distances and zones of two planes about a centre or an axis, "
            "and only with them"
        )
    if item.kind == "coordinate" and not item.axis:
        return "axis", "is missing: a coordinate is x, y or z"
    if item.kind == "position" and of_planes and not item.axis:
        return "axis", "is missing: it says across which planes the position counts"
    in_part = item.kind == "coordinate" or (item.kind == "distance" and item.axis != "")
    if in_part and not aligned:
        return "axis", f"needs a part frame: the plan has no 'alignment' for this {item.kind}"
    if item.kind == "position" and not item.datums and not aligned:
        return "datums", "is empty, and the plan has no 'alignment' that would take their place"
    return None


def _zone_fault(item: Characteristic, shapes: Mapping[str, Shape]) -> Fault | None:
    if not item.zone:
        return None
    first = shapes[item.features[0]]
    if item.kind not in ORIENTATIONS | {"position"}:
        return "zone", "goes with position and orientation only"
    if first is Shape.PLANE and item.zone != "planes":
        return "zone", f"is {item.zone!r}; that of a plane is two planes"
    if item.zone == "sphere" and (item.kind != "position" or first in AXES):
        return "zone", "is 'sphere', which is for the position of a centre"
    return None


def _number_fault(item: Characteristic, shapes: Mapping[str, Shape]) -> Fault | None:
    first = shapes[item.features[0]]
    if item.modifier and (item.kind != "position" or first not in _WITH_SIZE):
        return "modifier", "goes with the position of a feature that has a size only"
    if bool(item.modifier) != (item.material_size > 0.0):
        return "material_size", (
            f"is {item.material_size:g}; with a modifier it is the limit of size in mm, without "
            "one it is left out"
        )
    if item.length < 0.0:
        return "length", f"is {item.length:g}"
    if item.length and (
        first not in AXES or item.kind not in ORIENTATIONS | COAXIAL | {"position"}
    ):
        return "length", "goes with the orientation and place of an axis only"
    if item.offset and item.kind not in PROFILES:
        return "offset", "goes with profiles only"
    if item.at and not (item.kind == "diameter" and item.datums):
        return "at", "goes with the diameter of a cone only"
    return None


def _known_fault(
    item: Characteristic,
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
    probed: Collection[str],
) -> Fault | None:
    """Return a fault where points or nominals that the kind rests on are missing."""
    flat = item.kind in ORIENTATIONS | {"symmetry"} and shapes[item.features[0]] is Shape.PLANE
    if item.kind in PROFILES | RUNOUTS or flat:
        for name in item.features:
            if name not in probed:
                return "features", f"names {name!r}, which is constructed and has no surface"
    if item.kind in ORIENTATIONS | PROFILES | {"position"}:
        for field, names in (("features", item.features), ("datums", item.datums)):
            for name in names:
                if name not in nominals:
                    return field, f"names {name!r}, of which the nominal place is not known"
    return None


def _direction_fault(
    item: Characteristic, shapes: Mapping[str, Shape], nominals: Mapping[str, Float]
) -> Fault | None:
    if item.kind not in ORIENTATIONS:
        return None
    names = (item.features[0], item.datums[0])
    flat = [shapes[name] is Shape.PLANE for name in names]
    own, base = (nominals[name][DIRECTION] for name in names)
    if meant_direction(item.kind, own, base, alike=flat[0] == flat[1]) is None:
        word = "parallel" if item.kind == "parallelism" else "square"
        return "features", (
            f"names {names[0]!r}, whose nominal direction is not {word} to that of {names[1]!r}"
        )
    return None
