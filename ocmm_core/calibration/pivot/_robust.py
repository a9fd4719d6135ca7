"""Detection of frames that do not belong to a sweep: wrong spots, displaced ball.

Every frame is solved alone: its pose (six unknowns) tests the spots, its tip the common place. All
frames are re-judged after every fit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.calibration.cameras import OUTLIER_PROBABILITY
from ocmm_core.calibration.pivot._bundle import PivotMinimum, PivotState, adjust_pivot
from ocmm_core.calibration.pivot._data import ExcludedFrame, PivotSweep
from ocmm_core.calibration.pivot._start import PivotStart, lay
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import solve_leds
from ocmm_core.tracking.kernels import OK

_ROUNDS = 5
_LEAST_FRAMES = 10
_MEDIAN_OF_CHI2_3 = 2.3660


@dataclass(frozen=True, slots=True)
class FreePoses:
    """Independent poses of all frames, with the arms of a state as the body."""

    solved: NDArray[np.bool_]
    """(n,)."""
    tips: Points3
    covariances: Float
    """`tips`, `covariances`: (n, 3), mm, world, and (n, 3, 3), mm^2; NaN if unsolved."""
    rotations: Float
    """(n, 3, 3), world from probe; NaN if unsolved."""
    chi2: Float
    dof: Float
    """`chi2`, `dof`: (n,): of the spots."""

    @property
    def spot_scale(self) -> float:
        """Return the ratio of good spot residuals to sigma, at least one."""
        if not self.solved.any():
            return 1.0
        ratio = self.chi2[self.solved] / self.dof[self.solved]
        middle = float(np.median(self.dof[self.solved]))
        usual = scipy.special.chdtri(middle, 0.5) / middle
        return max(float(np.sqrt(np.median(ratio) / usual)), 1.0)


@dataclass(frozen=True, slots=True)
class RobustPivot:
    """Adjustment without outlier frames."""

    minimum: PivotMinimum
    """With the rotations of the used frames only, in order."""
    used: NDArray[np.bool_]
    """(n,): frames used."""
    left_out: tuple[ExcludedFrame, ...]
    free: FreePoses
    """Independent poses of all frames."""


def free_poses(rig: Rig, sweep: PivotSweep, arms: Points3) -> FreePoses:
    """Return the independent pose of every frame, of a body with its tip as origin."""
    # One sigma for all frames here; results are rescaled to each frame's own below.
    sigma = float(np.median(sweep.sigma_px))
    poses = solve_leds(sweep.uv, rig, np.ascontiguousarray(arms), np.zeros(3), sigma)
    size = (sweep.sigma_px / sigma) ** 2
    return FreePoses(
        (poses.status == OK) & (poses.dof > 0), poses.tip_world,
        poses.tip_covariance * size[:, None, None], poses.rotation_world_from_probe,
        poses.chi2 / size, poses.dof.astype(np.float64),
    )  # fmt: skip


def adjust_pivot_robustly(
    rig: Rig, sweep: PivotSweep, start: PivotStart, slack_mm: float
) -> RobustPivot:
    """Adjust the consistent frames; CalibrationError if fewer than ten."""
    used, state = start.agreeing, start.state
    for number in count():
        if np.count_nonzero(used) < _LEAST_FRAMES:
            raise CalibrationError(
                "pivot.no_agreement",
                f"Only {np.count_nonzero(used)} frames agree on the position of the ball.",
                "Put the ball firmly into its cone and sweep the probe without lifting it.",
            )
        rotations, slacks = state.rotations[used].copy(), state.slacks[used].copy()
        start_of_used = replace(state, rotations=rotations, slacks=slacks)
        minimum = adjust_pivot(rig, sweep.only(used), start_of_used, slack_mm)
        free = free_poses(rig, sweep, minimum.state.arms)
        state = _everywhere(start, minimum.state, used)
        # A frame at the limit may leave and return forever: later, none returns.
        among = used if number >= _ROUNDS else np.ones_like(used)
        good, left_out = _judge(sweep, minimum.state.centre, slack_mm, free, among)
        if np.array_equal(good, used):
            return RobustPivot(minimum, used, left_out, free)
        used = good
    raise AssertionError  # the used frames become fewer until they agree


def _judge(
    sweep: PivotSweep, centre: Points3, slack_mm: float, free: FreePoses, among: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], tuple[ExcludedFrame, ...]]:
    n = len(sweep.uv)
    probability = OUTLIER_PROBABILITY / max(n, 1)
    scale = free.spot_scale
    with np.errstate(invalid="ignore"):
        fits = free.chi2 <= scale**2 * scipy.special.chdtri(np.maximum(free.dof, 1.0), probability)
    off = free.tips - centre
    distances = np.full(n, np.nan)
    solved = free.solved
    spread = free.covariances[solved] * scale**2 + slack_mm**2 * np.eye(3)
    distances[solved] = np.einsum(
        "ni,ni->n", off[solved], np.linalg.solve(spread, off[solved][..., None])[..., 0]
    )
    both = solved & fits
    middle = float(np.median(distances[both])) / _MEDIAN_OF_CHI2_3 if both.any() else 1.0
    limit = max(middle, 1.0) * float(scipy.special.chdtri(3, probability))
    good = among & both & (np.nan_to_num(distances, nan=np.inf) <= limit)
    left_out = []
    for frame in np.flatnonzero(~good):
        if not solved[frame]:
            left_out.append(ExcludedFrame(int(frame), "few", 0.0))
        elif not fits[frame]:
            ratio = float(free.chi2[frame] / free.dof[frame])
            left_out.append(ExcludedFrame(int(frame), "spots", ratio))
        else:
            left_out.append(ExcludedFrame(int(frame), "tip", float(np.linalg.norm(off[frame]))))
    return good, tuple(left_out)


def _everywhere(start: PivotStart, found: PivotState, used: NDArray[np.bool_]) -> PivotState:
    rotations, _, _ = lay(found.arms, start.targets)
    rotations[~start.solvable] = np.eye(3)
    rotations[used] = found.rotations
    slacks = np.zeros((len(rotations), 3))
    slacks[used] = found.slacks
    return PivotState(found.centre, found.arms, rotations, slacks)
