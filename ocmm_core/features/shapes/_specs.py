"""Registry of shapes: the form of an entry, and all entries; code depends on traits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Literal, TypeAlias

import numpy as np

from ocmm_core.geometry import Float

GEOMETRY_SIZE = 12

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
"""Directions in which a shape has a place: all, along its own direction only (a plane), or square
to it only (an infinite axis; an outline, whose depth is that of the touches).
"""

BallWay: TypeAlias = Literal["approach", "normal", "beside", "sizes", "slanted", "kept"]
"""Compensation of an element of ball centres for the ball.

``approach``: the point moves against the approach; ``normal``: along the direction of the element;
``beside``: square to the line, towards the probe; ``sizes``: growing sizes are reduced;
``slanted``: the radius of a cone is reduced, depending on its angle; ``kept``: the parallel of the
shape is another shape, so the fit keeps the distance.
"""

Spread: TypeAlias = Literal["point", "line", "plane", "sphere", "turn"]
"""Required spread: none, along a length, over an area or half a sphere, round a direction."""

SizeField: TypeAlias = Literal["diameter", "length", "width", "angle_deg"]
"""Fields of a nominal feature, and of a report's element, with whole sizes."""

QifPlace: TypeAlias = Literal[
    "location", "location, normal", "location, direction", "location, axis", "axis", "long axis",
    "centre line",
]  # fmt: skip
"""Position elements in a QIF file."""


@dataclass(frozen=True, slots=True)
class Size:
    """One size of a shape."""

    word: str
    """In sentences; with underscores a property of `Fit`."""
    title: str
    place: int
    field: SizeField
    """Field of `NominalFeature` with the whole size."""
    grows: bool = True
    """The element of ball centres is larger by the ball."""

    @property
    def is_angle(self) -> bool:
        return self.place == HALF_ANGLE

    def whole(self, geometry: Float) -> float:
        """Return the whole size, mm or deg, of a geometry vector (12,)."""
        whole = 2.0 * float(geometry[self.place])
        return float(np.degrees(whole)) if self.is_angle else whole


