"""Elements between which the points cannot decide.

Two minima of the same problem are compared by their likelihoods. Of n points with normal noise of
unknown size and an element of k numbers, the noise integrated out, they stand in the ratio
(second cost / first cost) to the power of (n - k) / 2. Where that is less than `ODDS`, the second
element is a rival: noise of the size seen in the residuals may have made it the worse one. As many
points as numbers say nothing of the noise; there a rival passes through all points as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.search._common import degenerate
from ocmm_core.features.search._solver import Solution
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    HALF_ANGLE,
    MINIMUM_POINTS,
    POINT,
    RADIUS,
    SECOND,
    Criterion,
    Fit,
    Shape,
)
from ocmm_core.geometry import Float

ODDS = 100.0
"""So many times as probable as another an element must be to stand alone."""
EXACT = 1e-10
"""Residual against the size of the points below which an element passes through a point."""
NEAR = 0.05
"""Relative difference from what the plan says that an element may show."""
CLEARLY = 2.0
"""Times `NEAR` by which all others have to differ for the plan to decide."""
COVERAGE = 2.0
"""Expanded uncertainty in standard deviations; what it covers is no rival."""

Distance = Callable[[Float], float]
"""How far parameters (8,) are from what the plan says, in units of what is allowed (`NEAR`)."""


def undecided(least: float, other: float, n: int, numbers: int) -> bool:
    """Return whether noise cannot decide between two costs, sums of squares of scaled points.

    Parameters
    ----------
    least, other
        The costs, the smaller one first.
    n
        Number of points.
    numbers
        That determine the element.
    """
    if other < n * EXACT**2:
        return True
    return n > numbers and other < least * ODDS ** (2.0 / (n - numbers))


def candidates(
    shape: Shape, solutions: Sequence[Solution], n: int, expected: Distance | None
) -> list[Solution]:
    """Return the best solution and those that noise may have made worse, best first.

    Parameters
    ----------
    solutions
        Best first, at least one.
    n
        Number of points.
    expected
        What the plan says. It decides between rivals only, and only where one is near it and all
        others are clearly not: that one is returned alone.

    Raises
    ------
    FitError
        The best one is no minimum.
    """
    best, numbers = solutions[0], MINIMUM_POINTS[shape]
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


def decided(possible: Sequence[Solution], build: Callable[[Float], Fit]) -> Fit:
    """Return the fit of the first of the `candidates`, with its rival if there is one.

    Parameters
    ----------
    possible
        At least one.
    build
        Makes the fit of parameters (8,).

    Raises
    ------
    FitError
        Of ``build``. Where the points do not determine a rival they do not determine the element.
    """
    first = build(possible[0].parameters.copy())
    for solution in possible[1:]:
        second = build(solution.parameters.copy())
        if not covered(first, second):
            return replace(first, rival=second)
    return first


def covered(first: Fit, second: Fit) -> bool:
    """Return whether the second element lies within the uncertainty of the first.

    That is the one that the scatter of the residuals gives, in every number of the geometry.
    """
    n, numbers = len(first.residuals), MINIMUM_POINTS[first.shape]
    if n <= numbers:
        return False
    sigma = float(np.sqrt(first.residuals @ first.residuals / (n - numbers)))
    expanded = COVERAGE * sigma * np.linalg.norm(first.jacobian, axis=1)
    apart = _turned(first, second) - first.geometry
    return bool(np.all(np.abs(apart) <= expanded))


def same(first: Fit, second: Fit, tolerance: float = 1e-6) -> bool:
    """Return whether two fits of the same points are one element."""
    apart = np.abs(_turned(first, second) - first.geometry)
    lengths = np.r_[POINT, RADIUS, SECOND]
    scale = max(first.radius, first.second, second.radius, second.second, 1e-300)
    return bool(
        np.all(apart[lengths] < tolerance * scale)
        and np.all(apart[np.r_[DIRECTION, ACROSS, HALF_ANGLE]] < tolerance)
    )


def _turned(first: Fit, second: Fit) -> Float:
    """Return the geometry (12,) of the second fit, its directions along those of the first."""
    geometry, spec = second.geometry.copy(), first.shape.spec
    # A shape that opens to one side is another one the other way round.
    opens = spec.has_sense and spec.is_curved
    for place in (DIRECTION, ACROSS):
        if not opens and first.geometry[place] @ geometry[place] < 0.0:
            geometry[place] *= -1.0
    return geometry


def with_rival(first: Fit, second: Fit) -> Fit:
    """Return the better of two fits by a criterion other than least squares, with its rival.

    A zone is judged as a cost of its squared width (that of uniform noise, to the power of n - k).
    Between inscribed or circumscribed elements from rivals no width decides.
    """
    if first.criterion is Criterion.MINIMUM_ZONE:
        first, second = sorted((first, second), key=lambda fit: fit.form)
        n, numbers = len(first.residuals), MINIMUM_POINTS[first.shape]
        if not undecided(first.form**2, second.form**2, n, numbers):
            return first
    if same(first, second):
        return first
    return replace(first, rival=second)


def unambiguous(fit: Fit) -> Fit:
    """Return the fit if it has no rival.

    Raises
    ------
    FitError
        `fit.ambiguous`: it names the sizes of both elements.
    """
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


def sizes_in_words(fit: Fit) -> str:
    """Return the sizes of a fit as a person reads them."""
    angle = 2.0 * float(np.degrees(fit.half_angle))
    return fit.shape.spec.sizes_text.format(2.0 * fit.radius, 2.0 * fit.second, angle)


def _place(fit: Fit) -> str:
    return ", ".join(f"{value:.3f}" for value in fit.point)
