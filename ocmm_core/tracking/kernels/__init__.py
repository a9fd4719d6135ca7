"""Compiled hot path: spots to labels, pose and tip.

In: arrays of spots, packed cameras and bodies. Out: labels, tip, covariance, chi-square, in place.

Read `_small_algebra` (algebra of fixed size without allocation), `_kernel` (the steps from spots to
a pose), `_lanes` (eight frames in parallel), `_lane_algebra`, `_lane_equations` and
`_solve_kernel` (labelled frames to tips), `_sensitivity_kernel` (derivatives of a pose), then the
search for labels: `_meeting_kernel` (ray intersections of two cameras), `_grow_kernel`,
`_match_kernel`, `_identify_kernel` (all possible poses) and `_decide_kernel`.
The package is independent of documents and classes: `tracking` passes numbers, and loops raise no
exceptions.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tracking.kernels import _decide_kernel as decide_kernel
    from ocmm_core.tracking.kernels import _identify_kernel as identify_kernel
    from ocmm_core.tracking.kernels import _small_algebra as small_algebra
    from ocmm_core.tracking.kernels._decide_kernel import FOUND, MAX_DOUBT
    from ocmm_core.tracking.kernels._identify_kernel import extend_tracked, without_rivals
    from ocmm_core.tracking.kernels._kernel import LOST, MAX_TIP_SIGMA, OK
    from ocmm_core.tracking.kernels._sensitivity_kernel import (
        ANSWERED, N_LENS, TOO_FEW, answer_of_poses,
    )  # fmt: skip
    from ocmm_core.tracking.kernels._small_algebra import (
        backward, best_turn, cholesky, forward, turn,
    )  # fmt: skip
    from ocmm_core.tracking.kernels._solve_kernel import allocate, solve_frames
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ANSWERED", "FOUND", "LOST", "MAX_DOUBT", "MAX_TIP_SIGMA", "N_LENS", "OK", "TOO_FEW",
    "allocate", "answer_of_poses", "backward", "best_turn", "cholesky", "decide_kernel",
    "extend_tracked", "forward", "identify_kernel", "small_algebra", "solve_frames", "turn",
    "without_rivals",
]  # fmt: skip
