"""What the histories of cameras and tips have in common when they are asked about a job.

A history is a sequence of events; some of them begin a time in doubt. `points_between` says which
points of the job were taken in it, `hold` holds them back, and `sentences` says so to a person.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from ocmm_core.inspection.evaluation import HoldReason
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile, Observed


@dataclass(frozen=True, slots=True)
class History:
    """What a history says of a job, in sentences."""

    against: tuple[str, ...] = ()
    """Which points it puts in doubt, and why; they are held back."""
    unread: tuple[str, ...] = ()
    """That it is here and cannot be read."""
    absent: str = ""
    """That it is not on this computer; empty where it is, where there is none, or where the absence
    says nothing."""


@dataclass(frozen=True, slots=True)
class Doubts:
    """Points that must not count, by number, and why."""

    open: dict[int, str]
    """Until a good check: of the tip, or a verification of the calibration."""
    failed: dict[int, str]
    """Whatever a later check says: for good (tip), or until a recall decides (cameras)."""


@dataclass(frozen=True, slots=True)
class Span:
    """A time in doubt: from ``since`` (None: from the first point) until a good check."""

    since: datetime | None
    why: str


def points_between(
    taken: Mapping[int, datetime],
    spans: Sequence[Span],
    end: datetime | None,
    *,
    reason: Literal["first", "last"],
) -> dict[int, str]:
    """Return the points from the beginning of a span up to a moment, with the reason of the span.

    Parameters
    ----------
    taken
        When each point was stored, by number.
    spans
        Oldest first.
    end
        Points from then on are not in doubt; None where nothing ends it.
    reason
        Which span gives the reason for a point that lies in several: the first or the last one.
    """
    return {
        number: span.why
        # A later entry of a dictionary replaces an earlier one.
        for span in (spans if reason == "last" else reversed(spans))
        for number, when in taken.items()
        if (span.since is None or when >= span.since) and (end is None or when < end)
    }


def first_taken(job: JobFile) -> dict[int, datetime]:
    """Return when the observation of each point was first stored, also of annulled ones.

    A point that was put back, or turned round, is a new row; its observation is as old as it was.
    Whether a point is as it was stored is not looked at.
    """
    return first_stored(job.observed())


def first_stored(observed: Sequence[Observed]) -> dict[int, datetime]:
    """Return the same of what is known of all points of a job, by number."""
    first: dict[tuple[float, int, int], datetime] = {}
    for one in observed:
        key = one.time_s, one.first_frame, one.last_frame
        first.setdefault(key, datetime.fromisoformat(one.stored_utc))
    return {one.number: first[(one.time_s, one.first_frame, one.last_frame)] for one in observed}


def sentences_of(session: InspectionSession, *hold_reasons: HoldReason) -> tuple[str, ...]:
    """Return what is held back for some causes now, each reason in one sentence."""
    return tuple(
        sentence
        for hold_reason in hold_reasons
        for sentence in _sentences(session.held.held_for(hold_reason), hold_reason)
    )


def hold(session: InspectionSession, points: Mapping[int, str], hold_reason: HoldReason) -> bool:
    """Hold back points, each for its reason, and say whether any was not held before.

    Raises
    ------
    StorageError
        It could not be made durable; points are held back until the program ends.
    """
    changed = False
    for reason in dict.fromkeys(points.values()):
        numbers = [number for number, why in points.items() if why == reason]
        changed |= bool(session.held.hold_back_points(numbers, reason, hold_reason))
    return changed


def _sentences(held: Mapping[int, str], hold_reason: HoldReason) -> list[str]:
    """Return for every reason how many points it puts in doubt, and what to do."""
    reasons = list(held.values())
    return [
        f"{why} {_counted(reasons.count(why))} suspect. {hold_reason.remedy}"
        for why in dict.fromkeys(reasons)
    ]


def _counted(count: int) -> str:
    return "1 point is" if count == 1 else f"{count} points are"
