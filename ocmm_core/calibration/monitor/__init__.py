"""The watch over a calibration in use: has a camera, the probe or the part moved.

In: residuals of tracked frames while points are taken, and a baseline that was learnt before.
Out: a verdict with its score: nothing has changed, or what did, and which camera.

Read `_looks` (residuals averaged while the probe hardly moves), `_baseline` with `_pattern_fit`
and `_baseline_file` (what is normal for these sensors), `_change_rows` (what would move the
spots), `_change_score`, `_change_verdict` and `_change_words`; `_monitor` runs it.
It must not know the station, threads or jobs: who holds points back is `station`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.calibration.monitor._baseline import Baseline, learn_baseline
    from ocmm_core.calibration.monitor._baseline_file import load_baseline, save_baseline
    from ocmm_core.calibration.monitor._change_rows import N_MOTIONS, camera_changes
    from ocmm_core.calibration.monitor._change_verdict import ChangeCause, DriftReport
    from ocmm_core.calibration.monitor._looks import ResidualAccumulator, ResidualSample
    from ocmm_core.calibration.monitor._monitor import CalibrationMonitor
else:
    __getattr__ = door(
        __name__,
        _baseline="Baseline learn_baseline",
        _baseline_file="load_baseline save_baseline",
        _change_rows="N_MOTIONS camera_changes",
        _change_verdict="ChangeCause DriftReport",
        _looks="ResidualSample ResidualAccumulator",
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
