"""Groups of shapes by trait, for the entries of kinds."""

from __future__ import annotations

from ocmm_core.features.shapes import Shape, shapes_where
from ocmm_core.tolerances.zones import AXES

ALL = tuple(Shape)
WITH_RADIUS = shapes_where(lambda spec: spec.is_radial)
WITH_DIAMETER = shapes_where(lambda spec: spec.has_size("diameter"))
SLOTS = shapes_where(lambda spec: spec.has_sides)
"""Shapes with two long sides, hence a middle plane."""
WITH_SIZE = (*WITH_RADIUS, *SLOTS)
LONG_AND_WIDE = shapes_where(lambda spec: spec.has_size("length"))
WITH_WIDTH = shapes_where(lambda spec: spec.has_size("width"))
DIRECTED = (Shape.PLANE, *AXES)
ROUND_AXES = (*AXES, Shape.CIRCLE)
SPHERICAL = shapes_where(lambda spec: spec.centred and not spec.has_direction)
"""Shapes with a centre and without a direction."""
OF_A_LINE = shapes_where(lambda spec: spec.is_flat or not spec.has_normals)
"""Shapes that can be touched as a line on a surface: points, edges and outlines."""
OF_A_SURFACE = shapes_where(
    lambda spec: not spec.is_flat and (spec.has_normals or spec.located == "everywhere")
)
"""Shapes that can be touched as a surface, including points."""
