"""Wizards of a tip: touched on the virtual rig, and results of sessions that were taken before."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QComboBox
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureKind, SessionSite
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import ProbeStore, State
from ocmm_core.calibration.tip import (
    Countdown,
    Phase,
    QualificationSetup,
    TipCheckProcedure,
    TipCheckView,
    TipOutcome,
    TipQualificationProcedure,
    TipView,
    TouchSetup,
)
from ocmm_gui.kit import Mark
from ocmm_gui.wizards import SESSIONS
from ocmm_gui.wizards.pages import ConePage, SpherePage, TipCheckResultPage, TipResultPage
from ocmm_gui.wizards.pages._touch_pages import told_of
from ocmm_sim.calibration_scenes import TipFault
from ocmm_sim.sources import scene_of_tip
from tests.core.calibration.test_procedure_tip import TIP, Tips, take
from tests.gui.wizard_bench import WizardBench


class TipBench:
    """A wizard bench with a probe that was calibrated with one tip."""

    def __init__(self, qtbot: QtBot, folder: Path, *, qualified: bool) -> None:
        self.tips = Tips.at(folder, qualified=qualified)
        self.wizard = WizardBench(qtbot, folder, TIP)

    def store(self) -> ProbeStore:
        return ProbeStore(self.wizard.probe_store)

    def taken(self, sphere: int = 25, cone: int = 5) -> None:
        """Leave a qualification with the given numbers of points."""
        bench = self.wizard.bench
        procedure = TipQualificationProcedure.start(
            SessionSite(
                self.wizard.probe_store / SESSIONS, bench.rig, bench.body, self.wizard.probe_store
            ),
            QualificationSetup(
                who="technician",
                temperature=Temperature(20.5, 0.3, ""),
                tip=TIP,
                sphere=bench.sphere,
            ),
            bench.now(),
        )
        take(procedure, bench, sphere, cone)
        while procedure.base.step.gate.open:
            procedure.advance(bench.now())

    def touch(self, at_most: int, fault: TipFault | None = None) -> int:
        """Touch the next targets on the virtual rig."""
        view = self.wizard.seen.view
        assert isinstance(view, TipView | TipCheckView)
        bench = self.wizard.bench
        scene = scene_of_tip(view, bench.sphere, bench.rig, 3, fault or TipFault())
        return self.wizard.show(bench.rig, scene, at_most=at_most)

    def until_word(self, page: TipResultPage, word: str) -> None:
        self.wizard.until(lambda: page.word() == word)

    def until_result(self) -> None:
        self.wizard.until(lambda: self.wizard.seen.view.outcome is not None)


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[TipBench]:
    made = TipBench(qtbot, tmp_path, qualified=False)
    yield made
    made.wizard.close()


def test_the_sphere_is_touched_without_a_key_and_goes_on_after_a_crash(bench: TipBench) -> None:
    wizard = bench.wizard
    wizard.begin(ProcedureKind.QUALIFICATION)
    field = wizard.wizard.start.fields["tip"]
    assert isinstance(field, QComboBox)
    assert field.currentData() == TIP
    wizard.key(Qt.Key.Key_Return)
    wizard.enters("sphere")
    page = wizard.runner.page()
    assert isinstance(page, SpherePage)
    assert wizard.seen.automatic
    wizard.until(lambda: page.banner.word() == "TOUCH")
    assert "pole" in page.banner.note()
    assert bench.touch(3) == 3
    wizard.until(lambda: page.bars.labels()[0] == "Places 3 / 25")
    assert page.map.accessibleDescription() == "3 of 25 directions"
    wizard.until(lambda: page.banner.word() == "TAKEN")
    wizard.key(Qt.Key.Key_Backspace)
    wizard.until(lambda: page.bars.labels()[0] == "Places 2 / 25")
    wizard.crash()
    wizard.wizard.open(ProcedureKind.QUALIFICATION)
    assert "sphere, 2 of 25" in wizard.wizard.start.list.item(0).text()
    wizard.go_on(ProcedureKind.QUALIFICATION)
    again = wizard.runner.page()
    assert isinstance(again, SpherePage)
    assert bench.touch(3) == 3
    wizard.until(lambda: again.bars.labels()[0] == "Places 5 / 25")
    # Now the points determine the ball, and the effect of the rest can be predicted.
    view = wizard.seen.view
    assert isinstance(view, TipView)
    expected = f"{2e3 * view.sphere.diameter_sigma_end_mm:.1f} µm"
    wizard.until(lambda: again.bars.labels()[-1] == f"… with all places {expected}")
    wizard.until(lambda: again.ball.number() == f"{view.sphere.diameter_mm:.4f} mm")


def test_banner_counts_down_and_says_how_to_hold_the_probe(bench: TipBench) -> None:
    bench.taken(cone=2)
    wizard = bench.wizard
    wizard.go_on(ProcedureKind.QUALIFICATION)
    page = wizard.runner.page()
    assert isinstance(page, ConePage)
    view = wizard.seen.view
    assert isinstance(view, TipView)
    assert view.cone.next_attitude is not None
    how = view.cone.attitudes[view.cone.next_attitude].name
    wizard.until(lambda: page.banner.word() == how.upper())
    assert page.map.accessibleDescription() == "2 of 5 directions"
    wizard.until(lambda: page.spread.number() == f"{1e3 * view.cone.spread_2s_mm:.1f} µm")
    shown = {}
    for phase, seconds, share in (
        (Phase.RESTING, 0.4, 0.2), (Phase.READY, 0.0, 1.0), (Phase.TAKEN, 0.0, 0.0),
    ):  # fmt: skip
        then = replace(view, countdown=Countdown(phase, seconds, share))
        told = told_of(then, "X", how, automatic=True)
        shown[phase] = (told.word, told.mark, told.share)
    assert shown == {
        Phase.RESTING: ("HOLD STILL  0.4", Mark.ACTIVE, 0.2),
        Phase.READY: ("READY", Mark.GOOD, 1.0),
        Phase.TAKEN: ("TAKEN", Mark.GOOD, 0.0),
    }


def test_a_verdict_is_shown_stored_and_compared_with_the_one_before(bench: TipBench) -> None:
    wizard = bench.wizard
    for number in range(2):
        bench.taken()
        wizard.go_on(ProcedureKind.QUALIFICATION)
        page = wizard.runner.page()
        assert isinstance(page, TipResultPage)
        bench.until_result()
        bench.until_word(page, "PASSED")
        outcome = wizard.seen.view.outcome
        assert isinstance(outcome, TipOutcome)
        assert page.facts.value("Diameter") == f"{outcome.record.diameter_mm:.4f} mm"
        assert page.chart.table.rowCount() == len(outcome.record.checks)
        assert page.form.word().startswith("25 points")
        assert page.compared.cells(0)[2] == (
            "–" if number == 0 else f"{bench.store().qualifications()[0].diameter_mm:.4f}"
        )
        for plot, title in enumerate(TipResultPage.plots):
            wizard.key(Qt.Key(Qt.Key.Key_1 + plot))
            assert page.plot() == title
        wizard.key(Qt.Key.Key_A)
        wizard.key(Qt.Key.Key_Return, wizard.wizard.focusWidget())
        wizard.until(lambda: wizard.seen.view.base.stored)
        wizard.key(Qt.Key.Key_Escape)
    assert bench.store().status(TIP, wizard.bench.now()).state is State.VALID


@pytest.mark.slow
def test_a_tip_that_is_too_long_fails_the_check_in_words(qtbot: QtBot, tmp_path: Path) -> None:
    bench = TipBench(qtbot, tmp_path, qualified=True)
    wizard, site = bench.wizard, bench.wizard.bench
    try:
        procedure = TipCheckProcedure.start(
            SessionSite(wizard.probe_store / SESSIONS, site.rig, site.body, wizard.probe_store),
            TouchSetup(who="inspector", tip=TIP, sphere=site.sphere),
            site.now(),
        )
        take(procedure, site, 13, 0)
        procedure.advance(site.now())
        wizard.go_on(ProcedureKind.TIP_CHECK)
        wizard.enters("cone")
        # The stylus came loose between sphere and cone.
        assert bench.touch(5, TipFault(length_mm=1.0)) == 5
        wizard.enters("result")
        page = wizard.runner.page()
        assert isinstance(page, TipCheckResultPage)
        wizard.until(lambda: page.word() == "FAILED")
        assert "longer" in page.warnings.text()
        wizard.key(Qt.Key.Key_A)
        wizard.key(Qt.Key.Key_Return, wizard.wizard.focusWidget())
        wizard.until(lambda: wizard.seen.view.base.stored)
        assert bench.store().status(TIP, site.now()).state is State.SUSPECT
    finally:
        wizard.close()


def test_a_tip_that_was_never_qualified_cannot_be_checked(bench: TipBench) -> None:
    bench.wizard.begin(ProcedureKind.TIP_CHECK)
    assert bench.wizard.wizard.runner is None
    assert "was not qualified since" in bench.wizard.wizard.start.trouble.text()
