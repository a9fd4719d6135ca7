"""Constructions of features from others, as in a plan (docs/quality/alignment.md).

Their permitted inputs and the resulting shapes are checked here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape, shapes_where


class _Construction(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind"
):
    """Common part of all kinds."""

    name: str
    """Unique among all features of the plan, probed and constructed."""
    features: tuple[str, ...]
    """Names of the input features, probed or constructed, in any order of the plan."""


class Intersection(_Construction, frozen=True, kw_only=True, tag="intersection"):
    """Intersection of two or three features."""


class Projection(_Construction, frozen=True, kw_only=True, tag="projection"):
    """The first feature, dropped square on the second, a plane, line or axis."""


class Midpoint(_Construction, frozen=True, kw_only=True, tag="midpoint"):
    """The middle of two points or centres."""


class Bisector(_Construction, frozen=True, kw_only=True, tag="bisector"):
    """The plane or line halfway between two planes or two lines or axes."""

    which: Literal["between", "across"] = "between"
    """Of planes: ``"between"`` halves the material between two faces, as those of a tongue, or the
    space between those of a groove; ``"across"`` is square to it, and the middle of two faces in
    the same direction. Of lines: ``"between"`` halves the smaller angle."""


class Symmetry(_Construction, frozen=True, kw_only=True, tag="symmetry"):
    """The plane of best mirror symmetry between pairs of points or centres, or two faces."""


class Offset(_Construction, frozen=True, kw_only=True, tag="offset"):
    """A feature moved by a distance.

    A plane alone along its normal; circle, sphere and cylinder alone grow by it in radius; any
    feature together with a second one is moved along that one's direction.
    """

    distance: float
    """mm; negative for the opposite direction."""
    towards: str = ""
    """For a line or axis as second feature, which has no sense: a feature at the positive side,
    seen from the first."""


class FitThrough(_Construction, frozen=True, kw_only=True, tag="best fit"):
    """The least-squares element through the centres, or all touched points."""

    shape: Shape
    through: Literal["centres", "points"] = "centres"
    """``"centres"``: points and centres of the features; ``"points"``: their touches, each
    compensated along the normal of its own feature."""
    plane: str = ""
    """A plane that cuts the features: only their points near it count, and a circle lies in it."""
    within: float = 0.5
    """mm: distance from that plane up to which points count."""


class BoltCircle(_Construction, frozen=True, kw_only=True, tag="bolt circle"):
    """The circle through the centres of at least three holes."""


class ConeSection(_Construction, frozen=True, kw_only=True, tag="cone section"):
    """The circle at a diameter of a cone, or at a distance from a plane."""

    diameter: float = 0.0
    """mm: of the gauge circle; then the cone is the only feature."""
    distance: float = 0.0
    """mm: from the plane that is the second feature, along its normal."""


class HiddenPoint(_Construction, frozen=True, kw_only=True, tag="hidden point"):
    """The point on the line from one centre through a second, beyond it by a distance."""

    distance: float
    """mm, from the second centre; as certified for the adapter with two balls."""


class TappedHole(_Construction, frozen=True, kw_only=True, tag="tapped hole"):
    """The centre of a thread in its face: axis of a gauge screwed in, a cylinder, and the plane."""

    play: float
    """mm: largest distance of the axis of the gauge from that of the thread, as certified."""
    engaged: float = 0.0
    """mm: length of the gauge in the thread, over which the play tilts it; 0: tilt not stated."""


class PartOf(_Construction, frozen=True, kw_only=True, tag="part of"):
    """A feature under another name, or its axis or centre alone."""

    part: Literal["all", "axis", "centre", "middle"] = "all"
    """``"middle"``: the point of a line, as an edge, amid its touches."""


Construction: TypeAlias = (
    Intersection
    | Projection
    | Midpoint
    | Bisector
    | Symmetry
    | Offset
    | FitThrough
    | BoltCircle
    | ConeSection
    | HiddenPoint
    | TappedHole
    | PartOf
)
"""All kinds; the plan's field ``kind`` selects one."""


def needed_features(construction: Construction) -> tuple[str, ...]:
    """Return the names of all features that a construction needs, each once."""
    extra = (construction.towards,) if isinstance(construction, Offset) else ()
    extra = (construction.plane,) if isinstance(construction, FitThrough) else extra
    return tuple(dict.fromkeys(name for name in (*construction.features, *extra) if name))


