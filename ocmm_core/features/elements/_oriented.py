"""Elements with a given direction, or one that turns about a given axis.

A secondary datum is associated with its points under the orientation left by the primary one (ISO
5459): a face square to another one only turns about that one's normal. The remaining tilt of the
points stays in the residuals, which are then not small; planes and lines are therefore solved with
full curvature, also in their derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from ocmm_core.errors import FitError
from ocmm_core.features import shapes
from ocmm_core.features.elements._ball import WORST_CONDITION
from ocmm_core.features.elements._registry import ELEMENTS, distance_derivatives
from ocmm_core.features.search import centred, checked_points, degenerate
from ocmm_core.geometry import Float, Int, Points3, perpendicular_pair, rotation_from_vector, skew

STEPS = 60
_SETTLED = 1e-12
"""Step at convergence, in units of the size of the points; rotation, rad."""
_PROGRAM_SETTLED, _POLISHED = 1e-6, 3
"""Step of the linear program after which its contacts are final; solutions of their equations."""
_TRUST = 0.1
"""Largest step of the first linear program, in the same units: beyond it distances curve."""
_NARROWED = 0.25
"""Factor of its reduction after a failed step."""
_SHARE = 1e-9
"""Multiplier of a point below which it is no contact."""


class OrientedSearch:
    """Sizes, position and, if free, direction of an element, about the points' centroid."""

    def __init__(
        self, start: shapes.Fit, points: Points3, direction: Float, about: Float | None
    ) -> None:
        if not ELEMENTS[start.shape].may_be_turned:
            raise FitError(
                "fit.oriented_shape",
                f"Fitting a {start.shape.value.lower()} with a direction given by datums is not "
                "supported.",
                "Make it the first datum, or choose least squares for it.",
            )
        spec = start.shape.spec
        self._has_own_centre = spec.centred and spec.located == "everywhere"
        self._start, self._about = start, about
        self._centroid, middle, self._size = centred(start.shape, points)
        self._points = middle * self._size
        geometry = start.geometry.copy()
        geometry[shapes.POINT] -= self._centroid
        geometry[shapes.DIRECTION] = direction
        self._geometry = self._at_foot(geometry)

    def found(self) -> tuple[shapes.Fit, Float]:
        """Return the element and its derivative by rotation of the constraint."""
        if self._start.criterion is shapes.Criterion.LEAST_SQUARES:
            self._descend()
            return self._finished(())
        contacts = self._held_by()
        for _ in range(_POLISHED):
            # A program gives its solution to some 1e-7; its contacts determine it fully.
            residuals, slopes, _ = self._distances()
            basis = self._basis()
            rows, design = self._held(contacts, slopes @ basis)
            step = _solved(design, residuals[rows])
            self._move(basis, step[: basis.shape[1]])
        return self._finished(contacts)

    def _descend(self) -> None:
        for _ in range(STEPS):
            residuals, slopes, _ = self._distances()
            basis = self._basis()
            step = _solved(slopes @ basis, residuals)
            self._move(basis, step)
            if float(np.abs(step).max()) < _SETTLED * self._size:
                return
        raise unsettled(self._start.shape)

    def _held_by(self) -> tuple[int, ...]:
        """Find the element of another criterion by linear programs; return its contacts."""
        trust = _TRUST * self._size
        for _ in range(STEPS):
            self._reach()
            residuals, slopes, _ = self._distances()
            basis, before = self._basis(), self._geometry
            step, _ = self._program(residuals, slopes @ basis, trust)
            self._move(basis, step)
            if float(np.abs(step).max()) < _PROGRAM_SETTLED * self._size:
                # A short reach may have ended the step; the contacts show without it.
                return self._program(residuals, slopes @ basis, _TRUST * self._size)[1]
            if self._cost(self._distances()[0]) > self._cost(residuals):
                # Distances curve within such a step.
                self._geometry, trust = before, _NARROWED * min(trust, float(np.abs(step).max()))
            else:
                trust = min(trust / _NARROWED, _TRUST * self._size)
        raise unsettled(self._start.shape)

    def _reach(self) -> None:
        """Set the radius of an inscribed or circumscribed element to fit its position."""
        if self._start.criterion is shapes.Criterion.MINIMUM_ZONE:
            return
        residuals = self._distances()[0]
        inscribed = self._start.criterion is shapes.Criterion.INSCRIBED
        self._geometry = self._geometry.copy()
        self._geometry[shapes.RADIUS] += residuals.min() if inscribed else residuals.max()

    def _cost(self, residuals: Float) -> float:
        """Return the quantity minimised by the criterion, for any radius."""
        match self._start.criterion:
            case shapes.Criterion.INSCRIBED:
                return -float(residuals.min() + self._geometry[shapes.RADIUS])
            case shapes.Criterion.CIRCUMSCRIBED:
                return float(residuals.max() + self._geometry[shapes.RADIUS])
        return float(np.abs(residuals).max())

    def _held(self, contacts: tuple[int, ...], slopes: Float) -> tuple[Int, Float]:
        """Return the rows of the relevant points, and the response of their equations."""
        n = len(slopes)
        if not contacts:
            return np.arange(n), slopes
        rows = np.array(contacts) % n
        design: Float = slopes[rows]
        if self._start.criterion is shapes.Criterion.MINIMUM_ZONE:
            design = np.column_stack([design, np.where(np.array(contacts) < n, -1.0, 1.0)])
        return rows, design

    def _distances(self) -> tuple[Float, Float, Float]:
        """Return signed distances (n,), d(distance) / d(geometry) (n, 12), and normals (n, 3)."""
        here = replace(self._start, geometry=self._geometry)
        slopes, normals = distance_derivatives(here, self._points)
        arms = self._points - self._geometry[shapes.POINT]
        values = np.einsum("ij,ij->i", arms, normals)
        sizes = [shapes.RADIUS, shapes.SECOND]
        return values + slopes[:, sizes] @ self._geometry[sizes], slopes, normals

    def _basis(self) -> Float:
        """Return the free directions of the geometry, (12, k)."""
        direction = self._geometry[shapes.DIRECTION]
        moves: list[tuple[slice | int, Float | float]] = []
        spec = self._start.shape.spec
        if spec.located != "along":
            moves += [(shapes.POINT, across) for across in perpendicular_pair(direction)]
        # The radius is third, as expected by `_program`.
        moves += [(size.place, 1.0) for size in spec.sizes if size.place == shapes.RADIUS]
        if spec.located == "along" or self._has_own_centre:
            moves.append((shapes.POINT, direction))
        for size in spec.sizes:
            if size.place != shapes.RADIUS:
                moves.append((size.place, 1.0 / self._size if size.is_angle else 1.0))
        if self._about is not None:
            moves.append((shapes.DIRECTION, np.cross(self._about, direction) / self._size))
        basis = np.zeros((shapes.GEOMETRY_SIZE, len(moves)))
        for column, (place, value) in enumerate(moves):
            basis[place, column] = value
        return basis

    def _move(self, basis: Float, step: Float) -> None:
        geometry = self._geometry + basis @ step
        direction = self._geometry[shapes.DIRECTION]
        if self._about is not None:
            angle = float(step[-1]) / self._size
            direction = rotation_from_vector(angle * self._about) @ direction
        geometry[shapes.DIRECTION] = direction
        self._geometry = self._at_foot(geometry)

    def _at_foot(self, geometry: Float) -> Float:
        """Return the geometry with its point at the foot of the centroid on the element."""
        point, direction = geometry[shapes.POINT], geometry[shapes.DIRECTION]
        along = float(point @ direction)
        if self._has_own_centre:
            return geometry
        if self._start.shape.spec.located == "along":
            geometry[shapes.POINT] = along * direction
        else:
            geometry[shapes.POINT] = point - along * direction
            geometry[shapes.RADIUS] -= along * np.tan(geometry[shapes.HALF_ANGLE])
        return geometry

    def _program(
        self, residuals: Float, slopes: Float, trust: float
    ) -> tuple[Float, tuple[int, ...]]:
        """Return the step of a linear program, and its contacts."""
        n, k = slopes.shape
        criterion = self._start.criterion
        bounds: list[tuple[float | None, float | None]] = [(-trust, trust)] * k
        cost = np.zeros(k)
        if criterion is shapes.Criterion.MINIMUM_ZONE:
            rows = np.vstack([slopes, -slopes])
            rows = np.hstack([rows, -np.ones((2 * n, 1))])
            limits = np.concatenate([-residuals, residuals])
            cost, bounds = np.append(cost, 1.0), [*bounds, (0.0, None)]
        else:
            # Column 2 is the radius: every distance falls with it.
            sign = -1.0 if criterion is shapes.Criterion.INSCRIBED else 1.0
            rows, limits = sign * slopes, -sign * residuals
            cost[2] = sign
            bounds[2] = (None, None)
        answer = scipy.optimize.linprog(cost, A_ub=rows, b_ub=limits, bounds=bounds, method="highs")
        if answer.status != 0 or answer.x is None:
            raise unsettled(self._start.shape)
        held = np.flatnonzero(-answer.ineqlin.marginals > _SHARE)
        return np.asarray(answer.x[:k]), tuple(int(row) for row in held)

    def _finished(self, contacts: tuple[int, ...]) -> tuple[shapes.Fit, Float]:
        residuals, slopes, normals = self._distances()
        basis = self._basis()
        n, k = len(residuals), basis.shape[1]
        rows, design = self._held(contacts, slopes @ basis)
        if np.linalg.cond(design / np.linalg.norm(design, axis=0)) > WORST_CONDITION:
            raise degenerate(
                self._start.shape,
                "they do not determine it with the direction given by the datums",
                "Spread the points over more of the feature.",
            )
        gain = np.zeros((k, n))
        gain[:, rows] = -np.linalg.pinv(design)[:k]
        turning = np.zeros((shapes.GEOMETRY_SIZE, 3))
        turning[shapes.DIRECTION] = small_turning(self._geometry[shapes.DIRECTION])

        by_points = (basis @ gain)[:, :, None] * normals
        by_turn = turning + basis @ (gain @ (slopes @ turning))
        jacobian = self._followed(by_points.reshape(shapes.GEOMETRY_SIZE, 3 * n), n)
        geometry = self._geometry.copy()
        geometry[shapes.POINT] = self._geometry[shapes.POINT] + self._centroid
        fit = shapes.make_fit(
            self._start.shape, geometry, jacobian, residuals, criterion=self._start.criterion,
            contacts=tuple(sorted(set(rows.tolist()))) if contacts else (),
        )  # fmt: skip
        return fit, self._followed(by_turn, 0)

    def _followed(self, slopes: Float, n: int) -> Float:
        """Return derivatives (12, m) at the foot of the centroid, which the ``n`` points move."""
        direction = self._geometry[shapes.DIRECTION]
        if self._has_own_centre:
            return slopes
        point, result = self._geometry[shapes.POINT], slopes.copy()
        middle = np.tile(np.eye(3) / n, n) if n else np.zeros((3, slopes.shape[1]))
        if self._start.shape.spec.located == "along":
            offset = float(point @ direction)
            own = direction @ slopes[shapes.POINT] + point @ slopes[shapes.DIRECTION]
            result[shapes.POINT] = np.outer(direction, own) + offset * slopes[shapes.DIRECTION]
            result[shapes.POINT] += middle - np.outer(direction, direction @ middle)
            return result
        along = (
            direction @ middle - point @ slopes[shapes.DIRECTION] - direction @ slopes[shapes.POINT]
        )
        result[shapes.POINT] += np.outer(direction, along)
        result[shapes.RADIUS] += np.tan(self._geometry[shapes.HALF_ANGLE]) * along
        return result


