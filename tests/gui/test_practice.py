"""Practice: every wizard is completed in the window with a virtual hand; nothing of it counts."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureDecision, ProcedureKind
from ocmm_core.calibration.records import CalibrationStore, ProbeStore, is_practice
from ocmm_core.composition import StationRequest, build_station, source_of
from ocmm_core.documents import resource
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import DEBOUNCE_S, Mode, NoticeCentre, use_language
from ocmm_gui.window import MainWindow
from ocmm_gui.wizards import Runner
from ocmm_sim.practice import Practice
from tests.gui.shown_english import foreign_in
from tests.gui.window_pages import TURNS, faults
from tests.host import HANG_MS, long_form
from tests.slow_rig import CALM_HZ, slow_rig_in
from tests.waiting import let_pass

PATIENCE_MS = 2 * HANG_MS


@dataclass(frozen=True, slots=True)
class _Bench:
    window: MainWindow
    practice: Practice
    notices: NoticeCentre


_LANGUAGES = ("en", "de")
_CASES = [
    (kind, language)
    # The virtual rig has cameras.
    for number, kind in enumerate(k for k in ProcedureKind if k is not ProcedureKind.TRACKER)
    for language in (_LANGUAGES if long_form() else _LANGUAGES[number % 2 :][:1])
]
"""Every wizard, in the short form in one language."""


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path, language: str) -> Iterator[_Bench]:
    """Return a window of a virtual rig, as the program opens it.

    Its cameras are slow: the virtual hand must rest for all the frames that a step wants, and there
    was a time when it left before.
    """
    use_language(qapp, language)
    request = StationRequest(
        plan=resource("plans", "quick.toml"), rig=slow_rig_in(tmp_path, CALM_HZ),
        out=tmp_path / "job", speed=0.1, stay=True, frame_rate_hz=800,
    )  # fmt: skip
    built = build_station(request)
    assert source_of(request.source).spec.practice is not None
    practice = Practice(request, tmp_path / "practice", speed=0.0)
    bridge, notices = StationBridge(built.station), NoticeCentre()
    window = MainWindow(
        bridge, notices, out=tmp_path / "out", hand=built.hand, practice=practice
    )  # fmt: skip
    window.resize(1280, 720)
    with qtbot.waitActive(window):
        window.show()
        window.activateWindow()
    bridge.start()
    yield _Bench(window, practice, notices)
    window.close()
    window.deleteLater()
    bridge.deleteLater()
    notices.deleteLater()
    use_language(qapp, "en")


def _press(key: Qt.Key) -> None:
    widget = QApplication.focusWidget()
    assert widget is not None
    QTest.keyClick(widget, key)


def _complete(
    qtbot: QtBot, bench: _Bench, kind: ProcedureKind,
    read: Callable[[_Bench], None], rest: Callable[[_Bench], None],
) -> Runner:  # fmt: skip
    """Follow the wizard with its keys; ``read`` sees each sentence, ``rest`` each result."""
    window = bench.window
    window.show_mode(Mode.MAINTAIN)
    window.maintenance.open_wizard(kind)
    wizard = window.maintenance.wizard
    assert wizard.start.trouble.text() == ""
    assert "PRACTICE" in window.hand.strip.text.text()
    wizard.start.begin_button.click()
    if wizard.currentWidget() is wizard.tables:
        wizard.tables.take.click()
    runner = wizard.runner
    assert runner is not None, wizard.start.trouble.text()
    pages = 0
    told = set[str]()

    def stands() -> bool:
        seen = runner.driver.now
        note = (seen.view.base.step.name, runner.gate.text(), seen.view.base.live.hint)
        if (sentence := re.sub(r"\d", "", " ".join(note))) not in told:
            told.add(sentence)
            read(bench)
        return seen.view.base.step.gate.open or seen.view.outcome is not None

    while True:
        assert window.hand.strip.isVisible()
        read(bench)
        base = runner.driver.now.view.base
        if "accept" in runner.page().keys:
            break
        name = base.step.name

        def moved_on(name: str = name) -> bool:
            return bool(runner.driver.now.view.base.step.name != name)

        if "automatic" in runner.page().keys and not runner.driver.now.automatic:
            QTest.keyClick(runner, Qt.Key.Key_Y)
        qtbot.waitUntil(lambda: moved_on() or stands(), timeout=PATIENCE_MS)
        if runner.driver.now.view.base.step.name == name:
            qtbot.waitUntil(
                lambda: runner.actions_by_key["next"].isEnabled() or moved_on(), timeout=PATIENCE_MS
            )
            if runner.driver.now.view.base.step.name == name:
                let_pass(DEBOUNCE_S)
                runner.actions_by_key["next"].trigger()
        qtbot.waitUntil(
            lambda: (
                moved_on() and runner.page() is runner.pages[runner.driver.now.view.base.step.name]
            ),
            timeout=PATIENCE_MS,
        )
        pages += 1
        assert pages < 10
    qtbot.waitUntil(
        lambda: (
            runner.driver.now.view.outcome is not None
            or runner.driver.now.view.base.error is not None
        ),
        timeout=PATIENCE_MS,
    )
    assert runner.driver.now.view.base.error is None
    qtbot.waitUntil(lambda: runner.actions_by_key["accept"].isEnabled(), timeout=PATIENCE_MS)
    rest(bench)
    QTest.keyClick(runner, Qt.Key.Key_A)
    qtbot.waitUntil(runner.decision.isVisible, timeout=PATIENCE_MS)
    rest(bench)
    _press(Qt.Key.Key_Return)
    qtbot.waitUntil(
        lambda: (
            runner.driver.now.view.base.decision is ProcedureDecision.ACCEPTED
            and runner.driver.now.view.base.stored
        ),
        timeout=PATIENCE_MS,
    )
    return runner


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "language"), _CASES)
def test_every_wizard_is_completed_and_signed_practice(
    qtbot: QtBot, bench: _Bench, kind: ProcedureKind, language: str
) -> None:
    wrong = set[str]()

    def read(bench: _Bench) -> None:
        wrong.update(foreign_in(bench.window, language))

    def rest(bench: _Bench) -> None:
        read(bench)
        left: list[str] = []
        for _ in range(TURNS):
            QApplication.processEvents()
            left = list(faults(bench.window))
            if not left:
                break
            time.sleep(0.01)
        wrong.update(left)

    runner = _complete(qtbot, bench, kind, read, rest)
    assert not wrong, "\n".join(sorted(wrong))
    assert is_practice(runner.driver.now.view.base.who)
    cameras, probe = CalibrationStore(bench.practice.cameras), ProbeStore(bench.practice.probe)
    made = [one.made_by for one in cameras.records()]
    made += [one.made_by for one in cameras.verifications()]
    made += [one.made_by for one in probe.calibrations()]
    made += [one.made_by for one in probe.qualifications()]
    made += [one.made_by for one in probe.checks()]
    # Four exist at the start; the completed one is the fifth.
    assert len(made) == 5
    assert all(map(is_practice, made))
    bench.window.maintenance.wizard.leave()
    assert "PRACTICE" not in bench.window.hand.strip.text.text()
