"""An ellipse by orthogonal distance, in a plane; see `_ellipse_starts`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements._ball import LARGEST_RADIUS, WORST_CONDITION, not_converged
from ocmm_core.features.elements._ellipse_starts import families
from ocmm_core.features.elements._flat import Outline, fit_in_given_plane, fit_in_own_plane
from ocmm_core.features.search import (
    ELLIPSE,
    FLAT,
    Solution,
    candidates,
    degenerate,
    derivatives,
    gains,
    minima,
)
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3

NEAR = 0.02
"""Root mean squared residual against the short axis, and"""
WIDEST_GAP = np.deg2rad(120.0)
"""Eccentric anomaly without a point, below which no other ellipse is as near."""
ROUNDEST = 1e-7
"""Relative difference of the axes below which an ellipse has no long one."""


def fit_ellipse(points: Points3, direction_hint: Float | None = None, offset: float = 0.0) -> Fit:
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


def _outline(points: Float, size: float, offset: float) -> list[Outline]:
    flat = degenerate(
        Shape.ELLIPSE,
        "they lie on a straight line, on a circle or on too short an arc",
        "Spread the points around the ellipse; measure a round one as a circle.",
    )
    sure = partial(_surrounded, points)
    solutions = minima(ELLIPSE, points, families(points, offset / size), _possible, sure)
    if not solutions:
        extents = np.linalg.svd(points, compute_uv=False)
        raise flat if extents[1] < FLAT * extents[0] else not_converged(Shape.ELLIPSE)
    p = solutions[0].parameters
    if abs(p[3] - p[4]) < ROUNDEST * max(p[3], p[4]):
        raise flat
    possible = candidates(Shape.ELLIPSE, solutions, len(points), None)
    found = outlines(ELLIPSE, points, possible, flat)
    long, short = found[0].radius, found[0].second
    if -offset / size >= short**2 / long:
        raise FitError(
            "feature.ball_too_large",
            "A ball of this size cannot touch the ends of the ellipse from inside: its radius is "
            f"not smaller than theirs, {size * short**2 / long:.3f} mm.",
            "Use a smaller ball, or check the probe side in the plan.",
        )
    return found


def _possible(p: Float) -> bool:
    return bool(0.0 < p[4] < LARGEST_RADIUS and 0.0 < p[3] < LARGEST_RADIUS)


def _surrounded(points: Float, found: Solution) -> bool:
    """Return whether ``points`` lie near an ellipse and all around it: then near no other."""
    p = found.parameters
    if found.cost > len(points) * (NEAR * min(p[3:5])) ** 2:
        return False
    c, s = np.cos(p[2]), np.sin(p[2])
    x, y = ((points - p[0:2]) @ np.array([[c, -s], [s, c]])).T
    anomaly = np.sort(np.arctan2(y * p[3], x * p[4]))
    gaps = np.diff(anomaly, append=anomaly[0] + 2.0 * np.pi)
    return bool(gaps.max() < WIDEST_GAP)


def outlines(
    kind: int, points: Float, possible: Sequence[Solution], flat: FitError
) -> list[Outline]:
    """Return the outlines of solutions; raise ``flat`` where the points leave one of them open."""
    found = []
    for solution in possible:
        p = solution.parameters.copy()
        residuals, jacobian, _ = derivatives(kind, points, p)
        gain, shifts, condition = gains(jacobian)
        if condition > WORST_CONDITION:
            raise flat
        found.append(oblong(p, residuals, jacobian, -gain, shifts))
    return found


def oblong(p: Float, residuals: Float, jacobian: Float, gain: Float, shifts: Float) -> Outline:
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