def _solved(design: Float, residuals: Float) -> Float:
    """Return the step that cancels or minimises residuals."""
    return np.asarray(-np.linalg.lstsq(design, residuals)[0], dtype=np.float64)


def small_turning(direction: Float) -> Float:
    """Return d(direction) / d(small rotation, rad), (3, 3)."""
    return -skew(direction)


def unsettled(shape: shapes.Shape) -> FitError:
    return FitError(
        "fit.oriented_unsettled",
        f"No {shape.value.lower()} with the direction given by the datums was found.",
        "Check the points of that feature; they may belong to different surfaces.",
    )


@dataclass(frozen=True, slots=True)
class Turned:
    """A direction optimised by rotation about an axis."""

    direction: Float
    """(3,), unit."""
    by_points: Float
    """(3, 3 n): d(direction) / d(points)."""
    by_turn: Float
    """(3, 3): d(direction) / d(small rotation of the axis and all directions, rad)."""


def fixed_direction(direction: Float, count: int) -> Turned:
    """Return a direction independent of the points."""
    return Turned(direction, np.zeros((3, 3 * count)), small_turning(direction))


def turned_direction(
    shape: shapes.Shape, points: Points3, start: Float, about: Float, *, along: bool = False
) -> Turned:
    """Return the direction of least, or most, scatter of points as it turns about an axis.

    ``start`` (3,), unit, rotated about ``about`` (3,), unit, gives all permitted directions;
    ``along``: it is that of a line, not the normal of a plane. FitError if undetermined.
    """
    _, about_middle, size = centred(shape, points)
    direction = start
    for _ in range(STEPS):
        y, across = about_middle @ direction, np.cross(about, direction)
        v = about_middle @ across
        # The second derivative of a rotating direction points back to the axis.
        bent = about_middle @ np.cross(about, across)
        slope, curvature = float(y @ v), float(v @ v + y @ bent)
        if (-curvature if along else curvature) <= len(y) / WORST_CONDITION:
            raise degenerate(
                shape,
                "they do not determine its rotation about the preceding datums",
                "Take the points further apart, square to the direction of those datums.",
            )
        step = -slope / curvature
        direction = rotation_from_vector(step * about) @ direction
        if abs(step) < _SETTLED:
            break
    else:
        raise unsettled(shape)
    y, across = about_middle @ direction, np.cross(about, direction)
    v = about_middle @ across
    curvature = float(v @ v + y @ (about_middle @ np.cross(about, across)))
    by_points = -(np.outer(v, direction) + np.outer(y, across)).ravel() / (size * curvature)
    # A small rotation of the whole family: its slope changes via both factors.
    by_family = v @ np.cross(direction, about_middle) + y @ np.cross(across, about_middle)
    by_turn = small_turning(direction) - np.outer(across, by_family) / curvature
    return Turned(direction, np.outer(across, by_points), by_turn)


