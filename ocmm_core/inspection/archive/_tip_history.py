"""Later findings on the tip of a job, and its suspect points.

A failed check makes every job since the last good one suspect. The history, on the computers that
measure with the probe, is used only if it contains the very calibration of the job.

A suspicion - a shock, a long pause, a mounted tip - holds the points since the tip was last found
good, or since the shock; a passed check releases them. After a failed check the start of the error
is unknown: points since the last good one must be measured again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from ocmm_core.calibration.records import (
    ProbeStore,
    ProbeText,
    TipEvent,
    TipEventKind,
    probe_store_folder,
    record_hash,
)
from ocmm_core.errors import InputError, StorageError
from ocmm_core.inspection.archive._points_in_doubt import (
    Doubts,
    History,
    Span,
    first_taken,
    hold,
    points_between,
    sentences_of,
)
from ocmm_core.inspection.evaluation import HoldReason
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile

GOOD = (TipEventKind.QUALIFIED, TipEventKind.PASSED)
_FAILED = (TipEventKind.FAILED, TipEventKind.NOT_QUALIFIED)
_DOUBTED = (TipEventKind.DOUBTED, TipEventKind.MOUNTED)


def last_good_utc(events: Sequence[TipEvent], tip: str) -> datetime | None:
    """Return when a tip was last found good, or None if never."""
    found = [one.utc for one in events if one.tip == tip and one.kind in GOOD]
    return datetime.fromisoformat(found[-1]) if found else None


def points_in_doubt(events: Sequence[TipEvent], tip: str, taken: Mapping[int, datetime]) -> Doubts:
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
    doubts = points_in_doubt(events, tip, first_taken(job))
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