def in_order(constructions: Sequence[Construction]) -> list[Construction]:
    """Return the constructions in dependency order; raise InputError for a cycle."""
    waiting = {item.name: item for item in constructions}
    ordered: list[Construction] = []
    while waiting:
        ready = [
            item
            for item in waiting.values()
            if not any(name in waiting for name in needed_features(item))
        ]
        if not ready:
            raise InputError(
                "construction.circle",
                f"The constructions {', '.join(waiting)} depend on each other in a loop.",
                "Construct one of them from probed features.",
            )
        ordered += ready
        for item in ready:
            del waiting[item.name]
    return ordered


def probed_features(name: str, constructions: Sequence[Construction]) -> tuple[str, ...]:
    """Return the names of the probed features behind a probed or constructed feature."""
    by_name = {item.name: item for item in constructions}
    found: dict[str, None] = {}
    waiting, seen = [name], {name}
    while waiting:
        item = by_name.get(current := waiting.pop())
        if item is None:
            found[current] = None
            continue
        new = [needed for needed in needed_features(item) if needed not in seen]
        seen.update(new)
        waiting += new
    return tuple(found)


CENTRED = shapes_where(lambda spec: spec.centred)
"""Shapes with a centre as point, not an arbitrary one."""

LONG = shapes_where(lambda spec: spec.is_long)
"""Lines, and shapes with an axis probed over a length."""

AXIAL = shapes_where(lambda spec: spec.is_axial)
"""Shapes with an axis or normal line."""

RADIAL = shapes_where(lambda spec: spec.is_radial)
"""Shapes that grow in radius."""


class _FaultError(Exception):
    """A faulty field of a construction."""

    def __init__(self, field: str, fault: str) -> None:
        super().__init__(field, fault)
        self.field = field
        self.fault = fault


def construction_fault(
    probed: Mapping[str, Shape], constructions: Sequence[Construction]
) -> tuple[str, str] | None:
    """Return field and fault of the first impossible construction, else None."""
    names = [item.name for item in constructions]
    places = {name: index for index, name in enumerate(names)}
    for index, item in enumerate(constructions):
        at = f"constructions[{index}]"
        if item.name in probed or names.index(item.name) != index:
            return f"{at}.name", f"repeats the name {item.name!r}"
    for index, item in enumerate(constructions):
        at = f"constructions[{index}]"
        for name in needed_features(item):
            if name not in probed and name not in places:
                return f"{at}.features", f"names {name!r}, which is not a feature of the plan"
    try:
        ordered = in_order(constructions)
    except InputError as error:
        return "constructions", f"cannot be made: {error.what}"
    shapes = dict(probed)
    for item in ordered:
        try:
            shapes[item.name] = _result(item, shapes, probed)
        except _FaultError as error:
            return f"constructions[{places[item.name]}].{error.field}", error.fault
    return None


def shapes_with(
    probed: Mapping[str, Shape], constructions: Sequence[Construction]
) -> dict[str, Shape]:
    """Return the shapes of all features of a checked plan, by name."""
    shapes = dict(probed)
    for item in in_order(constructions):
        shapes[item.name] = _result(item, shapes, probed)
    return shapes


def _result(item: Construction, known: Mapping[str, Shape], probed: Mapping[str, Shape]) -> Shape:
    if len(set(item.features)) < len(item.features):
        raise _FaultError("features", "names one feature twice")
    shapes = [known[name] for name in item.features]
    match item:
        case Intersection():
            return _intersection(shapes)
        case Projection():
            return _projection(shapes)
        case Midpoint() | HiddenPoint():
            _count(shapes, 2)
            _all(shapes, CENTRED)
            return Shape.POINT
        case Bisector():
            _count(shapes, 2)
            plane = shapes[0] is Shape.PLANE
            _all(shapes, (Shape.PLANE,) if plane else LONG)
            return Shape.PLANE if plane else Shape.LINE
        case Symmetry():
            if shapes and shapes[0] is Shape.PLANE:
                _count(shapes, 2)
                _all(shapes, (Shape.PLANE,))
            else:
                _all(shapes, CENTRED)
                if len(shapes) < 2 or len(shapes) % 2:
                    raise _FaultError("features", f"names {len(shapes)}, but pairs are needed")
            return Shape.PLANE
        case Offset():
            return _offset(item, shapes)
        case FitThrough():
            return _fit_through(item, known, shapes, probed)
        case BoltCircle():
            _least(shapes, 3, "a bolt circle")
            _all(shapes, CENTRED)
            return Shape.CIRCLE
        case ConeSection():
            return _cone_section(item, shapes)
        case TappedHole():
            _count(shapes, 2)
            _all(shapes[:1], (Shape.CYLINDER,))
            _all(shapes[1:], (Shape.PLANE,))
            if item.features[0] not in probed:
                raise _FaultError("features", f"names {item.features[0]!r}, which is not touched")
            if not item.play > 0.0:
                raise _FaultError("play", f"is {item.play:g}, but must be greater than zero")
            if item.engaged < 0.0 or (item.engaged and item.features[1] not in probed):
                raise _FaultError("engaged", "is below zero, or the face is not touched")
            return Shape.POINT
        case PartOf():
            _count(shapes, 1)
            if item.part == "all":
                return shapes[0]
            line = (Shape.LINE,)
            _all(shapes, {"axis": AXIAL, "middle": line}.get(item.part, CENTRED))
            return Shape.LINE if item.part == "axis" else Shape.POINT


