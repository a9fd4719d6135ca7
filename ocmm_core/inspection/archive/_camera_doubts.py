"""Which points of a job are in doubt because of the cameras: from the history of the calibration.

A doubt - an alarm of the monitor, a verification by an artefact that was wrong - holds back the
points since all was last known to be well; a verification that passes lets them count again. A
verification that fails leaves nobody knowing since when the cameras are wrong: the points since the
last good one stay held back, whatever the next one says, until a recall decides over them. So do
those of a doubt that was never answered because another calibration was put in force instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from ocmm_core.calibration.records import Event, EventKind, judgements


@dataclass(frozen=True, slots=True)
class CameraDoubts:
    """Points that must not count, by number, and why.

    Attributes
    ----------
    open
        Until the calibration is verified.
    failed
        Until a recall decides.
    """

    open: dict[int, str]
    failed: dict[int, str]


@dataclass(frozen=True, slots=True)
class _Span:
    """A time in doubt: from ``since`` (None: from the first point) until a good check."""

    since: datetime | None
    why: str


def points_in_doubt(
    events: Sequence[Event], calibration: str, taken: Mapping[int, datetime]
) -> CameraDoubts:
    """Return the points of a job that must not count because of its calibration.

    Parameters
    ----------
    events
        Of the rig, oldest first, also about its other calibrations.
    calibration
        Hash of the record that the points were taken with.
    taken
        When each point was stored, by number.
    """
    failed: dict[int, str] = {}
    good: datetime | None = None
    doubts: list[_Span] = []
    failures: list[_Span] = []
    for one in judgements(events):
        now = datetime.fromisoformat(one.utc)
        if one.calibration != calibration:
            if one.kind is EventKind.ACCEPTED and doubts and not failures:
                # Nobody will answer the doubt by a check any more, so it is believed.
                failures.append(_Span(good, f"{doubts[0].why} It was never verified since."))
        elif one.kind is EventKind.PASSED:
            # What failed before this good check may have been wrong up to it.
            failed |= _between(taken, failures, now)
            doubts, failures, good = [], [], now
        elif one.kind is EventKind.FAILED:
            failures.append(_Span(good, f"The verification of {_day(one.utc)} failed."))
        elif one.kind is EventKind.SUSPECTED:
            since = datetime.fromisoformat(one.since_utc) if one.since_utc else good
            doubts.append(_Span(since, one.reason))
    open_ = _between(taken, doubts, None)
    failed |= _between(taken, failures, None)
    for one in events:
        if one.kind is EventKind.FALLEN and not one.evidence and one.calibration == calibration:
            failed |= _between(taken, [_Span(None, one.reason)], None)
    return CameraDoubts(open_, failed)


def _between(
    taken: Mapping[int, datetime], spans: Sequence[_Span], end: datetime | None
) -> dict[int, str]:
    """Return the points from the beginning of a span up to a moment, both open where None."""
    return {
        number: span.why
        for span in reversed(spans)
        for number, when in taken.items()
        if (span.since is None or when >= span.since) and (end is None or when < end)
    }


def _day(utc: str) -> str:
    return f"{utc[:16].replace('T', ' ')} UTC"
