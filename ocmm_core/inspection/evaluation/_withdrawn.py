"""A job whose results are void: nobody knows what they are, so that none may look current."""

from __future__ import annotations

from dataclasses import replace

from ocmm_core.inspection.evaluation._view import FeatureView, JobView
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict

NOTE = "Result withdrawn."


def withdrawn(job: JobView, why: str) -> JobView:
    """Return a job with its points and without every number that was computed from them.

    Parameters
    ----------
    job
        As it was told last.
    why
        What has failed, a sentence.
    """
    return replace(
        job,
        features=tuple(map(_without_fit, job.features)),
        constructed=tuple(map(_without_fit, job.constructed)),
        characteristics=tuple(map(_without_value, job.characteristics)),
        unproven=why,
        target=None,
    )


def _without_fit(feature: FeatureView) -> FeatureView:
    return replace(feature, fit=None, note=NOTE, outliers=(), coverage=None, targets=())


def _without_value(result: CharacteristicResult) -> CharacteristicResult:
    return replace(
        result,
        measured=None,
        deviation=None,
        uncertainty=None,
        verdict=Verdict.NOT_MEASURED,
        note=NOTE,
        rule="",
        tur=None,
        leaning="",
        interval=None,
        floor=None,
        bonus=0.0,
    )
