"""Current state of a job: its points, its progress, and its cached view."""

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
    """Placeholder of a view under computation, valid while nothing changes."""


class JobLedger:
    """Points and progress of a job, shared by the parts of a session; callers hold its lock."""

    def __init__(self, plan: Plan, job: JobFile) -> None:
        self.plan = plan
        self.job = job
        self.lock = threading.RLock()
        self.log = StepLog(plan, job)
        self.points = self.log.points
        pauses = [event.kind for event in job.events() if event.kind in (PAUSED, RESUMED)]
        self.paused = pauses[-1:] == [PAUSED]
        self.selected = ""
        """Feature selected by the inspector, while active."""
        self.looked_at = ""
        """Feature under review; changes nothing."""
        self.refusal: Refusal | None = None
        """Of the last touch, until a step is carried out."""
        self.cache = EvaluationCache()
        """Results computed from the points; needs no lock."""
        self.view: JobView | UnderWay | None = None
        """The cached view; set to None by every change."""

    @property
    def progress(self) -> Progress:
        return self.log.progress

    def stand(self, after: Progress) -> None:
        """Change the progress without an undo step."""
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
        self.log.do(words, after, annul, restore, events)
        self.changed()

    def changed(self) -> None:
        """Reset the state of the last touch after a step."""
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
