"""Errors reach the banner in words and the log in full; sounds and keys behave."""

from __future__ import annotations

import logging
import sys
import threading
import wave
from datetime import UTC, datetime
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.errors import InputError, StorageError
from ocmm_gui.app import main
from ocmm_gui.kit import (
    Banner,
    DebouncedCommand,
    ErrorHooks,
    Level,
    Notice,
    NoticeCentre,
    PathPanel,
    Sound,
    SoundPlayer,
)
from ocmm_gui.kit._shortcuts import DEBOUNCE_S
from ocmm_gui.kit._sound import RATE_HZ, tone_wav
from ocmm_gui.window import MainWindow
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow


def test_an_error_is_shown_with_its_remedy(qtbot: QtBot) -> None:
    centre, banner = NoticeCentre(), Banner()
    qtbot.addWidget(banner)
    centre.posted.connect(banner.show_notice)
    centre.error(InputError("x", "The plan is empty.", "Add a feature."))
    assert "The plan is empty. Add a feature." in banner.text()
    centre.inform("Written.")
    assert "The plan is empty." in banner.text(), "good news must not cover an error"
    assert banner.dismiss()
    assert "Written." in banner.text(), "what came under an error is shown after it"
    assert banner.dismiss()
    assert not banner.dismiss()


class PaintCounter(QObject):
    """Counts how often a widget is painted."""

    painted = 0

    def eventFilter(self, _widget: QObject, event: QEvent) -> bool:
        self.painted += event.type() is QEvent.Type.Paint
        return False


def test_an_error_is_painted_in_the_event_that_reports_it(qtbot: QtBot) -> None:
    window, banner, counter = QWidget(), Banner(), PaintCounter()
    column = QVBoxLayout(window)
    column.addWidget(banner)
    column.addWidget(QLabel("page"), 1)
    qtbot.addWidget(window)
    window.resize(600, 400)
    with qtbot.waitExposed(window):
        window.show()
    banner.installEventFilter(counter)
    centre = NoticeCentre()
    centre.posted.connect(banner.show_notice)
    centre.error(InputError("x", "The job is lost.", "Look for it. " * 20))
    assert counter.painted == 1
    # At its final size: the text needs several lines.
    assert banner.height() >= banner.heightForWidth(banner.width()) > 40


