"""Ellipse by orthogonal distance, in a plane.

Independent families of starts: the constrained conic of R. Halir and J. Flusser (Numerically stable
direct least squares fitting of ellipses, 1998), which always is an ellipse, and the unconstrained
one if it is an ellipse; ellipses that osculate the bend of the points, needed for short arcs; and
frames about the points at any turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features import search
from ocmm_core.features.elements import _ball as ball
from ocmm_core.features.elements._flat import Outline, fit_in_given_plane, fit_in_own_plane
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3

SAMPLE = 60
SLENDER = np.array([0.03, 0.1, 0.2, 0.35, 0.55, 0.75, 0.92])
"""Ratio of short to long axis."""
ANOMALIES = 24
"""Osculating places on an ellipse."""
TURNS, SCALES = 12, (0.5, 0.8, 1.1, 1.6)
"""Trial turns over half a circle, and half sizes relative to the root mean squared extent."""
STRAIGHT = 1e3
"""Radius of a bend, relative to the size of the points, beyond which it is not visible."""


def families(points: Float, offset: float) -> tuple[search.Family, ...]:
    """Return the families of starts for centred and scaled points (n, 2), quickest first."""
    return (
        partial(conic_starts, points, offset),
        partial(_osculating, points, offset),
        partial(_framed, points, offset),
    )


def conic_starts(points: Float, offset: float) -> Float:
    """Return start parameters (m, 8): conics that are ellipses, and principal axes."""
    sample = search.sampled(points, SAMPLE)
    found, starts = np.empty((2, 6)), np.zeros((2, 8))
    try:
        search.conics(sample, found)
    except np.linalg.LinAlgError:
        # Collinear points, reported later.
        starts = starts[:0]
    pairs = zip(found, starts, strict=False)
    starts = starts[[search.of_conic(conic, offset, start) for conic, start in pairs]]
    squares, axes = np.linalg.eigh(sample.T @ sample)
    turn = np.arctan2(axes[1, 1], axes[0, 1])
    short, long = np.sqrt(np.maximum(squares, 0.0) * (2.0 / len(sample)))
    last = np.array([[0.0, 0.0, turn, long, short + 1e-3, 0.0, 0.0, offset]])
    return np.concatenate([starts, last])


def _osculating(points: Float, offset: float) -> Float:
    """Return start parameters (m, 8) of ellipses that osculate the points at their middle."""
    sample = search.sampled(points, SAMPLE)
    middle = sample.mean(axis=0)
    centre, radius, _ = ball.taubin_ball(sample - middle)
    reach = float(np.linalg.norm(centre))
    # From the middle of the points to the centre of their bend; arbitrary for a whole circle.
    inward = centre / reach if reach > 0.0 else np.array([1.0, 0.0])
    place = middle + centre - min(radius, STRAIGHT) * inward
    if radius > STRAIGHT:
        place = middle
    bend = max(min(radius, STRAIGHT) - offset, 1e-3)
    anomaly = np.arange(ANOMALIES) * 2.0 * np.pi / ANOMALIES
    c, s = np.cos(anomaly)[None], np.sin(anomaly)[None]
    k = SLENDER[:, None]
    long = bend * k / (s**2 + k**2 * c**2) ** 1.5
    short = k * long
    # The inner normal there, and the rotation to that of the points.
    turn = np.arctan2(inward[1], inward[0]) - np.arctan2(-s * np.ones_like(k), -k * c)
    x, y = long * c, short * s
    starts = np.zeros((len(SLENDER), ANOMALIES, 8))
    foot = place + offset * inward
    starts[..., 0] = foot[0] - (np.cos(turn) * x - np.sin(turn) * y)
    starts[..., 1] = foot[1] - (np.sin(turn) * x + np.cos(turn) * y)
    starts[..., 2], starts[..., 3], starts[..., 4] = turn, long, short
    starts[..., 7] = offset
    return starts.reshape(-1, 8)


def _framed(points: Float, offset: float) -> Float:
    """Return start parameters (m, 8): many turns and sizes about the middle of the points."""
    turns = np.arange(TURNS) * np.pi / TURNS
    along = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    beside = np.stack([-np.sin(turns), np.cos(turns)], axis=1)
    spread = [np.sqrt(2.0 * np.mean((ways @ points.T) ** 2, axis=1)) for ways in (along, beside)]
    starts = np.zeros((len(SCALES), len(SCALES), TURNS, 8))
    starts[..., 2], starts[..., 7] = turns, offset
    for i, first in enumerate(SCALES):
        for j, second in enumerate(SCALES):
            starts[i, j, :, 3], starts[i, j, :, 4] = first * spread[0], second * spread[1] + 1e-3
    return starts.reshape(-1, 8)


NEAR = 0.02
"""Root mean squared residual, relative to the short axis, and"""
WIDEST_GAP = np.deg2rad(120.0)
"""eccentric anomaly without a point, below which no other ellipse is as close."""
ROUNDEST = 1e-7
"""Relative difference of the axes below which an ellipse counts as round."""


def fit_ellipse(points: Points3, direction_hint: Float | None = None, offset: float = 0.0) -> Fit:
    """Return the ellipse in the orthogonal-distance plane of ``points`` (n, 3), mm.

    Residuals are in the plane, positive outside. ``direction_hint`` (3,) orients the normal;
    ``offset``, mm, is the distance of the points outside: centres of a ball that touched an ellipse
    are not on an ellipse. FitError if the points do not determine an ellipse, or a ball of that
    size cannot have touched it from inside.
    """
    outline = partial(_outline, offset=offset)
    return fit_in_own_plane(Shape.ELLIPSE, points, direction_hint, outline)


def fit_ellipse_projected(
    points: Points3, plane_normal: Float, offset: float = 0.0
) -> tuple[Fit, Float]:
    """Return the ellipse as `flat.fit_in_given_plane`; for ``offset`` see `fit_ellipse`."""
    outline = partial(_outline, offset=offset)
    return fit_in_given_plane(Shape.ELLIPSE, points, plane_normal, outline)


def _outline(points: Float, size: float, offset: float) -> list[Outline]:
    flat = search.degenerate(
        Shape.ELLIPSE,
        "they lie on a straight line, on a circle or on too short an arc",
        "Spread the points around the ellipse; measure a round one as a circle.",
    )
    sure = partial(_surrounded, points)
    solutions = search.minima(
        search.ELLIPSE, points, families(points, offset / size), _possible, sure
    )
    if not solutions:
        extents = np.linalg.svd(points, compute_uv=False)
        raise flat if extents[1] < search.FLAT * extents[0] else ball.not_converged(Shape.ELLIPSE)
    p = solutions[0].parameters
    if abs(p[3] - p[4]) < ROUNDEST * max(p[3], p[4]):
        raise flat
    possible = search.candidates(Shape.ELLIPSE, solutions, len(points), None)
    found = outlines(search.ELLIPSE, points, possible, flat)
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
    return bool(0.0 < p[4] < ball.LARGEST_RADIUS and 0.0 < p[3] < ball.LARGEST_RADIUS)


def _surrounded(points: Float, found: search.Solution) -> bool:
    """Return whether ``points`` are close to an ellipse and all around it, hence to no other."""
    p = found.parameters
    if found.cost > len(points) * (NEAR * min(p[3:5])) ** 2:
        return False
    c, s = np.cos(p[2]), np.sin(p[2])
    x, y = ((points - p[0:2]) @ np.array([[c, -s], [s, c]])).T
    anomaly = np.sort(np.arctan2(y * p[3], x * p[4]))
    gaps = np.diff(anomaly, append=anomaly[0] + 2.0 * np.pi)
    return bool(gaps.max() < WIDEST_GAP)


def outlines(
    kind: int, points: Float, possible: Sequence[search.Solution], flat: FitError
) -> list[Outline]:
    """Return the outlines of solutions; raise ``flat`` if one is undetermined."""
    found = []
    for solution in possible:
        p = solution.parameters.copy()
        residuals, jacobian, _ = search.derivatives(kind, points, p)
        gain, shifts, condition = search.gains(jacobian)
        if condition > ball.WORST_CONDITION:
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
