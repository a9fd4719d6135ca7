"""Registry of shapes: one entry each, with all properties used by the program."""

from __future__ import annotations

from dataclasses import replace

from ocmm_core.features.shapes._shape_spec import (
    HALF_ANGLE,
    RADIUS,
    SECOND,
    Criterion,
    QifShape,
    ShapeSpec,
    Size,
    SizeField,
)

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
