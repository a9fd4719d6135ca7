"""What was taken in a pivot calibration: both sweeps, how far they have come, and their gates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime

from ocmm_core.calibration.pivot_conclusion import PivotMaterial, conclude_pivot
from ocmm_core.calibration.pivot_progress import (
    Progress,
    gate_of,
    is_forcible,
    progress_of,
    view_of,
)
from ocmm_core.calibration.pivot_session import (
    FIRST,
    SECOND,
    SWEEPS,
    PivotBegun,
    PosesTaken,
    SweepDiscarded,
    SweepPoses,
)
from ocmm_core.calibration.pivot_steps import apart, second_gate, steps_of
from ocmm_core.calibration.pivot_views import PivotOutcome, SweepPhase, SweepView
from ocmm_core.calibration.pivot_watch import SweepWatch
from ocmm_core.calibration.probe_records import ProbeRecord
from ocmm_core.calibration.procedure import Gate, Step
from ocmm_core.camera.rig import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking.body import ProbeBody


@dataclass(slots=True)
class PivotState:
    """Everything that was taken.

    Attributes
    ----------
    rig, body, begun
        What it is about.
    poses
        Of each sweep.
    last_utc
        When the last ones were taken.
    """

    rig: Rig
    body: ProbeBody
    begun: PivotBegun
    poses: dict[str, SweepPoses] = field(
        default_factory=lambda: {name: SweepPoses() for name in SWEEPS}
    )
    last_utc: str = ""
    _progress: dict[str, Progress] = field(default_factory=dict)

    def add(self, event: PosesTaken | SweepDiscarded) -> None:
        """Take in an observation."""
        self._progress.pop(event.step, None)
        if isinstance(event, SweepDiscarded):
            self.poses[event.step].batches.clear()
        else:
            self.poses[event.step].add(event)
            self.last_utc = max(self.last_utc, event.utc)

    def remove(self, step: str) -> None:
        """Take out the last poses of a sweep."""
        self.poses[step].batches.pop()
        self._progress.pop(step, None)

    def progress(self, step: str) -> Progress:
        """Return how far a sweep has come, computed once for what was taken."""
        known = self._progress.get(step)
        if known is None:
            known = self._progress[step] = progress_of(
                self.rig,
                self.begun.expected(self.body),
                self.poses[step].sweep(self.rig, self.body),
                self.begun.limits(),
                self.begun.expected_tip is not None,
            )
        return known

    def watch(self, step: str) -> SweepWatch:
        """Return what looks at the frames of a sweep from now on."""
        watch = SweepWatch(
            self.rig,
            self.begun.expected(self.body),
            tip_known=self.begun.expected_tip is not None,
            first=self.progress(FIRST) if step == SECOND else None,
        )
        if self.poses[step].count:
            watch.stored(self.progress(step))
        return watch

    def gate(self, step: str, *, forced: bool) -> Gate:
        """Return the gate out of a sweep; ``forced``: somebody overruled what may be overruled."""
        begun, progress = self.begun, self.progress(step)
        gate = gate_of(
            self.rig, progress, begun.limits(), begun.poses_wanted, begun.tip_sigma_mm,
            forced=forced,
        )  # fmt: skip
        if step == FIRST or forced:
            return gate
        return second_gate(gate, self.progress(FIRST), progress)

    def view(self, step: str, phase: SweepPhase, *, forced: bool) -> SweepView:
        """Return what a screen shows of a sweep."""
        begun, progress = self.begun, self.progress(step)
        return view_of(
            progress,
            phase,
            self.gate(step, forced=forced),
            begun.limits(),
            begun.poses_wanted,
            begun.tip_sigma_mm,
            may_end=forced and is_forcible(progress, begun.limits()),
        )

    def steps(self, *, forced: bool) -> tuple[Step, ...]:
        """Return the steps with their gates."""
        first, second = (self.poses[name].count for name in SWEEPS)
        gates = self.gate(FIRST, forced=forced), self.gate(SECOND, forced=forced)
        return steps_of(self.begun, (first, second), gates)

    def apart(self) -> tuple[float, float]:
        """Return how far the sweeps are apart: places of the ball, mm, and attitudes, rad."""
        return apart(self.progress(FIRST), self.progress(SECOND))

    def calculation(
        self, previous: ProbeRecord | None, *, forced: bool
    ) -> Callable[[], PivotOutcome]:
        """Return what calculates the result, apart from this state.

        Parameters
        ----------
        previous
            The record in force when the session was begun.

        Raises
        ------
        CalibrationError
            A sweep is not complete.
        """
        for step in SWEEPS:
            gate = self.gate(step, forced=forced)
            if not self.view(step, SweepPhase.IDLE, forced=forced).may_end:
                raise CalibrationError("pivot.incomplete", gate.reason, gate.remedy)
        given = PivotMaterial(
            rig=self.rig,
            body=self.body,
            begun=self.begun,
            first=self.poses[FIRST].sweep(self.rig, self.body),
            second=self.poses[SECOND].sweep(self.rig, self.body),
            previous=previous,
            made=datetime.fromisoformat(self.last_utc),
            force=forced,
        )
        return lambda: conclude_pivot(given)