@dataclass(frozen=True, slots=True)
class QifShape:
    """QIF terms of a shape."""

    feature: str
    """Prefix of its element names."""
    place: QifPlace
    sizes: tuple[tuple[str, SizeField], ...] = ()
    """Elements of its sizes, each with its field of `export.report.Element`."""
    extent: Literal["", "nominal", "definition", "cone", "flat"] = ""
    """Further bounds: ``nominal`` and ``definition`` have the length from the start; ``cone`` has
    both ends along its axis, ``flat`` straight ends."""
    form: str = "OtherForm"
    """Prefix of its form characteristic, if ISO 1101 has no such kind."""
    before: int = 0
    """Number of sizes that precede the place in a measurement."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapeSpec:
    """One shape."""

    minimum_points: int
    """Minimum to determine it."""
    usual_points: int
    """Default if the plan has no number."""
    recommended_points: int
    """Number from which form is evaluated without a note (BS 7172, NPL guide 41)."""
    located: Located
    centred: bool
    """Its point is a centre, not an arbitrary one of the element or its axis."""
    point_word: str
    direction_word: Literal["", "Direction", "Normal", "Axis"]
    """`point_word`, `direction_word`: Names in tables; the second is empty without a direction."""
    has_sense: bool
    """Its direction has a sense: away from the material, or to growing radius."""
    is_long: bool
    """Line, or shape with an axis probed over a length."""
    is_flat: bool
    """Fitted in a plane, possibly of another feature."""
    has_across: bool
    """It has a length direction in its plane."""
    has_sides: bool
    """It has two straight sides with a middle plane."""
    is_curved: bool
    """The side in the plan, outer or inner, defines the side of the material. Other shapes are
    linear in their points, except for the square of a small rotation."""
    has_normals: bool
    """Normals at its points follow from the element alone."""
    planned_direction: bool
    """A plan states a direction for it, at least that of the approach."""
    may_be_free: bool
    """Can be fitted in space as one problem instead of plane first."""
    sizes: tuple[Size, ...]
    """In the order of the geometry vector."""
    sizes_text: str
    """Format of its sizes: whole first, whole second, mm, and full angle, deg."""
    often_ambiguous: bool
    """The minimum number of points often fits two elements."""
    ball: BallWay
    criteria: frozenset[Criterion]
    """Supported association criteria."""
    spread: Spread
    is_round: bool
    """Its points are plotted along its direction, on a dial."""
    form_kind: str
    """Kind of its form characteristic, or of the one whose symbol is used."""
    qif: QifShape

    @property
    def has_direction(self) -> bool:
        return self.direction_word != ""

    @property
    def may_be_projected(self) -> bool:
        """Return whether its points can be projected onto a plane: outlines, and edges."""
        return self.is_flat or self.ball == "beside"

    @property
    def may_be_behind(self) -> bool:
        """Return whether a sheet can be touched on the other side than that of the plan."""
        return not self.is_flat and self.ball != "beside"

    @property
    def is_axial(self) -> bool:
        """Return whether it has an axis, or a normal line through its centre."""
        return self.has_direction and (self.centred or self.is_long)

    @property
    def is_radial(self) -> bool:
        """Return whether its only size is a diameter, which grows as points move out."""
        return self.ball == "sizes" and [size.field for size in self.sizes] == ["diameter"]

    @property
    def unused(self) -> frozenset[str]:
        """Return the fields of `NominalFeature` without a meaning for this shape."""
        is_plane = self.spread == "plane"
        is_surface = self.has_normals and not self.is_flat
        used = {
            "diameter": self.has_size("diameter"),
            "side": self.is_curved,
            "projection": self.may_be_projected,
            "length": self.has_size("length") or self.is_long or is_plane,
            "width": self.has_size("width") or is_plane or self.ball == "beside",
            "angle_deg": self.has_size("angle_deg"),
            "across": self.has_across or is_plane,
            "criterion": len(self.criteria) > 1,
            "free": self.may_be_free,
            "sheet": self.may_be_behind,
            "sheet_limit": self.may_be_behind,
            "targets": is_surface,
        }
        return frozenset(field for field, is_used in used.items() if not is_used)

    def has_size(self, field: str) -> bool:
        """Return whether a plan has a size in a field of `NominalFeature`."""
        return any(size.field == field for size in self.sizes)


_SQUARES = frozenset({Criterion.LEAST_SQUARES})
_ZONE = _SQUARES | {Criterion.MINIMUM_ZONE}
_EVERY = frozenset(Criterion)
_DIAMETER = (Size("diameter", "Diameter", RADIUS, "diameter"),)
_QIF_DIAMETER: tuple[str, SizeField] = ("Diameter", "diameter")

_POINT = ShapeSpec(
    minimum_points=1, usual_points=1, recommended_points=1,
    located="everywhere", centred=True, point_word="Point", direction_word="",
    has_sense=False, is_long=False, is_flat=False, has_across=False, has_sides=False,
    is_curved=False, has_normals=False, planned_direction=True, may_be_free=False,
    sizes=(), sizes_text="no size", often_ambiguous=False, ball="approach", criteria=_SQUARES,
    spread="point", is_round=False, form_kind="position",
    qif=QifShape("Point", "location, normal"),
)  # fmt: skip
_LINE = ShapeSpec(
    minimum_points=2, usual_points=5, recommended_points=5,
    located="across", centred=False, point_word="Point on it", direction_word="Direction",
    has_sense=False, is_long=True, is_flat=False, has_across=False, has_sides=False,
    is_curved=False, has_normals=False, planned_direction=True, may_be_free=False,
    sizes=(), sizes_text="no size", often_ambiguous=False, ball="beside", criteria=_ZONE,
    spread="line", is_round=False, form_kind="straightness",
    qif=QifShape("Line", "location, direction", extent="nominal"),
)  # fmt: skip
_PLANE = ShapeSpec(
    minimum_points=3, usual_points=9, recommended_points=9,
    located="along", centred=False, point_word="Point on it", direction_word="Normal",
    has_sense=True, is_long=False, is_flat=False, has_across=False, has_sides=False,
    is_curved=False, has_normals=True, planned_direction=True, may_be_free=False,
    sizes=(), sizes_text="no size", often_ambiguous=False, ball="normal", criteria=_ZONE,
    spread="plane", is_round=False, form_kind="flatness",
    qif=QifShape("Plane", "location, normal"),
)  # fmt: skip
_CIRCLE = ShapeSpec(
    minimum_points=3, usual_points=8, recommended_points=7,
    located="across", centred=True, point_word="Centre", direction_word="Normal",
    has_sense=False, is_long=False, is_flat=True, has_across=False, has_sides=False,
    is_curved=True, has_normals=True, planned_direction=True, may_be_free=True,
    sizes=_DIAMETER, sizes_text="diameter {0:.4f} mm", often_ambiguous=False, ball="sizes",
    criteria=_EVERY, spread="turn", is_round=True, form_kind="roundness",
    qif=QifShape("Circle", "location, normal", (_QIF_DIAMETER,)),
)  # fmt: skip
_SPHERE = ShapeSpec(
    minimum_points=4, usual_points=9, recommended_points=9,
    located="everywhere", centred=True, point_word="Centre", direction_word="",
    has_sense=False, is_long=False, is_flat=False, has_across=False, has_sides=False,
    is_curved=True, has_normals=True, planned_direction=False, may_be_free=False,
    sizes=_DIAMETER, sizes_text="diameter {0:.4f} mm", often_ambiguous=False, ball="sizes",
    criteria=_EVERY, spread="sphere", is_round=True, form_kind="surface profile",
    qif=QifShape("Sphere", "location", (_QIF_DIAMETER,), form="Sphericity"),
)  # fmt: skip
_CYLINDER = ShapeSpec(
    minimum_points=5, usual_points=12, recommended_points=12,
    located="across", centred=False, point_word="Point of the axis", direction_word="Axis",
    has_sense=False, is_long=True, is_flat=False, has_across=False, has_sides=False,
    is_curved=True, has_normals=True, planned_direction=True, may_be_free=False,
    sizes=_DIAMETER, sizes_text="diameter {0:.4f} mm", often_ambiguous=True, ball="sizes",
    criteria=_EVERY, spread="turn", is_round=True, form_kind="cylindricity",
    qif=QifShape("Cylinder", "axis", (_QIF_DIAMETER,), "definition"),
)  # fmt: skip
_ELLIPSE = ShapeSpec(
    minimum_points=5, usual_points=10, recommended_points=9,
    located="across", centred=True, point_word="Centre", direction_word="Normal",
    has_sense=False, is_long=False, is_flat=True, has_across=True, has_sides=False,
    is_curved=True, has_normals=True, planned_direction=True, may_be_free=False,
    sizes=(
        Size("length", "Long axis", RADIUS, "length"),
        Size("width", "Short axis", SECOND, "width"),
    ),
    sizes_text="{0:.4f} by {1:.4f} mm", often_ambiguous=False, ball="kept", criteria=_ZONE,
    spread="turn", is_round=True, form_kind="line profile",
    qif=QifShape(
        "Ellipse", "long axis", (("MajorDiameter", "length"), ("MinorDiameter", "width")),
        form="Ellipticity",
    ),
)  # fmt: skip
_RECTANGLE = ShapeSpec(
    minimum_points=5, usual_points=10, recommended_points=9,
    located="across", centred=True, point_word="Centre", direction_word="Normal",
    has_sense=False, is_long=False, is_flat=True, has_across=True, has_sides=True,
    is_curved=True, has_normals=True, planned_direction=True, may_be_free=False,
    sizes=(
        Size("length", "Length", RADIUS, "length"),
        Size("width", "Width", SECOND, "width"),
    ),
    sizes_text="{0:.4f} by {1:.4f} mm", often_ambiguous=True, ball="sizes", criteria=_ZONE,
    spread="turn", is_round=False, form_kind="line profile",
    qif=QifShape(
        "OppositeParallelLines", "centre line", (("Width", "width"), ("Length", "length")), "flat"
    ),
)  # fmt: skip
_ROUND_SLOT = replace(
    _RECTANGLE, often_ambiguous=False,
    qif=QifShape(
        "ElongatedCircle", "centre line", (("Diameter", "width"), ("Length", "length")), before=1
    ),
)  # fmt: skip
_CONE = ShapeSpec(
    minimum_points=6, usual_points=12, recommended_points=12,
    located="everywhere", centred=False, point_word="Point of the axis", direction_word="Axis",
    has_sense=True, is_long=True, is_flat=False, has_across=False, has_sides=False,
    is_curved=True, has_normals=True, planned_direction=True, may_be_free=False,
    sizes=(
        Size("diameter", "Diameter there", RADIUS, "diameter"),
        Size("full angle", "Full angle", HALF_ANGLE, "angle_deg", grows=False),
    ),
    sizes_text="angle {2:.4f} deg with diameter {0:.4f} mm at the points", often_ambiguous=True,
    ball="slanted", criteria=_ZONE, spread="turn", is_round=True, form_kind="surface profile",
    qif=QifShape(
        "Cone", "axis", (_QIF_DIAMETER, ("FullAngle", "angle_deg")), "cone", "Conicity"
    ),
)  # fmt: skip
_TORUS = ShapeSpec(
    minimum_points=7, usual_points=12, recommended_points=14,
    located="everywhere", centred=True, point_word="Centre", direction_word="Axis",
    has_sense=False, is_long=False, is_flat=False, has_across=False, has_sides=False,
    is_curved=True, has_normals=True, planned_direction=True, may_be_free=False,
    sizes=(
        Size("ring diameter", "Diameter of the centre line", RADIUS, "diameter", grows=False),
        Size("tube diameter", "Diameter of the tube", SECOND, "width"),
    ),
    sizes_text="ring {0:.4f} mm with tube {1:.4f} mm", often_ambiguous=True, ball="sizes",
    criteria=_ZONE, spread="turn", is_round=True, form_kind="surface profile",
    qif=QifShape(
        "Torus", "location, axis", (("MinorDiameter", "width"), ("MajorDiameter", "diameter")),
        form="Toroidicity",
    ),
)  # fmt: skip

SPECS = {
    "Point": _POINT,
    "Line": _LINE,
    "Plane": _PLANE,
    "Circle": _CIRCLE,
    "Sphere": _SPHERE,
    "Cylinder": _CYLINDER,
    "Ellipse": _ELLIPSE,
    "RoundSlot": _ROUND_SLOT,
    "SquareSlot": _RECTANGLE,
    "Rectangle": _RECTANGLE,
    "Cone": _CONE,
    "Torus": _TORUS,
}
"""Entries by the name of their shape; access them by `Shape.spec`."""
