"""Nothing long runs in the window's thread: other processes open and report jobs."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.export import ENDING, registry
from ocmm_core.inspection.finished import reopen
from ocmm_core.inspection.session import JobSteps
from ocmm_core.station import JobChange, Reports
from ocmm_gui.kit import Level, Notice
from ocmm_gui.operator import _job_sheet as job_sheet
from ocmm_gui.reports import _pdf as pdf
from ocmm_gui.results import ReportSheet
from tests.gui.long_job import make_long_job
from tests.host import BUSY, HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import Bench, OpenWindow

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

KEY = Qt.Key
PATIENCE_MS = HANG_MS
POST_EVERY_S = 0.005
MAX_P99_S = 0.100
"""Nothing that takes a second runs in the window's thread. The limit of the product is half of it,
on a computer that does nothing else: benchmarks/window.py."""


@pytest.fixture(scope="module")
def long_job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a finished job of 98 points; not to be changed."""
    return make_long_job(tmp_path_factory.mktemp("long"))


class Heart(QObject):
    """Posts time stamps to the window from a separate thread and records their delays."""

    posted = Signal(float)

    def __init__(self) -> None:
        super().__init__()
        self.latencies: list[float] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._post, name="test-heart")
        self.posted.connect(self._handle, Qt.ConnectionType.QueuedConnection)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _post(self) -> None:
        while not self._stop.wait(POST_EVERY_S):
            self.posted.emit(time.perf_counter())

    def _handle(self, at: float) -> None:
        self.latencies.append(time.perf_counter() - at)


@pytest.fixture
def heart() -> Iterator[Heart]:
    """Return a heart; it is stopped after the test."""
    made = Heart()
    yield made
    made.stop()


def _press(*keys: Qt.Key) -> None:
    for key in keys:
        widget = QApplication.focusWidget()
        assert widget is not None
        QTest.keyClick(widget, key)


def _go_on_with(bench: Bench, qtbot: QtBot, job: Path, folder: Path) -> Path:
    """Let the window measure a copy of a job, and return it."""
    own = folder / job.name
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(job, own)
    # It is shown a moment before it has begun, and keys of that moment are refused.
    with qtbot.waitSignal(bench.bridge.jobs.job_begun, timeout=PATIENCE_MS):
        bench.bridge.jobs.go_on(own)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.job == job.stem, timeout=PATIENCE_MS)
    return own


def _mark_all(sheet: ReportSheet) -> None:
    for row in range(sheet.formats.count()):
        sheet.formats.setCurrentRow(row)
        if str(sheet.formats.item(row).data(Qt.ItemDataRole.UserRole)) not in sheet.marked():
            sheet.mark()


@pytest.mark.timing
@pytest.mark.usefixtures("fresh_sides")
def test_the_window_answers_while_a_job_is_opened_and_a_report_is_written(
    qtbot: QtBot,
    open_window: OpenWindow,
    long_job: Path,
    heart: Heart,
    tmp_path: Path,
    record_property: Callable[[str, object], None],
) -> None:
    bench = open_window(speed=0.1, stay=True, out=tmp_path / "report")
    sheets = bench.window.sheets
    _go_on_with(bench, qtbot, long_job, tmp_path / "own")
    heart.start()
    _press(KEY.Key_F3)
    sheets.results.open_file(long_job)
    qtbot.waitUntil(lambda: not sheets.results.is_opening(), timeout=PATIENCE_MS)
    opened = len(heart.latencies)
    sheets.results.open()
    _press(KEY.Key_F8)
    qtbot.waitUntil(sheets.report.is_previewing, timeout=PATIENCE_MS)
    qtbot.waitUntil(lambda: not sheets.report.is_previewing(), timeout=PATIENCE_MS)
    _mark_all(sheets.report)
    with qtbot.waitSignal(bench.window.output.exported, timeout=PATIENCE_MS) as written:
        _press(KEY.Key_F8)
    heart.stop()
    assert {path.suffix for path in written.args[0]} >= {".pdf", ".xlsx", ".json"}
    p99 = float(np.quantile(heart.latencies, 0.99))
    record_property("events", len(heart.latencies))
    record_property("p99_ms", f"{1e3 * p99:.1f}")
    record_property("worst_ms", f"{1e3 * max(heart.latencies):.1f}")
    assert opened >= 100
    assert len(heart.latencies) >= 300
    assert p99 <= BUSY * MAX_P99_S


