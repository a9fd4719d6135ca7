"""Points and progress of a job, changed together, durable, with undo.

A step changes the valid points and the progress. Both go into the job file together with the step
itself, so that a reopened job is in the state before the step or after it, and knows its undo
steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import STANDING_EVENT, Progress, progress_of
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._job_points import FLIPPED, Change, JobPoints
from ocmm_core.inspection.session._undo import UndoStep, Way, deed_event, deeds_from
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile
from ocmm_core.tracking import TipSensitivity

_UNDONE = "undone by the operator"


class StepLog:
    """Carry out and undo steps; callers hold a lock.

    Every method raises StorageError, without a change, if the step could not be made durable.
    """

    def __init__(self, plan: Plan, job: JobFile) -> None:
        events = job.events()
        self.points = JobPoints(job)
        self.progress = progress_of(plan, self.points.counts(), events)
        self._deeds = deeds_from(
            events,
            self.progress.names,
            {point.number for point in self.points.counting},
            self.points.next_number(),
        )

    @property
    def last(self) -> UndoStep | None:
        """Return the step that `undo` reverts."""
        return self._deeds.last or self._last_point()

    @property
    def last_undone(self) -> UndoStep | None:
        """Return the step that `redo` repeats."""
        return self._deeds.last_undone

    def take(
        self, point: MeasuredPoint, sensitivity: TipSensitivity, before: Progress, after: Progress
    ) -> None:
        """Add a new point.

        `before`, `after`: progress after undoing the point, and with it.
        """
        change = Change((point.number,), ())
        step = UndoStep(f"point {point.number} of {point.feature}", change, before, after)
        self.points.add(point, sensitivity, self._events_of(step))
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
        after: Progress,
        annul: Mapping[int, str] = MappingProxyType({}),
        restore: Sequence[int] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Carry out a step without a new point.

        `words`: for the undo button. `after`: new progress. `annul`, `restore`: points to delete,
        each for its reason, and to restore. `events`: written with it.
        """
        step = UndoStep(words, self.points.planned(annul, restore), self.progress, after)
        self.points.change(annul, restore, [*events, *self._events_of(step)])
        self._remember(step)

    def stand(self, after: Progress) -> None:
        """Change the progress without an undo step."""
        self.points.change({}, (), self._status_events(after))
        self.progress = after

    def undo(self) -> None:
        """Undo the last step: a point, a deletion, a skip; MeasuringError if there is none.

        Nothing leaves the job file.
        """
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
        """Return the events of a step: itself, and the new progress."""
        return [deed_event(way, step, self.points.next_number()), *self._status_events(step.after)]

    def _status_events(self, after: Progress) -> list[tuple[str, str]]:
        return [(STANDING_EVENT, after.text)] if after != self.progress else []

    def _reverse(self, step: UndoStep, word: str, way: Way) -> UndoStep:
        """Revert a step, and return the reverse step."""
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
        """Return the last point as a step, for a job without stored steps."""
        if not self.points.counting:
            return None
        last = self.points.counting[-1]
        return UndoStep(
            f"point {last.number} of {last.feature}",
            Change((last.number,), ()),
            self.progress.opened(last.feature),
            self.progress,
        )
