"""Preview of the alignment of a job, before it is accepted."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.alignment import AlignmentReport, doubt_of, preview_alignment
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation._evaluation import checked_features
from ocmm_core.inspection.evaluation._options import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint, joint_factors, reported_points
from ocmm_core.tracking import ProbeBody, TipSensitivity


def alignment_of_points(
    plan: Plan,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
) -> AlignmentReport:
    """Return residuals, their uncertainty and open degrees of freedom of the plan's alignment.

    ``sensitivities`` in the order of ``points``. InputError if the plan has no alignment.
    """
    bound = plan.bound_alignment
    if bound is None:
        raise InputError(
            "alignment.none",
            f"Plan {plan.name} has no alignment: its results are independent of the frame.",
            "Add an alignment to the plan to get coordinates or positions.",
        )
    reported = reported_points(points, options.climate.part)
    factors = joint_factors(
        reported, sensitivities, rig, body, options.contact, options.climate.part,
        doubt_of(bound),
    )  # fmt: skip
    return preview_alignment(bound, checked_features(plan, reported, options), factors)
