"""The wizard that calibrates an optical tracker, with the frames of a virtual one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from benchmarks.trackers import TrackerSite, drawn
from ocmm_core.calibration.cameras import TrackerProcedure
from ocmm_core.calibration.guided import ProcedureDecision, ProcedureKind
from ocmm_core.calibration.records import CalibrationStatus, judge, open_calibration
from ocmm_gui.wizards import Wizard, WizardSite
from ocmm_gui.wizards._site import running_rig
from ocmm_gui.wizards.pages import TrackerPage, TrackerResultPage
from ocmm_sim.sources import VirtualSite, scenes_of_tracker
from tests.gui.wizard_bench import WizardBench


class TrackerBench(WizardBench):
    """A wizard of the tracker instead of cameras."""

    def _open(self) -> Wizard:
        self.tracker = TrackerSite(self.bench.folder, *drawn(3), 3)
        self.store = self.tracker.store.folder
        wizard = super()._open()
        self.site = WizardSite(
            self.tracker.rig, self.tracker.body, self.store, "technician", self._tap
        )
        wizard._site = self.site  # noqa: SLF001 - the site of the tracker
        return wizard

    def play(self) -> None:
        """Show the minute at rest and the places; the wizard records by itself."""
        procedure = self.runner.driver.procedure
        assert isinstance(procedure, TrackerProcedure)
        tracker = self.tracker
        for attempt in range(4):
            if procedure.base.step.done < procedure.base.step.wanted:
                self._show(procedure, tracker.virtual(1000 * attempt))

    def _show(self, procedure: TrackerProcedure, site: VirtualSite) -> None:
        rig, tracker = self.tracker.rig, self.tracker
        shown = site.script(scenes_of_tracker(site, rig, procedure.view)).build()
        for first in range(0, shown.n_frames, 50):
            if self.watcher is None or procedure.base.step.name == "result":
                break
            self.watcher(tracker.frames(rig, shown, first, min(50, shown.n_frames - first)))
            if procedure.base.live.ready:
                procedure.record(self.bench.now())
            if procedure.base.step.name == "rest" and procedure.base.step.gate.open:
                procedure.advance(self.bench.now())


@pytest.fixture
def bench(qtbot: QtBot, tmp_path: Path) -> Iterator[TrackerBench]:
    made = TrackerBench(qtbot, tmp_path)
    yield made
    made.close()


def test_a_tracker_is_calibrated_in_the_window(bench: TrackerBench) -> None:
    bench.begin(ProcedureKind.TRACKER)
    bench.until(lambda: bench.wizard.runner is not None)
    bench.step("rest")
    page = bench.runner.page()
    assert isinstance(page, TrackerPage)
    bench.play()
    bench.until(lambda: bench.seen.view.base.step.done >= 20)
    bench.step("result")
    result = bench.runner.page()
    assert isinstance(result, TrackerResultPage)
    bench.until(lambda: result.table.rowCount() > 0)
    rows = [result.table.cells(row) for row in range(result.table.rowCount())]
    assert rows[2][0] == "sigma_across"
    assert float(rows[2][2]) == pytest.approx(bench.tracker.true.noise.sigma_across, rel=0.05)
    assert result.word() == "USABLE, CHECK"
    bench.key(Qt.Key.Key_A)
    reason = bench.wizard.focusWidget()
    assert isinstance(reason, QLineEdit)
    QTest.keyClicks(reason, "a new tracker")
    QTest.keyClick(reason, Qt.Key.Key_Return)
    bench.until(lambda: bench.seen.view.base.stored)
    assert bench.seen.view.base.decision is ProcedureDecision.ACCEPTED
    in_use = open_calibration(bench.tracker.file, bench.tracker.folder)
    assert judge(in_use, bench.bench.now()).word is CalibrationStatus.SUSPECT
    # The frames still come by the calibration at the start of the program.
    assert running_rig(bench.site).identity == bench.site.rig.identity
    assert running_rig(bench.site).identity != bench.tracker.store.active_hash
