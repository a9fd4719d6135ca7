"""What an inspector decides while a job is measured: every step durable, and to be taken back."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from ocmm_core.errors import MeasuringError
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.inspection.evaluation import PAUSED, RESUMED, JobView, Probing, Progress
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._side_choice import awaits_pull, chosen_methods, method_of
from ocmm_core.inspection.session._step_log import StepLog
from ocmm_core.measuring import Refusal
from ocmm_core.storage import JobFile

_LONGEST_REASON = 200


class UnderWay:
    """Stands in for a view that somebody computes, as long as nothing has changed meanwhile."""


class JobSteps:
    """Keep the points and the progress of a job, and every step that changed them.

    Parameters
    ----------
    plan
        What is measured.
    job
        Holds what was done before.
    """

    def __init__(self, plan: Plan, job: JobFile) -> None:
        self._plan = plan
        self._job = job
        self._lock = threading.RLock()
        self._log = StepLog(plan, job)
        self._points = self._log.points
        events = job.events()
        pauses = [event.kind for event in events if event.kind in (PAUSED, RESUMED)]
        self._paused = pauses[-1:] == [PAUSED]
        self._selected = ""
        """Feature that the inspector chose and that is still active."""
        self._looked_at = ""
        """Feature that the inspector looks back at; that changes nothing."""
        self._refusal: Refusal | None = None
        self._view: JobView | UnderWay | None = None
        """The view as far as it is known; whoever changes the job sets it to None."""

    def undo(self) -> None:
        """Take back the last step, also one of an earlier run; errors as `StepLog.undo`."""
        with self._lock:
            self._log.undo()
            self._changed()

    def redo(self) -> None:
        """Do again what was undone last; errors as `StepLog.redo`."""
        with self._lock:
            self._log.redo()
            self._changed()

    def flip(self, number: int | None = None) -> None:
        """Turn the compensation of a point, or of the last one, to the other side.

        Raises
        ------
        MeasuringError
            There is no such point.
        """
        with self._lock:
            if not self._points.counting:
                raise MeasuringError(
                    "session.no_point", "No point was taken yet.", "Take one first."
                )
            old = self._points.counting[-1] if number is None else self._points.point(number)
            new = replace(
                old,
                number=self._points.next_number(),
                direction=-old.direction,
                approach="flipped",
            )
            self._log.flip(old, new)
            self._changed()

    def delete_point(self, number: int, reason: str) -> None:
        """Take a point out, and say why; its observation stays in the job file.

        The feature is fitted without it. It takes points again where it has fewer than the plan
        wants; `finish` accepts it with fewer.

        Raises
        ------
        MeasuringError
            There is no such point, or no reason is given.
        """
        with self._lock:
            feature = self._points.point(number).feature
            self._did(
                f"deletion of point {number}",
                self._settled(feature, -1),
                annul={number: _checked_reason(reason)},
            )

    def restore_point(self, number: int) -> None:
        """Put a deleted point back, with a new number.

        Raises
        ------
        MeasuringError
            The point was not deleted, or is back already.
        """
        with self._lock:
            feature = self._points.taken_out(number).feature
            self._did(f"restoring of point {number}", self._settled(feature, 1), restore=[number])

    def skip(self, name: str = "") -> None:
        """Leave a feature, or the active one, out; what rests on it is not measured.

        Raises
        ------
        MeasuringError
            There is no such feature, or none is active.
        """
        with self._lock:
            name = self._known(name or self._require_active())
            self._did(
                f"skipping of {name}", self._progress.left_out(name), events=[("skipped", name)]
            )

    def repeat(self, name: str = "") -> None:
        """Measure a feature, or the active one, anew: all its points are taken out.

        Raises
        ------
        MeasuringError
            There is no such feature, or none is active.
        """
        with self._lock:
            name = self._known(name or self._require_active())
            numbers = [point.number for point in self._points.of(name)]
            self._did(
                f"repeating of {name}",
                self._progress.opened(name),
                annul=dict.fromkeys(numbers, f"{name} is measured anew"),
                events=[("repeated", name)],
            )
            self._selected = name

    def finish(self) -> None:
        """Accept the active feature with the points it has and go to the next one.

        Raises
        ------
        MeasuringError
            No feature is active, or it has fewer points than its shape needs.
        """
        with self._lock:
            feature = self._plan.feature(self._require_active())
            minimum, count = MINIMUM_POINTS[feature.shape], self._points.count(feature.name)
            if count < minimum:
                raise MeasuringError(
                    "session.too_few",
                    f"{feature.name} has {count} of the {minimum} points that a "
                    f"{feature.shape.value.lower()} needs.",
                    f"Take {minimum - count} more.",
                )
            self._did(
                f"finishing of {feature.name}",
                self._progress.finished(feature.name),
                events=[("finished", f"{feature.name} with {count} points")],
            )

    def select(self, name: str) -> None:
        """Look at a feature; one that still takes points also gets the next touch.

        A feature that is done or skipped is looked at and stays what it is: no verdict and no count
        changes. `reopen` is the step that lets it take points again. An empty name looks at the
        feature that is probed again.

        Raises
        ------
        MeasuringError
            The plan has no feature of that name.
        """
        with self._lock:
            progress = self._progress
            if name and self._known(name) not in progress.done | progress.skipped:
                if name != progress.active:
                    self._stand(replace(progress, active=name))
                self._selected, self._looked_at = name, ""
            else:
                self._looked_at = name

    def reopen(self, name: str = "") -> None:
        """Let a feature that is done or skipped, or the one looked at, take points again.

        Raises
        ------
        MeasuringError
            There is no such feature, none is looked at, or it takes points already.
        """
        with self._lock:
            name = self._known(name or self._looked_at or self._require_active())
            if name not in self._progress.done | self._progress.skipped:
                raise MeasuringError(
                    "session.open", f"{name} is open: it takes points.", "Touch it."
                )
            self._did(
                f"reopening of {name}", self._progress.opened(name), events=[("reopened", name)]
            )
            self._selected = name

    def set_order(self, probing: Probing) -> None:
        """Probe in the order of the plan, or in any: the feature that is touched is then found.

        Before the part frame is known, which says where the features are, the order of the plan
        holds in any case.
        """
        with self._lock:
            self._stand(replace(self._progress, probing=probing))

    def _stand(self, after: Progress) -> None:
        self._log.stand(after)
        self._view = None

    def _did(
        self,
        words: str,
        after: Progress,
        annul: Mapping[int, str] = MappingProxyType({}),
        restore: Sequence[int] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        self._log.do(words, after, annul, restore, events)
        self._changed()

    def pause(self) -> None:
        """Take no points until `resume`, whatever is touched; also when the job is opened anew."""
        with self._lock:
            if not self._paused:
                self._job.append_event(PAUSED, "by the operator")
                self._paused, self._view = True, None

    def resume(self) -> None:
        """Take points again."""
        with self._lock:
            if self._paused:
                self._job.append_event(RESUMED, "by the operator")
                self._paused, self._view = False, None

    def go_on(self, operator: str) -> None:
        """Go on with a job that was begun earlier, and note who does."""
        with self._lock:
            self._job.append_event("gone on", f"by {operator}")
            self.resume()

    @property
    def paused(self) -> bool:
        """Return whether touches are refused until `resume`."""
        return self._paused

    def missing(self) -> list[tuple[str, int]]:
        """Return the features that are not done and how many points each still needs."""
        with self._lock:
            settled = self._progress.done | self._progress.skipped
            return [
                (feature.name, max(feature.points - self._points.count(feature.name), 0))
                for feature in self._plan.features
                if feature.name not in settled
            ]

    def set_compensation(self, method: str, name: str = "") -> None:
        """Find the side of a feature, or of all that allow it, in another way from now on.

        Parameters
        ----------
        method
            One of `measuring.compensation.METHODS`.
        name
            Of the feature; empty for all.

        Raises
        ------
        MeasuringError
            There is no such feature or way, or the way says nothing about its shape.
        """
        with self._lock:
            known = self._known(name) if name else ""
            chosen = chosen_methods(self._plan, self._progress, method, known)
            self._stand(replace(self._progress, methods=chosen))

    def compensation_of(self, name: str) -> str:
        """Return how the side of a feature is found now; MeasuringError if there is none."""
        return method_of(self._plan, self._progress, self._known(name))

    @property
    def awaits_pull(self) -> bool:
        """Return whether the ball is followed while it is pulled away after a touch."""
        with self._lock:
            return awaits_pull(self._plan, self._progress)

    @property
    def _progress(self) -> Progress:
        return self._log.progress

    def _changed(self) -> None:
        """Note that a step was carried out: whatever was said before it is of the past."""
        self._refusal = self._view = None
        self._looked_at = ""
        if self._selected != self._progress.active:
            self._selected = ""

    def _settled(self, name: str, more: int) -> Progress:
        """Return the progress after ``more`` points of a feature."""
        if self._points.count(name) + more >= self._plan.feature(name).points:
            return self._progress.finished(name)
        return self._progress.reopened(name)

    def _require_active(self) -> str:
        if not self._progress.active:
            raise MeasuringError(
                "session.complete",
                "Every feature of the plan is measured.",
                "Write the report, or reopen a feature to add points.",
            )
        return self._progress.active

    def _known(self, name: str) -> str:
        if name not in self._progress.names:
            raise MeasuringError(
                "session.feature",
                f"The plan has no feature called {name!r}.",
                "Select one of the features in the list.",
            )
        return name


def _checked_reason(reason: str) -> str:
    """Return the reason of a deletion on one line; MeasuringError where there is none."""
    line = " ".join(reason.split())[:_LONGEST_REASON]
    if not line or not line.isprintable():
        raise MeasuringError(
            "session.no_reason",
            "A point is only deleted with a reason.",
            "Say in some words why it does not belong to the feature.",
        )
    return line
