"""Sphere centres of LED paths: one for all, or one for each.

The algebraic fit of the thesis (1.3.1.2) minimises the squares of ``|x - c|^2 - r^2``. About the
mean of its path a sphere has the centre ``c = mean + S^-1 q / 2`` with ``S = sum y y'`` and ``q =
sum y |y|^2``. All paths share one centre: its normal matrix is the sum of theirs, each with its own
radius. Compared with the mean of the centres, that halves the error for a tilt of 20 degrees, and
quarters it for 10.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.pivot._kernel import add_moments, average_turned
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Points3

_MOST_ROUNDS = 20
_SMALL_FALL = 1e-9
"""Relative decrease of the group average residual considered insignificant (thesis 3.2)."""

_LARGEST_CONDITION = 1e12


@dataclass(frozen=True, slots=True)
class ThesisPivot:
    """The result of the thesis's method (3.2)."""

    centre_world: Float
    """(3,), mm: mean of the centres of all LEDs."""
    centres_world: Points3
    """(L, 3), mm."""
    arms: Points3
    """(L, 3), mm: group average of the LEDs about the centre, turned as in the first pose."""

    @property
    def deviations(self) -> Points3:
        """Return the centres less their mean, (L, 3), mm (thesis Table 4)."""
        return self.centres_world - self.centre_world

    @property
    def spread(self) -> float:
        """Return the RMS distance of the centres from their mean, mm (5.2 um in the thesis)."""
        return float(np.sqrt(np.mean(np.sum(self.deviations**2, axis=1))))


def moments_of(targets: Float, reference: Points3) -> Float:
    """Return the moments (L, 13) of the paths (n, L, 3), mm, about ``reference`` (L, 3)."""
    moments = np.zeros((targets.shape[1], 13))
    add_moments(np.ascontiguousarray(targets), reference, moments)
    return moments


def sphere_centres(moments: Float, reference: Points3) -> Points3:
    """Return the centre of each path, (L, 3), mm, NaN for a flat one; thesis 1.3.1.2."""
    matrices, rights, means = _centred(moments)
    centres = np.full((len(moments), 3), np.nan)
    for led, (matrix, right) in enumerate(zip(matrices, rights, strict=True)):
        if np.linalg.cond(matrix) < _LARGEST_CONDITION:
            centres[led] = reference[led] + means[led] + 0.5 * np.linalg.solve(matrix, right)
    return centres


def common_centre(moments: Float, reference: Points3) -> Float:
    """Return the common centre (3,), mm, of all paths; NaN if undetermined."""
    matrices, rights, means = _centred(moments)
    matrix = matrices.sum(axis=0)
    if not np.linalg.cond(matrix) < _LARGEST_CONDITION:
        return np.full(3, np.nan)
    # Common origin at the first reference, to preserve digits of differences.
    places = means + reference - reference[0]
    right = 0.5 * rights.sum(axis=0) + np.einsum("lij,lj->i", matrices, places)
    centre: Float = reference[0] + np.linalg.solve(matrix, right)
    return centre


def complete_poses(targets: Float) -> Int:
    """Return the poses (n, L, 3) with all LEDs; raise CalibrationError if none."""
    whole = np.flatnonzero(np.isfinite(targets).all(axis=(1, 2)))
    if not len(whole):
        raise CalibrationError(
            "pivot.no_complete_frame",
            "No frame shows all LEDs of the probe to two cameras.",
            "Turn the LEDs towards the cameras while the probe is swept.",
        )
    return whole


def group_average(targets: Float, centre: Float) -> Points3:
    """Return the mean arms (L, 3), mm, of all complete poses about the centre (3,).

    Gower's group average (thesis 1.3.2, 3.2), turned as the first; CalibrationError without one.
    """
    whole = complete_poses(targets)
    targets = np.ascontiguousarray(targets)
    body: Points3 = targets[whole[0]] - centre
    last = np.inf
    for _ in range(_MOST_ROUNDS):
        average = np.empty_like(body)
        residual = average_turned(targets, centre, body, average)
        body = average
        if not last - residual > _SMALL_FALL * last:
            break
        last = residual
    return body


def thesis_pivot(targets: Float) -> ThesisPivot:
    """Return the thesis's pivot of targets (n, L, 3), mm; CalibrationError if undetermined."""
    reference = np.nanmean(targets, axis=0)
    centres = sphere_centres(moments_of(targets, reference), reference)
    if not np.isfinite(centres).all():
        raise CalibrationError(
            "pivot.flat_path",
            "The LEDs moved in a plane or along a line, which does not determine the centre.",
            "Sweep the probe in two directions across each other.",
        )
    centre: Float = centres.mean(axis=0)
    return ThesisPivot(centre, centres, group_average(targets, centre))


def _centred(moments: Float) -> tuple[Float, Float, Float]:
    """Return S (L, 3, 3) and q (L, 3) about the means, and the means (L, 3) about the reference."""
    count = np.maximum(moments[:, 0], 1.0)
    means = moments[:, 1:4] / count[:, None]
    raw = moments[:, [4, 5, 6, 5, 7, 8, 6, 8, 9]].reshape(-1, 3, 3)
    trace = np.trace(raw, axis1=1, axis2=2)[:, None]
    square = np.sum(means**2, axis=1)[:, None]
    matrices = raw - count[:, None, None] * means[:, :, None] * means[:, None, :]
    turned = np.einsum("lij,lj->li", raw, means)
    rights = moments[:, 10:] - 2.0 * turned - trace * means
    rights += 2.0 * count[:, None] * square * means
    return matrices, rights, means
