"""Probe geometry from a sweep about its ball, with its uncertainty.

In: spots of a probe that is turned about its resting ball, and calibrated cameras.
Out: LED positions about the ball, the covariance of the tip, and findings.

Read `_data` (input and output), `_centre` and `_start` (first values), `_bundle` with `_kernel`
(one rotation a pose), `_robust` (wrong frames), `_covariance`, then `_pivot`, which combines them.
`_guards` and `_validation` (a second sweep) judge. The package is independent of steps, sessions
and screens; the guided form is `sweeping`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.pivot._bundle import PivotState, adjust_pivot
    from ocmm_core.calibration.pivot._centre import (
        common_centre, group_average, moments_of, sphere_centres, thesis_pivot,
    )  # fmt: skip
    from ocmm_core.calibration.pivot._covariance import preview_pivot
    from ocmm_core.calibration.pivot._data import (
        PivotCalibration, PivotLimits, PivotOptions, PivotSweep, SweepCoverage, load_sweeps,
    )  # fmt: skip
    from ocmm_core.calibration.pivot._guards import (
        find_jump, judge_jump, judge_shape, shared_part, tips_by_cameras,
    )  # fmt: skip
    from ocmm_core.calibration.pivot._pivot import LEAST_FRAMES, calibrate_probe
    from ocmm_core.calibration.pivot._robust import free_poses
    from ocmm_core.calibration.pivot._start import (
        PosePivot, locate_targets, mean_shape, pivot_of_poses, start_pivot,
    )  # fmt: skip
    from ocmm_core.calibration.pivot._validation import (
        OTHER_ATTITUDE, OTHER_PLACE_MM, PivotValidation, attitude_between, validate_pivot,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "LEAST_FRAMES", "OTHER_ATTITUDE", "OTHER_PLACE_MM", "PivotCalibration", "PivotLimits",
    "PivotOptions", "PivotState", "PivotSweep", "PivotValidation", "PosePivot", "SweepCoverage",
    "adjust_pivot", "attitude_between", "calibrate_probe", "common_centre", "find_jump",
    "free_poses", "group_average", "judge_jump", "judge_shape", "load_sweeps", "locate_targets",
    "mean_shape", "moments_of", "pivot_of_poses", "preview_pivot", "shared_part", "sphere_centres",
    "start_pivot", "thesis_pivot", "tips_by_cameras", "validate_pivot",
]  # fmt: skip
