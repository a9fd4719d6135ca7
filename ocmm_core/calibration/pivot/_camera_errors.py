"""Effect of the stated uncertainty of the cameras on the tips of single frames of a sweep."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.pivot._bundle import (
    PivotState,
    camera_error_root,
    normals_at,
    solve_pinned,
    spots_of_cameras,
)
from ocmm_core.calibration.pivot._data import PivotSweep
from ocmm_core.calibration.pivot._robust import free_poses
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int

_FRAMES = 400
"""Frames that stand for all: errors of cameras vary slowly with the attitude."""


@dataclass(frozen=True, slots=True)
class CameraTips:
    """Shifts of the tips of some frames by independent camera errors of one sigma each."""

    frames: Int
    """(m,): indices into the used frames, increasing."""
    shifts: Float
    """(m, 3, 14 C), mm, world; NaN for a frame without pose."""


def tips_by_cameras(rig: Rig, sweep: PivotSweep, state: PivotState, slack_mm: float) -> CameraTips:
    """Return what camera errors do to the tips of frames, after the adjustment has followed them.

    Noise-free spots of wrong cameras are adjusted with the calibrated ones by one step, and each
    frame is then solved alone, as `free_poses` does for those of the sweep.
    """
    some = np.arange(0, len(sweep.uv), max(1, len(sweep.uv) // _FRAMES))
    state = replace(state, rotations=state.rotations[some], slacks=state.slacks[some])
    sweep = replace(sweep, uv=sweep.uv[some], sigma_px=sweep.sigma_px[some])
    root = camera_error_root(rig)
    shifts = np.empty((len(some), 3, root.shape[1]))
    for number, off in enumerate(root.T):
        seen = spots_of_cameras(rig, sweep, state, off)
        here = normals_at(rig, seen, state, slack_mm)
        step = -solve_pinned(here.normals[0], state.turns(), here.gradients[0])
        free = free_poses(rig, seen, state.arms + step[3:].reshape(-1, 3))
        shifts[:, :, number] = np.where(free.solved[:, None], free.tips - state.centre, np.nan)
    return CameraTips(some.astype(np.int64), shifts)
