"""Make the pictures of the wizards, on the virtual rig.

Run ``python docs/images/make_wizards.py [FOLDER]``; without a folder the pictures beside this file
are made again.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

from ocmm_core.calibration.cameras import KnownPointsSetup
from ocmm_core.calibration.guided import SessionSite
from ocmm_core.calibration.verification import VerificationSetup

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtTest import QTest  # the platform must be chosen before
from PySide6.QtWidgets import QApplication

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.cameras import KnownPoints, KnownPointsProcedure, SpotTable
from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.calibration.records import CalibrationStore, load_bar, load_sphere, rig_from_record
from ocmm_core.calibration.tip import TouchView
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig, load_rig, project
from ocmm_core.composition import RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe
from ocmm_gui.app import make_application
from ocmm_gui.kit import THEMES, apply_theme
from ocmm_gui.wizards import SESSIONS, ProbeWizardSite, Runner, Wizard, WizardSite
from ocmm_sim.calibration_scenes import (
    SEATS,
    CalibrationScenesRig,
    FreeMotionScene,
    Scene,
    SweepProbe,
    TipFault,
    TouchSeats,
)
from ocmm_sim.sources import VirtualSite, scene_of_tip, scenes_of_verification

SIZE = (1280, 720)
SEED = 5
PATIENCE_S = 60.0
CONE = (0.0, 0.0, -150.0)
"""Place of the first sweep, mm, world."""

_BLOCK = 40


class Stage:
    """A wizard with an empty store, and the virtual rig before it."""

    def __init__(self, app: QApplication, folder: Path, pictures: Path) -> None:
        self._app, self._pictures = app, pictures
        self.store = folder
        self.rig, self.body = load_rig(RECOMMENDED_RIG), load_probe(STANDARD_PROBE)
        self.watcher: Callable[[FrameBlock], None] | None = None
        probe = ProbeWizardSite(self.body, folder / "probe", hold_s=0.0)
        site = WizardSite(self.rig, self.body, folder, "technician", self._tap, probe=probe)
        self.wizard = Wizard(site)
        self.wizard.resize(*SIZE)
        self.wizard.show()

    def virtual(self, *scenes: Scene) -> CalibrationScenesRig:
        """Return the virtual rig with scenes."""
        return CalibrationScenesRig(self.rig, self.body, scenes, SEED)

    def show(self, runner: Runner, *scenes: Scene) -> None:
        """Show scenes to a procedure that takes finished items automatically."""
        virtual = self.virtual(*scenes)
        for first in range(0, virtual.n_frames - _BLOCK, _BLOCK):
            if self.watcher is not None:
                self.watcher(virtual.frames(first, _BLOCK))
            self.wait(lambda: not runner.driver.procedure.base.live.ready)

    def wait(self, condition: Callable[[], bool]) -> None:
        """Let the wizard go on until something is so."""
        for _ in range(round(PATIENCE_S / 0.02)):
            if condition():
                return
            QTest.qWait(20)
        raise TimeoutError

    def take_picture(self, name: str, theme: str) -> None:
        """Save the shown content."""
        apply_theme(self.wizard, THEMES[theme])
        QTest.qWait(200)
        self.wizard.grab().save(str(self._pictures / f"wizard_{name}_{theme}.png"))

    def running(self) -> Rig:
        """Return the rig with the calibration in force."""
        record = CalibrationStore(self.store).active()
        return self.rig if record is None else rig_from_record(record)

    def collect(self, n: int, seed: int, now: datetime) -> KnownPointsProcedure:
        """Leave a session with all points taken."""
        rng = np.random.default_rng(seed)
        names = tuple(f"P{number:03d}" for number in range(n))
        low, high = self.rig.volume_world
        places = rng.uniform(low, high, (n, 3))
        uv = np.stack([project(camera, places) for camera in self.virtual().world.cameras])
        uv += 0.0105 * rng.standard_normal(uv.shape)
        procedure = KnownPointsProcedure.start(
            SessionSite(self.store / SESSIONS, self.running(), self.body, self.store),
            KnownPointsSetup(who="technician", points=KnownPoints(names, places, 0.0, "CMM")),
            now,
        )
        serials = tuple(camera.serial for camera in self.rig.cameras)
        procedure.take_table(SpotTable(serials, uv, 0.0105), now)
        procedure.advance(now)
        procedure.advance(now)
        return procedure

    def _tap(self, watcher: Callable[[FrameBlock], None] | None) -> None:
        self.watcher = watcher


def main(pictures: Path) -> None:
    """Make all pictures in a folder."""
    app = make_application()
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(app, Path(folder), pictures)
        _relocation(stage)
        first = stage.collect(200, 1, datetime.now(UTC) - timedelta(days=30))
        first.compute()
        first.accept(datetime.now(UTC), "first")
        _verdict(stage)
        _comparison(stage)
        stage.wizard.leave()
        _sweeps(stage)
        _touches(stage)
        stage.wizard.close()


def _relocation(stage: Stage) -> None:
    stage.wizard.open(ProcedureKind.RELOCATION)
    stage.wizard.start.begin_button.click()
    runner = stage.wizard.runner
    assert runner is not None  # noqa: S101 - the proposals of the start page suffice
    runner.driver.advance()
    stage.wait(partial(_is_shown, runner, "seats"))
    runner.driver.set_automatic(True)
    stage.wait(lambda: runner.driver.now.automatic)
    low, high = stage.rig.volume_world
    (x0, y0, z0), (x1, y1, z1) = (low + SEATS * (high - low)).tolist()
    stage.show(runner, TouchSeats(tips=((x0, y0, z0), (x1, y1, z1)), seed=1))
    runner.driver.advance()
    # Both hands are full while the probe is waved: finished items are taken automatically.
    stage.wait(lambda: _is_shown(runner, "wave") and runner.driver.now.automatic)
    stage.show(runner, FreeMotionScene(ways=12, seed=2))
    stage.take_picture("wave", "dark")
    stage.wizard.leave()


def _verdict(stage: Stage) -> None:
    bar = load_bar(resource("artefacts", "verification_bar.toml"))
    spheres = (load_sphere(resource("artefacts", "sphere.toml")),)
    store, now = CalibrationStore(stage.store), datetime.now(UTC)
    procedure = VerificationProcedure.start(
        SessionSite(stage.store / SESSIONS, stage.running(), stage.body, store.folder),
        VerificationSetup(who="technician", spheres=spheres, bar=bar),
        now,
    )
    site = VirtualSite(RECOMMENDED_RIG, STANDARD_PROBE, SEED, None)
    scenes = scenes_of_verification(site, procedure.rig, procedure.view, bar, spheres)
    virtual = stage.virtual(*scenes)
    for first in range(0, virtual.n_frames - _BLOCK, _BLOCK):
        if procedure.base.step.gate.open:
            procedure.advance(now)
        procedure.watch(virtual.frames(first, _BLOCK))
        if procedure.base.live.ready:
            procedure.take(now)
    while procedure.base.step.gate.open:
        procedure.advance(now)
    _resume(stage, ProcedureKind.VERIFICATION)
    stage.take_picture("verdict", "contrast")
    stage.wizard.leave()


def _comparison(stage: Stage) -> None:
    stage.collect(200, 9, datetime.now(UTC))
    _resume(stage, ProcedureKind.KNOWN_POINTS)
    stage.take_picture("residuals", "light")
    if stage.wizard.runner is not None:
        stage.wizard.runner.page().show_plot(3)
    stage.take_picture("compared", "dark")


def _sweeps(stage: Stage) -> None:
    runner = _begin(stage, ProcedureKind.PIVOT)
    reach = (30.0, 30.0, 14.0)
    virtual = stage.virtual(
        SweepProbe(cone=CONE, seconds=16.0, seed=1, reach_deg=reach),
        SweepProbe(cone=(70.0, 10.0, -130.0), seconds=16.0, seed=2, reach_deg=reach),
    )
    pictured = False
    # A procedure takes at most a look of eight frames in twenty milliseconds.
    for first in range(0, virtual.n_frames, 160):
        base = runner.driver.procedure.base
        if base.step.name == "again":
            break
        if stage.watcher is not None:
            stage.watcher(virtual.frames(first, 8))
        stage.wait(lambda: not runner.driver.procedure.base.live.ready)
        if base.step.done >= 200 and not pictured:
            pictured = True
            QTest.qWait(200)
            stage.take_picture("sweep", "dark")
        if base.step.gate.open:
            runner.driver.advance()
            stage.wait(partial(_is_left, runner, base.step.name))
    stage.wait(partial(_is_shown, runner, "again"))
    stage.show(runner, SweepProbe(cone=CONE, seconds=1.0, seed=3, reach_deg=(0.0, 0.0, 0.0)))
    stage.wait(lambda: runner.driver.now.view.outcome is not None)
    stage.take_picture("paths", "light")
    runner.driver.accept("first")
    stage.wait(lambda: runner.driver.procedure.base.stored)
    stage.wizard.leave()


def _is_shown(runner: Runner, step: str) -> bool:
    return runner.driver.now.view.base.step.name == step and runner.page() is runner.pages[step]


def _is_left(runner: Runner, step: str) -> bool:
    return runner.driver.procedure.base.step.name != step


def _touches(stage: Stage) -> None:
    runner = _begin(stage, ProcedureKind.QUALIFICATION)
    view = runner.driver.procedure.view
    if isinstance(view, TouchView):
        sphere = load_sphere(resource("artefacts", "sphere.toml"))
        scene = scene_of_tip(view, sphere, stage.running(), SEED, TipFault())
        virtual = stage.virtual(scene)
        for first in range(0, virtual.n_frames - 2 * _BLOCK, 2 * _BLOCK):
            if runner.driver.procedure.base.step.done >= 14:
                break
            if stage.watcher is not None:
                stage.watcher(virtual.frames(first, 2 * _BLOCK))
            stage.wait(lambda: not runner.driver.procedure.base.live.ready)
    QTest.qWait(200)
    stage.take_picture("sphere", "contrast")
    stage.wizard.leave()


def _begin(stage: Stage, kind: ProcedureKind) -> Runner:
    """Begin with the proposed fields, and go to the first recording step."""
    stage.wizard.open(kind)
    stage.wizard.start.begin_button.click()
    runner = stage.wizard.runner
    assert runner is not None  # noqa: S101 - the proposals of the start page suffice
    runner.driver.advance()
    stage.wait(lambda: runner.driver.now.view.base.current == 1 and runner.driver.now.automatic)
    return runner


def _resume(stage: Stage, kind: ProcedureKind) -> None:
    stage.wizard.open(kind)
    stage.wizard.start.resume_button.click()
    runner = stage.wizard.runner
    assert runner is not None  # noqa: S101 - the session was just left behind
    stage.wait(
        lambda: (
            runner.driver.now.view.outcome is not None and runner.driver.now.calculating_s is None
        )
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