def fit_oriented(
    start: shapes.Fit, points: Points3, direction: Float, about: Float | None
) -> tuple[shapes.Fit, Float]:
    """Return the element of points with a direction that is fixed or turns about an axis.

    Parameters
    ----------
    start
        Unconstrained element of the same points, with shape and criterion to keep. Plane, line,
        circle, cylinder, cone or torus.
    points
        (n, 3), mm.
    direction
        (3,), unit: the direction, or a permitted one near that of ``start``.
    about
        (3,), unit: axis of free rotation; None if fixed.

    Returns
    -------
    fit
        Its jacobian treats the constraint as constant.
    by_turn
        (12, 3): d(geometry) / d(small rotation of the constraint, rad).

    Raises
    ------
    FitError
        The points do not determine the element, or a line has another criterion than least squares.
    """
    points = checked_points(start.shape, points)
    least_squares = start.criterion is shapes.Criterion.LEAST_SQUARES
    if start.shape is shapes.Shape.LINE or (start.shape is shapes.Shape.PLANE and least_squares):
        return _flat_or_straight(start, points, direction, about)
    if start.shape is shapes.Shape.CIRCLE and about is not None:
        # The plane of a circle comes first, for any criterion in it.
        turned = turned_direction(start.shape, points, direction, about)
        fit, by_turn = fit_oriented(start, points, turned.direction, None)
        # Motion of the direction acts on the circle like a rotation of the constraint.
        turning = np.cross(turned.direction, turned.by_points, axis=0)
        jacobian = fit.jacobian + by_turn @ turning
        carried = by_turn @ np.cross(turned.direction, turned.by_turn, axis=0)
        return replace(fit, jacobian=jacobian), carried
    return OrientedSearch(start, points, direction, about).found()


