"""Monitor a calibration in use for motion of a camera, the probe or the part.

In: residuals of tracked frames during measuring, and a baseline learnt before.
Out: a verdict with its score: unchanged, or the kind of change and the camera.

Read `_residual_samples` (residuals averaged during little motion, and their derivatives),
`_baseline` (normal residuals of these sensors), `_drift_statistic` and `_drift_decision`;
`_monitor` runs it. The package is independent of station, threads and jobs: `station` decides on
holding points back.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.monitor._baseline import Baseline, learn_baseline
    from ocmm_core.calibration.monitor._drift_decision import ChangeCause, DriftReport
    from ocmm_core.calibration.monitor._drift_statistic import N_MOTIONS, camera_changes
    from ocmm_core.calibration.monitor._monitor import (
        CalibrationMonitor, load_baseline, save_baseline,
    )  # fmt: skip
    from ocmm_core.calibration.monitor._residual_samples import ResidualAccumulator, ResidualSample
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "N_MOTIONS", "Baseline", "CalibrationMonitor", "ChangeCause", "DriftReport",
    "ResidualAccumulator", "ResidualSample", "camera_changes", "learn_baseline", "load_baseline",
    "save_baseline",
]  # fmt: skip
