"""Uncertainty of a fit from points alone, by the scatter of its residuals.

It is the uncertainty of a job (`sampling.widened`, `_first_order.growth`) without point noise, so
that all scatter counts as form: independent between places, square to the element. Student's
distribution accounts for few points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.features import shapes
from ocmm_core.features.elements import distance_derivatives
from ocmm_core.features.measured import beyond_first_order
from ocmm_core.geometry import Float, Points3, perpendicular_pair
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.uncertainty._first_order import growth, second_order
from ocmm_core.tolerances.uncertainty._interval import TWO_SIDED
from ocmm_core.tolerances.uncertainty._sampling import FormSample, Widened, student_factor, widened

_PLANE_PARAMETERS = 3

FEW_DEGREES = 2
"""Degrees of freedom up to which two scatters of an outline are kept separate."""

LIKELY_SCATTER_MM = 0.01
"""The first-order test uses the scatter as if one more residual of this size had been observed.

Few residuals may be small by chance, and then a poorly determined element appears well determined.
A job with given point noise needs no such term.
"""


@dataclass(frozen=True, slots=True)
class Stated:
    """Uncertainty of one number of a fit, or of a direction."""

    standard: float
    """Standard uncertainty u; of a direction the greatest, rad."""
    expanded: float | None
    """U (95.45 %), of a direction its cone; None if first order is invalid or it has a rival."""
    degrees: float
    """Effective degrees of freedom."""
    growth: float = 1.0
    """Factor of the second-order term in U; 1 if first order is exact, infinite if not valid."""

    @property
    def valid(self) -> bool:
        """Return whether first order, with its second-order term, holds."""
        return math.isfinite(self.growth)

    @property
    def k(self) -> float | None:
        """Return the coverage factor U / u; None without U."""
        if self.expanded is None or self.standard == 0.0:
            return None
        return self.expanded / self.standard


@dataclass(frozen=True, slots=True)
class FitUncertainty:
    """Uncertainty of every number of a fit from the scatter of the points."""

    centre: tuple[Stated, Stated, Stated] | None
    """x, y and z of a centre or point; None for a line, a plane and an axis."""
    foot: Stated | None
    """Their position, square to them, at the foot of the points' centroid; else None."""
    direction: Stated | None
    """rad, of an axis or normal."""
    turn: Stated | None
    """rad, of the length direction within its plane; the plane's is in `direction`."""
    radius: Stated | None
    second: Stated | None
    half_angle: Stated | None
    """`radius`, `second`, `half_angle`: as in the fit, mm and rad; None if the shape has none."""


def fit_uncertainty(fit: shapes.Fit, points: Points3) -> FitUncertainty | None:
    """Return the uncertainty of a least-squares fit of points (n, 3), mm; None without scatter."""
    samples = scatter_samples(fit, points)
    if not samples:
        return None
    jacobian = Rows.of_points(range(len(points)), fit.jacobian)

    places = np.arange(len(points))
    # Of an outline, the scatter within its plane, which is nonlinear.
    scatter, degrees = samples[0].scatter, samples[0].degrees
    likely = (degrees * scatter + LIKELY_SCATTER_MM**2) / (degrees + 1.0)
    stretch = math.sqrt(max(likely / scatter, 1.0)) if scatter > 0.0 else math.inf

    # Effective degrees of freedom are too many if the scatter with the fewest is small by chance:
    # then each scatter gets its own U, and their squares add up.
    own = {sample.degrees for sample in samples}
    mixed = len(own) > 1 and min(own) <= FEW_DEGREES

    numbers = _numbers(fit)
    firsts = {name: rows @ jacobian for name, rows in numbers.items()}
    founds = {name: widened(gradients, None, samples) for name, gradients in firsts.items()}

    def changed(rows: Float, gradients: Rows, found: Widened) -> Float:
        def follow(moves: Rows) -> Float:
            return beyond_first_order(fit, points, moves.at(places)) @ rows.T

        return second_order(gradients, None, samples, found, follow)

    changes = {name: changed(numbers[name], firsts[name], found) for name, found in founds.items()}
    # A failed refit is not a number.
    largest = (np.nan_to_num(abs(c), nan=np.inf).max(initial=0.0) for c in changes.values())
    related = stretch * float(max(largest))

    def stated(name: str) -> Stated | None:
        found = founds.get(name)
        if found is None:
            return None
        variances = _unwidened(found.covariance, found.degrees)
        standard = math.sqrt(max(float(variances[-1]), 0.0))
        if float(variances.sum()) <= 0.0:
            return Stated(0.0, 0.0, found.degrees)
        grown = growth(changes[name], found.degrees, stretch, related)
        if fit.rival is not None or not math.isfinite(grown):
            return Stated(standard, None, found.degrees, grown)
        reach = _reach(variances, found.degrees)
        if mixed:
            alone = [widened(firsts[name], None, [sample]) for sample in samples]
            reach = math.sqrt(
                sum(
                    _reach(_unwidened(one.covariance, one.degrees), one.degrees) ** 2
                    for one in alone
                )
            )
        return Stated(standard, grown * reach, found.degrees, grown)

    x, y, z = (stated(word) for word in "xyz")
    return FitUncertainty(
        None if x is None or y is None or z is None else (x, y, z),
        *(stated(name) for name in ("foot", "direction", "turn", "radius", "second", "half angle")),
    )


