"""What the inspector did, so that it can be taken back and done again, also after a restart.

A step is written together with what it changed, as an event of the job file, so that both are
durable or none.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import msgspec

from ocmm_core.inspection.evaluation import Progress, WrittenProgress, progress_from
from ocmm_core.inspection.session._job_points import Change
from ocmm_core.storage import JobEvent, event_value

EVENT = "step"
"""Kind of the event of the job file."""

Way = Literal["did", "undid", "redid"]
"""A step was done; the last one was taken back; the last one that was taken back was done again."""


@dataclass(frozen=True, slots=True)
class UndoStep:
    """One step of the inspector."""

    words: str
    """What it was, for the button that takes it back."""
    change: Change
    """Points that it added and took out."""
    before: Progress
    after: Progress
    """`before`, `after`: Where the job stood."""

    def undone_by(self, change: Change) -> UndoStep:
        """Return the deed that this change of points was: it takes this one back."""
        return UndoStep(self.words, change, self.after, self.before)


class UndoHistory:
    """The steps of a job, newest last, and those that were taken back."""

    def __init__(self) -> None:
        self._done: list[UndoStep] = []
        self._undone: list[UndoStep] = []

    @property
    def last(self) -> UndoStep | None:
        """Return the deed that an undo would take back."""
        return self._done[-1] if self._done else None

    @property
    def last_undone(self) -> UndoStep | None:
        """Return the undo that a redo would take back."""
        return self._undone[-1] if self._undone else None

    def did(self, step: UndoStep) -> None:
        """Remember a new step; what was undone before it cannot be done again."""
        self._done.append(step)
        self._undone.clear()

    def undid(self, reverse: UndoStep) -> None:
        """Remember that the last step was taken back by ``reverse``."""
        if self._done:
            self._done.pop()
        self._undone.append(reverse)

    def redid(self, reverse: UndoStep) -> None:
        """Remember that the last undo was taken back by ``reverse``."""
        self._undone.pop()
        self._done.append(reverse)


class _Written(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A step as it is written down."""

    way: Way
    words: str
    added: tuple[int, ...]
    removed: tuple[int, ...]
    before: WrittenProgress
    after: WrittenProgress | None
    """`way`, `words`, `added`, `removed`, `before`, `after`: See `Way` and `UndoStep`; ``after`` is
    None where the job stood as before."""
    next_number: int
    """Of the point that comes after this step."""


def deed_event(way: Way, step: UndoStep, next_number: int) -> tuple[str, str]:
    """Return the event, kind and text, of a step.

    Parameters
    ----------
    step
        What changes with it; of an undo the step that takes the other one back.
    next_number
        Number of the next point before this step.
    """
    written = _Written(
        way,
        step.words,
        step.change.added,
        step.change.removed,
        step.before.written,
        None if step.after == step.before else step.after.written,
        max((next_number, *(number + 1 for number in step.change.added))),
    )
    return EVENT, msgspec.json.encode(written).decode()


def deeds_from(
    events: Sequence[JobEvent], names: tuple[str, ...], counting: Collection[int], next_number: int
) -> UndoHistory:
    """Return the steps of a job that can be taken back or done again.

    Parameters
    ----------
    events
        Of the job file, oldest first.
    names
        All features, in the order of the plan.
    counting
        Numbers of the points that count.

    Returns
    -------
    Deeds
        Without any step where the points are not those that the steps left behind: a program that
        wrote no such events went on with the job, and a step that lies behind that one is not the
        last any more.
    """
    deeds = UndoHistory()
    counts: dict[int, bool] = {}
    expected = next_number
    for event in events:
        if event.kind != EVENT:
            continue
        written = event_value(EVENT, event.text, _Written)
        before = progress_from(written.before, names)
        after = before if written.after is None else progress_from(written.after, names)
        step = UndoStep(written.words, Change(written.added, written.removed), before, after)
        {"did": deeds.did, "undid": deeds.undid, "redid": deeds.redid}[written.way](step)
        counts |= dict.fromkeys(written.removed, False) | dict.fromkeys(written.added, True)
        expected = written.next_number
    same = all((number in counting) == still for number, still in counts.items())
    return deeds if same and expected == next_number else UndoHistory()