def _intersection(shapes: Sequence[Shape]) -> Shape:
    planes = sum(shape is Shape.PLANE for shape in shapes)
    if len(shapes) == 3:
        _all(shapes, (Shape.PLANE,))
        return Shape.POINT
    _count(shapes, 2)
    _all(shapes, (Shape.PLANE, *AXIAL))
    return Shape.LINE if planes == 2 else Shape.POINT


def _projection(shapes: Sequence[Shape]) -> Shape:
    _count(shapes, 2)
    what, onto = shapes
    if onto is not Shape.PLANE:
        _all([onto], (Shape.PLANE, *AXIAL))
        _all([what], CENTRED)
        return Shape.POINT
    _all([what], (*CENTRED, *LONG))
    if what is Shape.CIRCLE:
        return Shape.CIRCLE
    return Shape.POINT if what in CENTRED else Shape.LINE


def _offset(item: Offset, shapes: Sequence[Shape]) -> Shape:
    if len(shapes) == 1:
        _all(shapes, (Shape.PLANE, *RADIAL))
        return shapes[0]
    _count(shapes, 2)
    _all(shapes[1:], (Shape.PLANE, *AXIAL))
    if not shapes[1].spec.has_sense and not item.towards:
        raise _FaultError(
            "towards",
            f"is missing: a {shapes[1].value.lower()} does not define a positive direction",
        )
    return shapes[0]


def _fit_through(
    item: FitThrough, known: Mapping[str, Shape], shapes: Sequence[Shape],
    probed: Mapping[str, Shape],
) -> Shape:  # fmt: skip
    if item.shape is Shape.POINT:
        raise _FaultError("shape", "is a point, which cannot be fitted")
    if item.plane:
        if item.through != "points" or not item.within > 0.0:
            raise _FaultError("plane", "goes with 'through' points and a 'within' above zero")
        if known[item.plane] is not Shape.PLANE:
            raise _FaultError("plane", f"names {item.plane!r}, which is not a plane")
    if item.through == "points":
        for name in item.features:
            if name not in probed:
                raise _FaultError("features", f"names {name!r}, which has no points of its own")
        _least(shapes, 1, "a best fit")
        return item.shape
    _all(shapes, CENTRED)
    _least(shapes, MINIMUM_POINTS[item.shape], f"a {item.shape.value.lower()}")
    return item.shape


def _cone_section(item: ConeSection, shapes: Sequence[Shape]) -> Shape:
    if len(shapes) == 1:
        _all(shapes, (Shape.CONE,))
        if not item.diameter > 0.0:
            raise _FaultError("diameter", f"is {item.diameter:g}, but must be greater than zero")
        return Shape.CIRCLE
    _count(shapes, 2)
    _all(shapes[:1], (Shape.CONE,))
    _all(shapes[1:], (Shape.PLANE,))
    if item.diameter != 0.0:
        raise _FaultError("diameter", "is given, but with a plane the distance applies")
    return Shape.CIRCLE


def _count(shapes: Sequence[Shape], count: int) -> None:
    if len(shapes) != count:
        raise _FaultError("features", f"names {len(shapes)} feature(s), but needs {count}")


def _least(shapes: Sequence[Shape], count: int, what: str) -> None:
    if len(shapes) < count:
        raise _FaultError(
            "features", f"names {len(shapes)} feature(s), but {what} needs at least {count}"
        )


def _all(shapes: Sequence[Shape], wanted: Sequence[Shape]) -> None:
    for shape in shapes:
        if shape not in wanted:
            words = ", ".join(item.value.lower() for item in wanted)
            raise _FaultError("features", f"names a {shape.value.lower()}, but needs: {words}")
