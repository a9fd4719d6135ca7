"""What a plan says about one feature."""

from __future__ import annotations

from typing import Literal

import msgspec

from ocmm_core.camera.rig import Vector3
from ocmm_core.features.shapes import Shape


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
        Nominal diameter; only circle, sphere and cylinder have one.
    projection
        Circle only: the plane feature along whose normal the points are projected before the
        circle is fitted in it.
    """

    name: str
    shape: Shape
    points: int
    point: Vector3
    direction: Vector3 = (0.0, 0.0, 1.0)
    diameter: float = 0.0
    side: Literal["outer", "inner"] = "outer"
    projection: str = ""
