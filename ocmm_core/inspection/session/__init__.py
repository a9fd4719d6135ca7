"""A running job: touches become points, and every step is durable.

In: touches with tracked frames, decisions of the inspector, records in force.
Out: a job file, point by point, and views of the job; refusals with reason and remedy.

Read `_session`: the job and its parts. A touch goes through it (is the ball at rest), `_assignment`
(which feature, and is it that face), then `_touch_filter` (does it become a point; in any order: of
which feature). Decisions of the inspector: `_steps`, stored by `_step_log` (also undo, also after a
restart), which is shared by all parts; `_header` is a smaller part; `_job_points` and `_job_view`
(also the placed part) are read by others. It must not know threads or clocks: one lock guards it,
and `station` calls it.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.inspection.session._header import (
        CLIENT_EVENT, HEADER_EVENT, NOT_GIVEN, check_header, header_of, header_text, is_simulated,
    )  # fmt: skip
    from ocmm_core.inspection.session._job_points import ReferenceUse
    from ocmm_core.inspection.session._session import InspectionSession
    from ocmm_core.inspection.session._steps import JobSteps
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CLIENT_EVENT", "HEADER_EVENT", "NOT_GIVEN", "InspectionSession", "JobSteps", "ReferenceUse",
    "check_header", "header_of", "header_text", "is_simulated",
]  # fmt: skip