def test_a_failure_is_reported_before_changes_that_wait(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bridge = open_window(stay=True).window._bridge  # noqa: SLF001 - the window gives it to no one
    order: list[str] = []
    bridge.job_changed.connect(lambda _job: order.append("job"))
    bridge.failed.connect(lambda _error: order.append("failure"))
    for _ in range(3):
        bridge._changed_elsewhere.emit(bridge.shown.job)  # noqa: SLF001 - as the evaluator
    bridge.station.faults.tell(InputError("x", "The job is lost.", "Look for it."))
    qtbot.waitUntil(lambda: order.count("job") >= 3, timeout=HANG_MS)
    assert order[0] == "failure"


def test_notices_of_a_job_end_with_it_and_others_wait_in_order(qtbot: QtBot) -> None:
    centre, banner = NoticeCentre(), Banner()
    qtbot.addWidget(banner)
    centre.posted.connect(banner.show_notice)
    banner.end_job("A-001")
    centre.warn("INCOMPLETE report of A-001.", job="A-001")
    centre.error(InputError("x", "No point was taken.", ""), job="A-001")
    centre.warn("The archive is full.")
    centre.warn("The archive is full.")
    assert "No point was taken." in banner.text()
    banner.end_job("A-002")
    assert "The archive is full." in banner.text()
    # A late report is still announced, for a moment.
    centre.error(InputError("x", "The report of A-001 failed.", ""), job="A-001")
    assert "A-001" in banner.text()
    timer = banner.findChild(QTimer)
    assert timer is not None
    assert timer.isActive()
    banner.end_job("A-002")
    assert banner.dismiss()
    assert not banner.dismiss()


def _has_left(window: MainWindow, page: QWidget) -> bool:
    return window.pages.shown() is not page


def test_esc_dismisses_a_notice_before_it_leaves_a_page(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    window = open_window(start=False).window
    for open_page in (
        partial(window.sheets.show_sheet, "results"), window.sheets.open_job,
        lambda: window.maintenance.open_wizard(ProcedureKind.QUALIFICATION),
    ):  # fmt: skip
        open_page()
        page = window.pages.shown()
        assert page is not None
        window.banner.show_notice(Notice(Level.ERROR, "It failed.", "", "", datetime.now(UTC)))
        focus = QApplication.focusWidget()
        assert focus is not None
        QTest.keyClick(focus, Qt.Key.Key_Escape)
        assert not window.banner.isVisible(), page
        assert window.pages.shown() is page
        QTest.keyClick(focus, Qt.Key.Key_Escape)
        # A button that is pressed by its key clicks a moment later.
        qtbot.waitUntil(partial(_has_left, window, page), timeout=HANG_MS)


def test_what_nobody_caught_is_shown_without_a_traceback_and_logged_with_it(
    qtbot: QtBot, tmp_path: Path
) -> None:
    centre, banner = NoticeCentre(), Banner()
    qtbot.addWidget(banner)
    centre.posted.connect(banner.show_notice)
    before = (sys.excepthook, threading.excepthook)
    with ErrorHooks(centre):
        thread = threading.Thread(target=lambda: 1 / 0)
        thread.start()
        thread.join()
        qtbot.waitUntil(lambda: "ZeroDivisionError" in banner.text(), timeout=HANG_MS)
        logging.getLogger("ocmm_core.test").warning("A cycle was late.")
    assert (sys.excepthook, threading.excepthook) == before
    assert "Traceback" not in banner.text()
    centre.save(tmp_path / "log.txt")
    text = (tmp_path / "log.txt").read_text()
    assert "Traceback" in text
    assert "A cycle was late." in text


def test_a_log_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match=r"file/log\.txt"):
        NoticeCentre().save(tmp_path / "file" / "log.txt")


def test_a_path_with_a_blank_takes_no_point(qtbot: QtBot) -> None:
    window = QWidget()
    panel = PathPanel("Write the report", "Folder of the report", "Write")
    panel.setParent(window)
    qtbot.addWidget(window)
    taken: list[bool] = []
    action = QAction("Take", window)
    action.setShortcuts([QKeySequence("Space"), QKeySequence("Return")])
    action.triggered.connect(taken.append)
    window.addAction(action)
    window.show()
    panel.ask(Path("/data"))
    field = panel.findChild(QWidget, "path")
    assert field is not None
    with qtbot.waitSignal(panel.given, timeout=HANG_MS) as given:
        QTest.keyClicks(field, "/data/my report")
        QTest.keyClick(field, Qt.Key.Key_Return)
    assert given.args == [Path("/data/my report")]
    assert not taken


def test_a_bouncing_switch_gives_one_command() -> None:
    times = iter([0.0, 0.02, 0.1, DEBOUNCE_S + 0.001, DEBOUNCE_S + 0.01])
    given: list[int] = []
    press = DebouncedCommand(lambda: given.append(1), clock=lambda: next(times))
    for _ in range(5):
        press()
    assert len(given) == 2


@pytest.mark.parametrize("sound", Sound)
def test_tones_are_whole_wav_files(sound: Sound) -> None:
    with wave.open(BytesIO(tone_wav(sound.value))) as file:
        length = file.getnframes() / RATE_HZ
    assert length == pytest.approx(sum(seconds for _, seconds in sound.value), abs=0.001)


def test_a_sound_that_cannot_be_played_is_silent(
    qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    player = SoundPlayer()
    for sound in Sound:
        player.play(sound)
    player.close()
    player.play(Sound.TAKEN)


def test_a_missing_plan_ends_with_one_sentence_and_code_2(
    qtbot: QtBot, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    code = main(["--plan", str(tmp_path / "none.toml"), "--out", str(tmp_path), "--silent"])
    assert code == 2
    shown = capsys.readouterr().err
    assert "none.toml" in shown
    assert "Traceback" not in shown
