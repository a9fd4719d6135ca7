"""A running job: touches become points, and every step is durable.

In: touches with tracked frames, decisions of the inspector, records in force.
Out: a job file, point by point, and views of the job; refusals with reason and remedy.

Read `_session`: the job and its parts. A touch goes through `_intake` (is the ball at rest),
`_assignment` (which feature, and is it that face) with `_any_order`, `_acceptance` with
`_side_choice` (does it become a point). Decisions of the inspector: `_steps`, `_point_steps`,
stored by `_step_log` (also undo, also after a restart). `_ledger` is shared by all parts;
`_conditions`, `_placed_part`, `_reference_use` and `_header` are smaller parts; `_job_points` and
`_job_view` are read by others.
It must not know threads or clocks: one lock guards it, and `station` calls it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.session._conditions import is_simulated
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
        _conditions="is_simulated",
        _header="HEADER_EVENT NOT_GIVEN check_header header_of header_text",
        _reference_use="ReferenceUse",
        _session="InspectionSession",
        _steps="JobSteps",
    )

__all__ = [
    "HEADER_EVENT", "NOT_GIVEN", "InspectionSession", "JobSteps", "ReferenceUse", "check_header",
    "header_of", "header_text", "is_simulated",
]  # fmt: skip
