"""Starts of a torus, in families that owe nothing to each other.

Where points surround the axis, Taubin's circle seen along a trial axis gives the centre. A short
piece of a torus is a bent tube: its tube comes from the curvatures of the patch, or from the
cylinders nearest to the points, and the axis is tried all around it, near by for thick tubes and
far off for thin ones. The circle in the half plane of distance from the axis and height gives the
rest (`axis_kernel.tubes`).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.features.elements import _cylinder as cylinder
from ocmm_core.features.elements._ball import taubin_centre, taubin_moments
from ocmm_core.features.search import (
    CYLINDER,
    Family,
    across_axes,
    best_ends,
    curved_patch,
    few_axes,
    sampled,
    trial_axes,
    tubes,
)
from ocmm_core.geometry import Float

RANKING_POINTS = 60
BENT = np.array([0.7, 2.0, 6.0])
"""Distances of trial centres against the size of the points."""
WAYS = 8
"""Directions around a trial axis."""
REACH = np.array([1.03, 1.25, 1.7, 2.6, 5.0, 12.0, 40.0])
"""Distances of the axis from a tube against its radius: a ring is never thinner than its tube."""
TURNS = 16
"""Directions of the axis around a tube."""
CYLINDERS = 5
"""Nearest ones that are bent."""
THICKEST = 100.0
"""Radius of a tube against the size of the points beyond which it shows no bend."""


def families(points: Float) -> tuple[Family, ...]:
    """Return the families of starts for centred and scaled points (n, 3), the quickest first."""
    return (
        lambda: ring_starts(points, few_axes(points)),
        partial(_by_curvature, points),
        partial(_by_cylinders, points),
        lambda: ring_starts(points, trial_axes(points)),
    )


def ring_starts(points: Float, axes: Float) -> Float:
    """Return starts (m, 8) around trial ``axes`` (k, 3)."""
    sample = sampled(points, RANKING_POINTS)
    frames = np.stack(across_axes(axes), axis=1)
    flat = sample @ frames.reshape(-1, 3).T
    x = np.ascontiguousarray(flat.reshape(len(sample), len(axes), 2).swapaxes(0, 1))
    middle = x.mean(axis=1)
    moments, mean_square = taubin_moments(x - middle[:, None, :])
    centres, _ = taubin_centre(np.linalg.eigh(moments)[1][..., 0], mean_square)
    turns = np.arange(WAYS) * 2.0 * np.pi / WAYS
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    bent = (BENT[:, None, None] * ways).reshape(-1, 1, 2)
    across = np.concatenate([(centres + middle)[None], np.tile(bent, (1, len(axes), 1))])
    feet = np.einsum("wmk,mkx->wmx", across, frames)
    starts = np.zeros((*feet.shape[:2], 8))
    starts[..., 0:3], starts[..., 3:6] = feet, axes
    starts = starts.reshape(-1, 8)
    tubes(sample, starts)
    return starts


def _by_curvature(points: Float) -> Float:
    patch = curved_patch(points)
    radii = 1.0 / np.maximum(np.abs(patch.curvatures), 1.0 / THICKEST)
    sides = np.where(patch.curvatures < 0.0, -1.0, 1.0)
    centres = patch.foot + (sides * radii)[:, None] * patch.normal
    # Along the ring the patch bends in the other of its two directions.
    return _bent(points, centres, patch.directions[::-1], radii)


def _by_cylinders(points: Float) -> Float:
    ends = best_ends(CYLINDER, points, cylinder.starts(points, few_axes(points)), CYLINDERS)
    ends = ends[np.abs(ends[:, 6]) < THICKEST]
    return _bent(points, ends[:, 0:3], ends[:, 3:6], np.abs(ends[:, 6]))


def _bent(points: Float, places: Float, ways: Float, radii: Float) -> Float:
    """Return starts (m, 8) of tubes at ``places`` (k, 3) that run along ``ways`` (k, 3)."""
    turns = np.arange(TURNS) * 2.0 * np.pi / TURNS
    first, second = across_axes(ways)
    outward = np.cos(turns)[:, None, None] * first + np.sin(turns)[:, None, None] * second
    axes = np.cross(ways, outward)
    centres = places + REACH[:, None, None, None] * radii[:, None] * outward
    starts = np.zeros((*centres.shape[:3], 8))
    starts[..., 0:3], starts[..., 3:6] = centres, axes
    starts = starts.reshape(-1, 8)
    tubes(sampled(points, RANKING_POINTS), starts)
    return starts
