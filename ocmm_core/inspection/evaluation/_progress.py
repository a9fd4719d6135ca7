"""How far a job has come: which features are done or skipped, and which one is next.

The points alone do not say it: an inspector finishes a feature with fewer points, skips one, or
opens one again. Every such decision is kept in the job file as an event `STANDING_EVENT`, so that
the job goes on where it was when it is opened again.
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
"""Kinds of events of the job file."""


class WrittenProgress(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A standing as it is written down; the fields are those of `Progress`."""

    done: list[str]
    skipped: list[str]
    active: str
    probing: Literal["plan", "any"]
    methods: dict[str, str] = msgspec.field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a job stands."""

    names: tuple[str, ...]
    """All features, in the order of the plan."""
    active: str = ""
    """Feature that takes the next point; empty where none does."""
    done: frozenset[str] = frozenset()
    skipped: frozenset[str] = frozenset()
    """`done`, `skipped`: Features that have what they need, and those that were left out."""
    probing: Probing = "plan"
    """In the order of the plan, or in any."""
    methods: Mapping[str, str] = field(default_factory=dict)
    """Compensation (`measuring.compensation.METHODS`) of features where the inspector has chosen
    another one than the plan."""

    def advanced(self) -> Progress:
        """Return it with the next feature active: the first one after the active that is open."""
        start = self.names.index(self.active) if self.active in self.names else 0
        order = (*self.names[start:], *self.names[:start])
        if self.active not in self.skipped:
            order = self.names
        settled = self.done | self.skipped
        return replace(self, active=next((name for name in order if name not in settled), ""))

    def finished(self, name: str) -> Progress:
        """Return it with a feature done; the next one becomes active if that was."""
        changed = replace(self, done=self.done | {name}, skipped=self.skipped - {name})
        return changed.advanced() if name == self.active or not self.active else changed

    def left_out(self, name: str) -> Progress:
        """Return it with a feature skipped; the next one becomes active if that was."""
        changed = replace(self, done=self.done - {name}, skipped=self.skipped | {name})
        return changed.advanced() if name == self.active else changed

    def opened(self, name: str) -> Progress:
        """Return it with a feature active that takes points again."""
        return replace(self, active=name, done=self.done - {name}, skipped=self.skipped - {name})

    def reopened(self, name: str) -> Progress:
        """Return it with a feature that takes points again; active where no other is.

        One that was skipped stays so: who takes a point out of it has not opened it again.
        """
        changed = replace(self, done=self.done - {name})
        if changed.active or name in self.skipped:
            return changed
        return replace(changed, active=name)

    @property
    def written(self) -> WrittenProgress:
        """Return it as it is written down."""
        return WrittenProgress(
            sorted(self.done), sorted(self.skipped), self.active, self.probing, dict(self.methods)
        )

    @property
    def text(self) -> str:
        """Return the text of the event."""
        return msgspec.json.encode(self.written).decode()


def progress_from(written: WrittenProgress, names: tuple[str, ...]) -> Progress:
    """Return what was written down, for the features of a plan."""
    return Progress(
        names,
        written.active if written.active in names else "",
        frozenset(written.done) & set(names),
        frozenset(written.skipped) & set(names),
        written.probing,
        {name: method for name, method in written.methods.items() if method in METHODS},
    )


def progress_of(plan: Plan, counts: Mapping[str, int], events: Sequence[JobEvent]) -> Progress:
    """Return where a job stands after its points and events.

    Parameters
    ----------
    counts
        How many points each feature has.
    """
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
        # What is written knows of features that were reopened with all their points.
        or (not written and counts.get(feature.name, 0) >= feature.points)
    }
    found = replace(start, done=frozenset(done), skipped=start.skipped - done)
    if found.active and found.active not in found.done | found.skipped:
        return found
    return found.advanced()


def open_plan(plan: Plan, job: JobFile) -> Plan:
    """Return what is left of a plan after the points of a job: features with missing points."""
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
