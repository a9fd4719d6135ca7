"""An ellipse by orthogonal distance, in a plane: the direct algebraic fit first, then Newton.

Start: the constrained conic of R. Halir and J. Flusser (Numerically stable direct least squares
fitting of ellipses, 1998), which always is an ellipse, and the unconstrained one where it is one,
which short arcs prefer.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.fit.ball import LARGEST_RADIUS, WORST_CONDITION, not_converged
from ocmm_core.features.fit.common import FLAT, degenerate
from ocmm_core.features.fit.ellipse_kernel import conics, of_conic
from ocmm_core.features.fit.flat import Outline, fit_in_given_plane, fit_in_own_plane
from ocmm_core.features.fit.flat_kernel import ELLIPSE
from ocmm_core.features.fit.newton_kernel import descend
from ocmm_core.features.fit.search import sampled
from ocmm_core.features.fit.solver import Solution, derivatives, gains, minimise
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3

SAMPLE, STEPS = 40, 20
"""Points and steps with which a start goes down before all points are used."""
MIDDLE = 200
"""Points on which a start is refined before all points are used."""
NEAR = 0.02
"""Root mean squared residual against the short axis below which no other minimum is looked for."""
ROUNDEST = 1e-7
"""Relative difference of the axes below which an ellipse has no long one."""


def fit_ellipse(
    points: Points3, direction_hint: Float | None = None, offset: float = 0.0
) -> Fit:
    """Return the ellipse in the orthogonal-distance plane of ``points`` (n, 3), mm.

    Residuals are in the plane, positive outside.

    Parameters
    ----------
    points
        (n, 3), mm.
    direction_hint
        (3,): orients the normal.
    offset
        mm: the points lie this far outside the ellipse. Centres of a ball that touched an ellipse
        do not lie on one.

    Raises
    ------
    FitError
        Too few points, or they do not determine an ellipse, or a ball of that size cannot have
        touched it from inside.
    """
    outline = partial(_outline, offset=offset)
    return fit_in_own_plane(Shape.ELLIPSE, points, direction_hint, outline)


def fit_ellipse_projected(
    points: Points3, plane_normal: Float, offset: float = 0.0
) -> tuple[Fit, Float]:
    """Return the ellipse of ``points`` projected along ``plane_normal``.

    See `flat.fit_in_given_plane` and, for ``offset``, `fit_ellipse`.
    """
    outline = partial(_outline, offset=offset)
    return fit_in_given_plane(Shape.ELLIPSE, points, plane_normal, outline)


def _outline(points: Float, size: float, offset: float) -> Outline:
    flat = degenerate(
        Shape.ELLIPSE,
        "they lie on a straight line, on a circle or on too short an arc",
        "Spread the points around the ellipse; measure a round one as a circle.",
    )
    found: list[Solution] = []
    middle = sampled(points, MIDDLE)
    for start in _descended(sampled(points, SAMPLE), offset / size):
        # Steps on fewer points are cheap, and the last ones on all points are then few.
        near = minimise(ELLIPSE, middle, start)
        solution = minimise(ELLIPSE, points, near.parameters if near.converged else start)
        a, b = solution.parameters[3:5]
        if solution.converged and 0.0 < b < LARGEST_RADIUS and 0.0 < a < LARGEST_RADIUS:
            found.append(solution)
            if solution.cost < len(points) * (NEAR * min(a, b)) ** 2:
                break
    if not found:
        extents = np.linalg.svd(points, compute_uv=False)
        raise flat if extents[1] < FLAT * extents[0] else not_converged(Shape.ELLIPSE)
    p = min(found, key=lambda solution: solution.cost).parameters
    if abs(p[3] - p[4]) < ROUNDEST * max(p[3], p[4]):
        raise flat
    residuals, jacobian, _ = derivatives(ELLIPSE, points, p)
    gain, shifts, condition = gains(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    long, short = max(p[3], p[4]), min(p[3], p[4])
    if -offset / size >= short**2 / long:
        raise FitError(
            "feature.ball_too_large",
            "A ball of this size cannot touch the ends of the ellipse from inside: its radius is "
            f"not smaller than theirs, {size * short**2 / long:.3f} mm.",
            "Use a smaller ball, or check the side in the plan.",
        )
    return oblong(p, residuals, jacobian, -gain, shifts)


def oblong(
    p: Float, residuals: Float, jacobian: Float, gain: Float, shifts: Float
) -> Outline:
    """Return the outline of parameters (8,) of `flat_kernel`, its longer half size first.

    ``jacobian`` is (n, 5) by a step, ``gain`` and ``shifts`` are as in `flat.Outline`, for a step.
    """
    turn, order = float(p[2]), [0, 1, 2, 3, 4]
    c, s = np.cos(turn), np.sin(turn)
    frame = np.array([[c, s], [-s, c]])
    rows = gain.copy()
    rows[0:2] = frame.T @ gain[0:2]
    if p[4] > p[3]:
        turn, order = turn + 0.5 * np.pi, [0, 1, 2, 4, 3]
    return Outline(
        p[0:2].copy(), float(p[order[3]]), float(p[order[4]]), turn, -jacobian[:, 0:2] @ frame,
        residuals, rows[order], shifts,
    )  # fmt: skip


def _descended(sample: Float, offset: float) -> Iterator[Float]:
    """Yield start parameters (8,) that have gone down on a sample of the points, best first."""
    starts = _conics(sample, offset)
    costs = np.empty(len(starts))
    descend(ELLIPSE, sample, starts, STEPS, costs)
    yield from starts[np.argsort(costs, kind="stable")]
    # Where neither leads to the ellipse: the principal axes of the points.
    squares, axes = np.linalg.eigh(sample.T @ sample)
    turn = np.arctan2(axes[1, 1], axes[0, 1])
    short, long = np.sqrt(np.maximum(squares, 0.0) * (2.0 / len(sample)))
    last = np.array([[0.0, 0.0, turn, long, short + 1e-3, 0.0, 0.0, offset]])
    descend(ELLIPSE, sample, last, STEPS, np.empty(1))
    yield last[0]


def _conics(points: Float, offset: float) -> Float:
    """Return start parameters (m, 8) of those algebraic fits that are ellipses."""
    found, starts = np.empty((2, 6)), np.zeros((2, 8))
    try:
        conics(points, found)
    except np.linalg.LinAlgError:
        # They lie on a straight line, which is told later.
        return starts[:0]
    pairs = zip(found, starts, strict=True)
    return starts[[of_conic(conic, offset, start) for conic, start in pairs]]
