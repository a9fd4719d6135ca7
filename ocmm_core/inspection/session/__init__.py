"""One job being measured: touches become points, and every step is durable.

In: touches with what was tracked, decisions of the inspector, records in force.
Out: a job file, point by point, and views of the job; refusals with reason and remedy.

Read `_session` (the job), `_acceptance` (may a touch become a point), `_meaning` and `_any_order`
(which feature was touched), `_side_choice`, `_conditions`. What the inspector decides: `_steps`,
`_step_log` and `_deeds` (undo, also after a restart). `_job_points` and `_job_view` are what
others see, `_reference_use` and `_header` what the job is bound to.
It must not know threads or clocks: one lock guards it, and `station` calls it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.session._header import (
        HEADER_EVENT,
        NOT_GIVEN,
        check_header,
        header_of,
        header_text,
    )
    from ocmm_core.inspection.session._reference_use import ReferenceUse
    from ocmm_core.inspection.session._session import InspectionSession
    from ocmm_core.inspection.session._steps import JobSteps
else:
    __getattr__ = door(
        __name__,
        _header="HEADER_EVENT NOT_GIVEN check_header header_of header_text",
        _reference_use="ReferenceUse",
        _session="InspectionSession",
        _steps="JobSteps",
    )

__all__ = [
    "HEADER_EVENT",
    "NOT_GIVEN",
    "InspectionSession",
    "JobSteps",
    "ReferenceUse",
    "check_header",
    "header_of",
    "header_text",
]
