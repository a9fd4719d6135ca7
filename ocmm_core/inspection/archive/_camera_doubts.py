"""Points of a job that are suspect because of the cameras, by the history of the calibration.

A suspicion - an alarm of the monitor, a verification by a wrong artefact - holds the points since
the last good check; a passed verification releases them. After a failed one the start of the error
is unknown: points since the last good one stay held until a recall decides. So do those of a
suspicion never checked because another calibration was put in force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime

from ocmm_core.calibration.records import Event, EventKind, judgements
from ocmm_core.inspection.archive._points_in_doubt import Doubts, Span, points_between


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
