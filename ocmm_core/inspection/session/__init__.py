"""One job being measured: touches become points, and every step is durable."""

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
