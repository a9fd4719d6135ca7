"""The shapes that can be fitted and the common form of every fit."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from ocmm_core.geometry import Float

GEOMETRY_SIZE = 7
"""Length of the geometry vector: point (3), direction (3), radius (1)."""


class Shape(Enum):
    """Shape of a feature, in the words of the plan and of the export."""

    POINT = "Point"
    LINE = "Line"
    PLANE = "Plane"
    CIRCLE = "Circle"
    SPHERE = "Sphere"
    CYLINDER = "Cylinder"


MINIMUM_POINTS = {
    Shape.POINT: 1,
    Shape.LINE: 2,
    Shape.PLANE: 3,
    Shape.CIRCLE: 3,
    Shape.SPHERE: 4,
    Shape.CYLINDER: 5,
}
"""Points without which the shape is not determined."""


@dataclass(frozen=True, slots=True)
class Fit:
    """An orthogonal-distance least-squares fit, in the same form for every shape.

    Attributes
    ----------
    shape
        What was fitted.
    geometry
        (7,): point (3, mm), direction (3, unit), radius (mm); what the shape does not have is
        zero. The point is the centre of point, circle and sphere, and for line, plane and
        cylinder the foot of the points' centroid on the element.
    jacobian
        (7, 3 n): d(geometry) / d(points), points row by row (x1 y1 z1 x2 ...). First order in the
        residuals: exact where they are small against the size of the feature.
    residuals
        (n,), mm: signed orthogonal distance of each point from the element.
    rms
        mm: square root of the mean squared residual.
    form
        mm: greatest minus smallest signed residual.
    """

    shape: Shape
    geometry: Float
    jacobian: Float
    residuals: Float
    rms: float
    form: float

    @property
    def point(self) -> Float:
        """Return the point of the element, (3,), mm."""
        return self.geometry[0:3]

    @property
    def direction(self) -> Float:
        """Return the direction of the element, (3,), unit, zero for point and sphere."""
        return self.geometry[3:6]

    @property
    def radius(self) -> float:
        """Return the radius, mm, zero where the shape has none."""
        return float(self.geometry[6])


def make_fit(shape: Shape, geometry: Float, jacobian: Float, residuals: Float) -> Fit:
    """Return the fit with its figures of form."""
    return Fit(
        shape=shape,
        geometry=geometry,
        jacobian=jacobian,
        residuals=residuals,
        rms=float(np.sqrt(np.mean(residuals**2))),
        form=float(np.ptp(residuals)),
    )
