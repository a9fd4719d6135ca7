"""The wizard that calibrates the cameras from known points, on the virtual rig."""

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

from ocmm_core.calibration.cameras import KnownPoints, KnownPointsProcedure, KnownPointsSetup
from ocmm_core.calibration.guided import (
    CalibrationOutcome,
    KnownPointsView,
    ProcedureDecision,
    ProcedureKind,
    SessionSite,
)
from ocmm_core.calibration.records import State
from ocmm_core.errors import CalibrationError
from ocmm_gui.kit import DEBOUNCE_S
from ocmm_gui.wizards.pages import KnownPointsPage, ResultPage
from ocmm_sim.calibration_scenes import TargetScene
from tests.gui.wizard_bench import WizardBench
from tests.waiting import let_pass


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[WizardBench]:
    made = WizardBench(qtbot, tmp_path)
    yield made
    made.close()


def _list(folder: Path, points: KnownPoints) -> str:
    path = folder / "points.csv"
    rows = (
        f"{name};{x!r};{y!r};{z!r}"
        for name, (x, y, z) in zip(points.names, points.positions_world.tolist(), strict=True)
    )
    head = f"# ocmm reference points\n# unit: mm\n# uncertainty: {points.sigma}\n# frame: CMM\n"
    path.write_text(head + "\n".join(("name;x;y;z", *rows)) + "\n")
    return str(path)


def _scene(points: KnownPoints, first: int, last: int) -> TargetScene:
    return TargetScene(positions=tuple(map(tuple, points.positions_world[first:last].tolist())))


def _collected(
    bench: WizardBench, n: int = 100, *, wrong_order: bool = False
) -> KnownPointsProcedure:
    """Leave a session behind in which all points are taken, as after a crash."""
    site, points = bench.bench, bench.bench.points(n)
    store = bench.use_store_of_bench()
    rig, spots = bench.running(), site.spots(points)
    if wrong_order:
        spots = replace(spots, uv=spots.uv[:, ::-1])
    procedure = KnownPointsProcedure.start(
        SessionSite(bench.store / "sessions", rig, site.body, store.folder),
        KnownPointsSetup(who="technician", points=points),
        site.now(),
    )
    procedure.take_table(spots, site.now())
    procedure.advance(site.now())
    procedure.advance(site.now())
    return procedure


def _result(bench: WizardBench) -> ResultPage:
    bench.go_on(ProcedureKind.KNOWN_POINTS)
    page = bench.runner.page()
    assert isinstance(page, ResultPage)
    bench.until(lambda: bench.seen.view.outcome is not None and bench.seen.calculating_s is None)
    bench.until(lambda: page.word() in ("GOOD", "USABLE, CHECK"))
    return page


def test_one_key_takes_one_point_and_says_why_next_is_closed(bench: WizardBench) -> None:
    points = bench.bench.points(12)
    bench.begin(ProcedureKind.KNOWN_POINTS, points=_list(bench.bench.folder, points))
    bench.step("collect")
    page, runner = bench.runner.page(), bench.runner
    assert isinstance(page, KnownPointsPage)
    assert page.score.number() == "0 / 12"
    assert "12 of 12 points are missing" in runner.gate.text()
    assert not runner.buttons["next"].isEnabled()
    # Nothing is seen yet: Space is answered, and nothing is taken.
    bench.key(Qt.Key.Key_Space)
    bench.until(lambda: len(bench.errors) == 1)
    assert bench.errors[0].code == "session.not_ready"
    bench.show(None, _scene(points, 0, 1))
    bench.until(lambda: page.live.word() == "READY")
    assert [camera.accessibleDescription() for camera in page.live.cameras] == ["1 spot"] * 2
    for _ in range(5):
        # Between the picture and the key a window of frames may not have been whole.
        let_pass(DEBOUNCE_S)
        bench.key(Qt.Key.Key_Space)
        told = len(bench.errors)
        bench.until(lambda: page.score.number() == "1 / 12" or len(bench.errors) > told)  # noqa: B023
        if page.score.number() == "1 / 12":
            break
    assert page.score.number() == "1 / 12"
    # The same place cannot be taken twice, and the next point is aimed at.
    bench.until(lambda: page.live.word() == "WAIT")
    assert "move to" in page.live.hint()
    assert "P001" in runner.instruction.text()
    assert page.picture.accessibleDescription() == "Next: P001"
    assert page.list.item(0).text().startswith("✓")
    bench.key(Qt.Key.Key_Backspace)
    bench.until(lambda: page.score.number() == "0 / 12")
    assert "P000" in runner.instruction.text()


