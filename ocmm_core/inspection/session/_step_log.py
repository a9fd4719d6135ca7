"""Points and progress of a job, changed together, durable, with undo; and its cached view.

Both go into the job file together with the step itself, so that a reopened job is in the state
before the step or after it, and knows its undo steps.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import msgspec

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection import evaluation
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._job_points import FLIPPED, Change, JobPoints
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.storage import JobEvent, JobFile, event_value
from ocmm_core.tracking import TipSensitivity

EVENT = "step"

Way = Literal["did", "undid", "redid"]
"""A step was done; the last one was undone; the last undone one was redone."""


@dataclass(frozen=True, slots=True)
class UndoStep:
    words: str
    change: Change
    before: evaluation.Progress
    after: evaluation.Progress

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
        self._undone.pop()
        self._done.append(reverse)


class _Written(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A step as stored."""

    way: Way
    words: str
    added: tuple[int, ...]
    removed: tuple[int, ...]
    before: evaluation.WrittenProgress
    after: evaluation.WrittenProgress | None
    """See `Way` and `UndoStep`; ``after`` is None if the progress is unchanged."""
    next_number: int
    """Of the first point after this step."""


def deed_event(way: Way, step: UndoStep, next_number: int) -> tuple[str, str]:
    """Return kind and text of a step (of an undo: reversed); ``next_number`` before it."""
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

    Empty if the points differ from their result: a program without such events has continued the
    job. `events`: oldest first. `names`: all features, in the order of the plan. `counting`: points
    that count.
    """
    deeds = UndoHistory()
    counts: dict[int, bool] = {}
    expected = next_number
    for event in events:
        if event.kind != EVENT:
            continue
        written = event_value(EVENT, event.text, _Written)
        before = evaluation.progress_from(written.before, names)
        after = before if written.after is None else evaluation.progress_from(written.after, names)
        step = UndoStep(written.words, Change(written.added, written.removed), before, after)
        {"did": deeds.did, "undid": deeds.undid, "redid": deeds.redid}[written.way](step)
        counts |= dict.fromkeys(written.removed, False) | dict.fromkeys(written.added, True)
        expected = written.next_number
    same = all((number in counting) == still for number, still in counts.items())
    return deeds if same and expected == next_number else UndoHistory()


_UNDONE = "undone by the operator"


class StepLog:
    """Carry out and undo steps; callers hold a lock. StorageError: not durable, no change."""

    def __init__(self, plan: Plan, job: JobFile) -> None:
        events = job.events()
        self.points = JobPoints(job)
        self.progress = evaluation.progress_of(
            plan, Counter(point.feature for point in self.points.counting), events
        )
        self._deeds = deeds_from(
            events,
            self.progress.names,
            {point.number for point in self.points.counting},
            self.points.next_number(),
        )

    @property
    def last(self) -> UndoStep | None:
        return self._deeds.last or self._last_point()

    @property
    def last_undone(self) -> UndoStep | None:
        """Return the step that `redo` repeats."""
        return self._deeds.last_undone

    def add(
        self,
        points: Sequence[MeasuredPoint],
        sensitivities: Sequence[TipSensitivity],
        before: evaluation.Progress,
        after: evaluation.Progress,
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Add the points of a touch or path. `before`, `after`: progress without and with them."""
        first, last = points[0], points[-1]
        words = f"point {first.number} of {first.feature}"
        if last is not first:
            words = f"points {first.number} to {last.number} of {first.feature}"
        change = Change(tuple(point.number for point in points), ())
        step = UndoStep(words, change, before, after)
        self.points.add(points, sensitivities, [*events, *self._events_of(step)])
        self._remember(step)

    def flip(self, old: MeasuredPoint, new: MeasuredPoint) -> None:
        """Replace a point whose side was wrong."""
        change = Change((new.number,), (old.number,))
        step = UndoStep(f"flip of point {old.number}", change, self.progress, self.progress)
        self.points.replace(old, new, FLIPPED, self._events_of(step))
        self._remember(step)

    def do(
        self,
        words: str,
        after: evaluation.Progress,
        annul: Mapping[int, str] = MappingProxyType({}),
        restore: Sequence[int] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Carry out a step without a new point.

        `words`: for the undo button. `annul`: each for its reason. `events`: written with it.
        """
        step = UndoStep(words, self.points.planned(annul, restore), self.progress, after)
        self.points.change(annul, restore, [*events, *self._events_of(step)])
        self._remember(step)

    def stand(self, after: evaluation.Progress) -> None:
        """Change the progress without an undo step."""
        self.points.change({}, (), self._status_events(after))
        self.progress = after

    def undo(self) -> None:
        """Undo the last step, keeping all in the job file; MeasuringError without one."""
        step = self.last
        if step is None:
            raise MeasuringError("session.no_point", "No points taken yet.", "Take one first.")
        self._deeds.undid(self._reverse(step, "undone", "undid"))

    def redo(self) -> None:
        """Redo the last undone step; MeasuringError if nothing was undone since."""
        step = self._deeds.last_undone
        if step is None:
            raise MeasuringError("session.no_redo", "Nothing was undone.", "Undo something first.")
        self._deeds.redid(self._reverse(step, "done again", "redid"))

    def _remember(self, step: UndoStep) -> None:
        self._deeds.did(step)
        self.progress = step.after

    def _events_of(self, step: UndoStep, way: Way = "did") -> list[tuple[str, str]]:
        return [deed_event(way, step, self.points.next_number()), *self._status_events(step.after)]

    def _status_events(self, after: evaluation.Progress) -> list[tuple[str, str]]:
        return [(evaluation.STANDING_EVENT, after.text)] if after != self.progress else []

    def _reverse(self, step: UndoStep, word: str, way: Way) -> UndoStep:
        # A replaced point has the same observation as its successor: it must not return twice.
        reason = FLIPPED if step.change.added and step.change.removed else _UNDONE
        annul = {self.points.latest(number): reason for number in step.change.added}
        restore = [self.points.latest(number) for number in step.change.removed]
        reverse = step.undone_by(self.points.planned(annul, restore))
        events = [(word, step.words), *self._events_of(reverse, way)]
        self.points.change(annul, restore, events)
        self.progress = reverse.after
        return reverse

    def _last_point(self) -> UndoStep | None:
        if not self.points.counting:
            return None
        last = self.points.counting[-1]
        return UndoStep(
            f"point {last.number} of {last.feature}",
            Change((last.number,), ()),
            self.progress.opened(last.feature),
            self.progress,
        )


class UnderWay:
    """Placeholder of a view under computation, valid while nothing changes."""


class JobLedger:
    """Points and progress of a job, shared by the parts of a session; callers hold its lock."""

    def __init__(self, plan: Plan, job: JobFile) -> None:
        self.plan = plan
        self.job = job
        self.lock = threading.RLock()
        self.log = StepLog(plan, job)
        self.points = self.log.points
        pauses = [
            event.kind
            for event in job.events()
            if event.kind in (evaluation.PAUSED, evaluation.RESUMED)
        ]
        self.paused = pauses[-1:] == [evaluation.PAUSED]
        self.selected = ""
        """Feature selected by the inspector, while active."""
        self.looked_at = ""
        """Feature under review; changes nothing."""
        self.refusal: Refusal | None = None
        """Of the last touch, until a step is carried out."""
        self.commanded: evaluation.Target | None = None
        """Point that another program asks for; it replaces the targets of the plan."""
        self.cache = evaluation.EvaluationCache()
        """Results computed from the points; needs no lock."""
        self.view: evaluation.JobView | UnderWay | None = None
        """The cached view; set to None by every change."""

    @property
    def progress(self) -> evaluation.Progress:
        return self.log.progress

    def stand(self, after: evaluation.Progress) -> None:
        """Change the progress without an undo step."""
        self.log.stand(after)
        self.view = None

    def did(
        self,
        words: str,
        after: evaluation.Progress,
        annul: Mapping[int, str] = MappingProxyType({}),
        restore: Sequence[int] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        self.log.do(words, after, annul, restore, events)
        self.changed()

    def changed(self) -> None:
        """Reset the state of the last touch after a step."""
        self.refusal = self.view = None
        self.looked_at = ""
        if self.selected != self.progress.active:
            self.selected = ""

    def obstacle(self, time_s: float, *, interrupted: bool) -> Refusal | None:
        """Return why no touch or path counts now."""
        if self.paused:
            return Refusal(
                RefusalCode.PAUSED,
                "The job is paused.",
                "Resume the job, then touch again.",
                time_s,
            )
        if interrupted:
            return Refusal(
                RefusalCode.GAP,
                "Camera frames were interrupted during the touch.",
                "Touch again when the machine is ready.",
                time_s,
            )
        return None

    def note(self, refusal: Refusal) -> None:
        """Store and show why a touch or path gave no point."""
        self.job.append_event("refused", f"{refusal.code.value}: {refusal.what}")
        self.refusal, self.view, self.looked_at = refusal, None, ""

    def add(
        self,
        points: Sequence[MeasuredPoint],
        sensitivities: Sequence[TipSensitivity],
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Make new points of one feature durable, and finish it if it has enough."""
        name, progress = points[0].feature, self.progress
        before = progress.opened(name)
        follows = progress.active == name or progress.probing == "any"
        after = before if follows else progress
        if self.points.count(name) + len(points) >= self.plan.feature(name).points:
            after = after.finished(name)
        self.log.add(points, sensitivities, before, after, events)
        self.changed()

    def settled(self, name: str, more: int) -> evaluation.Progress:
        """Return the progress after ``more`` points of a feature."""
        if self.points.count(name) + more >= self.plan.feature(name).points:
            return self.progress.finished(name)
        return self.progress.reopened(name)

    def require_active(self) -> str:
        """Return the active feature; MeasuringError if every feature is measured."""
        if not self.progress.active:
            raise MeasuringError(
                "session.complete",
                "Every feature of the plan is measured.",
                "Write the report, or reopen a feature to add points.",
            )
        return self.progress.active

    def known(self, name: str) -> str:
        """Return the name of a feature; MeasuringError if the plan lacks it."""
        if name not in self.progress.names:
            raise MeasuringError(
                "session.feature",
                f"The plan has no feature named {name!r}.",
                "Select one of the features in the list.",
            )
        return name
