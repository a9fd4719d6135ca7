"""What a plan says about one feature."""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np

from ocmm_core.camera import Vector3
from ocmm_core.features.shapes._shape import Shape
from ocmm_core.features.shapes._shape_spec import ACROSS, DIRECTION, GEOMETRY_SIZE, POINT, Criterion
from ocmm_core.geometry import Float, perpendicular_pair, unit


class NominalFeature(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One feature to probe.

    Attributes
    ----------
    name
        Unique in the plan.
    shape
        `Shape` by its word.
    points
        Touches to take; at least the minimum of the shape.
    side
        ``"outer"``: the probe stands outside the material's curve (shaft, ball, face);
        ``"inner"``: inside it (bore).
    point, direction
        Nominal geometry in the part frame: centre or point on the element, and its normal or
        axis. For planes and points the direction leaves the material.
    diameter
        Nominal diameter of circle, sphere, cylinder, cone (square to its axis at ``point``) and
        torus (of its centre line); zero for other shapes.
    length, width
        Overall length and width of slot and rectangle, axes of an ellipse, both; tube diameter of
        a torus is its width. Length of a cylinder, cone, line or plane along axis or ``across``
        where the plan knows it, else zero.
    angle_deg
        Full apex angle of a cone.
    across
        Direction of the length of ellipse, slot, rectangle and plane, part frame.
    criterion
        How the element is associated with its points, in the words of `CRITERIA`.
    free
        Circle only, least squares or minimum zone: fitted in space as one problem instead of
        plane first.
    text, picture
        What the inspector reads, and the file of the picture beside the plan that he sees.
    compensation
        How the side of the material is found (`measuring.compensation.METHODS`); empty: as the
        plan says.
    projection
        Circle, ellipse, slot and rectangle: the plane feature along whose normal the points are
        projected before the outline is fitted in it.
    targets
        mm, part frame: where to touch plane, cylinder, cone, sphere or torus, the first ones first;
        empty: spread over the shape by its sizes, as if it had no holes.
    """

    name: str
    shape: Shape
    points: int
    point: Vector3
    direction: Vector3 = (0.0, 0.0, 1.0)
    diameter: float = 0.0
    side: Literal["outer", "inner"] = "outer"
    projection: str = ""
    length: float = 0.0
    width: float = 0.0
    angle_deg: float = 0.0
    across: Vector3 = (1.0, 0.0, 0.0)
    criterion: Literal["least squares", "minimum zone", "inscribed", "circumscribed"] = (
        "least squares"
    )
    text: str = ""
    picture: str = ""
    free: bool = False
    compensation: Literal["", "approach", "pulled", "shank", "nominal"] = ""
    targets: tuple[Vector3, ...] = ()


CRITERIA = {
    "least squares": Criterion.LEAST_SQUARES,
    "minimum zone": Criterion.MINIMUM_ZONE,
    "inscribed": Criterion.INSCRIBED,
    "circumscribed": Criterion.CIRCUMSCRIBED,
}
"""Criteria of association by their words in a plan."""


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
