"""What the inspector did, as events of the job file: an undo knows it also after a restart.

A step is written together with what it changed, so that both are durable or none.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Literal

import msgspec

from ocmm_core.inspection.evaluation import WrittenProgress, progress_from
from ocmm_core.inspection.session._job_points import Change
from ocmm_core.inspection.session._undo import UndoHistory, UndoStep
from ocmm_core.storage import JobEvent, event_value

EVENT = "step"
"""Kind of the event of the job file."""

Way = Literal["did", "undid", "redid"]
"""A step was done; the last one was taken back; the last one that was taken back was done again."""


class _Written(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A step as it is written down.

    Attributes
    ----------
    way, words, added, removed, before, after
        See `Way` and `UndoStep`; ``after`` is None where the job stood as before.
    next_number
        Of the point that comes after this step.
    """

    way: Way
    words: str
    added: tuple[int, ...]
    removed: tuple[int, ...]
    before: WrittenProgress
    after: WrittenProgress | None
    next_number: int


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
    events: Sequence[JobEvent],
    names: tuple[str, ...],
    counting: Collection[int],
    next_number: int,
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
    next_number
        Of the next point.

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
