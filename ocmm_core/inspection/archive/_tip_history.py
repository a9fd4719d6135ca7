"""Later findings on the tip of a job.

A failed check makes every job since the last good one suspect. The history, on the computers that
measure with the probe, is used only if it contains the very calibration of the job.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
from ocmm_core.inspection.archive._points_in_doubt import History, first_taken, hold, sentences_of
from ocmm_core.inspection.archive._tip_doubts import points_in_doubt
from ocmm_core.inspection.evaluation import HoldReason
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile

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
