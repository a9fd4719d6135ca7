"""What became of the tip after a job was measured.

A check that failed puts every job since the last good one in doubt, not only the one at hand. The
history of a probe is on the computers that measure with it. It is asked only where it holds the
very calibration that the job was measured with; elsewhere a job says what its own file says.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    History,
    first_taken,
    hold,
    sentences_of,
)
from ocmm_core.inspection.archive._tip_doubts import points_in_doubt
from ocmm_core.inspection.evaluation import HoldReason
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile

_CHECKED = "The tip has since been checked and is unchanged."


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
    changed = [hold(session, doubts.failed, HoldReason.FAILED_TIP)]
    if doubts.open:
        changed.append(hold(session, doubts.open, HoldReason.TIP))
    else:
        changed.append(bool(session.held.release(_CHECKED, HoldReason.TIP)))
    return any(changed)


def settle_by_history(
    session: InspectionSession, job: JobFile, probe: ProbeText | None, folder: Path
) -> History:
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
        return History()
    name = probe.calibration.probe
    try:
        store = ProbeStore(probe_store_folder(folder, name))
    except InputError:
        # No probe of such a name can have a history here.
        return History()
    except (StorageError, OSError) as error:
        why = error.what if isinstance(error, StorageError) else str(error)
        sentence = (
            f"The history of probe '{name}' cannot be read, so it is unknown whether its tip "
            f"has failed since: {why}"
        )
        return History(unread=(sentence,))
    used = record_hash(probe.calibration)
    calibrated = [one for one in store.events if one.kind is TipEventKind.CALIBRATED]
    if all(one.record != used for one in calibrated):
        return History()
    settle_tip(session, job, store.events, probe.calibration.tip)
    return History(against=sentences_of(session, HoldReason.FAILED_TIP, HoldReason.TIP))
