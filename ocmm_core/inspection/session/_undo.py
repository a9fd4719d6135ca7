"""Steps of the inspector, for undo and redo, also after a restart.

A step is written together with its changes, as an event of the job file, so that both are durable
or none.
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

Way = Literal["did", "undid", "redid"]
"""A step was done; the last one was undone; the last undone one was redone."""


@dataclass(frozen=True, slots=True)
class UndoStep:
    words: str
    change: Change
    before: Progress
    after: Progress
    """`before`, `after`: Progress."""

    def undone_by(self, change: Change) -> UndoStep:
        """Return the step of this change of points, which undoes this one."""
        return UndoStep(self.words, change, self.after, self.before)


class UndoHistory:
    """Steps of a job, newest last, and undone ones."""

    def __init__(self) -> None:
        self._done: list[UndoStep] = []
        self._undone: list[UndoStep] = []

    @property
    def last(self) -> UndoStep | None:
        """Return the step that an undo would revert."""
        return self._done[-1] if self._done else None

    @property
    def last_undone(self) -> UndoStep | None:
        """Return the undo that a redo would revert."""
        return self._undone[-1] if self._undone else None

    def did(self, step: UndoStep) -> None:
        """Add a new step; undone ones can no longer be redone."""
        self._done.append(step)
        self._undone.clear()

    def undid(self, reverse: UndoStep) -> None:
        """Note that the last step was undone by ``reverse``."""
        if self._done:
            self._done.pop()
        self._undone.append(reverse)

    def redid(self, reverse: UndoStep) -> None:
        """Note that the last undo was reverted by ``reverse``."""
        self._undone.pop()
        self._done.append(reverse)


class _Written(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A step as stored."""

    way: Way
    words: str
    added: tuple[int, ...]
    removed: tuple[int, ...]
    before: WrittenProgress
    after: WrittenProgress | None
    """`way`, `words`, `added`, `removed`, `before`, `after`: See `Way` and `UndoStep`; ``after`` is
    None if the progress is unchanged."""
    next_number: int
    """Of the first point after this step."""


def deed_event(way: Way, step: UndoStep, next_number: int) -> tuple[str, str]:
    """Return the event, kind and text, of a step.

    `step`: of an undo, the reverse step. `next_number`: of the next point before this step.
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
    """Return the steps of a job that can be undone or redone.

    Empty if the points differ from the result of the steps: then a program without such events has
    continued the job, and the last step is unknown. `events`: oldest first. `names`: all features,
    in the order of the plan. `counting`: numbers of the points that count.
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
