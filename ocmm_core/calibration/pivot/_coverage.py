"""Rotation range of a probe about its ball, with predicted uncertainty, also live."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ocmm_core.calibration.pivot._bundle import PivotState, inverse_pinned, normals_at
from ocmm_core.calibration.pivot._covariance import geometry_in
from ocmm_core.calibration.pivot._data import PivotSweep, SweepCoverage
from ocmm_core.calibration.pivot._pattern import pattern_covariance
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking import ProbeBody, solve

ATTITUDE_STEP = np.radians(2.0)
_LEAST_FRAMES = 10
_WAVES = 60
"""Cosine waves of a sensor pattern: sufficient for display."""


@dataclass(frozen=True, slots=True)
class PivotPreview:
    """Preview of a sweep in progress."""

    coverage: SweepCoverage | None
    """None with fewer than ten frames."""
    tip_sigma: float
    """mm: standard uncertainty of the tip (root of the sum over its axes) from spot noise and
    cameras if the sweep ended now; infinite if undetermined."""
    centre_world: Float
    """(3,), mm: ball centre by the probe's document; NaN without coverage."""


def coverage_of(rotations: Float, middle_probe: Float) -> SweepCoverage:
    """Return the coverage by rotations (n, 3, 3), world from probe; ball to LEDs' middle (3,)."""
    turns = Rotation.from_matrix(rotations)
    vectors = (turns.mean().inv() * turns).as_rotvec()
    axes = np.linalg.svd(vectors - vectors.mean(axis=0), full_matrices=False)[2]
    along = vectors @ axes.T
    low, high = np.percentile(along, [1.0, 99.0], axis=0)
    order = np.argsort(low - high)
    cells = np.unique(np.round(vectors / ATTITUDE_STEP).astype(np.int64), axis=0)
    return SweepCoverage(
        axes[order], (high - low)[order], len(cells), unit(rotations @ middle_probe)
    )


def preview_pivot(
    rig: Rig, body: ProbeBody, sweep: PivotSweep, *, pattern: bool = False
) -> PivotPreview:
    """Return coverage and predicted uncertainty, live: nominal probe, only poses fitted."""
    sigma = float(np.median(sweep.sigma_px)) if len(sweep.uv) else 1.0
    poses = solve(sweep.uv, rig, body, sigma)
    solved = poses.status == 0
    if np.count_nonzero(solved) < _LEAST_FRAMES:
        return PivotPreview(None, np.inf, np.full(3, np.nan))
    arms = body.leds_probe - body.tip_probe
    rotations = poses.rotation_world_from_probe[solved]
    centre = np.median(poses.tip_world[solved], axis=0)
    state = PivotState(centre, arms, rotations, np.zeros((len(rotations), 3)))
    kept = sweep.only(solved)
    here = normals_at(rig, kept, state, 0.0, with_cameras=True)
    covariance = inverse_pinned(here.normals[0], state.turns())
    tip_sigma = np.inf
    if covariance is not None:
        by_arms = geometry_in(body.leds_probe, arms).by_arms[-3:]
        by_cameras = by_arms @ (covariance @ here.crossed[0])[3:]
        variance = by_arms @ covariance[3:, 3:] @ by_arms.T
        variance += by_cameras @ rig.parameter_covariance @ by_cameras.T
        if pattern:
            by_common = np.hstack([np.zeros((3, 3)), by_arms])
            variance += pattern_covariance(rig, kept, state, by_common, covariance, 0.0, _WAVES, 1)
        tip_sigma = float(np.sqrt(np.trace(variance)))
    return PivotPreview(coverage_of(rotations, arms.mean(axis=0)), tip_sigma, centre)
