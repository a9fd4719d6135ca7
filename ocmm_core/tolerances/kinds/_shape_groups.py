"""Groups of shapes that entries of kinds name."""

from __future__ import annotations

from ocmm_core.features.shapes import Shape
from ocmm_core.tolerances.zones import AXES

ALL = tuple(Shape)
WITH_RADIUS = (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)
SLOTS = (Shape.ROUND_SLOT, Shape.SQUARE_SLOT, Shape.RECTANGLE)
"""Shapes with two long sides, thus with a middle plane."""
WITH_SIZE = (*WITH_RADIUS, *SLOTS)
LONG_AND_WIDE = (Shape.ELLIPSE, *SLOTS)
DIRECTED = (Shape.PLANE, *AXES)
ROUND_AXES = (*AXES, Shape.CIRCLE)
SPHERICAL = (Shape.POINT, Shape.SPHERE)
"""Shapes that are a centre and have no direction."""