def _flat_or_straight(
    start: shapes.Fit, points: Points3, direction: Float, about: Float | None
) -> tuple[shapes.Fit, Float]:
    shape, n = start.shape, len(points)
    if start.criterion is not shapes.Criterion.LEAST_SQUARES:
        raise FitError(
            "fit.oriented_criterion",
            f"A {shape.value.lower()} with a given direction supports least squares only.",
            "Choose least squares for that feature.",
        )
    turned = fixed_direction(direction, n)
    if about is not None:
        turned = turned_direction(shape, points, direction, about, along=shape is shapes.Shape.LINE)
    jacobian, by_turn = np.zeros((shapes.GEOMETRY_SIZE, 3 * n)), np.zeros((shapes.GEOMETRY_SIZE, 3))
    jacobian[shapes.POINT] = np.tile(np.eye(3) / n, n)
    jacobian[shapes.DIRECTION], by_turn[shapes.DIRECTION] = turned.by_points, turned.by_turn
    middle = points.mean(axis=0)
    arms = points - middle
    along = arms @ turned.direction
    residuals = along
    if shape is shapes.Shape.LINE:
        across = arms - np.outer(along, turned.direction)
        widest = np.linalg.svd(across, full_matrices=False)[2][0]
        residuals = np.linalg.norm(across, axis=1) * np.where(across @ widest < 0.0, -1.0, 1.0)
    fit = shapes.make_fit(shape, shapes.element(middle, turned.direction), jacobian, residuals)
    return fit, by_turn