def _banner(bench: Bench) -> list[Notice]:
    """Return a list that fills with the notices from now on."""
    told: list[Notice] = []
    bench.notices.posted.connect(told.append)
    return told


@pytest.mark.parametrize("far", [False, True], ids=["desk", "far"])
def test_an_incomplete_job_is_written_only_on_an_answer(
    qtbot: QtBot,
    open_window: OpenWindow,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    far: bool,
) -> None:
    monkeypatch.chdir(tmp_path)
    # Not started: a busy computer gets as far as the first feature meanwhile.
    bench = open_window(speed=0.1, stay=True, out=Path("report"), start=False)
    window, told = bench.window, _banner(bench)
    window.show_far(far)
    question = window.output.question
    _press(KEY.Key_E)
    assert question.isVisible()
    assert "INCOMPLETE: BED, BLOCK_TOP, SPHERE not measured." in question.question()
    assert QApplication.focusWidget() is question
    _press(KEY.Key_Escape)
    assert not question.isVisible()
    # Nothing was begun, so nothing can come.
    assert not window.output.is_writing()
    assert not (tmp_path / "report").exists()

    _press(KEY.Key_E)
    with qtbot.waitSignal(window.output.exported, timeout=PATIENCE_MS) as written:
        _press(KEY.Key_Return)
        assert "cancels" in window.output.work.message()
    assert window.output.work.message() == ""
    paths: tuple[Path, ...] = written.args[0]
    assert paths
    assert all(path.parent == tmp_path / "report" and path.is_file() for path in paths)
    qtbot.waitUntil(lambda: bool(told))
    assert told[-1].level is Level.WARNING
    assert "INCOMPLETE" in told[-1].what
    assert str(tmp_path / "report") in told[-1].what
    qtbot.waitUntil(lambda: window.banner.text().startswith("⚠  INCOMPLETE"))


