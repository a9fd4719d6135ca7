"""A virtual rig with a probe in a cone, and its records, for the tests of pivot calibration."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ocmm_core.calibration.guided import SessionSite
from ocmm_core.calibration.records import ProbeStore
from ocmm_core.calibration.sweeping import PivotProcedure, PivotRequest, PivotSetup, PivotView
from ocmm_core.camera import Rig, load_rig
from ocmm_core.geometry import Float, Pixels, rigid_fit
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.calibration_scenes import CalibrationScenesRig, SweepProbe
from tests.core.calibration.procedure_site import PROBE_DOCUMENT, RIG_DOCUMENT, SEED, Clock
from tests.core.calibration.swept_probe import attitudes, spots

CONE, OTHER_CONE = (0.0, 0.0, -150.0), (70.0, 10.0, -130.0)
SIGMA_PX = 0.0105
_LOOK, _EVERY = 8, 160
"""Shown frames and their spacing: the length of a look's mean, and its period."""


@dataclass(slots=True)
class PivotBench:
    """Rig, probe and an empty store in a folder."""

    folder: Path
    now: Clock = field(default_factory=Clock)
    rig: Rig = field(default_factory=lambda: load_rig(RIG_DOCUMENT))
    body: ProbeBody = field(default_factory=lambda: load_probe(PROBE_DOCUMENT))

    def store(self) -> ProbeStore:
        return ProbeStore(self.folder / "probe")

    def site(self) -> SessionSite:
        return SessionSite(self.folder / "sessions", self.rig, self.body, self.folder / "probe")

    def begin(self, *, tip_unknown: bool = False, poses: int = 150) -> PivotProcedure:
        return PivotProcedure.start(
            self.site(),
            PivotSetup(
                who="technician",
                request=PivotRequest(tip_unknown=tip_unknown, poses=poses),
                tip="A",
            ),
            self.now(),
        )

    def resume(self, path: Path) -> PivotProcedure:
        return PivotProcedure.resume(self.site(), path)

    def swept(
        self, seed: int, cone: tuple[float, float, float] = CONE, *, n: int = 200,
        range_deg: float = 30.0, body: ProbeBody | None = None, shift: Float | None = None,
    ) -> Pixels:  # fmt: skip
        """Return labelled spots of a sweep; from its middle on the ball is shifted, mm."""
        rng = np.random.default_rng(seed)
        balls = np.tile(np.array(cone), (n, 1))
        if shift is not None:
            balls[n // 2 :] += shift
        return spots(self.rig, body or self.body, attitudes(n, range_deg, rng), balls, rng)

    def rested(
        self, cone: tuple[float, float, float] = CONE, body: ProbeBody | None = None
    ) -> Pixels:
        """Return labelled spots (C, L, 2), px, of the probe that rests upright in a cone."""
        rng = np.random.default_rng(3)
        upright, ball = np.eye(3)[None], np.array([cone])
        seen: Pixels = spots(self.rig, body or self.body, upright, ball, rng)[0]
        return seen

    def both(
        self, procedure: PivotProcedure, body: ProbeBody | None = None,
        again: tuple[float, float, float] = CONE,
    ) -> None:  # fmt: skip
        """Take two good recorded sweeps, and the first cone again."""
        procedure.advance(self.now())
        for seed, cone in ((1, CONE), (2, OTHER_CONE)):
            procedure.take_sweep(self.swept(seed, cone, body=body), SIGMA_PX, self.now())
            procedure.advance(self.now())
        procedure.take_visit(self.rested(again, body), SIGMA_PX, self.now())
        procedure.advance(self.now())

    def virtual(self, *scenes: SweepProbe, body: ProbeBody | None = None) -> CalibrationScenesRig:
        return CalibrationScenesRig(self.rig, body or self.body, scenes, SEED)

    def true_tip(self, virtual: CalibrationScenesRig) -> Float:
        """Return the tip of the virtual probe, laid onto the document as calibrations are."""
        rotation, shift = rigid_fit(virtual.world.leds_probe, self.body.leds_probe)
        return rotation @ virtual.world.tip_probe + shift


def show_sweeps(
    procedure: PivotProcedure, virtual: CalibrationScenesRig, now: Clock, *, first: int = 0,
    at_most: int | None = None,
) -> tuple[int, list[PivotView]]:  # fmt: skip
    """Show moments of a rig, take each finished result, and enter open steps.

    Returns the last frame (at the result, or after ``at_most`` batches) and the views at every
    visible change.
    """
    views: list[PivotView] = []
    last, taken = len(procedure.base.steps) - 1, 0
    for frame in range(first, virtual.n_frames - _EVERY, _EVERY):
        while procedure.base.current < last and procedure.base.step.gate.open:
            procedure.advance(now())
        if procedure.base.current == last:
            return frame, views
        # Rest is judged without gaps.
        resting = procedure.base.step.name == "again"
        procedure.watch(virtual.frames(frame, _EVERY if resting else _LOOK))
        view = procedure.view
        if not views or _noticed(view) != _noticed(views[-1]):
            views.append(view)
        if view.base.live.ready:
            procedure.record(now())
            taken += 1
            if taken == at_most:
                return frame + _EVERY, views
    return virtual.n_frames, views


def _noticed(view: PivotView) -> tuple[object, ...]:
    phase = view.sweep.phase if view.sweep is not None else None
    return view.base.step.name, phase, tuple(one.code for one in view.warnings)
