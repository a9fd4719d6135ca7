"""What became of the tip after a job was measured.

A check that failed puts every job since the last good one in doubt, not only the one at hand. The
history of a probe is on the computers that measure with it. It is asked only where it holds the
very calibration that the job was measured with; elsewhere a job says what its own file says.
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
from ocmm_core.inspection.archive._tip_doubts import points_in_doubt
from ocmm_core.inspection.evaluation import Ward
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile

_CHECKED = "The tip was checked since and is as it was."


def settle_tip(
    session: InspectionSession, job: JobFile, events: Sequence[TipEvent], tip: str
) -> bool:
    """Hold back and release the points of a job by what happened to its tip; say if any changed.

    Parameters
    ----------
    events
        Of the probe, oldest first.
    tip
        That the points were taken with.

    Raises
    ------
    StorageError
        It could not be made durable; points are held back until the program ends.
    """
    doubts = points_in_doubt(events, tip, first_taken(job))
    changed = [hold(session, doubts.failed, Ward.FAILED_TIP)]
    if doubts.open:
        changed.append(hold(session, doubts.open, Ward.TIP))
    else:
        changed.append(bool(session.held.release(_CHECKED, Ward.TIP)))
    return any(changed)


@dataclass(frozen=True, slots=True)
class TipHistory:
    """What the history of the probe says of a job, in sentences.

    Attributes
    ----------
    against
        Which points it puts in doubt, and why; they are held back.
    unread
        That it is here and cannot be read.
    """

    against: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()


def settle_by_history(
    session: InspectionSession, job: JobFile, probe: ProbeText | None, folder: Path
) -> TipHistory:
    """Do so by the history of the probe on this computer, where there is one.

    Parameters
    ----------
    job
        Own copy of a job file.
    probe
        What the job was measured with; None for a probe without records, which has no history.
    folder
        Where records of probes are kept, probe by probe.
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
            f"The history of probe '{name}' cannot be read, so that nobody knows whether its tip "
            f"failed since: {why}"
        )
        return TipHistory(unread=(sentence,))
    used = record_hash(probe.calibration)
    calibrated = [one for one in store.events if one.kind is TipEventKind.CALIBRATED]
    if all(one.record != used for one in calibrated):
        return TipHistory()
    settle_tip(session, job, store.events, probe.calibration.tip)
    return TipHistory(
        against=tuple(
            sentence
            for ward in (Ward.FAILED_TIP, Ward.TIP)
            for sentence in sentences(session.held.held_for(ward), ward)
        )
    )


def first_taken(job: JobFile) -> dict[int, datetime]:
    """Return when the observation of each point was first stored, also of annulled ones.

    A point that was put back, or turned round, is a new row; its observation is as old as it was.
    """
    stored = {k: datetime.fromisoformat(v) for k, v in job.taken_utc().items()}
    points = [*job.points(), *(point for point, _ in job.annulled())]
    first: dict[tuple[float, int, int], datetime] = {}
    for point in sorted(points, key=lambda point: point.number):
        first.setdefault((point.time_s, point.first_frame, point.last_frame), stored[point.number])
    return {
        point.number: first[(point.time_s, point.first_frame, point.last_frame)] for point in points
    }


def sentences(held: Mapping[int, str], ward: Ward) -> list[str]:
    """Return for every reason how many points it puts in doubt, and what to do."""
    reasons = list(held.values())
    return [
        f"{why} {_counted(reasons.count(why))} in doubt. {ward.remedy}"
        for why in dict.fromkeys(reasons)
    ]


def hold(session: InspectionSession, points: Mapping[int, str], ward: Ward) -> bool:
    """Hold back points, each for its reason, and say whether any was not held before.

    Raises
    ------
    StorageError
        It could not be made durable; points are held back until the program ends.
    """
    changed = False
    for reason in dict.fromkeys(points.values()):
        numbers = [number for number, why in points.items() if why == reason]
        changed |= bool(session.held.hold_back_points(numbers, reason, ward))
    return changed


def _counted(count: int) -> str:
    return "1 point is" if count == 1 else f"{count} points are"
