"""Constructions of features from others, as in a plan (docs/quality/alignment.md)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.features.shapes import Shape


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
    the same direction. Of lines: ``"between"`` halves the smaller angle.
    """


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
    seen from the first.
    """


class FitThrough(_Construction, frozen=True, kw_only=True, tag="best fit"):
    """The least-squares element through the centres, or all touched points."""

    shape: Shape
    through: Literal["centres", "points"] = "centres"
    """``"centres"``: points and centres of the features; ``"points"``: their touches, each
    compensated along the normal of its own feature.
    """


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


class PartOf(_Construction, frozen=True, kw_only=True, tag="part of"):
    """A feature under another name, or its axis or centre alone."""

    part: Literal["all", "axis", "centre"] = "all"


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
    | PartOf
)
"""All kinds; the plan's field ``kind`` selects one."""


def needed_features(construction: Construction) -> tuple[str, ...]:
    """Return the names of all features that a construction needs, each once."""
    extra = (construction.towards,) if isinstance(construction, Offset) else ()
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
