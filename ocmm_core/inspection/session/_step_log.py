"""The points and the progress of a job, changed together, durable, and to be taken back.

A step changes which points count and where the job stands. Both go into the job file together with
the step itself, so that whatever happens between, a reopened job is as it was before the step or
after it, and knows what an undo takes back.
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
    """Carry out steps and take them back; whoever uses it holds a lock.

    Every method raises StorageError where the step could not be made durable; nothing is changed
    then.

    Parameters
    ----------
    plan
        What is measured.
    job
        Holds what was done before.
    """

    def __init__(self, plan: Plan, job: JobFile) -> None:
        events = job.events()
        self.points = JobPoints(job)
        """The points of the job."""
        self.progress = progress_of(plan, self.points.counts(), events)
        """Where it stands."""
        self._deeds = deeds_from(
            events,
            self.progress.names,
            {point.number for point in self.points.counting},
            self.points.next_number(),
        )

    @property
    def last(self) -> UndoStep | None:
        """Return what `undo` takes back."""
        return self._deeds.last or self._last_point()

    @property
    def last_undone(self) -> UndoStep | None:
        """Return what `redo` does again."""
        return self._deeds.last_undone

    def take(
        self, point: MeasuredPoint, sensitivity: TipSensitivity, before: Progress, after: Progress
    ) -> None:
        """Add a new point.

        Parameters
        ----------
        before, after
            Where the job stands when the point is taken back, and with it.
        """
        change = Change((point.number,), ())
        step = UndoStep(f"point {point.number} of {point.feature}", change, before, after)
        self.points.add(point, sensitivity, self._events_of(step))
        self._remember(step)

    def flip(self, old: MeasuredPoint, new: MeasuredPoint) -> None:
        """Put a point in the place of one whose side was wrong."""
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
        """Carry out a step that takes no new point.

        Parameters
        ----------
        words
            What it is, for the button that takes it back.
        after
            Where the job stands then.
        annul, restore
            Points that it takes out, each for its reason, and puts back.
        events
            What else is written with it.
        """
        step = UndoStep(words, self.points.planned(annul, restore), self.progress, after)
        self.points.change(annul, restore, [*events, *self._events_of(step)])
        self._remember(step)

    def stand(self, after: Progress) -> None:
        """Let the job stand elsewhere; that is no step, and an undo does not know of it."""
        self.points.change({}, (), self._status_events(after))
        self.progress = after

    def undo(self) -> None:
        """Take back the last step: a point, a deletion, a skip; nothing leaves the job file.

        Raises
        ------
        MeasuringError
            There is nothing to take back.
        """
        step = self.last
        if step is None:
            raise MeasuringError("session.no_point", "No points taken yet.", "Take one first.")
        self._deeds.undid(self._reverse(step, "undone", "undid"))

    def redo(self) -> None:
        """Do again what was undone last.

        Raises
        ------
        MeasuringError
            Nothing was undone since the last step.
        """
        step = self._deeds.last_undone
        if step is None:
            raise MeasuringError("session.no_redo", "Nothing was undone.", "Undo something first.")
        self._deeds.redid(self._reverse(step, "done again", "redid"))

    def _remember(self, step: UndoStep) -> None:
        self._deeds.did(step)
        self.progress = step.after

    def _events_of(self, step: UndoStep, way: Way = "did") -> list[tuple[str, str]]:
        """Return what is written with a step: itself, and where the job stands then."""
        return [deed_event(way, step, self.points.next_number()), *self._status_events(step.after)]

    def _status_events(self, after: Progress) -> list[tuple[str, str]]:
        return [(STANDING_EVENT, after.text)] if after != self.progress else []

    def _reverse(self, step: UndoStep, word: str, way: Way) -> UndoStep:
        """Take a step back, and return the one that this was."""
        # A point in the place of another has the same observation: it is not to come back twice.
        reason = FLIPPED if step.change.added and step.change.removed else _UNDONE
        annul = {self.points.latest(number): reason for number in step.change.added}
        restore = [self.points.latest(number) for number in step.change.removed]
        reverse = step.undone_by(self.points.planned(annul, restore))
        events = [(word, step.words), *self._events_of(reverse, way)]
        self.points.change(annul, restore, events)
        self.progress = reverse.after
        return reverse

    def _last_point(self) -> UndoStep | None:
        """Return the taking of the last point as a step, of a job whose steps are not known."""
        if not self.points.counting:
            return None
        last = self.points.counting[-1]
        return UndoStep(
            f"point {last.number} of {last.feature}",
            Change((last.number,), ()),
            self.progress.opened(last.feature),
            self.progress,
        )
