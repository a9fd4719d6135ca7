"""Snapshot of job and machine for a second screen: texts in the language of its reader.

Every word and number is composed here from the views of the core, so that the page shows and never
decides. Words have the English one next to them (``code``), which the page uses for marks and
colours.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.inspection.causes import Explanation
from ocmm_core.inspection.evaluation import (
    INCOMPLETE,
    FeatureState,
    FeatureView,
    JobView,
    LiveView,
    job_states,
    limit_words,
    state_lines,
)  # fmt: skip
from ocmm_core.options import DEFAULT_OPERATOR, DEFAULT_SERIAL
from ocmm_core.tolerances.decisions import CharacteristicResult, VerdictSummary
from ocmm_core.wording import Speech

SCHEMA = "ocmm.screen/1"
DASHES = "———"
"""In place of a number that is unknown or not trusted."""


class _Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Part of the snapshot."""


class ScreenWord(_Part, frozen=True, kw_only=True):
    """A word of the core: ``code`` in English, empty without a tolerance, and as displayed."""

    code: str
    text: str


class ScreenLive(_Part, frozen=True, kw_only=True):
    """The machine now: ``position`` X, Y, Z and ``uncertainty`` (k = 2) in mm, or dashes.

    ``distance`` to the next point is a sentence.
    """

    status: ScreenWord
    reason: str
    position: tuple[str, str, str]
    uncertainty: str
    distance: str
    faults: tuple[str, ...]


class ScreenResult(_Part, frozen=True, kw_only=True):
    """One characteristic; ``unit`` is that of all its numbers, ``valued``: it has a value."""

    name: str
    kind: str
    features: tuple[str, ...]
    unit: str
    limits: str
    measured: str
    deviation: str
    uncertainty: str
    valued: bool
    verdict: ScreenWord
    reason: str


class ScreenFeature(_Part, frozen=True, kw_only=True):
    """One feature of the plan list, with its points as ``3 / 8``."""

    name: str
    shape: str
    count: str
    state: ScreenWord
    verdict: ScreenWord
    note: str


class ScreenJob(_Part, frozen=True, kw_only=True):
    """The job after its change ``sequence``.

    ``shown``: feature in large digits; empty while the verdict on the part is shown. ``deciding``:
    the result that decides over it; ``reason``: of that verdict. ``next``: the next step;
    ``instruction``: that of the plan. ``picture``: feature of the plan
    that has one. ``refusal``: why the last touch gave no point, and what to do.
    """

    job: str
    sequence: int
    title: str
    states: tuple[str, ...]
    paused: str
    next: str
    instruction: str
    refusal: tuple[str, ...]
    shown: str
    deciding: str
    part: ScreenWord
    reason: str
    features: tuple[ScreenFeature, ...]
    results: tuple[ScreenResult, ...]
    picture: str
    undo: str
    can_finish: bool


class ScreenAnswer(_Part, frozen=True, kw_only=True):
    """Answer to the action ``id`` of this reader: empty sentences if it was done."""

    id: int
    what: str
    remedy: str


class ScreenSnapshot(_Part, frozen=True, kw_only=True):
    """One message to a reader, who acknowledges its ``number`` before the next one.

    ``job`` is null if unchanged; ``current`` is false while it is evaluated again: its results are
    of an earlier state. ``texts`` of the page are in the first message only.
    """

    schema: str
    number: int
    controls: bool
    current: bool
    live: ScreenLive
    job: ScreenJob | None
    answers: tuple[ScreenAnswer, ...]
    texts: dict[str, str]


def texts_of(speech: Speech) -> dict[str, str]:
    """Return the fixed texts of the page."""
    english = {
        "take": "Take",
        "undo": "Undo",
        "finish": "Next",
        "far": "Measure",
        "plan": "Plan",
        "results": "Results",
        "measured": "Measured",
        "deviation": "Deviation",
        "uncertainty": "U",
        "limits": "Tolerance",
        "old": "The results are being calculated.",
        "gone": "No connection to the station.",
        "gone_remedy": "Nothing shown here is valid now. Look at the station; this page reconnects "
        "by itself.",
        "wrong": "This address is no longer valid. Scan the code of the station again.",
        "full": "Too many pages are open on this station. Close one.",
        "picture": "Picture of this step",
    }
    return {
        "language": speech.language,
        **{name: _spoken(speech, text) for name, text in english.items()},
    }


def live_of(live: LiveView, job: JobView | None, speech: Speech) -> ScreenLive:
    """Return the machine for display; numbers only if the core trusts them."""
    position, tip = (DASHES, DASHES, DASHES), live.tip_world
    distance = ""
    if tip is not None:
        x, y, z = (_number(speech, float(value), 3) for value in tip)
        position = (x, y, z)
        if job is not None and job.target is not None:
            off = job.target.distance(tip)
            distance = f"{off:.0f} mm to the next point."
            if job.target.approximate:
                distance = f"About {off:.0f} mm to the next point."
    return ScreenLive(
        status=ScreenWord(code=live.status.value, text=speech.word(live.status.value)),
        reason=speech.text(live.reason),
        position=position,
        uncertainty=_number(speech, live.tip_uncertainty, 3),
        distance=speech.text(distance),
        faults=tuple(map(speech.text, live.faults)),
    )


