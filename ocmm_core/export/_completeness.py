"""Guard of reports: incomplete jobs need an explicit request."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.errors import MeasuringError
from ocmm_core.export.report import ReportData
from ocmm_core.inspection.evaluation import JobView

_MOST_NAMED = 6


def missing_of(view: JobView) -> tuple[str, ...]:
    """Return the missing items: features, then characteristics without a value though measured."""
    part = view.part_verdict
    left = set(part.missing_features)
    about = {item.name: set(item.features) for item in view.characteristics}
    return (*part.missing_features, *(name for name in part.unmeasured if not about[name] & left))


def missing_words(missing: Sequence[str]) -> str:
    """Return names in one line, truncated."""
    more = len(missing) - _MOST_NAMED
    named = ", ".join(missing[:_MOST_NAMED])
    return f"{named} and {more} more" if more > 0 else named


def require_complete(jobs: Sequence[ReportData]) -> None:
    """Raise MeasuringError, code ``export.incomplete``, if a job is not complete."""
    for data in jobs:
        missing = missing_of(data.view)
        if missing:
            raise MeasuringError(
                "export.incomplete",
                f"Job {data.job} is INCOMPLETE: {missing_words(missing)} not measured.",
                "Measure what is missing; or ask for the report of an incomplete job.",
            )
