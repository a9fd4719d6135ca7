"""A wizard on the virtual rig, whose scenes the test shows block by block."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.calibration.records import CalibrationStore, rig_from_record
from ocmm_core.camera import Rig
from ocmm_core.errors import OcmmError
from ocmm_gui.kit import DEBOUNCE_S, THEMES, ThemedWidget
from ocmm_gui.wizards import ProbeWizardSite, Runner, Wizard, WizardSite
from ocmm_gui.wizards.pages import StepSnapshot
from ocmm_sim.calibration_scenes import CalibrationScenesRig, Scene
from tests.core.calibration.procedure_site import Bench
from tests.host import HANG_MS
from tests.waiting import let_pass

PATIENCE_MS = HANG_MS
_BLOCK = 40
_LOOKS = 4000


class WizardBench:
    """A separate wizard at the smallest window size, and its records."""

    def __init__(self, qtbot: QtBot, folder: Path, tip: str = "T1") -> None:
        self.qtbot = qtbot
        self.tip = tip
        self.bench = Bench.at(folder)
        self.errors: list[OcmmError] = []
        self.left: list[int] = []
        self.watcher: Callable[[FrameBlock], None] | None = None
        self.store = folder / "store"
        self.probe_store = folder / "probe"
        self.wizard = self._open()

    @property
    def runner(self) -> Runner:
        """Return the procedure that is shown."""
        assert self.wizard.runner is not None
        return self.wizard.runner

    @property
    def seen(self) -> StepSnapshot:
        """Return the shown view."""
        return self.runner.driver.now

    def _open(self) -> Wizard:
        self.site = WizardSite(
            self.bench.rig, self.bench.body, self.store, "technician", self._tap,
            probe=ProbeWizardSite(self.bench.body, self.probe_store, self.tip, hold_s=0.0),
        )  # fmt: skip
        wizard = Wizard(self.site, self.bench.now)
        wizard.resize(1024, 600)
        wizard.failed.connect(self.errors.append)
        wizard.left.connect(lambda: self.left.append(1))
        with self.qtbot.waitActive(wizard):
            wizard.show()
            wizard.activateWindow()
        return wizard

    def _tap(self, watcher: Callable[[FrameBlock], None] | None) -> None:
        self.watcher = watcher

    def use_store_of_bench(self) -> CalibrationStore:
        """Return the store of the wizard."""
        return CalibrationStore(self.store)

    def running(self) -> Rig:
        """Return the rig with the calibration in force."""
        record = self.use_store_of_bench().active()
        return self.bench.rig if record is None else rig_from_record(record)

    def begin(self, kind: ProcedureKind, **values: str) -> None:
        """Open a wizard and begin with the given fields."""
        self.wizard.open(kind)
        for key, value in values.items():
            field = self.wizard.start.fields[key]
            assert isinstance(field, QLineEdit)
            field.setText(value)
        self.key(Qt.Key.Key_Return, self.wizard.start.fields["who"])
        if self.wizard.currentWidget() is self.wizard.tables:
            # The table is shown before anything is accepted.
            self.key(Qt.Key.Key_Return, self.wizard.tables)

    def go_on(self, kind: ProcedureKind) -> None:
        """Open a wizard and go on with the session that is proposed."""
        self.wizard.open(kind)
        self.key(Qt.Key.Key_G, self.wizard.start.list)
        self.until(lambda: self.wizard.runner is not None)

    def crash(self) -> None:
        """Throw the wizard away as it is, and open another one."""
        self.wizard.close_runner()
        self.wizard.close()
        self.wizard.deleteLater()
        self.wizard = self._open()

    def key(self, key: Qt.Key, widget: QWidget | None = None) -> None:
        """Press a key at the widget with the focus."""
        if widget is None:
            widget = QApplication.focusWidget()
        QTest.keyClick(self.wizard if widget is None else widget, key)

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait until something is so."""
        self.qtbot.waitUntil(condition, timeout=PATIENCE_MS)

    def step(self, name: str) -> None:
        """Go on with Return until a step is reached."""
        while self.seen.view.base.step.name != name:
            following = self.seen.view.base.steps[self.seen.view.base.current + 1].name
            self.until(lambda: self.runner.actions_by_key["next"].isEnabled())
            let_pass(DEBOUNCE_S)
            self.key(Qt.Key.Key_Return)
            self.enters(following)

    def enters(self, name: str) -> None:
        """Wait until a step is reached and its page is shown."""
        self.until(
            lambda: (
                self.seen.view.base.step.name == name
                and self.runner.page() is self.runner.pages[name]
            )
        )

    def show(self, rig: Rig | None, *scenes: Scene, at_most: int = 10_000) -> int:
        """Show scenes; wait until each finished item was taken automatically."""
        virtual = self.bench.virtual(*scenes)
        if rig is not None:
            virtual = CalibrationScenesRig(rig, self.bench.body, scenes, virtual.seed)
        # The state of the procedure, not the shown one: a busy computer shows it later.
        procedure = self.runner.driver.procedure
        before = procedure.base.step.done
        for first in range(0, virtual.n_frames, _BLOCK):
            if procedure.base.step.done - before >= at_most:
                break
            assert self.watcher is not None
            self.watcher(virtual.frames(first, min(_BLOCK, virtual.n_frames - first)))
            if self.seen.automatic:
                self._let_it_take()
        done = procedure.base.step.done
        self.until(lambda: self.seen.view.base.step.done == done)
        return done - before

    def _let_it_take(self) -> None:
        for _ in range(_LOOKS):
            if not self.runner.driver.procedure.base.live.ready:
                return
            QTest.qWait(2)

    def dress(self, theme: str) -> None:
        """Paint everything in a theme."""
        for widget in (self.wizard, *self.wizard.findChildren(QWidget)):
            if isinstance(widget, ThemedWidget):
                widget.set_theme(THEMES[theme])

    def close(self) -> None:
        """Close everything, and wait for the prediction that the wizard does not wait for."""
        self.wizard.close_runner()
        self.wizard.close()
        self.wizard.deleteLater()
        for thread in threading.enumerate():
            if thread.name == "ocmm-prediction":
                thread.join(PATIENCE_MS / 1000.0)
