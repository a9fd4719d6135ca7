"""Shapes, nominal geometry of features, and its checks."""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np

from ocmm_core.camera import Vector3
from ocmm_core.features.shapes._shape import Shape
from ocmm_core.features.shapes._specs import ACROSS, DIRECTION, GEOMETRY_SIZE, POINT, Criterion
from ocmm_core.geometry import Float, perpendicular_pair, triple, unit


class NominalFeature(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One feature to probe."""

    name: str
    shape: Shape
    points: int
    """Number of touches; at least the minimum of the shape."""
    point: Vector3
    direction: Vector3 = (0.0, 0.0, 1.0)
    """`point`, `direction`: Nominal geometry in the part frame: centre or point on the element, and
    its normal or axis. For planes and points the direction points out of the material."""
    diameter: float = 0.0
    """Nominal diameter of circle, sphere, cylinder, cone (square to its axis at ``point``) and
    torus (of its centre line); zero for other shapes."""
    side: Literal["outer", "inner"] = "outer"
    """``"outer"``: the probe is outside the material's curve (shaft, ball, face); ``"inner"``:
    inside it (bore)."""
    projection: str = ""
    """Line, circle, ellipse, slot and rectangle: the plane feature whose normal the points are
    projected along before the fit. Such a line is the edge of a sheet with this face."""
    length: float = 0.0
    width: float = 0.0
    """`length`, `width`: Overall length and width of slot and rectangle, axes of an ellipse, both;
    tube diameter of a torus is its width, thickness of the sheet that of an edge. Length of a
    cylinder, cone, line or plane along axis or ``across`` if given in the plan, else zero."""
    angle_deg: float = 0.0
    """Full apex angle of a cone."""
    across: Vector3 = (1.0, 0.0, 0.0)
    """Direction of the length of ellipse, slot, rectangle and plane, part frame."""
    criterion: Literal["least squares", "minimum zone", "inscribed", "circumscribed"] = (
        "least squares"
    )
    """Association criterion, as in `CRITERIA`."""
    text: str = ""
    picture: str = ""
    """`text`, `picture`: Note to the inspector, and its picture file stored with the plan."""
    free: bool = False
    """Circle only, least squares or minimum zone: fitted in space as one problem."""
    spacing: float = 0.0
    """Continuous probing: distance of the points along the path, mm; 0 for single touches."""
    interval: float = 0.0
    turn_deg: float = 0.0
    """`interval`, `turn_deg`: Of a path: least time between points, s; change of direction between
    points, which are ten times as far apart on a straight path."""
    gates: Vector3 = (0.0, 0.0, 0.0)
    """Of a path: normal, part frame, of planes ``spacing`` apart from ``point``; the first crossing
    of each in this direction gives a point. Zero without."""
    scan: Literal["", "ring", "spiral", "raster"] = ""
    """Form of a path: ring, spiral, or parallel lines over a face. Empty: anywhere."""
    sheet: float = 0.0
    sheet_limit: float = 0.0
    """`sheet`, `sheet_limit`: mm: thickness of a sheet touched on the other side than that of the
    plan, and its largest deviation; 0 if the surface of the plan is touched."""
    compensation: Literal["", "approach", "pulled", "shank", "nominal"] = ""
    """Method to find the material's side (`measuring.compensation.METHODS`); empty: the plan's."""
    targets: tuple[Vector3, ...] = ()
    """mm, part frame: touch targets on plane, cylinder, cone, sphere or torus, in order; empty:
    spread over the shape by its sizes, ignoring holes."""


CRITERIA = {
    "least squares": Criterion.LEAST_SQUARES,
    "minimum zone": Criterion.MINIMUM_ZONE,
    "inscribed": Criterion.INSCRIBED,
    "circumscribed": Criterion.CIRCUMSCRIBED,
}
"""Association criteria by their words in a plan."""


def nominal_geometry(nominal: NominalFeature) -> Float:
    """Return the nominal geometry vector (12,) of `features.shapes.element`, part frame."""
    spec = nominal.shape.spec
    geometry = np.zeros(GEOMETRY_SIZE)
    geometry[POINT] = nominal.point
    for size in spec.sizes:
        half = 0.5 * getattr(nominal, size.field)
        geometry[size.place] = np.radians(half) if size.is_angle else half
    if not spec.has_direction:
        return geometry
    direction = unit(np.array(nominal.direction))
    geometry[DIRECTION] = direction
    if spec.has_across:
        across = np.array(nominal.across) - (direction @ np.array(nominal.across)) * direction
        if float(np.linalg.norm(across)) < 1e-9:
            across = perpendicular_pair(direction)[0]
        geometry[ACROSS] = unit(across)
    return geometry


def nominal_of(
    name: str, shape: Shape, geometry: Float, points: int = 0, **more: object
) -> NominalFeature:
    """Return the nominal feature of a geometry vector (12,); inverse of `nominal_geometry`."""
    if np.any(geometry[DIRECTION]):
        more["direction"] = triple(geometry[DIRECTION])
    if shape.spec.has_across:
        more["across"] = triple(geometry[ACROSS])
    more |= {size.field: size.whole(geometry) for size in shape.spec.sizes}
    bare = NominalFeature(name=name, shape=shape, points=points, point=triple(geometry[POINT]))
    return msgspec.structs.replace(bare, **more)


_ROUND_ENDS = (Shape.ELLIPSE, Shape.ROUND_SLOT)
"""Outlines that are circles for equal sizes."""

SQUARE = 1e-6
"""Cosine of the angle between a normal and a direction in its plane."""


def shape_fault(feature: NominalFeature) -> tuple[str, str] | None:
    """Return the first faulty field and its fault, or None."""
    spec = feature.shape.spec
    if spec.has_size("diameter") != (feature.diameter > 0.0):
        return (
            "diameter",
            f"is {feature.diameter}; circle, sphere, cylinder, cone and torus have a diameter "
            "greater than zero, other shapes have none",
        )
    if spec.has_size("angle_deg") != (feature.angle_deg != 0.0):
        return "angle_deg", f"is {feature.angle_deg:g}; a cone has one, other shapes have none"
    if spec.has_size("angle_deg") and not 0.0 < feature.angle_deg < 179.0:
        return "angle_deg", f"is {feature.angle_deg:g}; it is the full angle, 0 to 179"
    if feature.shape is Shape.TORUS and not 0.0 < feature.width < feature.diameter:
        return (
            "width",
            f"is {feature.width:g}; it is the diameter of the tube of a torus, smaller than that "
            "of its centre line",
        )
    if feature.sheet and not spec.may_be_behind:
        return "sheet", "is not for lines and outlines"
    if feature.sheet < 0.0 or (feature.sheet > 0.0) != (feature.sheet_limit > 0.0):
        return (
            "sheet_limit",
            f"is {feature.sheet_limit:g} with a sheet of {feature.sheet:g}; both are greater than "
            "zero, or left out",
        )
    if spec.has_across:
        return _outline_fault(feature) or _criterion_fault(feature)
    for size in spec.sizes:
        if not getattr(feature, size.field) > 0.0:
            return size.field, f"is not greater than zero; it is the {size.word}"
    if feature.free and (not spec.may_be_free or feature.projection):
        return "free", "is only for circles that are not projected"
    if feature.projection and not spec.may_be_projected:
        return "projection", "is only for lines, circles, ellipses, slots and rectangles"
    if feature.projection and not spec.is_flat and not feature.width > 0.0:
        return "width", "is missing: of an edge it is the thickness of the sheet at the touches"
    return _criterion_fault(feature)


def _criterion_fault(feature: NominalFeature) -> tuple[str, str] | None:
    word = feature.criterion
    if word == "least squares":
        return None
    if feature.projection:
        return "criterion", f"is {word!r}; what is projected is fitted by least squares"
    offered = CRITERIA[word] in feature.shape.spec.criteria
    if word == "minimum zone" and not offered:
        return "criterion", f"is {word!r}; a {feature.shape.value.lower()} has no zone"
    if word != "minimum zone" and (not offered or feature.free):
        return (
            "criterion",
            f"is {word!r}, which is for circles in their own plane, spheres and cylinders",
        )
    return None


def _outline_fault(feature: NominalFeature) -> tuple[str, str] | None:
    if feature.free:
        return "free", "is only for circles that are not projected"
    for field, value in (("length", feature.length), ("width", feature.width)):
        if not value > 0.0:
            return field, f"is {value:g}; ellipse, slot and rectangle have length and width"
    if feature.width > feature.length:
        return "width", f"is {feature.width:g}, more than the length; the longer one is the length"
    if feature.width == feature.length and feature.shape in _ROUND_ENDS:
        return "width", "is the length; measure it as a circle"
    across, normal = np.array(feature.across), np.array(feature.direction)
    lengths = float(np.linalg.norm(across) * np.linalg.norm(normal))
    if not lengths > 0.0 or abs(float(across @ normal)) > SQUARE * lengths:
        return "across", "is not square to 'direction'; it is the direction of the length"
    return None
