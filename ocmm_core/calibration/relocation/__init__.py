"""Calibrate cameras in place: a waved probe, a length bar, one adjustment.

In: frames of a waved probe, placements of a length bar, two seats visited first and last.
Out: cameras in the chosen world, their covariance, findings, and a record to accept.

Read `_data` (input and output), `_problem` (from observations to a bundle), `_relocation` (the
adjustment), `_frame` (the world), `_guards` and `_culprit` (acceptance, and faulty elements).
`_procedure_relocation` with `_steps` (and their display) and `_state` is the guided form. The
adjustment itself is in `bundle`. The package is independent of the probe's own calibration.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.relocation._data import (
        BarDistance, KeptByCameras, KeptByPoints, Observations, ProbeFrames, RelocationOptions,
        ShownBar, TouchedBar,
    )  # fmt: skip
    from ocmm_core.calibration.relocation._frame import (
        anchors_of, jacobian_of_world, motion_to_world,
    )  # fmt: skip
    from ocmm_core.calibration.relocation._guards import (
        judge_convergence, judge_focal, judge_residuals,
    )  # fmt: skip
    from ocmm_core.calibration.relocation._problem import RelocationProblem, build
    from ocmm_core.calibration.relocation._procedure_relocation import (
        RelocationProcedure, RelocationSetup,
    )  # fmt: skip
    from ocmm_core.calibration.relocation._relocation import relocate
    from ocmm_core.calibration.relocation._request import (
        GeometryMode, LensMode, RelocationRequest, World,
    )  # fmt: skip
    from ocmm_core.calibration.relocation._state import observations_of
    from ocmm_core.calibration.relocation._steps import BAR, bar_ends
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BAR", "BarDistance", "GeometryMode", "KeptByCameras", "KeptByPoints", "LensMode",
    "Observations", "ProbeFrames", "RelocationOptions", "RelocationProblem", "RelocationProcedure",
    "RelocationRequest", "RelocationSetup", "ShownBar", "TouchedBar", "World", "anchors_of",
    "bar_ends", "build", "jacobian_of_world", "judge_convergence", "judge_focal", "judge_residuals",
    "motion_to_world", "observations_of", "relocate",
]  # fmt: skip