def test_a_point_that_nobody_sees_is_skipped_and_one_that_is_chosen_comes_next(
    bench: WizardBench,
) -> None:
    bench.begin(
        ProcedureKind.KNOWN_POINTS, points=_list(bench.bench.folder, bench.bench.points(12))
    )
    bench.step("collect")
    page = bench.runner.page()
    assert isinstance(page, KnownPointsPage)
    bench.key(Qt.Key.Key_S)
    bench.until(lambda: page.score.number() == "1 / 12")
    assert page.list.item(0).text().startswith("–")
    page.list.setCurrentRow(7)
    bench.until(lambda: "P007" in bench.runner.instruction.text())


def test_what_was_taken_survives_a_crash_and_is_offered(bench: WizardBench) -> None:
    points = bench.bench.points(12)
    bench.begin(ProcedureKind.KNOWN_POINTS, points=_list(bench.bench.folder, points))
    bench.step("collect")
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    assert bench.show(None, _scene(points, 0, 5)) == 5
    bench.crash()
    bench.wizard.open(ProcedureKind.KNOWN_POINTS)
    (item,) = (bench.wizard.start.list.item(i).text() for i in range(1))
    assert "technician: known points, 5 of 12" in item
    assert bench.wizard.start.resume_button.property("role") == "primary"
    bench.go_on(ProcedureKind.KNOWN_POINTS)
    assert bench.seen.view.base.step.name == "collect"
    bench.until(lambda: "P005" in bench.runner.instruction.text())
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    assert bench.show(None, _scene(points, 5, 12)) == 7
    # All are taken, but so few say nothing: that is why Next is still closed.
    bench.until(lambda: "saw only 12 of the points" in bench.runner.gate.text())
    # Each observation is at its place in the list, independent of the operator.
    view = bench.seen.view
    assert isinstance(view, KnownPointsView)
    assert [point.views for point in view.points] == [2] * 12


def test_a_damaged_session_is_named_and_cannot_go_on(bench: WizardBench) -> None:
    procedure = _collected(bench, 40)
    path = procedure.base.session
    path.write_bytes(path.read_bytes().replace(b"P003", b"P004", 1))
    bench.wizard.open(ProcedureKind.KNOWN_POINTS)
    start = bench.wizard.start
    assert start.list.item(0).text().startswith("▲")
    assert not start.resume_button.isEnabled()
    assert start.begin_button.property("role") == "primary"


