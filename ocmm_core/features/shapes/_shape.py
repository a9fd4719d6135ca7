"""Shapes of features by name; their properties are in `_specs`."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ocmm_core.features.shapes._specs import ShapeSpec


class Shape(Enum):
    """Shape of a feature, by its name in plan and export."""

    POINT = "Point"
    LINE = "Line"
    PLANE = "Plane"
    CIRCLE = "Circle"
    SPHERE = "Sphere"
    CYLINDER = "Cylinder"
    ELLIPSE = "Ellipse"
    ROUND_SLOT = "RoundSlot"
    SQUARE_SLOT = "SquareSlot"
    RECTANGLE = "Rectangle"
    CONE = "Cone"
    TORUS = "Torus"

    @property
    def spec(self) -> ShapeSpec:
        # A command lists the shapes in its help; the registry needs numpy.
        from ocmm_core.features.shapes._specs import SPECS

        return SPECS[self.value]

    @property
    def label(self) -> str:
        """Return the name as displayed: ``Round slot`` for ``RoundSlot``."""
        return "".join(
            f" {c.lower()}" if c.isupper() and i else c for i, c in enumerate(self.value)
        )
