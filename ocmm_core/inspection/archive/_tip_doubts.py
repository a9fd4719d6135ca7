"""Points of a job that are suspect because of the tip, by the tip's history.

A suspicion - a shock, a long pause, a mounted tip - holds the points since the tip was last found
good, or since the shock; a passed check releases them. After a failed check the start of the error
is unknown: points since the last good one must be measured again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime

from ocmm_core.calibration.records import TipEvent, TipEventKind
from ocmm_core.inspection.archive._points_in_doubt import Doubts, Span, points_between

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
