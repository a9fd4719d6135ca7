"""Suspect spans of time, and points held in them: for the histories of cameras and tips."""

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
    """Findings of a history on a job, in sentences."""

    against: tuple[str, ...] = ()
    """Suspect points and reasons; they are held."""
    unread: tuple[str, ...] = ()
    absent: str = ""
    """Missing history; empty if it is here, does not exist, or its absence is irrelevant."""


@dataclass(frozen=True, slots=True)
class Doubts:
    """Points that must not count, by number, and why."""

    open: dict[int, str]
    """Until a good check: of the tip, or a verification of the calibration."""
    failed: dict[int, str]
    """Regardless of later checks: for good (tip), or until a recall decides (cameras)."""


@dataclass(frozen=True, slots=True)
class Span:
    """A suspect span: from ``since`` (None: the first point) until a good check."""

    since: datetime | None
    why: str


def points_between(
    taken: Mapping[int, datetime],
    spans: Sequence[Span],
    end: datetime | None,
    *,
    reason: Literal["first", "last"],
) -> dict[int, str]:
    """Return the points within spans up to a moment, with the reason of the span.

    `taken`: storing times by number. `spans`: oldest first. `end`: points from then on are not
    suspect. `reason`: which of several spans gives it.
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

    Restored or flipped points are new rows with the old age. The rows' audit is not checked.
    """
    return first_stored(job.observed())


def first_stored(observed: Sequence[Observed]) -> dict[int, datetime]:
    """Return the same from the observations of a job, by number."""
    first: dict[tuple[float, int, int], datetime] = {}
    for one in observed:
        key = one.time_s, one.first_frame, one.last_frame
        first.setdefault(key, datetime.fromisoformat(one.stored_utc))
    return {one.number: first[(one.time_s, one.first_frame, one.last_frame)] for one in observed}


def sentences_of(session: InspectionSession, *hold_reasons: HoldReason) -> tuple[str, ...]:
    """Return the reasons for which points are now held, one sentence each."""
    return tuple(
        sentence
        for hold_reason in hold_reasons
        for sentence in _sentences(session.held.held_for(hold_reason), hold_reason)
    )


def hold(session: InspectionSession, points: Mapping[int, str], hold_reason: HoldReason) -> bool:
    """Hold points for their reasons; return whether any is new. StorageError if not durable."""
    changed = False
    for reason in dict.fromkeys(points.values()):
        numbers = [number for number, why in points.items() if why == reason]
        changed |= bool(session.held.hold_back_points(numbers, reason, hold_reason))
    return changed


def _sentences(held: Mapping[int, str], hold_reason: HoldReason) -> list[str]:
    reasons = list(held.values())
    return [
        f"{why} {_counted(reasons.count(why))} suspect. {hold_reason.remedy}"
        for why in dict.fromkeys(reasons)
    ]


def _counted(count: int) -> str:
    return "1 point is" if count == 1 else f"{count} points are"
