"""The wizard that calibrates the probe: sweeps on the virtual rig, results of recorded ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureKind, SessionSite
from ocmm_core.calibration.records import ProbeStore, State
from ocmm_core.calibration.sweeping import (
    BATCH,
    PivotOutcome,
    PivotProcedure,
    PivotRequest,
    PivotSetup,
    PivotView,
)
from ocmm_core.tracking import ProbeBody
from ocmm_gui.kit import Sound
from ocmm_gui.wizards import SESSIONS
from ocmm_gui.wizards.pages import FirstConePage, PivotResultPage, SweepPage
from ocmm_sim.calibration_scenes import SweepProbe
from tests.core.calibration.pivot_site import CONE, OTHER_CONE, SIGMA_PX, PivotBench
from tests.gui.wizard_bench import WizardBench

REACH = (30.0, 30.0, 14.0)
_LOOK, _EVERY = 8, 160
"""Shown frames, and their spacing."""


class Sweeps:
    """A wizard bench for sweeps, with its sounds."""

    def __init__(self, qtbot: QtBot, folder: Path) -> None:
        self.wizard = WizardBench(qtbot, folder)
        self.recorded = PivotBench(folder)
        self.heard: list[Sound] = []
        self.wizard.wizard.sounded.connect(self.heard.append)
        self.shown = 0

    def store(self) -> ProbeStore:
        return ProbeStore(self.wizard.probe_store)

    def begun(self, poses: int = 150) -> PivotProcedure:
        """Leave a session behind that wants a few poses only."""
        bench = self.wizard.bench
        return PivotProcedure.start(
            SessionSite(
                self.wizard.probe_store / SESSIONS, bench.rig, bench.body, self.store().folder
            ),
            PivotSetup(who="technician", request=PivotRequest(poses=poses), tip="T1"),
            bench.now(),
        )

    def swept(
        self, second: ProbeBody | None = None, first: ProbeBody | None = None
    ) -> PivotProcedure:
        """Leave a session behind in which only the first cone again is missing."""
        procedure, now = self.begun(), self.wizard.bench.now
        procedure.advance(now())
        for seed, cone, body in ((1, CONE, first), (2, OTHER_CONE, second)):
            uv = self.recorded.swept(seed, cone, body=body)
            procedure.take_sweep(uv, SIGMA_PX, now())
            procedure.advance(now())
        return procedure

    def taken(self, second: ProbeBody | None = None, first: ProbeBody | None = None) -> None:
        """Leave a session behind in which both sweeps are taken."""
        procedure, now = self.swept(second, first), self.wizard.bench.now
        procedure.take_visit(self.recorded.rested(body=second), SIGMA_PX, now())
        procedure.advance(now())

    def result(self) -> PivotResultPage:
        """Go on with that session until there is a result or none."""
        wizard = self.wizard
        wizard.go_on(ProcedureKind.PIVOT)
        page = wizard.runner.page()
        assert isinstance(page, PivotResultPage)
        wizard.until(
            lambda: wizard.seen.view.outcome is not None or wizard.seen.view.base.error is not None
        )
        wizard.until(lambda: wizard.seen.calculating_s is None and "CALCULATING" not in page.word())
        return page

    @property
    def view(self) -> PivotView:
        view = self.wizard.seen.view
        assert isinstance(view, PivotView)
        return view

    def page(self) -> SweepPage:
        page = self.wizard.runner.page()
        assert isinstance(page, SweepPage)
        return page

    def sweep(self, scene: SweepProbe, *, batches: int = 10_000) -> list[str]:
        """Show a sweep until its step ends or enough is recorded; return the banner's texts."""
        virtual = self.wizard.bench.virtual(scene)
        driver, said = self.wizard.runner.driver, list[str]()
        step, before = driver.procedure.base.step.name, driver.procedure.base.step.done
        for first in range(0, virtual.n_frames - _LOOK, _EVERY):
            base = driver.procedure.base
            if base.step.name != step or base.step.done - before >= batches * BATCH:
                break
            assert self.wizard.watcher is not None
            self.wizard.watcher(virtual.frames(first, _LOOK))
            while driver.procedure.base.live.ready:
                QTest.qWait(2)
            if first % (8 * _EVERY) == 0:
                QTest.qWait(55)
            word = self.page().banner.word() if self.is_sweeping() else ""
            if not said or said[-1] != word:
                said.append(word)
        return said

    def is_sweeping(self) -> bool:
        return isinstance(self.wizard.runner.page(), SweepPage)

    def close(self) -> None:
        self.wizard.close()


