"""Guided pivot calibration: two sweeps in a cone, recorded, judged and concluded.

In: frames of a probe swept about its ball, in one cone and in a second one.
Out: snapshots with the map of directions, then a record of the probe awaiting acceptance.

Read `_procedure_pivot` (the procedure) with `_state`, `_watch` (selection of poses), `_progress`
(completeness), `_views` (snapshots, its file) and `_conclusion` (motion of the cone, the record).
The computation is in `pivot`. No other package of calibration imports this one.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.sweeping._procedure_pivot import PivotProcedure, PivotSetup
    from ocmm_core.calibration.sweeping._progress import CELL_RAD
    from ocmm_core.calibration.sweeping._request import PivotRequest
    from ocmm_core.calibration.sweeping._views import (
        AGAIN, SECOND, SWEEPS, MapCell, PivotChange, PivotOutcome, PivotView, SweepPhase, SweepView,
        led_paths,
    )  # fmt: skip
    from ocmm_core.calibration.sweeping._watch import BATCH, COUNTDOWN_S
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AGAIN", "BATCH", "CELL_RAD", "COUNTDOWN_S", "SECOND", "SWEEPS", "MapCell", "PivotChange",
    "PivotOutcome", "PivotProcedure", "PivotRequest", "PivotSetup", "PivotView", "SweepPhase",
    "SweepView", "led_paths",
]  # fmt: skip
