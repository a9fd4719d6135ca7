"""The compiled hot path: spots to labels, pose and tip."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.tracking.kernels import _identify_kernel as identify_kernel
    from ocmm_core.tracking.kernels import _small_algebra as small_algebra
    from ocmm_core.tracking.kernels._follow_kernel import grow_known, without_rivals
    from ocmm_core.tracking.kernels._identify_kernel import FOUND
    from ocmm_core.tracking.kernels._kernel import LOST, MAX_TIP_SIGMA, OK, allocate, solve_frames
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
        _follow_kernel="grow_known without_rivals",
        _identify_kernel="FOUND identify_kernel",
        _kernel="LOST MAX_TIP_SIGMA OK allocate solve_frames",
        _small_algebra="backward best_turn cholesky forward small_algebra turn",
    )

__all__ = [
    "FOUND",
    "LOST",
    "MAX_TIP_SIGMA",
    "OK",
    "allocate",
    "backward",
    "best_turn",
    "cholesky",
    "forward",
    "grow_known",
    "identify_kernel",
    "small_algebra",
    "solve_frames",
    "turn",
    "without_rivals",
]