def test_the_report_page_asks_too_and_what_is_given_up_leaves_nothing(
    qtbot: QtBot, open_window: OpenWindow, long_job: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "report"
    bench = open_window(speed=0.1, stay=True, out=folder)
    sheet, told = bench.window.sheets.report, _banner(bench)
    _press(KEY.Key_F3, KEY.Key_F8)
    qtbot.waitUntil(lambda: "Points" in sheet.text.toPlainText(), timeout=PATIENCE_MS)
    _mark_all(sheet)
    _press(KEY.Key_F8)
    assert sheet.question.isVisible()
    _press(KEY.Key_Escape)
    assert sheet.isVisible(), "Esc answers the question, and leaves the page only after it"
    assert not sheet.is_writing()
    _press(KEY.Key_F8)
    _press(KEY.Key_Return)
    assert sheet.is_writing()
    assert "F8 cancels" in sheet.work.message()
    _press(KEY.Key_F8)
    assert not sheet.is_writing()
    qtbot.waitUntil(lambda: any("not written" in notice.what for notice in told))
    _press(KEY.Key_Escape)

    # A complete job is written without a question, and the notice is good news.
    _go_on_with(bench, qtbot, long_job, tmp_path / "own")
    _press(KEY.Key_F3, KEY.Key_F8)
    assert not folder.exists()
    with qtbot.waitSignal(bench.window.output.exported, timeout=PATIENCE_MS) as written:
        _press(KEY.Key_F8)
        assert not sheet.question.isVisible()
    assert {path.suffix for path in written.args[0]} >= {".pdf", ".xlsx"}
    left = sorted(path for path in folder.iterdir() if not path.name.endswith(ENDING))
    assert left == sorted(written.args[0]), "no file is left half-written"
    assert told[-1].level is Level.INFO
    assert str(folder) in told[-1].what


def test_opening_is_shown_given_up_and_told_where_it_fails(
    qtbot: QtBot, open_window: OpenWindow, long_job: Path, tmp_path: Path
) -> None:
    bench = open_window(speed=0.1, stay=True)
    results, told = bench.window.sheets.results, _banner(bench)
    _press(KEY.Key_F3)
    results.open_file(long_job)
    assert "F7 cancels" in results.opening.message()
    # Its process has only just begun: the key comes before the job is open.
    _press(KEY.Key_F7)
    assert not results.is_opening()
    assert results.opening.message() == ""
    assert "Current job" in results.about()
    results.open_file(long_job)
    qtbot.waitUntil(lambda: "read-only" in results.about(), timeout=PATIENCE_MS)
    torn = tmp_path / "torn.ocmm"
    torn.write_bytes(b"no job")
    results.open_file(torn)
    qtbot.waitUntil(lambda: not results.is_opening(), timeout=PATIENCE_MS)
    assert "torn.ocmm" in told[-1].what
    assert told[-1].level is Level.ERROR
    assert "read-only" in results.about(), "what was shown stays"
    begun = time.monotonic()
    results.open_file(long_job)
    bench.window.close()
    assert time.monotonic() - begun < BUSY * 2.0


def _spy(monkeypatch: pytest.MonkeyPatch, name: str, owner: object) -> list[str]:
    """Record the thread of a function's calls, for every module that imported it."""
    real, seen = getattr(owner, name), list[str]()

    def noting(*args: object, **named: object) -> object:
        seen.append(threading.current_thread().name)
        return real(*args, **named)

    places = [owner, *(m for key, m in sys.modules.items() if key.startswith("ocmm_"))]
    for place in places:
        if getattr(place, name, None) is real:
            monkeypatch.setattr(place, name, noting)
    return seen


def test_nothing_long_is_called_in_the_thread_of_the_window(
    qtbot: QtBot,
    open_window: OpenWindow,
    long_job: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = open_window(speed=0.1, stay=True, out=tmp_path / "report")
    sheets = bench.window.sheets
    long = [(reopen, "reopen_job"), (registry, "write_report"), (registry, "preview"),
            (pdf, "lay_out"), (pdf, "page_picture"), (pdf, "pdf_bytes")]  # fmt: skip
    here = {name: _spy(monkeypatch, name, owner) for owner, name in long}
    beside = {
        name: _spy(monkeypatch, name, owner)
        for owner, name in [
            (Reports, "data"), (JobChange, "go_on"),
            (JobChange, "next_part"), (JobSteps, "undo"), (JobSteps, "select"),
            (job_sheet, "parts_of_batch"), (job_sheet, "list_plans"),
        ]
    }  # fmt: skip
    _go_on_with(bench, qtbot, long_job, tmp_path / "own")
    # The robot would repeat the undone touch: under load it has time for that.
    _press(KEY.Key_Z)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.paused, timeout=PATIENCE_MS)
    _press(KEY.Key_Backspace)
    qtbot.waitUntil(lambda: not bench.bridge.shown.job.complete, timeout=PATIENCE_MS)
    _press(KEY.Key_PageUp)
    _press(KEY.Key_F3)
    sheets.results.open_file(long_job)
    qtbot.waitUntil(lambda: not sheets.results.is_opening(), timeout=PATIENCE_MS)
    _press(KEY.Key_F9, KEY.Key_F8)
    qtbot.waitUntil(lambda: sheets.report.pages.page_count() > 0, timeout=PATIENCE_MS)
    _mark_all(sheets.report)
    _press(KEY.Key_F8)
    with qtbot.waitSignal(bench.window.output.exported, timeout=PATIENCE_MS):
        _press(KEY.Key_Return)
    # One of them dismisses the banner of the report, if it is there already.
    while not bench.window.desk.isVisible():
        _press(KEY.Key_Escape)
    _press(KEY.Key_J)
    with qtbot.waitSignal(bench.bridge.jobs.job_begun, timeout=PATIENCE_MS):
        _press(KEY.Key_F6)
    assert here == {name: [] for name in here}, "these belong into another process"
    window = threading.main_thread().name
    for name, threads in beside.items():
        assert threads, name
        assert window not in threads, name
