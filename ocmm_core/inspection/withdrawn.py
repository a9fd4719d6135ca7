"""A job whose results are void: nobody knows what they are, so that none may look current."""

from __future__ import annotations

from dataclasses import replace

from ocmm_core.inspection.view import FeatureView, JobView
from ocmm_core.tolerances.result import CharacteristicResult, Verdict


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
        features=tuple(_without_fit(feature, why) for feature in job.features),
        constructed=tuple(_without_fit(feature, why) for feature in job.constructed),
        characteristics=tuple(_without_value(result, why) for result in job.characteristics),
        unproven=why,
        target=None,
    )


def _without_fit(feature: FeatureView, why: str) -> FeatureView:
    return replace(
        feature, fit=None, note=why, outliers=(), coverage=None, targets=()
    )


def _without_value(result: CharacteristicResult, why: str) -> CharacteristicResult:
    return replace(
        result,
        measured=None,
        deviation=None,
        uncertainty=None,
        verdict=Verdict.NOT_MEASURED,
        note=why,
        rule="",
        tur=None,
        leaning="",
        interval=None,
        floor=None,
        bonus=0.0,
    )
