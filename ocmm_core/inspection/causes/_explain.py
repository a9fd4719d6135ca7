"""Explanations: why a characteristic is NOT CONFORM or NOT PROVEN, and the remedy."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.camera import Rig
from ocmm_core.inspection.causes._amounts import amount_words, beyond_limit
from ocmm_core.inspection.causes._cause import Cause, Explanation
from ocmm_core.inspection.causes._causes import cause_of
from ocmm_core.inspection.causes._inquiry import Inquiry
from ocmm_core.inspection.evaluation import EvaluatedJob, JobView, SessionOptions, evaluated_job
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.tracking import ProbeBody, TipSensitivity

EXPLAINED = (Verdict.NOT_CONFORM, Verdict.NOT_PROVEN)


def explanations(
    plan: Plan,
    view: JobView,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
) -> tuple[Explanation, ...]:
    """Explain every result that is NOT CONFORM or NOT PROVEN; evaluates the job several times.

    Arguments as `evaluation.evaluate_job`: the points that count, as stored.
    """
    if not any(result.verdict in EXPLAINED for result in view.characteristics):
        return ()
    job = evaluated_job(plan, points, sensitivities, rig, body, options)
    return explanations_of(job, view)


def explanations_of(job: EvaluatedJob, view: JobView) -> tuple[Explanation, ...]:
    """Return the same for an evaluated job."""
    inquiry = Inquiry(job, view)
    asked = {item.name: item for item in job.plan.characteristics}
    return tuple(
        explain(inquiry, asked[result.name], result)
        for result in view.characteristics
        if result.verdict in EXPLAINED and result.name in asked
    )


def explain(inquiry: Inquiry, item: Characteristic, result: CharacteristicResult) -> Explanation:
    """Return why one characteristic is not CONFORM, and the remedy."""
    beyond, uncertainty = beyond_limit(item, result), result.uncertainty
    finding = cause_of(inquiry, item, result)
    if beyond is None or uncertainty is None:
        why = result.note
    elif finding.cause is Cause.DOUBT:
        told = amount_words(item, result)
        why = f"The measurement is in doubt. {told}"
    else:
        why = amount_words(item, result)
    return Explanation(result.name, result.verdict, result.unit, beyond, uncertainty, why, finding)
