from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np

from ocmm_core.camera import Vector3
from ocmm_core.features.shapes._shape import Shape
from ocmm_core.features.shapes._shape_spec import ACROSS, DIRECTION, GEOMETRY_SIZE, POINT, Criterion
from ocmm_core.geometry import Float, perpendicular_pair, unit


class NominalFeature(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One feature to probe."""

    name: str
    shape: Shape
    points: int
    """Number of touches; at least the minimum of the shape."""
    point: Vector3
    direction: Vector3 = (0.0, 0.0, 1.0)
    """`point`, `direction`: Nominal geometry in the part frame: centre or point on the element, and
    its normal or axis. For planes and points the direction points out of the material.
    """
    diameter: float = 0.0
    """Nominal diameter of circle, sphere, cylinder, cone (square to its axis at ``point``) and
    torus (of its centre line); zero for other shapes."""
    side: Literal["outer", "inner"] = "outer"
    """``"outer"``: the probe is outside the material's curve (shaft, ball, face); ``"inner"``:
    inside it (bore).
    """
    projection: str = ""
    """Circle, ellipse, slot and rectangle: the plane feature whose normal the points are projected
    along before the fit of the outline.
    """
    length: float = 0.0
    width: float = 0.0
    """`length`, `width`: Overall length and width of slot and rectangle, axes of an ellipse, both;
    tube diameter of a torus is its width. Length of a cylinder, cone, line or plane along axis or
    ``across`` if given in the plan, else zero.
    """
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
    compensation: Literal["", "approach", "pulled", "shank", "nominal"] = ""
    """Method to find the material's side (`measuring.compensation.METHODS`); empty: the plan's."""
    targets: tuple[Vector3, ...] = ()
    """mm, part frame: touch targets on plane, cylinder, cone, sphere or torus, in order; empty:
    spread over the shape by its sizes, ignoring holes.
    """


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
