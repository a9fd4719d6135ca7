"""The watch over a calibration in use: has a camera, the probe or the part moved.

In: residuals of tracked frames while points are taken, and a baseline that was learnt before.
Out: a verdict with its score: nothing has changed, or what did, and which camera.

Read `_residual_samples` (residuals averaged while the probe hardly moves), `_baseline` with
`_pattern_fit` and `_baseline_file` (what is normal for these sensors), `_drift_design_matrix` (what
would move the spots), `_drift_statistic` and `_drift_decision`; `_monitor` runs
it.
It must not know the station, threads or jobs: who holds points back is `station`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.calibration.monitor._baseline import Baseline, learn_baseline
    from ocmm_core.calibration.monitor._baseline_file import load_baseline, save_baseline
    from ocmm_core.calibration.monitor._drift_decision import ChangeCause, DriftReport
    from ocmm_core.calibration.monitor._drift_design_matrix import N_MOTIONS, camera_changes
    from ocmm_core.calibration.monitor._monitor import CalibrationMonitor
    from ocmm_core.calibration.monitor._residual_samples import ResidualAccumulator, ResidualSample
else:
    __getattr__ = door(
        __name__,
        _baseline="Baseline learn_baseline",
        _baseline_file="load_baseline save_baseline",
        _drift_design_matrix="N_MOTIONS camera_changes",
        _drift_decision="ChangeCause DriftReport",
        _residual_samples="ResidualSample ResidualAccumulator",
        _monitor="CalibrationMonitor",
    )

__all__ = [
    "N_MOTIONS",
    "Baseline",
    "CalibrationMonitor",
    "ChangeCause",
    "DriftReport",
    "ResidualAccumulator",
    "ResidualSample",
    "camera_changes",
    "learn_baseline",
    "load_baseline",
    "save_baseline",
]
