"""Points that are held back: stored and shown, but proving nothing until they are released.

Where the calibration or the tip came into doubt while a job was measured, the points since the last
good check may be wrong. Which ones follows from the events of the job file alone, so that they stay
held back when the job is opened again.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from enum import Enum

from ocmm_core.inspection.evaluation._view import JobView
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobEvent
from ocmm_core.tolerances.decisions import CharacteristicResult, not_proven


class HoldReason(Enum):
    """What points are held back for, and so what lets them count again.

    Each has its own kinds of events; their text names the points, then says why:
    ``5,6,7: reason``.
    """

    CAMERAS = (
        "points held back",
        "points released",
        "Verify the calibration. If it passes, the points count again; if not, re-probe them.",
    )
    TIP = (
        "points held back for the tip",
        "points released for the tip",
        "Run the quick tip check. If it passes, the points count again; if not, re-probe them.",
    )
    FAILED_TIP = (
        "points of a tip that failed",
        "points of a tip that failed, released",
        "Re-probe them.",
    )
    """Nothing releases them: nobody knows since when the tip was wrong."""
    CALIBRATION = (
        "points held back for the calibration",
        "points released for the calibration",
        "Verify the calibration. If it passes, the points count again; if not, recall the jobs.",
    )
    """By the history of the calibration; what the monitor saw in the job itself is `CAMERAS`."""
    FAILED_CALIBRATION = (
        "points of a calibration that failed",
        "points of a calibration that failed, released",
        "Recall the jobs (ocmm recall) and re-probe the points it does not release.",
    )
    """Only a recall releases them: nobody knows since when the cameras were wrong."""

    def __init__(self, held: str, released: str, remedy: str) -> None:
        self.held = held
        self.released = released
        self.remedy = remedy


def event_text(numbers: Collection[int], reason: str) -> str:
    """Return the text of an event about points."""
    return f"{','.join(str(number) for number in sorted(numbers))}: {reason}"


def held_back(
    events: Sequence[JobEvent], hold_reason: HoldReason = HoldReason.CAMERAS
) -> dict[int, str]:
    """Return the points that are held back after these events, oldest first, and why each is."""
    held: dict[int, str] = {}
    for event in events:
        if event.kind not in (hold_reason.held, hold_reason.released):
            continue
        names, _, reason = event.text.partition(": ")
        for name in names.split(","):
            if event.kind == hold_reason.held:
                held[int(name)] = reason
            else:
                held.pop(int(name), None)
    return held


def notes_of(held: Mapping[HoldReason, Mapping[int, str]]) -> dict[int, str]:
    """Return for every point that is held back why, and what to do."""
    notes: dict[int, str] = {}
    # What nothing releases is told first.
    for hold_reason in reversed(HoldReason):
        for number, reason in held[hold_reason].items():
            notes.setdefault(number, f"{reason} {hold_reason.remedy}")
    return notes


def feature_note(feature: str, points: Sequence[MeasuredPoint], held: Mapping[int, str]) -> str:
    """Return why points of a feature prove nothing, and what to do; empty where all count."""
    numbers = [p.number for p in points if p.feature == feature and p.number in held]
    if not numbers:
        return ""
    count = "1 point" if len(numbers) == 1 else f"{len(numbers)} points"
    return f"{count} of {feature} held back. {held[numbers[0]]}"


def held_below(result: CharacteristicResult, plan: Plan, view: JobView) -> tuple[int, ...]:
    """Return the numbers of the points that are held back and that a result rests on."""
    item = next((item for item in plan.characteristics if item.name == result.name), None)
    names = result.features if item is None else plan.rests_on(item)
    return tuple(
        point.number
        for feature in view.features
        if feature.name in names
        for point in feature.points
        if point.number in view.held
    )


def with_doubt(
    result: CharacteristicResult,
    plan: Plan,
    points: Sequence[MeasuredPoint],
    held: Mapping[int, str],
) -> CharacteristicResult:
    """Return a result, NOT PROVEN where it rests on points that are held back."""
    if not held:
        return result
    item = next(item for item in plan.characteristics if item.name == result.name)
    features = plan.rests_on(item)
    notes = [note for name in features if (note := feature_note(name, points, held))]
    return not_proven(result, notes[0]) if notes else result
