"""Later findings on the calibration and the tip of a job, and its suspect points.

A failed verification or check, a suspicion or a wrong artefact makes every job since the last good
one suspect. The history, on the computers that measure with the calibration or the probe, is used
only if it contains the very record of the job; if that of the cameras is missing, a note reports
it.

A suspicion - an alarm of the monitor, a verification by a wrong artefact, a shock, a mounted tip -
holds the points since the last good check, or since the shock; a passed check releases them. After
a failed one the start of the error is unknown: points since the last good one stay held until a
recall decides (cameras), or must be measured again (tip). So do those of a suspicion never checked
because another calibration was put in force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from ocmm_core.calibration.records import (
    CalibrationStore,
    CameraRecord,
    Event,
    EventKind,
    ProbeStore,
    ProbeText,
    TipEvent,
    TipEventKind,
    judgements,
    probe_store_folder,
    record_hash,
    store_folder,
)
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.inspection.evaluation import HoldReason, held_back
from ocmm_core.inspection.finished._points_in_doubt import (
    Doubts,
    History,
    Span,
    first_taken,
    hold,
    points_between,
    sentences_of,
)
from ocmm_core.inspection.finished._recall_record import points_released
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile


def points_in_doubt(
    events: Sequence[Event], calibration: str, taken: Mapping[int, datetime]
) -> Doubts:
    """Return the points of a job that must not count because of its calibration.

    ``events`` of the rig, oldest first; ``calibration``: hash of the record of the points;
    ``taken``: when each was stored, by number.
    """
    failed: dict[int, str] = {}
    good: datetime | None = None
    doubts: list[Span] = []
    failures: list[Span] = []
    for one in judgements(events):
        now = datetime.fromisoformat(one.utc)
        if one.calibration != calibration:
            if one.kind is EventKind.ACCEPTED and doubts and not failures:
                # No later check will resolve the suspicion, so it is taken as true.
                failures.append(Span(good, f"{doubts[0].why} Not verified since."))
        elif one.kind is EventKind.PASSED:
            # What failed before this good check may have been wrong up to it.
            failed |= points_between(taken, failures, now, reason="first")
            doubts, failures = [], []
            good = datetime.fromisoformat(one.since_utc or one.utc)
        elif one.kind is EventKind.FAILED:
            failures.append(Span(good, f"The verification of {_day(one.utc)} failed."))
        elif one.kind is EventKind.SUSPECTED:
            since = datetime.fromisoformat(one.since_utc) if one.since_utc else good
            doubts.append(Span(since, one.reason))
    open_ = points_between(taken, doubts, None, reason="first")
    failed |= points_between(taken, failures, None, reason="first")
    for one in events:
        if one.kind is EventKind.FALLEN and not one.evidence and one.calibration == calibration:
            failed |= points_between(taken, [Span(None, one.reason)], None, reason="first")
    return Doubts(open_, failed)


def _day(utc: str) -> str:
    return f"{utc[:16].replace('T', ' ')} UTC"


_VERIFIED = "The calibration has since been verified and passed."
_TAKEN_OVER = "Recorded in the calibration history."
_RECALLED = "A recall found that the verdicts hold."
_SAME_ALARM = timedelta(minutes=1)
"""The monitor holds points and reports the calibration as suspect within this time."""


@dataclass(frozen=True, slots=True)
class CameraHistory:
    """History of the calibration of a job on this computer; can be sent to another one."""

    calibration: str = ""
    """Hash of the record of the job; empty without history."""
    events: tuple[Event, ...] = ()
    recalled: frozenset[int] = frozenset()
    """Points released by the last recall about the job."""
    absent: str = ""
    unread: tuple[str, ...] = ()
    """`absent`, `unread`: As in `History`."""
    rig: str = ""


def settle_cameras(
    session: InspectionSession, job: JobFile, store: CalibrationStore, calibration: str
) -> bool:
    """Hold and release points by the history of their calibration; return whether any changed.

    ``calibration``: hash of the record of the points. StorageError if not durable (points are held
    until the program ends), CalibrationError if the record of a recall was changed.
    """
    recalled = points_released(store, calibration, job)
    return _settle(session, job, CameraHistory(calibration, store.events, recalled))


def _settle(session: InspectionSession, job: JobFile, known: CameraHistory) -> bool:
    events, calibration, recalled = known.events, known.calibration, known.recalled
    doubts = points_in_doubt(events, calibration, first_taken(job))
    changed = [
        bool(session.held.release_points(recalled, _RECALLED, HoldReason.FAILED_CALIBRATION)),
        bool(session.held.release_points(recalled, _RECALLED, HoldReason.CALIBRATION)),
        hold(session, _without(doubts.failed, recalled), HoldReason.FAILED_CALIBRATION),
        hold(session, _without(doubts.open, recalled), HoldReason.CALIBRATION),
    ]
    over = [n for n in session.held.held_for(HoldReason.CALIBRATION) if n not in doubts.open]
    changed.append(bool(session.held.release_points(over, _VERIFIED, HoldReason.CALIBRATION)))
    alarms = _known_alarms(events, calibration, job)
    held = doubts.open.keys() | doubts.failed.keys()
    changed += [
        bool(session.held.release_points(alarms.keys() & held, _TAKEN_OVER, HoldReason.CAMERAS)),
        bool(
            session.held.release_points(
                [n for n, answered in alarms.items() if answered], _VERIFIED, HoldReason.CAMERAS
            )
        ),
    ]
    return any(changed)


def ask_cameras(
    job: JobFile, record: CameraRecord | None, folder: Path, store: CalibrationStore | None = None
) -> CameraHistory:
    """Return the history of a job's calibration on this computer, if present.

    `record`: None for a rig document, which has no history. `folder`: calibrations, one subfolder
    per rig. `store`: that of the rig, if already read.
    """
    if record is None:
        return CameraHistory()
    used = record_hash(record)
    absent = (
        f"The history of calibration {used[:12]} of rig '{record.rig}' is not on this computer: "
        "whether it failed later is unknown here."
    )
    try:
        store = store or CalibrationStore(store_folder(folder, record.rig))
        if not is_known(store.events, used):
            return CameraHistory(absent=absent)
        return CameraHistory(used, store.events, points_released(store, used, job), rig=record.rig)
    except InputError:
        # No rig of such a name can have a history here.
        return CameraHistory(absent=absent)
    except (OcmmError, OSError) as error:
        return CameraHistory(unread=(_unread(record.rig, error),))


def settle_by_calibration(
    session: InspectionSession, job: JobFile, known: CameraHistory
) -> History:
    """Hold and release points of an own copy of a job by the history of their calibration."""
    if not known.calibration:
        return History(absent=known.absent, unread=known.unread)
    try:
        _settle(session, job, known)
    except (OcmmError, OSError) as error:
        return History(unread=(_unread(known.rig, error),))
    return History(
        against=sentences_of(session, HoldReason.FAILED_CALIBRATION, HoldReason.CALIBRATION)
    )


def _unread(rig: str, error: Exception) -> str:
    why = error.what if isinstance(error, OcmmError) else str(error)
    return (
        f"The history of the calibration of rig '{rig}' cannot be read, so it is "
        f"unknown whether it has failed since: {why}"
    )


def is_known(events: Sequence[Event], calibration: str) -> bool:
    """Return whether a calibration was in force by these events."""
    return any(one.kind is EventKind.ACCEPTED and one.calibration == calibration for one in events)


def _without(points: dict[int, str], numbers: frozenset[int]) -> dict[int, str]:
    return {number: why for number, why in points.items() if number not in numbers}


def _known_alarms(events: Sequence[Event], calibration: str, job: JobFile) -> dict[int, bool]:
    """Return the points held by the monitor, each with whether a good check resolved it since.

    An alarm belongs to the history only with the same words at the same time: the monitor also
    holds points for causes that no verification resolves (moved part, changed probe).
    """
    own = [one for one in events if one.calibration == calibration]
    checked = [datetime.fromisoformat(one.utc) for one in own if one.kind is EventKind.PASSED]
    last = max(checked, default=None)
    doubts = [
        (datetime.fromisoformat(one.utc), one.reason)
        for one in own
        if one.kind is EventKind.SUSPECTED
    ]
    happened = job.events()
    held = held_back(happened)
    known: dict[int, bool] = {}
    for event in happened:
        if event.kind != HoldReason.CAMERAS.held:
            continue
        names, _, reason = event.text.partition(": ")
        when = datetime.fromisoformat(event.time_utc)
        same = [utc for utc, why in doubts if why == reason and abs(utc - when) < _SAME_ALARM]
        for number in (int(name) for name in names.split(",")):
            known.pop(number, None)
            if same and number in held:
                known[number] = last is not None and max(same) < last
    return known


GOOD = (TipEventKind.QUALIFIED, TipEventKind.PASSED)
_FAILED = (TipEventKind.FAILED, TipEventKind.NOT_QUALIFIED)
_DOUBTED = (TipEventKind.DOUBTED, TipEventKind.MOUNTED)


def last_good_utc(events: Sequence[TipEvent], tip: str) -> datetime | None:
    """Return when a tip was last found good, or None if never."""
    found = [one.utc for one in events if one.tip == tip and one.kind in GOOD]
    return datetime.fromisoformat(found[-1]) if found else None


def tip_points_in_doubt(
    events: Sequence[TipEvent], tip: str, taken: Mapping[int, datetime]
) -> Doubts:
    """Return the points that must not count because of the ``tip``; ``taken``: storing times."""
    doubts = Doubts({}, {})
    good: datetime | None = None
    failures: list[Span] = []
    for one in (one for one in events if one.tip == tip):
        now = datetime.fromisoformat(one.utc)
        if one.kind in GOOD:
            # What failed before this good check may have been wrong up to it.
            doubts.failed.update(points_between(taken, failures, now, reason="last"))
            doubts.open.clear()
            failures.clear()
            good = now
        elif one.kind in _FAILED:
            why = _FAILED_WORDS[one.kind].format(tip=tip, utc=one.utc[:16])
            failures.append(Span(good, why))
        elif one.kind in _DOUBTED:
            since = datetime.fromisoformat(one.since_utc) if one.since_utc else good
            why = one.reason if one.kind is TipEventKind.DOUBTED else _MOUNTED.format(tip=tip)
            doubts.open.update(points_between(taken, [Span(since, why)], None, reason="last"))
    doubts.failed.update(points_between(taken, failures, None, reason="last"))
    return doubts


_MOUNTED = "Tip '{tip}' was mounted again."
_FAILED_WORDS = {
    TipEventKind.FAILED: "The check of tip '{tip}' failed ({utc} UTC).",
    TipEventKind.NOT_QUALIFIED: "The qualification of tip '{tip}' failed ({utc} UTC).",
}


_CHECKED = "The tip has since been checked and is unchanged."


@dataclass(frozen=True, slots=True)
class TipHistory:
    """History of the tip of a job on this computer; can be sent to another one."""

    tip: str = ""
    """Name of the tip; empty without history."""
    events: tuple[TipEvent, ...] = ()
    unread: tuple[str, ...] = ()


def settle_tip(
    session: InspectionSession, job: JobFile, events: Sequence[TipEvent], tip: str
) -> bool:
    """Hold and release points by the history of their ``tip``; return whether any changed.

    StorageError if it could not be made durable; points are held until the program ends.
    """
    doubts = tip_points_in_doubt(events, tip, first_taken(job))
    changed = [hold(session, doubts.failed, HoldReason.FAILED_TIP)]
    if doubts.open:
        changed.append(hold(session, doubts.open, HoldReason.TIP))
    else:
        changed.append(bool(session.held.release(_CHECKED, HoldReason.TIP)))
    return any(changed)


def ask_tip(probe: ProbeText | None, folder: Path) -> TipHistory:
    """Return the history of a job's probe on this computer, if present.

    ``probe``: None without records, and so without history; ``folder``: one subfolder per probe.
    """
    if probe is None:
        return TipHistory()
    name = probe.calibration.probe
    try:
        store = ProbeStore(probe_store_folder(folder, name))
    except InputError:
        # No probe of such a name can have a history here.
        return TipHistory()
    except (StorageError, OSError) as error:
        why = error.what if isinstance(error, StorageError) else str(error)
        sentence = (
            f"The history of probe '{name}' cannot be read, so it is unknown whether its tip "
            f"has failed since: {why}"
        )
        return TipHistory(unread=(sentence,))
    used = record_hash(probe.calibration)
    calibrated = [one for one in store.events if one.kind is TipEventKind.CALIBRATED]
    if all(one.record != used for one in calibrated):
        return TipHistory()
    return TipHistory(probe.calibration.tip, store.events)


def settle_by_history(session: InspectionSession, job: JobFile, known: TipHistory) -> History:
    """Hold and release points by the known history of their tip. `job`: Own copy of a job file."""
    if not known.tip:
        return History(unread=known.unread)
    settle_tip(session, job, known.events, known.tip)
    return History(against=sentences_of(session, HoldReason.FAILED_TIP, HoldReason.TIP))
