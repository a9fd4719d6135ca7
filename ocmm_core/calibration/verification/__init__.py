"""Verification of a calibration with lengths and spheres (after VDI/VDE 2634 part 1).

In: a calibration, calibrated bars and spheres, averaged spots of them in the volume.
Out: errors against the limit, a verdict, and possible causes of a failure.

Read `_line_planning` (placements), `_verification` (errors), `_verdict` (checks, and motion in
between). `_procedure_verification` with `_state` is the guided procedure. The package is
independent of the calibration method.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.verification._limits import Limits
    from ocmm_core.calibration.verification._line_planning import (
        CORNER_NAMES, LinePlanning, PlannedLine, corner_distances, corners_of, plan_lines,
    )  # fmt: skip
    from ocmm_core.calibration.verification._procedure_verification import (
        LINES, RESULT, SEATS_AGAIN, SEATS_FIRST, SPHERES, VerificationProcedure, VerificationSetup,
    )  # fmt: skip
    from ocmm_core.calibration.verification._state import PLACES
    from ocmm_core.calibration.verification._verification import fit_sphere
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CORNER_NAMES", "LINES", "PLACES", "RESULT", "SEATS_AGAIN", "SEATS_FIRST", "SPHERES", "Limits",
    "LinePlanning", "PlannedLine", "VerificationProcedure", "VerificationSetup", "corner_distances",
    "corners_of", "fit_sphere", "plan_lines",
]  # fmt: skip
