"""Numbers and sentences for the inspector."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from ocmm_core.features.measured import CommandingPoints
from ocmm_core.features.shapes import CRITERIA, MINIMUM_POINTS, Shape
from ocmm_core.inspection import evaluation
from ocmm_core.tolerances.decisions import CharacteristicResult, PartWord, Verdict, VerdictSummary
from ocmm_core.tolerances.kinds import spec_of
from ocmm_gui.kit._texts import (
    later,
    length_number,
    length_words,
    localised,
    numbers_in_use,
    said,
    said_word,
    tr,
    unit_word,
)

DASHES = "———"
"""Placeholder for unknown or suspect numbers."""


def millimetres(value: float | None, *, signed: bool = False, decimals: int = 3) -> str:
    """Return a length given in mm; unit only in inch; dashes if None."""
    if value is None or not np.isfinite(value):
        return DASHES
    text = length_number(float(value), signed=signed, decimals=decimals)
    return f"{text} {unit_word()}" if numbers_in_use().inch else text


def shape_word(shape: Shape) -> str:
    """Return the displayed name of a shape."""
    return said_word(shape.label)


_LONG_NAME = 16


def feature_title(feature: evaluation.FeatureView) -> str:
    """Return shape and name; only the name if it is long."""
    if len(feature.name) > _LONG_NAME:
        return feature.name
    return f"{shape_word(feature.shape)} {feature.name}"


def form_words(feature: evaluation.FeatureView) -> str:
    """Return the form deviation, mm; dashes if the points do not determine it."""
    fit = feature.fit
    if fit is None or feature.shape is Shape.POINT:
        return DASHES
    return millimetres(fit.form if len(feature.points) > MINIMUM_POINTS[feature.shape] else None)


def led_name(number: int) -> str:
    """Return the displayed name of an LED, counting from one."""
    return f"L{number + 1}"


def reference_led_name(number: int) -> str:
    """Return the displayed name of a reference body LED, counting from one."""
    return f"R{number + 1}"


def slot_names(live: evaluation.LiveView, camera: int) -> tuple[str, ...]:
    """Return the LED of each slot of a camera, for its spot; '?' if unknown."""
    leds = [led_name(int(led)) if led >= 0 else "?" for led in live.slot_leds[camera]]
    if live.slot_references is None:
        return tuple(leds)
    references = live.slot_references[camera]
    return tuple(
        reference_led_name(int(other)) if other >= 0 else led
        for led, other in zip(leds, references, strict=True)
    )


_MOVED_MM, _MOVED_RAD = 0.1, 2e-4


def reference_words(live: evaluation.LiveView) -> str:
    """Return that part and cameras moved against each other, or an empty text."""
    reference = live.reference
    if reference is None or reference.moved_mm is None or reference.turned_rad is None:
        return ""
    if reference.moved_mm < _MOVED_MM and reference.turned_rad < _MOVED_RAD:
        return ""
    return tr(
        "Part and cameras have moved {moved_mm:.1f} mm and {turned_rad:.2f}° "
        "relative to each other since the job started. Points follow the reference "
        "body '{name}'."
    ).format(
        moved_mm=reference.moved_mm,
        turned_rad=np.degrees(reference.turned_rad),
        name=reference.name,
    )


def seen_cameras(live: evaluation.LiveView) -> int:
    """Return the number of cameras that see a spot not of the reference body."""
    seen = _seen(live)
    if live.slot_references is not None:
        seen = seen & (live.slot_references < 0)
    return int(np.count_nonzero(seen.any(axis=1)))


def seen_targets(live: evaluation.LiveView) -> int:
    """Return the number of identified LEDs seen by at least two cameras."""
    leds = live.slot_leds[_seen(live) & (live.slot_leds >= 0)]
    return int(np.count_nonzero(np.bincount(leds) >= 2)) if leds.size else 0


def _seen(live: evaluation.LiveView) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    return np.asarray(np.isfinite(live.spots).all(axis=2))


def active_feature(job: evaluation.JobView) -> evaluation.FeatureView | None:
    """Return the feature of the next point; None if all are done."""
    return next((item for item in job.features if item.name == job.active), None)


def characteristics_of(job: evaluation.JobView, feature: str) -> tuple[CharacteristicResult, ...]:
    """Return the characteristics of a feature, in plan order."""
    return tuple(item for item in job.characteristics if feature in item.features)


CRITERION_WORDS = {criterion: word for word, criterion in CRITERIA.items()}


def quantity(result: CharacteristicResult, value: float | None, *, signed: bool = False) -> str:
    """Return a characteristic's value, unit for inch and degrees only; angles a decimal more."""
    if value is None or not np.isfinite(value):
        return DASHES
    if result.unit != "deg":
        return millimetres(value, signed=signed)
    rounded = round(value, 4) + 0.0
    return localised(localised(f"{rounded:+.4f}°") if signed else localised(f"{rounded:.4f}°"))


