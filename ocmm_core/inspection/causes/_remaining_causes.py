"""Remaining causes if no error explains a value: too little evidence, or the part itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.inspection.causes._common_causes import scatter_ratio
from ocmm_core.inspection.causes._inquiry import (
    MOST_POINTS,
    Cause,
    CauseFinding,
    Inquiry,
    beyond_limit,
)
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.uncertainty import gradients_of
from ocmm_core.tolerances.zones import Characteristic

_AMPLIFIED = 1.8
"""Noise relative to equally many points all round, beyond which their spread is bad."""
_MOST_OF_U = 0.5
_ROUGH, _ENOUGH = 9.0, 3
"""Squared scatter of one surface relative to the usual one, and minimum number of features."""
_CHANCE = 3.0
"""Standard deviations by which the scatter of the points may move a value by chance."""

_REMEDIES = {
    "Image noise": "take more points",
    "Sensor pattern": "take more points, rotating the probe between them",
    "Cameras": "measure near the middle of the volume, or calibrate the cameras again",
    "Reference body": "calibrate the reference body again",
    "Probe geometry": "calibrate the probe and its tip again",
    "Probe temperature": "measure the probe temperature, or let it stabilise",
    "Probe weight": "hold the probe as during its calibration",
    "Hand force": "touch with less force, or take more points",
    "Tip radius": "qualify the tip",
    "Saved frame": "measure the datum features in this job",
    "Thermometer": "use a thermometer with a smaller uncertainty",
    "Part temperature": "measure the part temperature more accurately",
}


def few_points(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    """Return that points lie where they hardly determine the value."""
    evaluation = inquiry.job.evaluations.get(item.name)
    if evaluation is None or result.uncertainty is None:
        return None
    way = beyond_limit(item, result)
    if result.verdict is Verdict.NOT_CONFORM and (way or 0.0) > 2.0 * result.uncertainty:
        return None
    rows = gradients_of(evaluation, bonus=False)
    for view in inquiry.view.features:
        coverage = view.coverage
        if view.name not in inquiry.rests_on(item) or not coverage or not coverage.warning:
            continue
        jacobian = inquiry.jacobian(rows, view.name)
        if (
            not len(jacobian)
            or float(np.linalg.norm(jacobian)) * np.sqrt(len(jacobian)) < _AMPLIFIED * 2.0
        ):
            continue
        return CauseFinding(
            Cause.COVERAGE, (view.name,), inquiry.own_points(view.name)[:MOST_POINTS],
            f"Probe more of {view.name}: {coverage.words} have points. {coverage.warning}",
            "The point positions amplify every point error.",
        )  # fmt: skip
    return None


def scatter(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    """Return that the points scatter too much for the tolerance: all, or one surface's."""
    budget = inquiry.budget(item)
    if budget is None or result.measured is None:
        return None
    own = inquiry.rests_on(item)
    names = " and ".join(inquiry.own_features(item)[:2])
    random = sum(row.share for row in budget.rows if row.kind == "A")
    noisy = inquiry.noisy
    words = f"Points scatter {noisy:.1f} times more than the cameras' noise. " if noisy else ""
    if result.verdict is Verdict.NOT_PROVEN and random > _MOST_OF_U:
        shape = _own_shape(inquiry, own) if noisy is None else None
        if shape is not None and budget.rows[0].name == f"Form of {shape}":
            form = inquiry.job.actual[shape].fit.form
            return CauseFinding(
                Cause.PART, (shape,), inquiry.extremes(shape),
                f"Most likely the part: {shape} has a form error of {form:.3f} mm. More points "
                "on it stabilise the value.",
                f"Its points scatter more than those of the other features; they are "
                f"{100.0 * min(random, 1.0):.0f} % of the variance of U.",
            )  # fmt: skip
        evidence = f"{words}Scatter is {100.0 * min(random, 1.0):.0f} % of the variance of U."
    elif noisy is not None and _by_chance(inquiry, item, result):
        evidence = words.strip()
    else:
        return None
    hold = "Hold the probe still, and take" if noisy else "Take"
    return CauseFinding(
        Cause.NOISE, tuple(own), inquiry.strongest(item, result),
        f"{hold} more points on {names}: their scatter dominates the uncertainty.", evidence,
    )  # fmt: skip


def _own_shape(inquiry: Inquiry, names: Sequence[str]) -> str | None:
    samples = {item.feature: scatter_ratio(item) for item in inquiry.job.samples}
    usual = float(np.median(list(samples.values())))
    rough = [name for name in names if samples.get(name, 0.0) > _ROUGH * usual]
    return rough[0] if len(rough) == 1 and len(samples) > _ENOUGH else None


def _by_chance(inquiry: Inquiry, item: Characteristic, result: CharacteristicResult) -> bool:
    evaluation, beyond = inquiry.job.evaluations.get(item.name), beyond_limit(item, result)
    if evaluation is None or beyond is None:
        return False
    if spec_of(item.kind).form_alone:
        return True
    rows = gradients_of(evaluation, bonus=False)
    variance = 0.0
    for sample in inquiry.job.samples:
        variance += sample.scatter * float(np.sum(sample.jacobian(rows) ** 2))
    return beyond < _CHANCE * float(np.sqrt(variance))


def uncertainty(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    """Return the largest part of U if the value is inside, or could not be proven to be."""
    too_tight = result.tur is not None and result.tur < 1.0
    if result.verdict is not Verdict.NOT_PROVEN or (result.leaning != "in" and not too_tight):
        return None
    budget = inquiry.budget(item)
    if budget is None or not budget.rows:
        return None
    row = budget.rows[0]
    return CauseFinding(
        Cause.UNCERTAINTY, inquiry.own_features(item), inquiry.strongest(item, result),
        f"Lower the uncertainty: {_REMEDIES.get(row.name, 'take more points')}.",
        f"{row.name} is {100.0 * min(row.share, 1.0):.0f} % of the variance of U.",
    )  # fmt: skip


def the_part(inquiry: Inquiry, item: Characteristic, result: CharacteristicResult) -> CauseFinding:
    """Return that no measuring error fits the points."""
    beyond, u = beyond_limit(item, result), result.uncertainty
    small = "°" if result.unit == "deg" else " mm"
    names = inquiry.own_features(item)
    if beyond is None or u is None:
        said = "The part"
    elif result.verdict is Verdict.NOT_CONFORM:
        said = f"Most likely the part: {beyond:.3f}{small} out, {beyond / u:.1f} times U"
    else:
        said = "Most likely the part: it is at its limit, within U"
    return CauseFinding(
        Cause.PART, names, inquiry.strongest(item, result),
        f"{said}. The points agree.", "No measuring error explains the points.",
    )  # fmt: skip
