"""Nonlinear least squares for the fits: Newton steps guarded by Levenberg-Marquardt.

Orthogonal-distance problems have few parameters and cheap second derivatives, with which steps
converge quadratically even for large residuals or short arcs, where Gauss-Newton alone is slow.
Source: J. Nocedal and S. Wright, Numerical Optimization (2nd ed.), chapter 10; the damping is
Marquardt's. The loops are those of `newton_kernel`.

Rival elements that the points cannot exclude: two minima of the same problem are compared by their
likelihoods. For n points with normal noise of unknown size (integrated out) and an element of k
parameters, the ratio is (second cost / first cost) to the power of (n - k) / 2. Below `ODDS`, the
second element is a rival: noise of the observed size may have made it the worse one. With n = k the
noise is unknown; there a rival passes through all points.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import shapes
from ocmm_core.features.search._axis_kernel import RING
from ocmm_core.features.search._common import degenerate
from ocmm_core.features.search._newton_kernel import STEP_SIZE, gain_of, newton, terms
from ocmm_core.geometry import Float

WELL_CONDITIONED = 1e-10
"""Smallest over greatest eigenvalue of scaled normal equations above which they are used."""


@dataclass(frozen=True, slots=True)
class Solution:
    """Result of the iteration."""

    parameters: Float
    """(8,), as defined by `axis_kernel` and `flat_kernel` for the kind."""
    cost: float
    converged: bool
    """False if the steps did not become short."""


def minimise(kind: int, points: Float, start: Float) -> Solution:
    """Return the local minimum reached from ``start`` (8,) with points (n, d)."""
    parameters = start.copy()
    cost, converged = newton(kind, points, parameters)
    return Solution(parameters, float(cost), bool(converged))


def derivatives(kind: int, points: Float, parameters: Float) -> tuple[Float, Float, Float]:
    """Return residuals and their derivatives by a step.

    Residuals (n,), first derivatives (n, k), and the sum (k, k) of every residual times its matrix
    of second derivatives; 2 n rows for a ring.
    """
    k = STEP_SIZE[kind]
    rows = len(points) * (2 if kind == RING else 1)
    residuals, jacobian, curvature = np.empty(rows), np.empty((k, rows)).T, np.empty((k, k))
    terms(kind, points, parameters, residuals, jacobian, curvature)
    return residuals, jacobian, curvature


def gains(jacobian: Float) -> tuple[Float, Float, float]:
    """Return the pseudoinverse of ``jacobian`` (n, k) in two parts, and its condition.

    It is the first part (k, k) times the second (n, k) transposed. Columns are scaled to unit
    length, so that the condition number depends on the geometry of the points, not on units.
    """
    k = jacobian.shape[1]
    gain = np.empty((k, k))
    least, greatest = gain_of(jacobian, gain)
    if least > WELL_CONDITIONED * greatest:
        return gain, jacobian, float(np.sqrt(greatest / least))
    # Squaring lost too many digits; use the pseudoinverse itself.
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    u, s, vt = np.linalg.svd(jacobian / scale, full_matrices=False)
    condition = float(s[0] / s[-1]) if s[-1] > 0.0 else np.inf
    inverse_s = np.where(s > 1e-300, 1.0 / np.maximum(s, 1e-300), 0.0)
    return np.eye(k), u @ (vt * inverse_s[:, None] / scale), condition


def sensitivity(jacobian: Float) -> tuple[Float, float]:
    """Return the pseudoinverse (k, n) of ``jacobian`` (n, k) and its condition number."""
    gain, shifts, condition = gains(jacobian)
    inverse: Float = gain @ shifts.T
    return inverse, condition


ODDS = 100.0
"""Odds from which an element excludes another."""
EXACT = 1e-10
"""Residual, relative to the size of the points, of an element through a point."""
NEAR = 0.05
"""Allowed relative difference from the plan."""
CLEARLY = 2.0
"""Multiple of `NEAR` by which all others must differ for the plan to decide."""
COVERAGE = 2.0
"""Expanded uncertainty in standard deviations; elements within it are no rivals."""

Distance = Callable[[Float], float]
"""Distance of parameters (8,) from the plan, in units of the allowed one (`NEAR`)."""


def undecided(least: float, other: float, n: int, numbers: int) -> bool:
    """Return whether noise leaves two costs undecided, the smaller one first.

    They are sums of squares of ``n`` scaled points, for an element with ``numbers`` parameters.
    """
    if other < n * EXACT**2:
        return True
    return n > numbers and other < least * ODDS ** (2.0 / (n - numbers))


def candidates(
    shape: shapes.Shape, solutions: Sequence[Solution], n: int, expected: Distance | None
) -> list[Solution]:
    """Return the best solution and its possible rivals, best first.

    ``solutions``, at least one, are best first, of ``n`` points; ``expected``, the distance from
    the plan, decides only if one is near and all others are clearly not: that one is returned
    alone. FitError if the best one did not converge.
    """
    best, numbers = solutions[0], shapes.MINIMUM_POINTS[shape]
    if not best.converged:
        raise degenerate(
            shape,
            "ever larger elements fit them better",
            "Spread the points over more of the feature.",
        )
    possible = [best]
    possible += [item for item in solutions[1:] if undecided(best.cost, item.cost, n, numbers)]
    if expected is not None and len(possible) > 1:
        nearest, *others = sorted(possible, key=lambda item: expected(item.parameters))
        clearly = all(expected(other.parameters) >= CLEARLY for other in others)
        if expected(nearest.parameters) <= 1.0 and clearly:
            return [nearest]
    return possible


def decided(possible: Sequence[Solution], build: Callable[[Float], shapes.Fit]) -> shapes.Fit:
    """Return the fit of the first of `candidates`, with its rival if there is one.

    FitError from ``build``: points that do not determine a rival determine no element.
    """
    first = build(possible[0].parameters.copy())
    for solution in possible[1:]:
        second = build(solution.parameters.copy())
        if not covered(first, second):
            return replace(first, rival=second)
    return first


def covered(first: shapes.Fit, second: shapes.Fit) -> bool:
    """Return whether the second element is within the first one's uncertainty, from its scatter."""
    n, numbers = len(first.residuals), shapes.MINIMUM_POINTS[first.shape]
    if n <= numbers:
        return False
    sigma = float(np.sqrt(first.residuals @ first.residuals / (n - numbers)))
    expanded = COVERAGE * sigma * np.linalg.norm(first.jacobian, axis=1)
    apart = _turned(first, second) - first.geometry
    return bool(np.all(np.abs(apart) <= expanded))


