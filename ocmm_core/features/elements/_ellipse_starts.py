"""Starts of an ellipse, in families that owe nothing to each other.

The constrained conic of R. Halir and J. Flusser (Numerically stable direct least squares fitting of
ellipses, 1998), which always is an ellipse, and the unconstrained one where it is one; ellipses
that osculate the bend of the points at any of their places, which short arcs need; and frames about
the points at any turn.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.features.elements._ball import taubin_centre, taubin_moments
from ocmm_core.features.search import Family, conics, of_conic, sampled
from ocmm_core.geometry import Float

SAMPLE = 60
SLENDER = np.array([0.03, 0.1, 0.2, 0.35, 0.55, 0.75, 0.92])
"""Short axis against the long one."""
ANOMALIES = 24
"""Places on an ellipse that osculates."""
TURNS, SCALES = 12, (0.5, 0.8, 1.1, 1.6)
"""Trial turns over half a circle, and half sizes against the root mean squared extent."""
STRAIGHT = 1e3
"""Radius of a bend against the size of the points beyond which it does not show."""


def families(points: Float, offset: float) -> tuple[Family, ...]:
    """Return the families of starts for centred and scaled points (n, 2), the quickest first."""
    return (
        partial(conic_starts, points, offset),
        partial(_osculating, points, offset),
        partial(_framed, points, offset),
    )


def conic_starts(points: Float, offset: float) -> Float:
    """Return start parameters (m, 8): those conics that are ellipses, and the principal axes."""
    sample = sampled(points, SAMPLE)
    found, starts = np.empty((2, 6)), np.zeros((2, 8))
    try:
        conics(sample, found)
    except np.linalg.LinAlgError:
        # They lie on a straight line, which is told later.
        starts = starts[:0]
    pairs = zip(found, starts, strict=False)
    starts = starts[[of_conic(conic, offset, start) for conic, start in pairs]]
    squares, axes = np.linalg.eigh(sample.T @ sample)
    turn = np.arctan2(axes[1, 1], axes[0, 1])
    short, long = np.sqrt(np.maximum(squares, 0.0) * (2.0 / len(sample)))
    last = np.array([[0.0, 0.0, turn, long, short + 1e-3, 0.0, 0.0, offset]])
    return np.concatenate([starts, last])


def _osculating(points: Float, offset: float) -> Float:
    """Return start parameters (m, 8) of ellipses with the bend of the points at their middle."""
    sample = sampled(points, SAMPLE)
    middle = sample.mean(axis=0)
    moments, mean_square = taubin_moments(sample - middle)
    centre, radius = taubin_centre(np.linalg.eigh(moments)[1][:, 0], mean_square)
    reach = float(np.linalg.norm(centre))
    # From the middle of the points to the centre of their bend; of a whole circle any way does.
    inward = centre / reach if reach > 0.0 else np.array([1.0, 0.0])
    place = middle + centre - min(float(radius), STRAIGHT) * inward
    if radius > STRAIGHT:
        place = middle
    bend = max(min(float(radius), STRAIGHT) - offset, 1e-3)
    anomaly = np.arange(ANOMALIES) * 2.0 * np.pi / ANOMALIES
    c, s = np.cos(anomaly)[None], np.sin(anomaly)[None]
    k = SLENDER[:, None]
    long = bend * k / (s**2 + k**2 * c**2) ** 1.5
    short = k * long
    # The inner normal there, and the turn that brings it to that of the points.
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