def kind_value(kind: str, value: float, decimals: int) -> str:
    """Return a value of a kind of characteristic; lengths in inch with unit."""
    if spec_of(kind).unit == "mm":
        return millimetres(value, decimals=decimals)
    return localised(f"{value:.{decimals}f}")


def named_quantity(
    result: CharacteristicResult, value: float | None, *, signed: bool = False
) -> str:
    """Return a value of a characteristic with its unit, including mm."""
    text = quantity(result, value, signed=signed)
    if text == DASHES or result.unit == "deg" or numbers_in_use().inch:
        return text
    return f"{text} {unit_word()}"


def limit_words(result: CharacteristicResult) -> str:
    """Return the limits of the deviation; only one for a zone."""
    return evaluation.limit_words(result, partial(quantity, result, signed=True))


def basis_words(feature: evaluation.FeatureView, result: CharacteristicResult | None) -> str:
    """Return association and frame of a feature's numbers."""
    if feature.fit is None:
        return ""
    words = CRITERION_WORDS[feature.fit.criterion]
    frame = ""
    if result is not None:
        words, frame = result.association or words, result.frame
    return f"{said_word(words)}, {frame}" if frame else said_word(words)


def outlier_count(feature: evaluation.FeatureView) -> str:
    """Return the number of outliers for far reading; empty if none."""
    count = len(feature.outliers)
    return tr("%n outliers.", "1 outlier.", count) if count else ""


def outlier_words(feature: evaluation.FeatureView, chosen: int) -> str:
    """Return the outliers of a feature and the selected point, in one sentence each."""
    lines = []
    residuals = {} if feature.fit is None else dict(
        zip((point.number for point in feature.points), feature.fit.residuals.tolist(),
            strict=False)
    )  # fmt: skip
    if feature.commanding is not None:
        lines.append(_commanding(feature.commanding))
    elif feature.outliers:
        named = ", ".join(_off(number, residuals) for number in feature.outliers)
        lines.append(
            tr("Outliers: {named}. Still used in the fit. Delete to exclude.").format(named=named)
        )
    if chosen in {point.number for point in feature.points}:
        lines.append(tr("Selected: {point}. Del deletes it.").format(point=_off(chosen, residuals)))
    if feature.deleted:
        out = ", ".join(str(item.point.number) for item in feature.deleted)
        lines.append(tr("Point {numbers} deleted. Ins restores it.").format(numbers=out))
    return "\n".join(lines)


def _commanding(found: CommandingPoints) -> str:
    """Return the question about points that command the fit, with its key."""
    named = ", ".join(map(str, found.numbers))
    if found.rms is not None:
        text = tr("Without point {numbers} rms falls {fold}-fold to {rms}. Remove it? Press Del.")
        fold = localised(f"{found.fold:.0f}")
    else:
        text = tr("Without point {numbers} the others fit with rms {rms}. Remove it? Press Del.")
        fold = ""
    return text.format(numbers=named, fold=fold, rms=length_words(found.rms_without))


