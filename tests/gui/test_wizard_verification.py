"""The wizard that verifies a calibration, on the virtual rig."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import (
    ProcedureKind,
    SessionSite,
    VerificationOutcome,
    VerificationView,
)
from ocmm_core.calibration.records import EventKind, State, load_bar
from ocmm_core.calibration.verification import VerificationProcedure, VerificationSetup
from ocmm_core.documents import resource
from ocmm_gui.wizards.pages import LinesPage, SeatsPage, SpheresPage, VerdictPage
from ocmm_sim.calibration_scenes import TouchSeats
from tests.core.calibration.procedure_site import show
from tests.gui.wizard_bench import WizardBench


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[WizardBench]:
    made = WizardBench(qtbot, tmp_path)
    made.bench.calibrated()
    yield made
    made.close()


def _measured(bench: WizardBench, off_mm: float = 0.0) -> None:
    """Leave a session behind in which everything was taken; a nest of the first line may be off."""
    site, store = bench.bench, bench.use_store_of_bench()
    rig = bench.running()
    procedure = VerificationProcedure.start(
        SessionSite(bench.store / "sessions", rig, site.body, store.folder),
        VerificationSetup(who="technician", spheres=(site.sphere,), bar=site.bar),
        site.now(),
    )
    first, lines, *others = site.verified_scenes(procedure, (site.sphere,))
    assert isinstance(lines, TouchSeats)
    tips = np.array(lines.tips)
    tips[2] += off_mm * (tips[5] - tips[0]) / 400.0
    lines = msgspec.structs.replace(lines, tips=tuple(map(tuple, tips.tolist())))
    scenes = (first, lines, *others)
    show(procedure, site.virtual(*scenes), site.now)


def _verdict(bench: WizardBench) -> VerdictPage:
    bench.go_on(ProcedureKind.VERIFICATION)
    bench.step("result")
    page = bench.runner.page()
    assert isinstance(page, VerdictPage)
    bench.until(lambda: page.word() in ("PASSED", "FAILED", "NO VERDICT"))
    return page


def test_nests_are_taken_one_by_one_where_the_picture_says(bench: WizardBench) -> None:
    bench.begin(ProcedureKind.VERIFICATION)
    assert bench.wizard.runner is not None, bench.wizard.start.trouble.text()
    bench.step("seats")
    seats = bench.runner.page()
    assert isinstance(seats, SeatsPage)
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    places = ((-100.0, -40.0, -80.0), (100.0, 40.0, 60.0))
    assert bench.show(None, TouchSeats(tips=places, seed=1)) == 2
    bench.until(lambda: seats.picture.accessibleDescription() == "both seats visited")
    bench.step("lines")
    page = bench.runner.page()
    assert isinstance(page, LinesPage)
    assert "7 of 7 lines to go" in bench.runner.gate.text()
    assert page.picture.accessibleDescription() == "face diagonal YZ 1"
    view = bench.seen.view
    assert isinstance(view, VerificationView)
    begin, end = view.lines[0].ends_world
    nests = np.array(load_bar(resource("artefacts", "verification_bar.toml")).nests) / 400.0
    tips = tuple(tuple((begin + share * (end - begin)).tolist()) for share in nests)
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    assert bench.show(None, TouchSeats(tips=tips, seed=1)) == 6
    bench.until(lambda: page.score.number() == "6 / 42")
    bench.until(lambda: page.picture.accessibleDescription() == "face diagonal XY 1")
    # A complete line counts: it cannot be taken back, and it did not fail.
    bench.key(Qt.Key.Key_Backspace)
    bench.key(Qt.Key.Key_N)
    bench.until(lambda: len(bench.errors) == 1)
    assert "cannot be repeated" in bench.errors[0].what
    assert page.score.number() == "6 / 42"


@pytest.mark.slow
def test_a_passed_verification_makes_the_calibration_valid(bench: WizardBench) -> None:
    _measured(bench)
    store = bench.use_store_of_bench()
    assert store.status(bench.bench.now()).state is State.SUSPECT
    page = _verdict(bench)
    assert page.word() == "PASSED"
    outcome = bench.seen.view.outcome
    assert isinstance(outcome, VerificationOutcome)
    worst = outcome.record.checks[outcome.largest]
    assert page.facts.value("Checks") == "37"
    assert page.facts.value("Corners") == "8 of 8 reached"
    assert page.facts.value("Repeats").startswith("seat 1 ")
    assert "limit 80.0" in page.facts.value("Form")
    assert page.facts.value("Worst") == worst.name
    assert f"{1e3 * worst.error_mm:+.1f}" in page.chart.word()
    spheres = bench.runner.pages["spheres"]
    assert isinstance(spheres, SpheresPage)
    bench.key(Qt.Key.Key_A)
    assert bench.runner.decision.question() == "Store this verdict?"
    bench.key(Qt.Key.Key_Return)
    bench.until(lambda: bench.seen.view.base.stored)
    assert bench.use_store_of_bench().status(bench.bench.now()).state is State.VALID


@pytest.mark.slow
def test_a_failed_verification_says_so_and_keeps_the_calibration_suspect(
    bench: WizardBench,
) -> None:
    # 0.2 mm, and 0.05 mm are allowed.
    _measured(bench, 0.2)
    page = _verdict(bench)
    assert page.word() == "FAILED"
    assert page.facts.value("Checks") == "1 of 37 failed"
    assert "If only one line failed, repeat it once" in page.sentence.text()
    # The failed line may be repeated: back to the lines, among which it is missing.
    bench.key(Qt.Key.Key_N)
    bench.enters("lines")
    bench.until(lambda: "1 of 7 lines to go" in bench.runner.gate.text())
    # Leaving in the middle changes nothing: no verdict is stored, the session is offered.
    bench.crash()
    store = bench.use_store_of_bench()
    assert store.events[-1].kind is EventKind.ACCEPTED
    bench.wizard.open(ProcedureKind.VERIFICATION)
    assert "36 of 42" in bench.wizard.start.list.item(0).text()


@pytest.fixture
def fresh(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[WizardBench]:
    made = WizardBench(qtbot, tmp_path)
    yield made
    made.close()


def test_without_a_calibration_there_is_nothing_to_verify(fresh: WizardBench) -> None:
    fresh.begin(ProcedureKind.VERIFICATION)
    assert fresh.wizard.runner is None
    assert "Calibrate the cameras first" in fresh.wizard.start.trouble.text()
    fresh.key(Qt.Key.Key_Escape)
    fresh.until(lambda: fresh.left == [1])
