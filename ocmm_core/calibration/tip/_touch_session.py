"""Common part of tip qualification and quick check; only the user may remove points."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TypeVar

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided, records
from ocmm_core.calibration.tip import _steps as steps
from ocmm_core.calibration.tip._qualification import (
    BallInCone,
    BallOnSphere,
    TakenBack,
    TouchBegun,
    TouchEvent,
    continued_records,
    sphere_warnings,
)
from ocmm_core.calibration.tip._state import TouchPlan, TouchState
from ocmm_core.calibration.tip._views import TipCheckOutcome, TipOutcome, TouchView
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

POLE = np.array([0.0, 0.0, 1.0])
"""Of the sphere: its stem is at the opposite side."""

V = TypeVar("V", bound=TouchView)
R = TypeVar("R", bound=records.MadeRecord)
Q = TypeVar("Q", bound=TipOutcome | TipCheckOutcome)
B = TypeVar("B", bound=TouchBegun)


@dataclass(frozen=True, slots=True, kw_only=True)
class TouchSetup(guided.TipSetup):
    """Common part of both setups: the mounted tip, the sphere, and the cone if it is marked."""

    sphere: records.Sphere
    cone: records.ArtefactUse | None = None


S = TypeVar("S", bound=TouchSetup)


class TouchProcedure(guided.ProbeProcedure[TouchEvent, Q, B, S]):
    """Base of both procedures.

    `watch` frames; whenever ``view.base.live.ready`` is set, `record`; when the gate of the step is
    open, `advance`; in the last step `compute`, then `accept` (which also stores failed results) or
    `keep`. `drop` removes the last point, `take_back` any. `start` raises CalibrationError also if
    the tip is not mounted or lacks the record that the procedure rests on.
    """

    step_names = (steps.PREPARE, steps.SPHERE, steps.CONE, steps.RESULT)

    def __init__(
        self, site: guided.SessionSite, chain: ChainFile[guided.SessionLine[TouchEvent]], begun: B
    ) -> None:
        # First of all: another qualification in force is the better reason to refuse.
        rig, body = site.rig, site.body
        self._records = continued_records(records.ProbeStore(site.records), begun, chain.path)
        self._cameras = None if site.cameras is None else records.CalibrationStore(site.cameras)
        calibrated = records.probe_from_records(body, self._records.calibration, None)
        self._wanted = self._wanting(begun, rig, calibrated)
        super().__init__(site, chain, begun)
        self.tip = begun.tip
        guided.require_probe(chain.path, begun.probe_identity, body)
        self._state = TouchState(rig, calibrated, begun, self._wanted)
        self._sight = steps.RestingBall(self._state, site.hold_s)
        self._shocks = guided.ShockDetector()
        self._fold()

    @classmethod
    def _touch_line(
        cls, site: guided.SessionSite, setup: S, now: datetime, limit_mm: float
    ) -> dict[str, object]:
        """Return the fields of the first line common to both; ``limit_mm``: for the diameter."""
        sphere = setup.sphere
        known = sphere.artefact.judge(sphere.diameter, limit_mm, now, setup.temperature)
        records.let_pass(known, force=False)
        return {
            "tip": setup.tip, "probe_identity": site.body.identity, "sphere": sphere,
            "cone": setup.cone,
        }  # fmt: skip

    @property
    def sphere(self) -> records.Sphere:
        return self._begun.sphere

    def watch(self, block: FrameBlock) -> None:
        with self._lock:
            self._sight.push(block, self._step, self._version)
            if len(block) and len(self._shocks.push(block)):
                guided.record_shock(self._store, datetime.now(UTC))

    def take_shot(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add averaged spots (C, L, 2), px; CalibrationError if not due, TrackingError: no pose."""
        with self._lock:
            if not self._wants():
                raise CalibrationError(
                    "tip.nothing_next", "Nothing to take in this step.", "Go to the next step."
                )
            # Observations that cannot be computed must not enter the file.
            guided.touch_of(uv, sigma_px, self._state.rig, self._state.body)
            self._append(self._event(guided.Average(uv, sigma_px), guided.utc_text(now)))

    def take_back(self, point: int, now: datetime) -> None:
        """Remove an observation of this step by its index; CalibrationError if unknown."""
        with self._lock:
            if not 0 <= point < self._count(self._step):
                raise CalibrationError(
                    "tip.no_point",
                    f"No point {point + 1} in this step.",
                    "Choose one already taken.",
                )
            self._append(TakenBack(utc=guided.utc_text(now), step=self._step, point=point))

    @abstractmethod
    def _wanting(self, begun: B, rig: Rig, calibrated: ProbeBody) -> TouchPlan:
        """Return layouts and limits; called once, before the state exists."""

    @abstractmethod
    def _diameter_unknown(self, sigma_mm: float, limit_mm: float) -> guided.Gate:
        """Return the gate for an insufficiently determined diameter."""

    @abstractmethod
    def _cone_said(self) -> guided.Gate:
        """Return whether enough attitudes were recorded."""

    @abstractmethod
    def _concluded(self) -> Q:
        """Return the result; raise CalibrationError if data are insufficient."""

    def _sphere_said(self) -> guided.Gate:
        gate, progress = steps.places_gate(self._state), self._state.sphere
        known, limit = progress.diameter_sigma_mm, progress.diameter_sigma_limit_mm
        return gate if not gate.open or known <= limit else self._diameter_unknown(known, limit)

    def _calculation(self) -> Callable[[], Q]:
        # Fast enough to run within the state's lock.
        outcome = self._concluded()
        return lambda: outcome

    def _snapshot(self, kind: Callable[..., V], **own: object) -> V:
        """Return the snapshot of a kind: `TouchView` and its own fields."""
        state, begun = self._state, self._begun
        certified, expanded = begun.sphere.artefact.at(begun.sphere.diameter, begun.temperature)
        return kind(
            base=self.base, probe=state.body.name, tip=begun.tip,
            sphere_name=begun.sphere.artefact.use.name, sphere_diameter_mm=certified,
            sphere_expanded_mm=expanded, nominal_mm=begun.nominal_mm, sphere=state.sphere,
            cone=state.cone, countdown=self._sight.countdown(self._step, self._version), **own,
        )  # fmt: skip

    def _check(self, outcome: Q) -> None:
        super()._check(outcome)
        if outcome.record.passed and not self._is_stored():
            guided.require_no_doubt_since(
                self._store, self.tip, datetime.fromisoformat(self._begun.utc)
            )

    def _warned(self) -> tuple[records.Finding, ...]:
        """Return findings that weaken the result: the sphere and its uncertainty."""
        begun = self._begun
        known = begun.sphere.artefact.judge(
            begun.sphere.diameter,
            self._wanted.artefact_limit,
            datetime.fromisoformat(begun.utc),
            begun.temperature,
        )
        if self._cameras is None:
            return records.let_pass(known, force=False)
        used = sphere_warnings(begun.sphere, self._cameras.active(), self._cameras.verifications())
        return (*records.let_pass(known, force=False), *used)

    def _record(self, kind: Callable[..., R], **own: object) -> R:
        """Return a record of the observations, with the fields of its kind."""
        taken = self._state.taken
        cone = self._begun.cone
        return kind(
            probe=self._records.calibration.probe, tip=self.tip,
            made_utc=max(event.utc for event in taken), made_by=self._begun.who,
            software=self._begun.software, temperature_c=self._begun.temperature_c,
            rig=self.rig.name, rig_identity=self.rig.identity,
            data_sha256=guided.hash_of(np.array([guided.from_spots(event.uv) for event in taken])),
            calibration=self._begun.running,
            artefacts=(self.sphere.artefact.use, *((cone,) if cone is not None else ())), **own,
        )  # fmt: skip

    # Implementation of `GuidedProcedure`.

    def _seen(self) -> guided.Live:
        return self._sight.live(self._step, self._version)

    def _wants(self) -> bool:
        return self._step in steps.TAKING

    def _observation(self, utc: str) -> TouchEvent:
        return self._event(self._sight.average(), utc)

    def _event(self, average: guided.Average, utc: str) -> BallOnSphere | BallInCone:
        kind = BallOnSphere if self._step == steps.SPHERE else BallInCone
        return kind(utc=utc, uv=guided.to_spots(average.uv), sigma_px=average.sigma_px)

    def _observe(self, event: TouchEvent) -> None:
        if isinstance(event, TakenBack):
            self._state.remove(event.step, event.point)
        elif isinstance(event, BallOnSphere | BallInCone):
            self._state.add(event)
            self._sight.taken(guided.Average(guided.from_spots(event.uv), event.sigma_px))

    def _count(self, step: str) -> int:
        held = {steps.SPHERE: len(self._state.on_sphere), steps.CONE: len(self._state.in_cone)}
        return held.get(step, 0)

    def _has_observation(self, step: str) -> bool:
        return self._count(step) > 0

    def _undo(self, step: str) -> None:
        self._state.remove(step, -1)

    def _steps(self) -> tuple[guided.Step, ...]:
        return steps.steps_of(self._state, self._sphere_said(), self._cone_said())