def same(first: shapes.Fit, second: shapes.Fit, tolerance: float = 1e-6) -> bool:
    """Return whether two fits of the same points are the same element."""
    apart = np.abs(_turned(first, second) - first.geometry)
    lengths = np.r_[shapes.POINT, shapes.RADIUS, shapes.SECOND]
    scale = max(first.radius, first.second, second.radius, second.second, 1e-300)
    return bool(
        np.all(apart[lengths] < tolerance * scale)
        and np.all(apart[np.r_[shapes.DIRECTION, shapes.ACROSS, shapes.HALF_ANGLE]] < tolerance)
    )


def _turned(first: shapes.Fit, second: shapes.Fit) -> Float:
    """Return the geometry (12,) of the second fit, with directions aligned to the first."""
    geometry, spec = second.geometry.copy(), first.shape.spec
    # A shape open to one side changes when reversed.
    opens = spec.has_sense and spec.is_curved
    for place in (shapes.DIRECTION, shapes.ACROSS):
        if not opens and first.geometry[place] @ geometry[place] < 0.0:
            geometry[place] *= -1.0
    return geometry


def with_rival(first: shapes.Fit, second: shapes.Fit) -> shapes.Fit:
    """Return the better of two fits by another criterion than least squares, with rival.

    A zone counts with its squared width as cost (uniform noise, to the power of n - k). Widths do
    not decide between inscribed or circumscribed elements.
    """
    if first.criterion is shapes.Criterion.MINIMUM_ZONE:
        first, second = sorted((first, second), key=lambda fit: fit.form)
        n, numbers = len(first.residuals), shapes.MINIMUM_POINTS[first.shape]
        if not undecided(first.form**2, second.form**2, n, numbers):
            return first
    return first if same(first, second) else replace(first, rival=second)


def unambiguous(fit: shapes.Fit) -> shapes.Fit:
    """Return the fit; FitError `fit.ambiguous`, with both elements' sizes, if it has a rival."""
    if fit.rival is None:
        return fit
    first, second = sizes_in_words(fit), sizes_in_words(fit.rival)
    if first == second:
        first, second = f"one at {_place(fit)} ({first})", f"one at {_place(fit.rival)} ({second})"
    raise FitError(
        "fit.ambiguous",
        f"The {len(fit.residuals)} points fit two different elements of the shape "
        f"{fit.shape.value.lower()}, and their noise cannot tell which: {first}, or {second}.",
        "Take more points, spread over more of the feature.",
    )


def sizes_in_words(fit: shapes.Fit) -> str:
    """Return the sizes of a fit in display form."""
    angle = 2.0 * float(np.degrees(fit.half_angle))
    return fit.shape.spec.sizes_text.format(2.0 * fit.radius, 2.0 * fit.second, angle)


def _place(fit: shapes.Fit) -> str:
    return ", ".join(f"{value:.3f}" for value in fit.point)
