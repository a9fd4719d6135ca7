"""Calibrate cameras from known points, and trackers: fit, guards, covariance, guided procedures.

In: a list of known points and the averaged spots of each camera there; resting markers.
Out: cameras with full covariance or the noise of a tracker, findings, and a record to accept.

Read `_reference_points` (the files), `_dlt` (start values), `_least_squares`,
`_model_fit` (one camera), `_network` (all of them). `_guards` with `_lens` judges them, also
whether the lens model suffices. `_procedure_known_points` is the guided procedure. Of trackers:
`_tracker_noise` and `_procedure_tracker`. The package is independent of bundles, relocation and
probe calibration.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.cameras import _lens as lens
    from ocmm_core.calibration.cameras._dlt import cloud_of
    from ocmm_core.calibration.cameras._guards import (
        CHI2_DEVIATION, FLAT_REFUSED, FLAT_WARNED, FOCAL_SIGMA, OUTLIERS_REFUSED, RMS_FORCED,
        RMS_REFUSED, lens_effect,
    )  # fmt: skip
    from ocmm_core.calibration.cameras._lens import (
        LensCamera, empty_rows, project_extended, spot_rows,
    )  # fmt: skip
    from ocmm_core.calibration.cameras._model_fit import OUTLIER_PROBABILITY, fit_camera
    from ocmm_core.calibration.cameras._network import calibrate_rig
    from ocmm_core.calibration.cameras._procedure_known_points import (
        KnownPointsProcedure, KnownPointsSetup,
    )  # fmt: skip
    from ocmm_core.calibration.cameras._procedure_tracker import (
        TrackerProcedure, TrackerSetup, correct_scale,
    )  # fmt: skip
    from ocmm_core.calibration.cameras._reference_points import (
        KnownPoints, SpotTable, load_spots, read_reference_points,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CHI2_DEVIATION", "FLAT_REFUSED", "FLAT_WARNED", "FOCAL_SIGMA", "OUTLIERS_REFUSED",
    "OUTLIER_PROBABILITY", "RMS_FORCED", "RMS_REFUSED", "KnownPoints", "KnownPointsProcedure",
    "KnownPointsSetup", "LensCamera", "SpotTable", "TrackerProcedure", "TrackerSetup",
    "calibrate_rig", "cloud_of", "correct_scale", "empty_rows", "fit_camera", "lens", "lens_effect",
    "load_spots", "project_extended", "read_reference_points", "spot_rows",
]  # fmt: skip
