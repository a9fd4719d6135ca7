"""The form of one entry in the registry of shapes: all that the rest of the program asks of one.

What is here are words, numbers and traits. What computes with them asks for a trait, never for a
list of shapes, so that a new shape is known everywhere once it has its entry in `_specs`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

import numpy as np

from ocmm_core.geometry import Float

GEOMETRY_SIZE = 12
"""Length of the geometry vector of `element`."""

POINT, DIRECTION, ACROSS = slice(0, 3), slice(3, 6), slice(9, 12)
RADIUS, SECOND, HALF_ANGLE = 6, 7, 8
"""Places in the geometry vector."""


class Criterion(Enum):
    """How an element is associated with its points; the letters are those of ISO 1101."""

    LEAST_SQUARES = "G"
    MINIMUM_ZONE = "C"
    INSCRIBED = "X"
    CIRCUMSCRIBED = "N"


Located: TypeAlias = Literal["everywhere", "along", "across"]
"""In which directions a shape has a place: in all of them, along its own direction alone (a plane),
or square to it alone (an axis without end; an outline, which lies as deep as it was probed)."""

BallWay: TypeAlias = Literal["approach", "normal", "beside", "sizes", "slanted", "kept"]
"""How the ball is taken off an element of ball centres.

``approach``: the point moves against the approach; ``normal``: along the direction of the element;
``beside``: square to the line, to where the probe stood; ``sizes``: the sizes that grow with the
ball get smaller; ``slanted``: so does the radius of a cone, by what its angle makes of it;
``kept``: what lies one ball off is no element of the shape, so that the fit keeps that distance.
"""

Spread: TypeAlias = Literal["point", "line", "plane", "sphere", "turn"]
"""What is asked of the points: nothing, to lie along a length, over an area, over the half of a
sphere, or around a direction."""

SizeField: TypeAlias = Literal["diameter", "length", "width", "angle_deg"]
"""Fields of a nominal feature, and of an element in a report, that hold whole sizes."""

QifPlace: TypeAlias = Literal[
    "location", "location, normal", "location, direction", "location, axis", "axis", "long axis",
    "centre line",
]  # fmt: skip
"""The elements that tell a place in a QIF file."""


@dataclass(frozen=True, slots=True)
class Size:
    """One size of a shape."""

    word: str
    """In sentences; with underscores a property of `Fit`."""
    title: str
    place: int
    field: SizeField
    """Of `NominalFeature`, which holds the whole of it."""
    grows: bool = True
    """The element of ball centres is larger by the ball."""

    @property
    def is_angle(self) -> bool:
        """Return whether it is an angle, and not a length."""
        return self.place == HALF_ANGLE

    def whole(self, geometry: Float) -> float:
        """Return the whole size, mm or deg, of a geometry vector (12,)."""
        whole = 2.0 * float(geometry[self.place])
        return float(np.degrees(whole)) if self.is_angle else whole


@dataclass(frozen=True, slots=True)
class QifShape:
    """A shape in the words of a QIF file."""

    feature: str
    """Begins the names of its elements."""
    place: QifPlace
    """What tells where it lies."""
    sizes: tuple[tuple[str, SizeField], ...] = ()
    """Elements of its sizes, each with the field of `export.report.Element` that it holds."""
    extent: Literal["", "nominal", "definition", "cone", "flat"] = ""
    """What else bounds it: ``nominal`` and ``definition`` hold its length and tell it from its
    start; ``cone`` has both ends along its axis, ``flat`` ends that are straight."""
    form: str = "OtherForm"
    """Begins the name of its characteristic of form, where no kind of ISO 1101 is that."""
    before: int = 0
    """How many of the sizes a measurement tells before the place."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapeSpec:
    """One shape."""

    minimum_points: int
    """Points without which it is not determined."""
    usual_points: int
    """Points of a feature whose plan does not say how many."""
    recommended_points: int
    """Points from which on form is evaluated without a note (BS 7172, NPL guide 41)."""
    located: Located
    centred: bool
    """Its point is a centre, and not any point of the element or of its axis."""
    point_word: str
    direction_word: Literal["", "Direction", "Normal", "Axis"]
    """`point_word`, `direction_word`: What a table calls them; the second is empty where it has no
    direction."""
    has_sense: bool
    """Its direction says more than a line: away from the material, to where it grows."""
    is_long: bool
    """It is a line, or has an axis that is probed over a length."""
    is_flat: bool
    """It is fitted in a plane, which may be that of another feature."""
    has_across: bool
    """It has a direction of its length in its plane."""
    has_sides: bool
    """It has two straight sides with a middle plane."""
    is_curved: bool
    """The side of the plan, outer or inner, says where the material is. What is not curved follows
    its points linearly, but for the square of a small turn."""
    has_normals: bool
    """Its points have normals that follow from the element alone."""
    planned_direction: bool
    """A plan says a direction for it, be it that of the approach."""
    may_be_free: bool
    """It can be fitted in space as one problem instead of plane first."""
    sizes: tuple[Size, ...]
    """In the order of the geometry vector."""
    sizes_text: str
    """Format of a sentence on its sizes: whole first, whole second, mm, and full angle, deg."""
    often_ambiguous: bool
    """The least number of points often fits two elements."""
    ball: BallWay
    """How the ball is taken off."""
    criteria: frozenset[Criterion]
    """By which it can be associated."""
    spread: Spread
    """How its points should be spread."""
    is_round: bool
    """Its points are shown along its direction, on a dial."""
    form_kind: str
    """The kind of characteristic that its form is, or whose symbol stands for it."""
    qif: QifShape

    @property
    def has_direction(self) -> bool:
        """Return whether the element has a direction."""
        return self.direction_word != ""

    @property
    def is_axial(self) -> bool:
        """Return whether it has an axis, or a normal line through its centre."""
        return self.has_direction and (self.centred or self.is_long)

    @property
    def is_radial(self) -> bool:
        """Return whether it has a diameter alone, and grows in it where its points move out."""
        return self.ball == "sizes" and [size.field for size in self.sizes] == ["diameter"]

    def has_size(self, field: str) -> bool:
        """Return whether the plan says a size in a field of `NominalFeature`."""
        return any(size.field == field for size in self.sizes)
