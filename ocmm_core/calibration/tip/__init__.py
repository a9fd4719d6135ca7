"""Tip qualification and quick check on a calibrated sphere and in a cone.

In: frames of a probe touching a calibrated sphere and resting in a cone.
Out: diameter of the ball with its uncertainty and form, or whether the tip is unchanged.

Read `_sphere_layout` (places), `_fit` (the ball from its points, uncertainty contributions),
`_qualification` and `_check` (requirements). `_touch_session` is the guided procedure;
`_procedure_tip` has its two variants. The package is independent of bundle, relocation and pivot;
cameras are given.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.tip._procedure_tip import (
        QualificationSetup, TipCheckProcedure, TipQualificationProcedure,
    )  # fmt: skip
    from ocmm_core.calibration.tip._qualification import TipLimits, conforms, qualification_checks
    from ocmm_core.calibration.tip._sphere_layout import (
        CHECK_RINGS, QUALIFICATION_RINGS, frame_about, sphere_layout,
    )  # fmt: skip
    from ocmm_core.calibration.tip._steps import CONE, SPHERE
    from ocmm_core.calibration.tip._touch_session import POLE, TouchSetup
    from ocmm_core.calibration.tip._views import (
        CheckVerdict, ConeProgress, Countdown, Phase, SphereProgress, TipCheckOutcome, TipCheckView,
        TipOutcome, TipView, TouchView,
    )  # fmt: skip
    from ocmm_core.calibration.tip._wanted import VALID_DAYS
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CHECK_RINGS", "CONE", "POLE", "QUALIFICATION_RINGS", "SPHERE", "VALID_DAYS", "CheckVerdict",
    "ConeProgress", "Countdown", "Phase", "QualificationSetup", "SphereProgress", "TipCheckOutcome",
    "TipCheckProcedure", "TipCheckView", "TipLimits", "TipOutcome", "TipQualificationProcedure",
    "TipView", "TouchSetup", "TouchView", "conforms", "frame_about", "qualification_checks",
    "sphere_layout",
]  # fmt: skip
