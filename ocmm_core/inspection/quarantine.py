"""Points that are held back: stored and shown, but proving nothing until they are released.

Where the calibration came into doubt while a job was measured, the points since the last good check
may be wrong. Which ones follows from the events of the job file alone, so that they stay held back
when the job is opened again.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.storage.rows import JobEvent
from ocmm_core.tolerances.decision import not_proven
from ocmm_core.tolerances.evaluate import involved_features
from ocmm_core.tolerances.result import CharacteristicResult

HELD, RELEASED = "points held back", "points released"
"""Kinds of events; the text names the points, then says why: ``5,6,7: reason``."""

_REMEDY = "Verify the calibration; if it passes they count again, else take them again."


def event_text(numbers: Collection[int], reason: str) -> str:
    """Return the text of an event about points."""
    return f"{','.join(str(number) for number in sorted(numbers))}: {reason}"


def held_back(events: Sequence[JobEvent]) -> dict[int, str]:
    """Return the points that are held back after these events, oldest first, and why each is."""
    held: dict[int, str] = {}
    for event in events:
        if event.kind not in (HELD, RELEASED):
            continue
        names, _, reason = event.text.partition(": ")
        for name in names.split(","):
            if event.kind == HELD:
                held[int(name)] = reason
            else:
                held.pop(int(name), None)
    return held


def feature_note(feature: str, points: Sequence[MeasuredPoint], held: Mapping[int, str]) -> str:
    """Return why points of a feature prove nothing, and what to do; empty where all count."""
    numbers = [p.number for p in points if p.feature == feature and p.number in held]
    if not numbers:
        return ""
    count = "1 point" if len(numbers) == 1 else f"{len(numbers)} points"
    return f"{count} of {feature} held back. {held[numbers[0]]} {_REMEDY}"


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
    features = list(involved_features(item, plan.alignment))
    # What is projected onto a plane rests on it, too.
    features += [plane for name in features if (plane := plan.feature(name).projection)]
    notes = [note for name in features if (note := feature_note(name, points, held))]
    return not_proven(result, notes[0]) if notes else result
