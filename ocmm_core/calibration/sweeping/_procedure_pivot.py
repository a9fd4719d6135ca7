"""Guided pivot calibration: two sweeps of the probe about its ball in a cone.

Steps: ``prepare``, ``first`` (calibrating sweep), ``second`` (elsewhere or in another attitude,
must give the same tip), ``again`` (first cone once more, to detect motion), ``result``. Needs no
key: a sweep starts when the ball rests in the cone, and its gate opens when it is complete.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime

import msgspec
import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided
from ocmm_core.calibration.pivot import OTHER_ATTITUDE, OTHER_PLACE_MM
from ocmm_core.calibration.records import ArtefactUse, ProbeRecord, ProbeStore, load_named
from ocmm_core.calibration.sweeping import _views as views
from ocmm_core.calibration.sweeping._conclusion import expected_tip
from ocmm_core.calibration.sweeping._request import PivotRequest
from ocmm_core.calibration.sweeping._state import SweepingState
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float

_RECORDED_BATCH = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class PivotSetup(guided.TipSetup):
    cone: ArtefactUse | None = None
    request: PivotRequest = field(default_factory=PivotRequest)


class PivotProcedure(
    guided.ProbeProcedure[views.PivotEvent, views.PivotOutcome, views.PivotBegun, PivotSetup]
):
    """See `procedure`.

    `watch` frames; whenever ``view.base.live.ready`` is set, `record` (a batch of poses, durable
    when it returns); when the gate of the step is open, `advance`.
    """

    kind = guided.ProcedureKind.PIVOT
    sessions = guided.SessionFormat(kind, guided.SessionLine[views.PivotEvent], views.PivotBegun)
    step_names = (views.PREPARE, views.FIRST, views.SECOND, views.AGAIN, views.RESULT)

    def __init__(
        self,
        site: guided.SessionSite,
        chain: ChainFile[guided.SessionLine[views.PivotEvent]],
        begun: views.PivotBegun,
    ) -> None:
        super().__init__(site, chain, begun)
        self.tip = begun.tip
        guided.require_probe(chain.path, begun.probe_identity, site.body)
        self._state = SweepingState(site.rig, site.body, begun)
        # During replay of many lines, computing progress after each would be wasted.
        self._watching = False
        self._watch = self._state.watch(views.FIRST)
        self._cone = self._state.cone_spots()
        self._fold()
        if begun.again is None:
            self._refuse_older("did not come back to the first cone")
        self._watching = True
        self._rewatch()

    @classmethod
    def _first_line(
        cls, site: guided.SessionSite, setup: PivotSetup, now: datetime
    ) -> dict[str, object]:
        tip, body, request = setup.tip, site.body, setup.request
        if not tip.strip():
            raise CalibrationError(
                "pivot.tip_name",
                "The tip has no name.",
                "Use the name marked on its stylus; each tip has its own calibration.",
            )
        active = ProbeStore(site.records).active(tip)
        expected = expected_tip(
            body, None if active is None else active.calibration, tip_unknown=request.tip_unknown
        )
        return {
            "probe": body.name, "probe_identity": body.identity, "tip": tip,
            "expected_tip": expected, "cone": setup.cone, "slack_mm": request.slack,
            "change_limit_mm": request.limit, "poses_wanted": request.poses,
            "tip_sigma_mm": request.tip_sigma_mm, "valid_days": request.valid_days,
            "again": request.again,
        }  # fmt: skip

    @property
    def view(self) -> views.PivotView:
        with self._lock:
            first, second = (self._sweep_view(name) for name in views.SWEEPS)
            place, attitude = self._state.apart()
            watching = self._step in views.SWEEPS
            nothing = np.full(3, np.nan)
            findings = self._state.progress(self._step).findings if watching else ()
            warnings = {one.code: one for one in (*self._watch.warnings(), *findings)}
            return views.PivotView(
                base=self.base, probe=self._begun.probe, tip=self.tip,
                countdown_s=self._watch.countdown_s if watching else None,
                direction_world=self._watch.direction_world if watching else nothing, first=first,
                second=second, place_distance_mm=place, attitude_distance=attitude,
                place_wanted_mm=OTHER_PLACE_MM, attitude_wanted=float(OTHER_ATTITUDE),
                warnings=tuple(warnings.values()) if watching else (), outcome=self._outcome,
            )  # fmt: skip

    def watch(self, block: FrameBlock) -> None:
        with self._lock:
            if not len(block) or self._decided is not None:
                return
            if self._step in views.SWEEPS:
                self._watch.push(block)
            elif self._step == views.AGAIN:
                self._cone.push(block)

    def sweep_anew(self, now: datetime) -> None:
        """Discard all poses of the current sweep, and wait for the ball in the cone again."""
        with self._lock:
            if self._step in views.SWEEPS:
                self._append(views.SweepDiscarded(utc=guided.utc_text(now), step=self._step))
                self._rewatch()

    def end_sweep(self, now: datetime) -> None:
        """End a sweep early, after `force`; else, or below the minimum, CalibrationError."""
        with self._lock:
            if self._step not in views.SWEEPS or not self._sweep_view(self._step).may_end:
                gate = self._steps()[self.step_names.index(self._step)].gate
                raise CalibrationError("session.gate", gate.reason, gate.remedy)
            following = self.step_names[self.step_names.index(self._step) + 1]
            self._append(guided.Entered(utc=guided.utc_text(now), step=following))

    def take_sweep(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add recorded labelled spots (n, C, L, 2), px, NaN if unseen, to this sweep.

        CalibrationError if the step is no sweep, or the shape does not match rig and probe.
        """
        with self._lock:
            wanted = (len(self.rig.cameras), self._state.body.n_leds, 2)
            if self._step not in views.SWEEPS or uv.shape[1:] != wanted:
                raise CalibrationError(
                    "pivot.recorded",
                    f"Recorded spots of shape {uv.shape[1:]} do not fit here: the rig has "
                    f"{wanted[0]} cameras, the probe {wanted[1]} LEDs, and the step is "
                    f"'{self._step}'.",
                    "Give the sweeps of this rig and probe in a sweep step.",
                )
            self._watching = False
            try:
                utc, step = guided.utc_text(now), self._step
                for first in range(0, len(uv), _RECORDED_BATCH):
                    part = uv[first : first + _RECORDED_BATCH]
                    poses = tuple(guided.to_spots(pose) for pose in part)
                    self._append(
                        views.PosesTaken(utc=utc, step=step, poses=poses, sigma_px=sigma_px)
                    )
            finally:
                self._watching = True
                self._rewatch()

    def take_visit(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add spots (C, L, 2), px, of the final visit; CalibrationError if none is due."""
        with self._lock:
            if not (self._step == views.AGAIN and self._wants()):
                raise CalibrationError(
                    "pivot.visit",
                    "No visit to the first cone is due here.",
                    "Take it once, after both sweeps.",
                )
            self._append(
                views.ConeVisited(
                    utc=guided.utc_text(now), uv=guided.to_spots(uv), sigma_px=sigma_px
                )
            )

    def accept(self, now: datetime, reason: str) -> None:
        """Store the result and end the procedure; see `procedure.Procedure.accept`.

        CalibrationError also if the tip changed beyond the limit and ``reason`` is empty.
        """
        with self._lock:
            outcome = self._outcome
            if outcome is not None and outcome.must_be_confirmed and self._decided is None:
                change = outcome.change
                if change is not None and not reason.strip():
                    raise CalibrationError(
                        "pivot.unconfirmed",
                        f"The tip is {1e3 * change.tip_distance:.0f} um from the active "
                        f"calibration; the limit is {1e3 * change.limit_mm:.0f} um.",
                        "Give the reason (another stylus, a shock, a repair), or keep the old "
                        "calibration and sweep again.",
                    )
            super().accept(now, reason)

    def _sweep_view(self, name: str) -> views.SweepView:
        phase = self._watch.phase if self._step == name else views.SweepPhase.IDLE
        return self._state.view(name, phase, forced=self._forced)

    def _rewatch(self) -> None:
        if self._step in views.SWEEPS:
            self._watch = self._state.watch(self._step)
        elif self._step == views.AGAIN:
            self._cone = self._state.cone_spots()

    def _change(self, event: views.PivotEvent | guided.CommonEvent) -> None:
        super()._change(event)
        if isinstance(event, guided.Entered) and self._watching:
            self._rewatch()

    def _seen(self) -> guided.Live:
        if self._step == views.AGAIN:
            live = self._cone.live()
            if not live.ready or not self._wants():
                return live
            average = self._cone.average()
            hint = self._state.judge_visit(average.uv, average.sigma_px)
            return replace(live, ready=False, hint=hint) if hint else live
        live = self._watch.live()
        if live.ready or live.hint or self._step not in views.SWEEPS:
            return live
        return replace(live, hint=self._sweep_view(self._step).missing or "The sweep is complete.")

    def _wants(self) -> bool:
        visit = self._step == views.AGAIN and bool(self._begun.again) and not self._state.visited
        return self._step in views.SWEEPS or visit

    def _observation(self, utc: str) -> views.PosesTaken | views.ConeVisited:
        if self._step == views.AGAIN:
            average = self._cone.average()
            return views.ConeVisited(
                utc=utc, uv=guided.to_spots(average.uv), sigma_px=average.sigma_px
            )
        poses = tuple(guided.to_spots(pose) for pose in self._watch.batch)
        sigma_px = self._watch.sigma_px
        return views.PosesTaken(utc=utc, step=self._step, poses=poses, sigma_px=sigma_px)

    def _observe(self, event: views.PivotEvent) -> None:
        if isinstance(event, views.PivotBegun):
            return
        self._state.add(event)
        if isinstance(event, views.PosesTaken) and self._watching:
            self._watch.stored(self._state.progress(event.step))

    def _has_observation(self, step: str) -> bool:
        # A visit of the first cone is a result and cannot be removed.
        return step in views.SWEEPS and self._state.poses[step].count > 0

    def _undo(self, step: str) -> None:
        self._state.remove(step)
        if self._watching:
            self._rewatch()

    def _steps(self) -> tuple[guided.Step, ...]:
        return self._state.steps(forced=self._forced)

    def _calculation(self) -> Callable[[], views.PivotOutcome]:
        running = self._begun.running
        previous = load_named(self._store.folder, running, ProbeRecord) if running else None
        return self._state.calculation(previous, forced=self._forced)

    def _put(self, outcome: views.PivotOutcome, decided: guided.Decided) -> None:
        reason = decided.reason if outcome.must_be_confirmed else ""
        record = msgspec.structs.replace(outcome.record, change_reason=reason)
        now = datetime.fromisoformat(decided.utc)
        self._store.calibrate(record, self._begun.who, decided.reason, now, self._log.path)
