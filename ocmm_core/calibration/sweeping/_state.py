"""State of a pivot calibration: both sweeps, their progress, gates and steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime

import numpy as np

from ocmm_core.calibration import guided
from ocmm_core.calibration.guided import OPEN, SEAT_MM, STILL_FRAMES, Gate, ProbeSpotAverager, Step
from ocmm_core.calibration.pivot import OTHER_ATTITUDE, OTHER_PLACE_MM, attitude_between
from ocmm_core.calibration.records import ProbeRecord
from ocmm_core.calibration.sweeping import _conclusion as conclusion
from ocmm_core.calibration.sweeping import _views as views
from ocmm_core.calibration.sweeping._progress import (
    SweepProgress,
    gate_of,
    is_forcible,
    progress_of,
    view_of,
)
from ocmm_core.calibration.sweeping._watch import SweepWatch
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody, solve


def steps_of(
    begun: views.PivotBegun,
    poses: tuple[int, int],
    gates: tuple[Gate, Gate],
    again: Gate,
    *,
    visited: bool,
) -> tuple[Step, ...]:
    """Return the steps with their gates; ``again`` and ``visited`` are of the final visit."""
    cone = "the cone" if begun.cone is None else f"cone '{begun.cone.name}'"
    return (
        Step(
            views.PREPARE,
            "Prepare",
            f"Clamp {cone} where all cameras see it well, and clean it. Tighten tip "
            f"'{begun.tip}' on probe '{begun.probe}' and clean its ball.",
            OPEN,
        ),
        Step(
            views.FIRST,
            "First sweep",
            "Put the ball into the cone and sweep the probe to all sides, 20 degrees or more, "
            "along different paths; turn it about its handle too.",
            gates[0],
            poses[0],
            begun.poses_wanted,
        ),
        Step(
            views.SECOND,
            "Second sweep",
            "Leave the first cone in place. Sweep again in another one, 30 mm or more away, or "
            "in the same one with the probe leaning another way: the tip must be the same.",
            gates[1],
            poses[1],
            begun.poses_wanted,
        ),
        Step(
            views.AGAIN,
            "First cone again",
            "Put the ball back into the first cone and hold the probe still, as at the start."
            if begun.again
            else "Nothing to do: the recording has no such visit.",
            again,
            int(visited),
            int(begun.again or False),
        ),
        Step(
            views.RESULT,
            "Result",
            "Review the tip, the changes and the second sweep, then accept the new calibration "
            "or keep the old one.",
            guided.LAST_OF_CALIBRATION,
        ),
    )


def apart(first: SweepProgress, second: SweepProgress) -> tuple[float, float]:
    """Return the distance of two sweeps: ball positions, mm, and attitudes, rad."""
    if first.coverage is None or second.coverage is None:
        return np.nan, np.nan
    place = float(np.linalg.norm(second.centre_world - first.centre_world))
    return place, attitude_between(
        first.coverage.directions_world, second.coverage.directions_world
    )


def second_gate(gate: Gate, first: SweepProgress, second: SweepProgress) -> Gate:
    """Return the gate out of the second sweep, which must differ from the first."""
    if not gate.open:
        return gate
    place, attitude = apart(first, second)
    if place < OTHER_PLACE_MM and attitude < OTHER_ATTITUDE:
        return Gate(
            False,
            f"The second sweep is only {place:.0f} mm and {np.degrees(attitude):.0f} degrees "
            "from the first: it would repeat the first one's errors.",
            "Repeat it in another cone, 30 mm or more away, or with the probe leaning 15 "
            "degrees another way; leave the first cone in place.",
        )
    return gate


@dataclass(slots=True)
class SweepingState:
    """Observations collected."""

    rig: Rig
    body: ProbeBody
    begun: views.PivotBegun
    poses: dict[str, views.SweepPoses] = field(
        default_factory=lambda: {name: views.SweepPoses() for name in views.SWEEPS}
    )
    first_utc: str = ""
    last_utc: str = ""
    """`first_utc`, `last_utc`: First poses of the first sweep, last ones of all."""
    visits: list[views.ConeVisited] = field(default_factory=list)
    """Final visits of the first cone; all count as long as its sweep is unchanged."""
    visited: bool = False
    _progress: dict[str, SweepProgress] = field(default_factory=dict)
    _turned: Float | None = None

    def add(self, event: views.PosesTaken | views.SweepDiscarded | views.ConeVisited) -> None:
        if isinstance(event, views.ConeVisited):
            self.visits.append(event)
            self.visited = True
            self.last_utc = max(self.last_utc, event.utc)
            return
        self._forget(event.step)
        if event.step == views.FIRST and not self.poses[views.FIRST].count:
            self.first_utc = event.utc
        if isinstance(event, views.SweepDiscarded):
            self.poses[event.step].batches.clear()
        else:
            self.poses[event.step].add(event)
            self.last_utc = max(self.last_utc, event.utc)

    def remove(self, step: str) -> None:
        self.poses[step].batches.pop()
        self._forget(step)

    def _forget(self, step: str) -> None:
        self._progress.pop(step, None)
        self.visited = False
        if step == views.FIRST:
            self._turned = None
            self.visits.clear()

    def cone_spots(self) -> ProbeSpotAverager:
        body = self.begun.expected(self.body)
        return ProbeSpotAverager(self.rig, body, STILL_FRAMES, resting=True, distance_mm=-1.0)

    def judge_visit(self, uv: Float, sigma_px: float) -> str:
        """Return why a resting ball is not in the first cone, or empty text."""
        first = self.progress(views.FIRST)
        body = self.begun.expected(self.body)
        if first.tip_probe is not None:
            body = replace(body, tip_probe=first.tip_probe)
        pose = solve(uv[None], self.rig, body, sigma_px)
        away = float(np.linalg.norm(pose.tip_world[0] - first.centre_world))
        if away > SEAT_MM:
            return f"The ball is {away:.0f} mm from the first cone: put it back there."
        if self._turned is None:
            sweep = self.poses[views.FIRST].sweep(self.rig, self.body)
            shots = solve(sweep.uv, self.rig, body, float(sweep.sigma_px[0]))
            self._turned = shots.rotation_world_from_probe
        turns = conclusion.turns_from(self._turned, pose.rotation_world_from_probe[0])
        if np.count_nonzero(turns < conclusion.ALIKE) < conclusion.LEAST_ALIKE:
            return "This attitude was not in the first sweep: hold the probe as at its start."
        return ""

    def again_gate(self) -> Gate:
        if not self.begun.again or self.visited:
            return OPEN
        return Gate(
            False,
            "The ball was not put back into the first cone.",
            "Rest it there once more, held as at the start.",
        )

    def progress(self, step: str) -> SweepProgress:
        """Return the progress of a sweep, cached."""
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
        watch = SweepWatch(
            self.rig,
            self.begun.expected(self.body),
            tip_known=self.begun.expected_tip is not None,
            first=self.progress(views.FIRST) if step == views.SECOND else None,
        )
        if self.poses[step].count:
            watch.stored(self.progress(step))
        return watch

    def gate(self, step: str, *, forced: bool) -> Gate:
        """Return the gate out of a sweep; ``forced``: the user overruled the guards."""
        begun, progress = self.begun, self.progress(step)
        gate = gate_of(
            self.rig, progress, begun.limits(), begun.poses_wanted, begun.tip_sigma_mm,
            forced=forced,
        )  # fmt: skip
        if step == views.FIRST or forced:
            return gate
        return second_gate(gate, self.progress(views.FIRST), progress)

    def view(self, step: str, phase: views.SweepPhase, *, forced: bool) -> views.SweepView:
        begun, progress = self.begun, self.progress(step)
        return view_of(
            progress, phase, self.gate(step, forced=forced), begun.limits(), begun.poses_wanted,
            begun.tip_sigma_mm, may_end=forced and is_forcible(progress, begun.limits()),
        )  # fmt: skip

    def steps(self, *, forced: bool) -> tuple[Step, ...]:
        first, second = (self.poses[name].count for name in views.SWEEPS)
        gates = self.gate(views.FIRST, forced=forced), self.gate(views.SECOND, forced=forced)
        return steps_of(self.begun, (first, second), gates, self.again_gate(), visited=self.visited)

    def apart(self) -> tuple[float, float]:
        """Return the distance of the sweeps: ball positions, mm, and attitudes, rad."""
        return apart(self.progress(views.FIRST), self.progress(views.SECOND))

    def calculation(
        self, previous: ProbeRecord | None, *, forced: bool
    ) -> Callable[[], views.PivotOutcome]:
        """Return the calculation; CalibrationError for an incomplete sweep.

        ``previous`` is the record in force at the start.
        """
        for step in views.SWEEPS:
            gate = self.gate(step, forced=forced)
            if not self.view(step, views.SweepPhase.IDLE, forced=forced).may_end:
                raise CalibrationError("pivot.incomplete", gate.reason, gate.remedy)
        gate = self.again_gate()
        if not gate.open:
            raise CalibrationError("pivot.incomplete", gate.reason, gate.remedy)
        given = conclusion.PivotMaterial(
            rig=self.rig, body=self.body, begun=self.begun,
            first=self.poses[views.FIRST].sweep(self.rig, self.body),
            second=self.poses[views.SECOND].sweep(self.rig, self.body),
            visits=conclusion.ConeVisits(self.first_utc, tuple(self.visits), self.begun.slack_mm),
            previous=previous, made=datetime.fromisoformat(self.last_utc), force=forced,
        )  # fmt: skip
        return lambda: conclusion.conclude_pivot(given)
