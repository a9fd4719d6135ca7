"""The compiled hot path: spots to labels, pose and tip.

In: arrays of spots, packed cameras and bodies. Out: labels, tip, covariance, chi-square, in place.

Read `_small_algebra` (algebra of fixed size, nothing allocated), `_kernel` (the spots of a frame
to a tip: here a spot becomes a millimetre), `_sensitivity_kernel` (how a pose answers to what it
was computed from), then the search for labels: `_meeting_kernel` (where
rays of two cameras meet), `_grow_kernel`, `_identify_kernel` (all that the spots can mean, and the
decision), `_doubt_kernel`, `_follow_kernel`.
It must not know documents or classes: `tracking` gives it numbers, and nothing is raised in a
loop.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.tracking.kernels import _identify_kernel as identify_kernel
    from ocmm_core.tracking.kernels import _small_algebra as small_algebra
    from ocmm_core.tracking.kernels._follow_kernel import extend_tracked, without_rivals
    from ocmm_core.tracking.kernels._identify_kernel import FOUND
    from ocmm_core.tracking.kernels._kernel import LOST, MAX_TIP_SIGMA, OK, allocate, solve_frames
    from ocmm_core.tracking.kernels._sensitivity_kernel import (
        ANSWERED,
        N_LENS,
        TOO_FEW,
        answer_of_poses,
    )
    from ocmm_core.tracking.kernels._small_algebra import (
        backward,
        best_turn,
        cholesky,
        forward,
        turn,
    )
else:
    __getattr__ = door(
        __name__,
        _follow_kernel="extend_tracked without_rivals",
        _identify_kernel="FOUND identify_kernel",
        _kernel="LOST MAX_TIP_SIGMA OK allocate solve_frames",
        _sensitivity_kernel="ANSWERED N_LENS TOO_FEW answer_of_poses",
        _small_algebra="backward best_turn cholesky forward small_algebra turn",
    )

__all__ = [
    "ANSWERED",
    "FOUND",
    "LOST",
    "MAX_TIP_SIGMA",
    "N_LENS",
    "OK",
    "TOO_FEW",
    "allocate",
    "answer_of_poses",
    "backward",
    "best_turn",
    "cholesky",
    "extend_tracked",
    "forward",
    "identify_kernel",
    "small_algebra",
    "solve_frames",
    "turn",
    "without_rivals",
]
