"""What a job is by now: its points, its progress, and what is known of its view."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import PAUSED, RESUMED, EvaluationCache, JobView, Progress
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session._step_log import StepLog
from ocmm_core.measuring import Refusal
from ocmm_core.storage import JobFile


class UnderWay:
    """Stands in for a view that somebody computes, as long as nothing has changed meanwhile."""


class JobLedger:
    """Keep the points and the progress of a job; shared by the parts of a session.

    Whoever uses it holds its lock.

    Parameters
    ----------
    plan
        What is measured.
    job
        Holds what was done before.
    """

    def __init__(self, plan: Plan, job: JobFile) -> None:
        self.plan = plan
        self.job = job
        self.lock = threading.RLock()
        self.log = StepLog(plan, job)
        self.points = self.log.points
        pauses = [event.kind for event in job.events() if event.kind in (PAUSED, RESUMED)]
        self.paused = pauses[-1:] == [PAUSED]
        """No points are taken, whatever is touched."""
        self.selected = ""
        """Feature that the inspector chose and that is still active."""
        self.looked_at = ""
        """Feature that the inspector looks back at; that changes nothing."""
        self.refusal: Refusal | None = None
        """Of the last touch, until a step is carried out."""
        self.cache = EvaluationCache()
        """What was computed of the points, for whoever computes from them; it needs no lock."""
        self.view: JobView | UnderWay | None = None
        """The view as far as it is known; whoever changes the job sets it to None."""

    @property
    def progress(self) -> Progress:
        """Return which features are done, and which one is active."""
        return self.log.progress

    def stand(self, after: Progress) -> None:
        """Stand somewhere else from now on; that is no step that could be taken back."""
        self.log.stand(after)
        self.view = None

    def did(
        self,
        words: str,
        after: Progress,
        annul: Mapping[int, str] = MappingProxyType({}),
        restore: Sequence[int] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Carry out a step; see `StepLog.do`."""
        self.log.do(words, after, annul, restore, events)
        self.changed()

    def changed(self) -> None:
        """Note that a step was carried out: whatever was said before it is of the past."""
        self.refusal = self.view = None
        self.looked_at = ""
        if self.selected != self.progress.active:
            self.selected = ""

    def settled(self, name: str, more: int) -> Progress:
        """Return the progress after ``more`` points of a feature."""
        if self.points.count(name) + more >= self.plan.feature(name).points:
            return self.progress.finished(name)
        return self.progress.reopened(name)

    def require_active(self) -> str:
        """Return the active feature; MeasuringError where every feature is measured."""
        if not self.progress.active:
            raise MeasuringError(
                "session.complete",
                "Every feature of the plan is measured.",
                "Write the report, or reopen a feature to add points.",
            )
        return self.progress.active

    def known(self, name: str) -> str:
        """Return the name of a feature; MeasuringError where the plan has none of it."""
        if name not in self.progress.names:
            raise MeasuringError(
                "session.feature",
                f"The plan has no feature named {name!r}.",
                "Select one of the features in the list.",
            )
        return name