def job_of(
    view: JobView, explanations: Sequence[Explanation], sequence: int, speech: Speech
) -> ScreenJob:
    """Return a job for display. `explanations`: reasons of results that are not CONFORM."""
    shown = None if view.shows_part else view.shown
    active = next((item for item in view.features if item.name == view.active), None)
    reasons = {(one.characteristic, one.verdict): one for one in explanations}
    header, part = view.header, view.part_verdict
    names, refusal = (view.part, header.serial, header.operator), view.refusal
    # The plan list shows what is missing.
    states = [
        line
        for word, line in zip(job_states(view), state_lines(view), strict=True)
        if word != INCOMPLETE
    ]
    states.append(view.unproven)
    features = tuple(_feature(view, item, speech) for item in view.features)
    results = tuple(
        _result(item, reasons.get((item.name, item.verdict)), speech)
        for item in view.characteristics
    )
    return ScreenJob(
        job=view.job,
        sequence=sequence,
        title=" · ".join(one for one in names if one not in ("", DEFAULT_SERIAL, DEFAULT_OPERATOR)),
        states=tuple(speech.text(line) for line in states if line),
        paused=speech.text("The job is paused. Resume it at the station.") if view.paused else "",
        next=speech.text(next_step(view)),
        instruction=""
        if active is None
        else f"{active.text} {speech.text(active.spread_warning)}".strip(),
        refusal=() if refusal is None else (speech.text(refusal.what), speech.text(refusal.remedy)),
        shown="" if shown is None else shown.name,
        deciding="" if shown is None else view.verdict_of(shown.name).deciding,
        part=ScreenWord(
            code="" if part.shown_as is None else part.shown_as.value,
            text=speech.text(part.headline) if part.is_partial else speech.word(part.word.value),
        ),
        reason=_reason(view, shown, features, results, speech),
        features=features,
        results=results,
        picture=active.name if active is not None and active.picture else "",
        undo=speech.text(view.undo),
        can_finish=active is not None and active.taken >= MINIMUM_POINTS[active.shape],
    )


def next_step(view: JobView) -> str:
    """Return what the hand does next, in one sentence."""
    if view.target is not None and view.target.words:
        return view.target.words
    feature = next((item for item in view.features if item.name == view.active), None)
    if feature is None:
        if not view.part_verdict.complete:
            return "Select what is missing at the station, and measure it."
        return "All features are measured."
    if view.probing == "any" and not feature.points:
        return "Touch any feature; it is identified by position."
    if feature.open_ended:
        return "Touch, or wait for the point that the program asks for."
    missing = feature.needed - feature.taken
    name = feature.name
    if missing <= 0:
        return f"{name} has all its points: finish it."
    if feature.spacing > 0.0:
        way = missing * feature.spacing
        return f"Press on {name}, hold the button and slide {way:.0f} mm."
    more = " more" if feature.taken else ""
    if missing == 1:
        return f"Touch one{more} point on {name}."
    return f"Touch {missing:d}{more} points on {name}."


def _reason(
    view: JobView,
    shown: FeatureView | None,
    features: Sequence[ScreenFeature],
    results: Sequence[ScreenResult],
    speech: Speech,
) -> str:
    """Return why the shown verdict is not better, or what the shown feature lacks."""
    part = view.part_verdict
    if shown is None:
        return " · ".join(
            speech.text(one) for one in (*part.reasons, part.requirement_words) if one
        )
    told = [item.note for item in features if item.name == shown.name]
    if not shown.provisional:
        deciding = view.verdict_of(shown.name).deciding
        told += [item.reason for item in results if item.name == deciding]
    return " ".join(one for one in told if one)


def _feature(view: JobView, feature: FeatureView, speech: Speech) -> ScreenFeature:
    summary = view.verdict_of(feature.name)
    words = {
        FeatureState.ACTIVE: "active",
        FeatureState.PENDING: "open",
        FeatureState.SKIPPED: "skipped",
        FeatureState.DONE: "done",
    }
    # The next step states missing points.
    lacking = feature.taken < MINIMUM_POINTS[feature.shape]
    return ScreenFeature(
        name=feature.name,
        shape=speech.word(feature.shape.label),
        count=feature.count_text,
        state=ScreenWord(code=feature.state.value, text=speech.word(words[feature.state])),
        verdict=_verdict(summary, speech),
        note="" if lacking else speech.text(feature.note),
    )


def _verdict(summary: VerdictSummary, speech: Speech) -> ScreenWord:
    if summary.verdict is None:
        return ScreenWord(code="", text=speech.word("NO TOLERANCE"))
    words = speech.text(summary.share) or speech.word(summary.verdict.value)
    return ScreenWord(code=summary.verdict.value, text=words)


def _result(
    result: CharacteristicResult, explanation: Explanation | None, speech: Speech
) -> ScreenResult:
    degrees = result.unit == "deg"
    digits = 4 if degrees else 3
    told = [result.note, result.caution]
    if explanation is not None:
        told = [explanation.why, explanation.suggestion]
    return ScreenResult(
        name=result.name,
        kind=speech.word(result.kind),
        features=result.features,
        unit="°" if degrees else "mm",
        limits=limit_words(result, lambda one: _number(speech, one, digits, "+")),
        measured=_number(speech, result.measured, digits),
        deviation=_number(speech, result.deviation, digits, "+"),
        uncertainty=_number(speech, result.uncertainty, digits),
        valued=result.measured is not None,
        verdict=ScreenWord(code=result.verdict.value, text=speech.word(result.verdict.value)),
        reason=" ".join(speech.text(one) for one in told if one),
    )


def _number(speech: Speech, value: float | None, digits: int, sign: str = "") -> str:
    if value is None or not abs(value) < float("inf"):
        return DASHES
    # A value that rounds to zero has no minus.
    return speech.number(f"{round(value, digits) + 0.0:{sign}.{digits}f}")


def _spoken(speech: Speech, text: str) -> str:
    said = speech.text(text)
    return speech.word(text) if said == text else said
