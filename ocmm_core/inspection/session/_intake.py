"""Entry of touches into the job: it must not be paused, and the ball must be at rest."""

from __future__ import annotations

from ocmm_core.camera import Rig
from ocmm_core.inspection.session._assignment import TouchAssigner
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.measuring import (
    MeasuredPoint,
    PointOptions,
    Refusal,
    RefusalCode,
    Touch,
    TouchNoise,
    approach_direction,
    average,
    with_skew,
)
from ocmm_core.tracking import ProbeBody


class TouchIntake:
    """Make durable points of touches (rest, `TouchAssigner`, `Acceptance`); thread-safe."""

    def __init__(
        self,
        ledger: JobLedger,
        rig: Rig,
        body: ProbeBody,
        options: PointOptions,
        assignment: TouchAssigner,
    ) -> None:
        self._ledger, self._rig, self._body, self._options = ledger, rig, body, options
        self._noise = TouchNoise(rig, body)
        self._assignment = assignment

    def take(self, touch: Touch, feature: str | None = None) -> MeasuredPoint | Refusal:
        """Make a durable point of a touch, or return why not; StorageError if not durable.

        `feature`: intended feature; None for the active one.
        """
        with self._ledger.lock:
            outcome = self._rest(touch, feature)
            if isinstance(outcome, Refusal):
                self._note(outcome)
            return outcome

    def refuse(self, refusal: Refusal) -> None:
        """Note that a trigger got no answer from the cameras."""
        with self._ledger.lock:
            self._note(refusal)

    def _rest(self, touch: Touch, feature: str | None) -> MeasuredPoint | Refusal:
        if self._ledger.paused:
            return Refusal(
                RefusalCode.PAUSED,
                "The job is paused.",
                "Resume the job, then touch again.",
                float(touch.window.time_ns[0]) * 1e-9 if len(touch.window) else 0.0,
            )
        if touch.interrupted:
            return Refusal(
                RefusalCode.GAP,
                "Camera frames were interrupted during the touch.",
                "Touch again when the machine is ready.",
                0.0,
            )
        stable = average(touch.window, touch.expected, self._rig, self._options, self._noise)
        if not isinstance(stable, Refusal) and touch.skew is not None:
            stable = with_skew(stable, touch.window, self._rig, self._body, touch.skew)
        if isinstance(stable, Refusal):
            return stable
        near_mm = self._options.approach_mm
        trails = (touch.trail_world, touch.pull_world[::-1])
        ways = [approach_direction(trail, stable.tip_world, near_mm) for trail in trails]
        known = tuple(way for way in ways if way is not None)
        return self._assignment.take(touch, stable, known, feature)

    def _note(self, refusal: Refusal) -> None:
        ledger = self._ledger
        ledger.job.append_event("refused", f"{refusal.code.value}: {refusal.what}")
        ledger.refusal, ledger.view, ledger.looked_at = refusal, None, ""
