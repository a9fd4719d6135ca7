"""The common form of every fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ocmm_core.errors import FitError
from ocmm_core.features.shapes._shape import Shape
from ocmm_core.features.shapes._specs import (
    ACROSS,
    DIRECTION,
    GEOMETRY_SIZE,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    Criterion,
    ShapeSpec,
)
from ocmm_core.geometry import Float

MOST_POINTS = 1000
MINIMUM_POINTS = {shape: shape.spec.minimum_points for shape in Shape}

GEOMETRY_NAMES = (
    "x", "y", "z",
    "direction_x", "direction_y", "direction_z",
    "radius", "second", "half_angle",
    "across_x", "across_y", "across_z",
)  # fmt: skip
"""Entries of the geometry vector, in order."""


@dataclass(frozen=True, slots=True)
class Fit:
    """An element associated with points, in the same form for every shape."""

    shape: Shape
    geometry: Float
    """(12,): see `element`. The point is the centre if the shape has one, else (line, plane,
    cylinder, cone) the foot of the points' centroid on the element or its axis."""
    jacobian: Float
    """(12, 3 n): d(geometry) / d(points), points row by row (x1 y1 z1 x2 ...). First order in the
    residuals: exact for small residuals relative to the size of the feature."""
    residuals: Float
    """(n,), mm: signed orthogonal distance of each point from the element."""
    rms: float
    """mm: square root of the mean squared residual."""
    form: float
    """mm: greatest minus smallest signed residual; of a line in space the diameter of the thinnest
    cylinder along it about the points, of a circle in space by its minimum zone that of the tube.
    """
    criterion: Criterion = Criterion.LEAST_SQUARES
    contacts: tuple[int, ...] = ()
    """Rows of contact points of criteria but least squares: the certificate of optimality."""
    free: bool = False
    """Circle: in space, plane and circle as one problem."""
    rival: Fit | None = None
    """Another element of the same shape that the points do not exclude: noise of the observed size
    may have made it the worse one. No result may depend on a fit with a rival."""

    @property
    def point(self) -> Float:
        """Return the point of the element, (3,), mm."""
        return self.geometry[POINT]

    @property
    def direction(self) -> Float:
        """Return the direction of the element, (3,), unit, zero for point and sphere."""
        return self.geometry[DIRECTION]

    @property
    def across(self) -> Float:
        """Return the in-plane direction of ellipse, slot and rectangle, (3,), unit, or zero."""
        return self.geometry[ACROSS]

    @property
    def radius(self) -> float:
        """Return the radius or first half size, mm, or zero."""
        return float(self.geometry[RADIUS])

    @property
    def second(self) -> float:
        """Return the second half size, mm, or zero."""
        return float(self.geometry[SECOND])

    @property
    def half_angle(self) -> float:
        """Return the half apex angle of a cone, rad, else zero."""
        return float(self.geometry[HALF_ANGLE])

    @property
    def diameter(self) -> float:
        """Return the diameter of circle, sphere, cylinder, or of a cone at its point, mm."""
        return 2.0 * self._size("diameter", RADIUS)

    @property
    def ring_diameter(self) -> float:
        """Return the diameter of the centre line of a torus, mm."""
        return 2.0 * self._size("ring diameter", RADIUS)

    @property
    def tube_diameter(self) -> float:
        """Return the diameter of the tube of a torus, mm."""
        return 2.0 * self._size("tube diameter", SECOND)

    @property
    def length(self) -> float:
        """Return the long axis of an ellipse, or the overall length of slot and rectangle, mm."""
        return 2.0 * self._size("length", RADIUS)

    @property
    def width(self) -> float:
        """Return the short axis of an ellipse, or the width of slot and rectangle, mm."""
        return 2.0 * self._size("width", SECOND)

    @property
    def full_angle(self) -> float:
        """Return the apex angle of a cone, rad."""
        return 2.0 * self._size("full angle", HALF_ANGLE)

    def _size(self, word: str, place: int) -> float:
        words = [size.word for size in self.shape.spec.sizes]
        if word not in words:
            has = " and ".join(words) or "no size"
            raise FitError(
                "fit.no_such_size", f"{self.shape.value} has no {word}.", f"It has {has}."
            )
        return float(self.geometry[place])

    def covariance(self, points: float | Float) -> Float:
        """Return the covariance of the geometry, (12, 12), to first order.

        Order as `GEOMETRY_NAMES`; mm and, for directions and the half angle, rad; zero for absent
        entries. Twice the square root of a diagonal element is U (k = 2) only if the fit is nearly
        linear within the errors: see `ocmm_core.tolerances.uncertainty._fit_uncertainty`.
        ``points`` is the standard uncertainty, mm, of every coordinate, independent of each other,
        or their covariance (3 n, 3 n), mm^2, point by point (x1 y1 z1 x2 ...); FitError otherwise.
        """
        of_points = np.asarray(points, dtype=np.float64)
        count = self.jacobian.shape[1]
        if of_points.ndim == 0 and 0.0 < of_points < np.inf:
            return np.asarray(of_points**2 * (self.jacobian @ self.jacobian.T))
        if of_points.shape != (count, count) or not np.all(np.isfinite(of_points)):
            raise FitError(
                "fit.point_covariance",
                "The uncertainty of the points is neither a number of mm above zero nor a finite "
                f"covariance of {count} by {count} coordinates.",
                "Give one of the two.",
            )
        return np.asarray(self.jacobian @ of_points @ self.jacobian.T)


def element(
    point: ArrayLike,
    direction: ArrayLike = (0.0, 0.0, 0.0),
    radius: float = 0.0,
    *,
    second: float = 0.0,
    half_angle: float = 0.0,
    across: ArrayLike = (0.0, 0.0, 0.0),
) -> Float:
    """Return the geometry vector (12,) common to all shapes; absent entries are zero.

    Parameters
    ----------
    point
        (3,), mm.
    direction
        (3,), unit: along a line or axis, or the normal of a plane. A cone's points to growing
        radius.
    radius
        mm: of circle, sphere and cylinder; of a cone square to its axis at ``point``; of the centre
        line of a torus; semi-major axis of an ellipse; half the overall length of a slot or
        rectangle.
    second
        mm: semi-minor axis of an ellipse; half the width of a slot or rectangle; radius of the tube
        of a torus.
    half_angle
        rad: half the apex angle of a cone.
    across
        (3,), unit: direction of the length of ellipse, slot and rectangle, square to ``direction``.
    """
    geometry = np.zeros(GEOMETRY_SIZE)
    geometry[POINT], geometry[DIRECTION], geometry[ACROSS] = point, direction, across
    geometry[RADIUS], geometry[SECOND], geometry[HALF_ANGLE] = radius, second, half_angle
    return geometry


def make_fit(
    shape: Shape,
    geometry: Float,
    jacobian: Float,
    residuals: Float,
    *,
    criterion: Criterion = Criterion.LEAST_SQUARES,
    contacts: tuple[int, ...] = (),
) -> Fit:
    """Return the fit with its figures of form."""
    return Fit(
        shape=shape,
        geometry=geometry,
        jacobian=jacobian,
        residuals=residuals,
        rms=float(np.sqrt(residuals @ residuals / len(residuals))),
        form=float(np.maximum.reduce(residuals) - np.minimum.reduce(residuals)),
        criterion=criterion,
        contacts=contacts,
    )


def shapes_where(trait: Callable[[ShapeSpec], bool]) -> tuple[Shape, ...]:
    """Return the shapes with a trait, in the order of `Shape`."""
    return tuple(shape for shape in Shape if trait(shape.spec))