@pytest.fixture
def sweeps(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[Sweeps]:
    made = Sweeps(qtbot, tmp_path)
    yield made
    made.close()


def test_a_sweep_begins_and_ends_by_itself_and_the_next_one_follows(sweeps: Sweeps) -> None:
    sweeps.begun()
    wizard = sweeps.wizard
    wizard.go_on(ProcedureKind.PIVOT)
    wizard.key(Qt.Key.Key_Return)
    wizard.enters("first")
    page = sweeps.page()
    wizard.until(lambda: page.banner.word() == "BALL INTO THE CONE")
    assert not wizard.runner.buttons["next"].isEnabled()
    said = sweeps.sweep(SweepProbe(cone=CONE, seconds=16.0, seed=1, reach_deg=REACH))
    words = [word.rstrip("0123456789 ") for word in said if word]
    order = list(dict.fromkeys(words))
    assert order[:3] == ["BALL INTO THE CONE", "STARTS IN", "SWEEP"], said
    # Nobody has a hand for a key: the second sweep is entered, a moment after the first is good.
    wizard.enters("second")
    heard = list(dict.fromkeys(sweeps.heard))
    assert heard[:3] == [Sound.TICK, Sound.STARTED, Sound.FEATURE_COMPLETE], heard
    wizard.until(lambda: sweeps.page().banner.word() == "BALL INTO THE CONE")
    view = sweeps.view
    assert view.first.good
    assert view.second.poses == 0
    assert sweeps.page().bars.labels()[-1] == "Away from the first –"
    # The map of the first sweep is full: all wanted directions are among the reached ones.
    assert view.first.covered > 0.5


def test_what_was_swept_survives_a_crash_and_can_be_thrown_away(sweeps: Sweeps) -> None:
    sweeps.begun()
    wizard = sweeps.wizard
    wizard.go_on(ProcedureKind.PIVOT)
    wizard.key(Qt.Key.Key_Return)
    wizard.enters("first")
    scene = SweepProbe(cone=CONE, seconds=8.0, seed=1, reach_deg=REACH)
    sweeps.sweep(scene, batches=2)
    wizard.until(lambda: sweeps.view.first.poses == 2 * BATCH)
    page = sweeps.page()
    wizard.until(lambda: page.bars.labels()[4] == f"Poses {2 * BATCH} / 150")
    assert "%" not in page.map.accessibleDescription()
    assert page.map.accessibleDescription() != "0 of 0 directions"
    wizard.crash()
    wizard.wizard.open(ProcedureKind.PIVOT)
    assert f"first sweep, {2 * BATCH} of 150" in wizard.wizard.start.list.item(0).text()
    wizard.go_on(ProcedureKind.PIVOT)
    assert wizard.seen.view.base.step.name == "first"
    wizard.until(lambda: sweeps.view.first.poses == 2 * BATCH)
    wizard.until(lambda: wizard.runner.actions_by_key["anew"].isEnabled())
    wizard.key(Qt.Key.Key_W)
    wizard.until(lambda: sweeps.view.first.poses == 0)
    wizard.until(lambda: not wizard.runner.actions_by_key["anew"].isEnabled())


def test_the_first_cone_again_is_taken_by_itself(sweeps: Sweeps) -> None:
    sweeps.swept()
    wizard = sweeps.wizard
    wizard.go_on(ProcedureKind.PIVOT)
    page = wizard.runner.page()
    assert isinstance(page, FirstConePage)
    wizard.until(lambda: page.banner.word() == "BACK INTO THE FIRST CONE")
    assert not wizard.runner.buttons["next"].isEnabled()
    rested = SweepProbe(cone=CONE, seconds=1.0, seed=3, reach_deg=(0.0, 0.0, 0.0))
    virtual = wizard.bench.virtual(rested)
    driver = wizard.runner.driver
    for first in range(0, virtual.n_frames - _EVERY, _EVERY):
        assert wizard.watcher is not None
        wizard.watcher(virtual.frames(first, _EVERY))
        if driver.procedure.base.live.ready:
            wizard.until(lambda: not driver.procedure.base.live.ready)
            break
    # Both hands are full: the result opens automatically.
    wizard.enters("result")


@pytest.mark.slow
def test_result_is_shown_compared_and_a_changed_tip_wants_a_reason(sweeps: Sweeps) -> None:
    sweeps.taken()
    page, wizard = sweeps.result(), sweeps.wizard
    assert page.word() in ("GOOD", "USABLE, CHECK"), page.sentence.text()
    for number, title in enumerate(PivotResultPage.plots):
        wizard.key(Qt.Key(Qt.Key.Key_1 + number))
        assert page.plot() == title
    outcome = sweeps.view.outcome
    assert isinstance(outcome, PivotOutcome)
    first = outcome.first
    assert page.trails.word().startswith("400 poses, 6 LEDs")
    assert page.facts.value("Tip") == f"U {2e3 * first.tip_sigma:.1f} µm (k = 2)"
    assert "First calibration of this tip" in page.compare.summary.text()
    assert page.compare.tip.cells(2)[1] == f"{first.tip_probe[2]:.4f}"
    assert page.compare.tip.cells(2)[-1] == "–"
    thesis = 1e3 * (first.thesis_tip_probe - first.tip_probe)[0]
    assert page.compare.tip.cells(0)[5] == f"{thesis:+.1f}"
    wizard.key(Qt.Key.Key_A)
    wizard.key(Qt.Key.Key_Return, wizard.wizard.focusWidget())
    wizard.until(lambda: wizard.seen.view.base.stored)
    assert sweeps.store().status("T1", wizard.bench.now()).state is State.SUSPECT
    wizard.until(lambda: "Qualify the tip" in wizard.runner.gate.text())
    wizard.key(Qt.Key.Key_Escape)

    # A blow: the tip has moved by 0.1 mm.
    body = wizard.bench.body
    bent = replace(body, tip_probe=body.tip_probe + np.array([0.1, 0.0, 0.0]))
    sweeps.taken(bent, bent)
    page = sweeps.result()
    assert page.word() == "TIP CHANGED"
    assert page.compare.tip.cells(0)[-1].startswith("+9") or page.compare.tip.cells(0)[
        -1
    ].startswith("+10")
    wizard.key(Qt.Key.Key_A)
    assert wizard.runner.decision.question() == "The tip moved by 0.100 mm. Why?"
    reason = wizard.wizard.focusWidget()
    assert isinstance(reason, QLineEdit)
    # Without a reason Yes does nothing.
    QTest.keyClick(reason, Qt.Key.Key_Return)
    assert wizard.runner.decision.isVisible()
    QTest.keyClicks(reason, "it fell down")
    QTest.keyClick(reason, Qt.Key.Key_Return)
    wizard.until(lambda: wizard.seen.view.base.stored)
    record = sweeps.store().calibrations()[-1]
    assert record.change_reason == "it fell down"
    assert record.change_mm == pytest.approx(0.1, abs=0.01)


def test_sweeps_that_contradict_each_other_give_no_result(sweeps: Sweeps) -> None:
    body = sweeps.wizard.bench.body
    sweeps.taken(replace(body, tip_probe=body.tip_probe + np.array([0.0, 0.0, 0.2])))
    page = sweeps.result()
    assert page.word() == "NO RESULT"
    assert "second sweep places the tip" in page.sentence.text()
    assert not sweeps.wizard.runner.buttons["accept"].isEnabled()
    assert sweeps.store().tips == ()


def test_a_session_whose_file_is_lost_while_idle_is_told_once_and_takes_nothing(
    sweeps: Sweeps,
) -> None:
    sweeps.begun()
    wizard = sweeps.wizard
    wizard.go_on(ProcedureKind.PIVOT)
    session = sweeps.view.base.session
    session.unlink()
    wizard.until(lambda: len(wizard.errors) > 0)
    assert "it was removed" in wizard.errors[0].what
    wizard.until(lambda: "it was removed" in wizard.seen.view.base.live.hint)
    assert not wizard.seen.view.base.live.ready
    wizard.key(Qt.Key.Key_Return)
    wizard.until(lambda: len(wizard.errors) > 1)
    assert {one.code for one in wizard.errors} == {wizard.errors[0].code}
    assert not session.exists()
