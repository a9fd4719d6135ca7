"""Progress of a job: features done, skipped, and the active one.

An inspector finishes a feature with fewer points, skips one, or reopens one: each decision is an
event `STANDING_EVENT` of the job file, so that a reopened job resumes where it was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import msgspec

from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.inspection.evaluation._view import Probing
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import METHODS
from ocmm_core.storage import JobEvent, JobFile, event_value

STANDING_EVENT = "standing"
PAUSED, RESUMED = "paused", "resumed"


class WrittenProgress(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Stored progress; fields as of `Progress`."""

    done: list[str]
    skipped: list[str]
    active: str
    probing: Literal["plan", "any"]
    methods: dict[str, str] = msgspec.field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Progress:
    names: tuple[str, ...]
    """All features, in the order of the plan."""
    active: str = ""
    """Feature that takes the next point; empty if none."""
    done: frozenset[str] = frozenset()
    skipped: frozenset[str] = frozenset()
    """`done`, `skipped`: Complete features, and omitted ones."""
    probing: Probing = "plan"
    methods: Mapping[str, str] = field(default_factory=dict)
    """Compensation (`measuring.compensation.METHODS`) by the inspector instead of the plan."""

    def advanced(self) -> Progress:
        """Return a copy with the first open feature after the active one active."""
        start = self.names.index(self.active) if self.active in self.names else 0
        order = (*self.names[start:], *self.names[:start])
        if self.active not in self.skipped:
            order = self.names
        settled = self.done | self.skipped
        return replace(self, active=next((name for name in order if name not in settled), ""))

    def finished(self, name: str) -> Progress:
        """Return a copy with a feature done; the next one becomes active if it was."""
        changed = replace(self, done=self.done | {name}, skipped=self.skipped - {name})
        return changed.advanced() if name == self.active or not self.active else changed

    def left_out(self, name: str) -> Progress:
        """Return a copy with a feature skipped; the next one becomes active if it was."""
        changed = replace(self, done=self.done - {name}, skipped=self.skipped | {name})
        return changed.advanced() if name == self.active else changed

    def opened(self, name: str) -> Progress:
        """Return a copy with `name` reopened and active."""
        return replace(self, active=name, done=self.done - {name}, skipped=self.skipped - {name})

    def reopened(self, name: str) -> Progress:
        """Return a copy with a feature reopened (not if skipped), and active if no other is."""
        changed = replace(self, done=self.done - {name})
        if changed.active or name in self.skipped:
            return changed
        return replace(changed, active=name)

    @property
    def written(self) -> WrittenProgress:
        return WrittenProgress(
            sorted(self.done), sorted(self.skipped), self.active, self.probing, dict(self.methods)
        )

    @property
    def text(self) -> str:
        return msgspec.json.encode(self.written).decode()


def progress_from(written: WrittenProgress, names: tuple[str, ...]) -> Progress:
    return Progress(
        names,
        written.active if written.active in names else "",
        frozenset(written.done) & set(names),
        frozenset(written.skipped) & set(names),
        written.probing,
        {name: method for name, method in written.methods.items() if method in METHODS},
    )


def progress_of(plan: Plan, counts: Mapping[str, int], events: Sequence[JobEvent]) -> Progress:
    """Return the progress of a job after its points and events."""
    names = tuple(feature.name for feature in plan.features)
    start, written = Progress(names), False
    for event in reversed(events):
        if event.kind == STANDING_EVENT:
            start = progress_from(event_value(STANDING_EVENT, event.text, WrittenProgress), names)
            written = True
            break
    done = {
        feature.name
        for feature in plan.features
        if (
            feature.name in start.done
            and counts.get(feature.name, 0) >= MINIMUM_POINTS[feature.shape]
        )
        # Stored progress includes complete features that were reopened.
        or (not written and counts.get(feature.name, 0) >= feature.points)
    }
    found = replace(start, done=frozenset(done), skipped=start.skipped - done)
    if found.active and found.active not in found.done | found.skipped:
        return found
    return found.advanced()


def open_plan(plan: Plan, job: JobFile) -> Plan:
    """Return the rest of a plan after the points of a job: features with missing points."""
    names = [point.feature for point in job.points()]
    counts = {name: names.count(name) for name in names}
    progress = progress_of(plan, counts, job.events())
    left = [
        msgspec.structs.replace(feature, points=feature.points - counts.get(feature.name, 0))
        for feature in plan.features
        if feature.name not in progress.done | progress.skipped
        and feature.points > counts.get(feature.name, 0)
    ]
    return msgspec.structs.replace(plan, features=left)
