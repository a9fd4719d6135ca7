"""A report of a job that is not complete is made only for somebody who asks for just that."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.errors import MeasuringError
from ocmm_core.export.report_data import ReportData
from ocmm_core.inspection.view import FeatureState, JobView
from ocmm_core.tolerances.result import Verdict

_MOST_NAMED = 6


def missing_of(view: JobView) -> tuple[str, ...]:
    """Return the names of what is not measured or not done yet, features first."""
    features = [item.name for item in view.features if item.state is not FeatureState.DONE]
    results = [
        item.name
        for item in view.characteristics
        if (item.verdict is Verdict.NOT_MEASURED or item.name in view.provisional)
        and not set(item.features) & set(features)
    ]
    return (*features, *results)


def missing_words(missing: Sequence[str]) -> str:
    """Return names in one line, the first ones where they are many."""
    more = len(missing) - _MOST_NAMED
    named = ", ".join(missing[:_MOST_NAMED])
    return f"{named} and {more} more" if more > 0 else named


def require_complete(jobs: Sequence[ReportData]) -> None:
    """Raise MeasuringError, code ``export.incomplete``, where a job is not complete."""
    for data in jobs:
        missing = missing_of(data.view)
        if missing:
            raise MeasuringError(
                "export.incomplete",
                f"Job {data.job} is INCOMPLETE: {missing_words(missing)} not measured.",
                "Measure what is missing; or ask for the report of an incomplete job "
                "(--incomplete).",
            )