@pytest.mark.slow
def test_result_compared_accepted_and_compared_again(bench: WizardBench) -> None:
    _collected(bench)
    page = _result(bench)
    assert page.word() == "GOOD"
    for number, title in enumerate(ResultPage.plots):
        bench.key(Qt.Key(Qt.Key.Key_1 + number))
        assert page.plot() == title
    assert "nothing to compare" in page.compare.summary.text()
    outcome = bench.seen.view.outcome
    assert isinstance(outcome, CalibrationOutcome)
    # 100 points, a quarter of them held back: that many errors in space are shown.
    assert len(outcome.errors_world) == 25
    rms = 1e3 * np.sqrt(np.mean(outcome.errors_world**2, axis=0))
    assert page.space.word().startswith("RMS X {:.1f}, Y {:.1f}, Z {:.1f} µm".format(*rms))
    assert f"{outcome.record.rms_px:.4f} px RMS" == page.facts.value("Residuals")
    bench.key(Qt.Key.Key_A)
    assert bench.runner.decision.isVisible()
    assert bench.runner.decision.question() == "Activate this calibration?"
    reason = bench.wizard.focusWidget()
    assert isinstance(reason, QLineEdit)
    # Letters and blanks that are keys of the wizard belong to the reason.
    QTest.keyClicks(reason, "a new lens k")
    assert reason.text() == "a new lens k"
    assert bench.use_store_of_bench().active_hash is None
    QTest.keyClick(reason, Qt.Key.Key_Return)
    bench.until(lambda: bench.seen.view.base.stored)
    store = bench.use_store_of_bench()
    assert store.status(bench.bench.now()).state is State.SUSPECT
    assert store.events[-1].reason == "a new lens k"
    bench.until(lambda: "Verify it" in bench.runner.gate.text())
    assert not bench.runner.buttons["keep"].isEnabled()
    bench.key(Qt.Key.Key_Escape)
    assert bench.left == [1]

    _collected(bench)
    page = _result(bench)
    assert "mrad" in page.compare.summary.text()
    # The same spots again: nothing may seem to have moved.
    assert page.compare.cameras.cells(0) == (
        "left", "0.0000", "0.0000", "+0.00000", "+0.000", "+0.000",
    )  # fmt: skip
    bench.key(Qt.Key.Key_K)
    bench.key(Qt.Key.Key_Return)
    bench.until(lambda: bench.seen.view.base.decision is ProcedureDecision.KEPT)
    bench.until(lambda: "Nothing was changed" in bench.runner.gate.text())
    assert bench.use_store_of_bench().active_hash == store.active_hash
    bench.key(Qt.Key.Key_Escape)
    bench.wizard.open(ProcedureKind.KNOWN_POINTS)
    assert bench.wizard.start.list.count() == 0


def test_a_calculation_is_given_up_and_done_again(bench: WizardBench) -> None:
    _collected(bench, 60)
    bench.go_on(ProcedureKind.KNOWN_POINTS)
    page = bench.runner.page()
    assert isinstance(page, ResultPage)
    bench.until(lambda: bench.seen.calculating_s is not None)
    bench.until(lambda: bench.runner.actions_by_key["cancel"].isEnabled())
    assert not bench.runner.actions_by_key["accept"].isEnabled()
    bench.key(Qt.Key.Key_C)
    bench.until(lambda: page.word() == "NO RESULT")
    assert "cancelled" in page.sentence.text()
    bench.until(lambda: "No result to accept" in bench.runner.gate.text())
    # It does not restart automatically; leaving while it runs ends it.
    QTest.qWait(200)
    assert bench.seen.calculating_s is None
    bench.key(Qt.Key.Key_R)
    # At once: before its thread has run.
    bench.runner.driver.cancel()
    bench.until(lambda: bench.seen.calculating_s is None)
    bench.until(lambda: "cancelled" in page.sentence.text())
    bench.key(Qt.Key.Key_R)
    bench.until(lambda: bench.seen.calculating_s is not None)


@pytest.mark.slow
def test_a_list_in_the_wrong_order_is_refused_in_words(bench: WizardBench) -> None:
    procedure = _collected(bench, 40, wrong_order=True)
    with pytest.raises(CalibrationError):
        procedure.compute()
    bench.go_on(ProcedureKind.KNOWN_POINTS)
    page = bench.runner.page()
    assert isinstance(page, ResultPage)
    bench.until(lambda: page.word() == "NO RESULT")
    error = procedure.base.error
    assert error is not None
    assert page.sentence.text() == f"{error.what} {error.remedy}"
    assert not bench.runner.buttons["accept"].isEnabled()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"points": ""}, "No file given for the list of reference points."),
        ({"points": "/nowhere.csv"}, "nowhere.csv"),
        ({"who": " "}, "No name given"),
        ({"temperature": "warm"}, "not a number"),
        ({"temperature": "200"}, "200 °C"),
    ],
)
def test_what_is_filled_in_wrongly_is_said(
    bench: WizardBench, values: dict[str, str], said: str
) -> None:
    bench.begin(ProcedureKind.KNOWN_POINTS, **values)
    assert bench.wizard.runner is None
    assert said in bench.wizard.start.trouble.text()
    assert bench.wizard.start.trouble.isVisible()
