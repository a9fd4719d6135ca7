"""Probe geometry from a sweep about its ball, with its uncertainty.

In: spots of a probe that is turned about its resting ball, and calibrated cameras. Out: LED
positions about the ball, the covariance of the tip, and findings.

Read `_data` (input and output), `_centre` and `_start` (first values), `_bundle` with `_kernel`
(one rotation a pose), `_robust` (wrong frames), `_covariance` and `_pattern`, then `_pivot`, which
combines them. `_guards`, `_coverage`, and `_validation` (a second sweep) judge. The package is
independent of steps, sessions and screens; the guided form is `sweeping`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.calibration.pivot._bundle import PivotState, adjust_pivot
    from ocmm_core.calibration.pivot._centre import (
        common_centre,
        group_average,
        moments_of,
        sphere_centres,
        thesis_pivot,
    )
    from ocmm_core.calibration.pivot._coverage import preview_pivot
    from ocmm_core.calibration.pivot._data import (
        PivotCalibration,
        PivotLimits,
        PivotOptions,
        PivotSweep,
        SweepCoverage,
    )
    from ocmm_core.calibration.pivot._guards import (
        find_jump,
        judge_jump,
        judge_shape,
        shared_part,
        tips_by_cameras,
    )
    from ocmm_core.calibration.pivot._pivot import LEAST_FRAMES, calibrate_probe
    from ocmm_core.calibration.pivot._poses import pivot_of_poses
    from ocmm_core.calibration.pivot._robust import free_poses
    from ocmm_core.calibration.pivot._start import locate_targets, mean_shape, start_pivot
    from ocmm_core.calibration.pivot._sweep_table import load_sweeps
    from ocmm_core.calibration.pivot._validation import (
        OTHER_ATTITUDE,
        OTHER_PLACE_MM,
        PivotValidation,
        attitude_between,
        validate_pivot,
    )
else:
    __getattr__ = door(
        __name__,
        _bundle="PivotState adjust_pivot",
        _centre="common_centre group_average moments_of sphere_centres thesis_pivot",
        _coverage="preview_pivot",
        _data="SweepCoverage PivotCalibration PivotLimits PivotOptions PivotSweep",
        _guards="find_jump judge_jump judge_shape shared_part tips_by_cameras",
        _pivot="LEAST_FRAMES calibrate_probe",
        _poses="pivot_of_poses",
        _robust="free_poses",
        _start="locate_targets mean_shape start_pivot",
        _sweep_table="load_sweeps",
        _validation="OTHER_ATTITUDE OTHER_PLACE_MM PivotValidation attitude_between validate_pivot",
    )

__all__ = [
    "LEAST_FRAMES", "OTHER_ATTITUDE", "OTHER_PLACE_MM", "PivotCalibration", "PivotLimits",
    "PivotOptions", "PivotState", "PivotSweep", "PivotValidation", "SweepCoverage", "adjust_pivot",
    "attitude_between", "calibrate_probe", "common_centre", "find_jump", "free_poses",
    "group_average", "judge_jump", "judge_shape", "load_sweeps", "locate_targets", "mean_shape",
    "moments_of", "pivot_of_poses", "preview_pivot", "shared_part", "sphere_centres", "start_pivot",
    "thesis_pivot", "tips_by_cameras", "validate_pivot",
]  # fmt: skip