def _off(number: int, residuals: Mapping[int, float]) -> str:
    if number not in residuals:
        return tr("point {number}").format(number=number)
    return tr("point {number} ({residual})").format(
        number=number, residual=length_words(residuals[number], signed=True)
    )


PAUSED = later("PAUSED")
"""Displayed instead of the state of a ready machine while the job is paused."""


def is_held(job: evaluation.JobView | None, live: evaluation.LiveView) -> bool:
    """Return whether the machine is ready but the job is paused."""
    ready = live.status in (evaluation.StatusWord.READY, evaluation.StatusWord.MEASURING)
    return job is not None and job.paused and ready


def has_failed(live: evaluation.LiveView | None) -> bool:
    """Return whether measuring has failed until a restart."""
    return live is not None and live.status is evaluation.StatusWord.FAILED


_SCAN_WORDS = {
    "": later("Press on {name}, hold the button and slide {way:.0f} mm."),
    "ring": later("Press on {name}, hold the button and slide {way:.0f} mm around."),
    "spiral": later("Press on {name}, hold the button and slide {way:.0f} mm in a spiral."),
    "raster": later("Press on {name}, hold the button and slide {way:.0f} mm in parallel lines."),
}


def next_step(job: evaluation.JobView, live: evaluation.LiveView | None = None) -> str:
    if has_failed(live):
        return tr("Open the job again: Start page, Continue.")
    if job.paused:
        return tr("Paused. Press Z to resume.")
    if job.target is not None and job.target.words:
        return said(job.target.words)
    looked_at = job.shown if job.looked_at else None
    if looked_at is not None:
        words = tr("{name} is done. Press F6 to reopen it, PgDown to go on.")
        if looked_at.skipped:
            words = tr("{name} is skipped. Press F6 to reopen it, PgDown to go on.")
        return words.format(name=looked_at.name)
    feature = active_feature(job)
    if feature is None:
        if not job.part_verdict.complete:
            return tr("Select and measure what is missing, or press E to write the report.")
        return tr("All features measured. Press E to write the report.")
    if job.probing == "any" and not feature.points:
        return tr("Touch any feature; it is identified by position.")
    if feature.open_ended:
        return tr("Touch, or wait for the point that the program asks for.")
    path = None if live is None else live.path
    if path is not None:
        words = tr("{length:.0f} mm, {speed:.0f} mm/s. Release the button to finish.")
        if path.fast:
            words = tr("Too fast: {speed:.0f} mm/s. Slide more slowly.")
        elif path.lifted:
            words = tr("Lost contact. Put the ball back on the surface.")
        elif path.covered is not None:
            words = tr("{share:.0f} % of the scan, {speed:.0f} mm/s. Release the button to finish.")
        share = 100.0 * (path.covered or 0.0)
        return words.format(length=path.length_mm, speed=path.speed_mm_s, share=share)
    missing = feature.needed - len(feature.points)
    if missing <= 0:
        return tr("{name} has all its points. Press Return to finish it.").format(name=feature.name)
    if feature.spacing > 0.0:
        words = tr(_SCAN_WORDS[feature.scan])
        return words.format(name=feature.name, way=missing * feature.spacing)
    words = tr("Next: touch %n points on {name}.", "Next: touch one point on {name}.", missing)
    if feature.points:
        words = tr("Touch %n more points on {name}.", "Touch one more point on {name}.", missing)
    return words.format(name=feature.name)


def header_words(job: evaluation.JobView) -> str:
    """Return operator and part, in one line."""
    header = job.header
    parts = [header.operator or job.operator]
    if header.serial:
        parts.append(tr("serial {serial}").format(serial=header.serial))
    if header.order:
        parts.append(tr("order {order}").format(order=header.order))
    if header.batch:
        parts.append(tr("batch {batch}").format(batch=header.batch))
    return ", ".join(part for part in parts if part)