def _numbers(fit: shapes.Fit) -> dict[str, Float]:
    """Return the combinations (k, 12) of the geometry that have an uncertainty, by name."""
    rows = np.eye(len(fit.geometry))
    found: dict[str, Float] = {}
    if fit.shape.spec.is_long:
        found["foot"] = np.stack(perpendicular_pair(fit.direction)) @ rows[shapes.POINT]
    elif not fit.shape.spec.centred:
        found["foot"] = (fit.direction @ rows[shapes.POINT])[None]
    else:
        found |= {word: rows[k : k + 1] for word, k in zip("xyz", range(3), strict=True)}
    if fit.direction.any():
        found["direction"] = np.stack(perpendicular_pair(fit.direction)) @ rows[shapes.DIRECTION]
    if fit.across.any():
        found["turn"] = (np.cross(fit.direction, fit.across) @ rows[shapes.ACROSS])[None]
    for name, place in (
        ("radius", shapes.RADIUS), ("second", shapes.SECOND), ("half angle", shapes.HALF_ANGLE)
    ):  # fmt: skip
        if fit.geometry[place] != 0.0:
            found[name] = rows[place : place + 1]
    return found


def _unwidened(covariance: Float, degrees: float) -> Float:
    """Return the variances (k,) along the principal axes, without Student's factor."""
    variances = np.asarray(np.linalg.eigvalsh(covariance), dtype=np.float64)
    return variances * (2.0 / student_factor(degrees)) ** 2


def _reach(variances: Float, degrees: float) -> float:
    """Return the radius that covers a vector, by two moments of its square (Satterthwaite)."""
    total = float(variances.sum())
    if total <= 0.0 or not math.isfinite(degrees):
        return 0.0
    components = total**2 / float(np.sum(variances**2))
    return math.sqrt(total * float(scipy.special.fdtri(components, degrees, TWO_SIDED)))


def scatter_samples(fit: shapes.Fit, points: Points3) -> tuple[FormSample, ...]:
    """Return the scatter samples of a fit; of an outline two: in its plane, and across it."""
    if fit.criterion is not shapes.Criterion.LEAST_SQUARES:
        return ()
    n = len(points)
    places = np.arange(n)

    def sample(name: str, normals: Float, squares: float, degrees: int) -> FormSample:
        scatter = squares / degrees
        return FormSample(name, places, normals, scatter, scatter, degrees)

    residuals = fit.residuals
    squares = float(residuals @ residuals)
    if fit.shape is shapes.Shape.POINT:
        if n < 2:
            return ()
        return (sample("scatter", np.tile(np.eye(3), (n, 1, 1)), squares, 3 * n - 3),)
    if fit.shape is shapes.Shape.LINE:
        if n < 3:
            return ()
        pair = np.stack(perpendicular_pair(fit.direction), axis=1)
        return (sample("scatter", np.tile(pair, (n, 1, 1)), squares, 2 * n - 4),)
    degrees = n - shapes.MINIMUM_POINTS[fit.shape]
    if degrees < 1:
        return ()
    _, normals = distance_derivatives(fit, points)
    if not fit.shape.spec.is_flat:
        return (sample("scatter", normals[:, :, None], squares, degrees),)
    heights = (points - fit.point) @ fit.direction
    within = normals - np.outer(normals @ fit.direction, fit.direction)
    within /= np.maximum(np.linalg.norm(within, axis=1), 1e-12)[:, None]
    if fit.shape is shapes.Shape.CIRCLE:
        arms = points - fit.point - np.outer(heights, fit.direction)
        radial = np.linalg.norm(arms, axis=1) - fit.radius
        squares = float(radial @ radial)
    upright = np.tile(fit.direction[:, None], (n, 1, 1))
    return (
        sample("within its plane", within[:, :, None], squares, degrees),
        sample("out of its plane", upright, float(heights @ heights), n - _PLANE_PARAMETERS),
    )