def step_text(job: evaluation.JobView) -> str:
    """Return the plan's text for the step, and the core's warning about the spread."""
    feature = active_feature(job)
    if feature is None or job.looked_at:
        return ""
    return f"{feature.text} {feature.spread_warning}".strip()


def mode_words(job: evaluation.JobView) -> str:
    """Return probing order and side detection."""
    order = tr("Plan order") if job.probing == "plan" else tr("Any order")
    feature = active_feature(job)
    if feature is None:
        return f"{order}."
    side = tr(COMPENSATION_WORDS.get(feature.compensation, feature.compensation))
    return tr("{order}. Side: {side}.").format(order=order, side=side)


def approach_words(job: evaluation.JobView | None, live: evaluation.LiveView | None) -> str:
    """Return the distance to the next point; empty if unknown."""
    if job is None or job.target is None or live is None or live.tip_world is None:
        return ""
    return distance_words(job.target.distance(live.tip_world), approximate=job.target.approximate)


def distance_words(distance: float, *, approximate: bool) -> str:
    """Return the distance to the next point, mm, exact or approximate."""
    said = tr("{distance:.0f} mm to the next point")
    if approximate:
        said = tr("about {distance:.0f} mm to the next point")
    return said.format(distance=distance)


COMPENSATION_WORDS = {
    "approach": later("approach direction"),
    "pulled": later("pull away after the touch"),
    "shank": later("along the shank"),
    "nominal": later("as the plan says"),
}
"""Side detection, as displayed."""


def trouble(live: evaluation.LiveView | None, job: evaluation.JobView | None) -> tuple[str, ...]:
    """Return obstacles: the machine's reason, then that of the refused touch."""
    lines = []
    if live is not None and live.status not in (
        evaluation.StatusWord.READY,
        evaluation.StatusWord.MEASURING,
    ):
        lines.append(f"{said_word(live.status.value)}: {said(live.reason)}")
    told = live.reason if lines and live is not None else ""
    if job is not None and job.refusal is not None and job.refusal.what not in told:
        lines.append(
            tr("No point: {what} {remedy}")
            .format(what=said(job.refusal.what), remedy=said(job.refusal.remedy))
            .strip()
        )
    return tuple(lines)


def progress_word(feature: evaluation.FeatureView, verdict: Verdict | None) -> str:
    """Return the status of a feature in the plan; ``verdict`` is that of the feature."""
    if feature.state is evaluation.FeatureState.ACTIVE:
        return tr("ACTIVE")
    if feature.state is evaluation.FeatureState.PENDING:
        return tr("OPEN")
    if feature.state is evaluation.FeatureState.SKIPPED:
        return tr("SKIPPED")
    return tr("DONE") if verdict is None else said_word(verdict.value)


def verdict_line(summary: VerdictSummary) -> str:
    """Return the verdict of a feature, with counts for several characteristics."""
    if summary.verdict is None:
        return tr("NO TOLERANCE")
    return said(summary.share) or said_word(summary.verdict.value)


def counted_line(job: evaluation.JobView) -> str:
    """Return the part verdict with all counts, after the status words of the job."""
    part = job.part_verdict
    counted = part.summary.counted or tr("No characteristics in the plan")
    # NOT COMPLETE already implies it; after DOES NOT CONFORM it is new.
    told = (
        state
        for state in evaluation.job_states(job)
        if not (state == evaluation.INCOMPLETE and part.word is PartWord.NOT_COMPLETE)
    )
    states = ", ".join(map(said_word, told))
    words = f"{said_word(part.word.value)}: {said(counted)}"
    if part.is_partial:
        words = f"{said_word(part.word.value)}: {said(part.requirement_words)}. {said(counted)}"
    return f"{states}. {words}" if states else words
