"""The pages next to the measuring: results with budgets, trials, reports, the next part."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.finished import reopen_job
from ocmm_gui.results import JobSource
from ocmm_gui.results._job_source import opened_job
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

pytestmark = pytest.mark.slow

PATIENCE_MS = HANG_MS


def _press(*keys: Qt.Key) -> None:
    for key in keys:
        widget = QApplication.focusWidget()
        assert widget is not None
        QTest.keyClick(widget, key)


def test_results_have_budgets_trials_reports_and_a_next_part(
    qtbot: QtBot, open_window: OpenWindow, tmp_path: Path
) -> None:
    bench = open_window(out=tmp_path / "report", stay=True)
    bench.wait_complete(qtbot)
    window, sheets = bench.window, bench.window.sheets
    _press(Qt.Key.Key_Z)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.paused, timeout=PATIENCE_MS)
    job = bench.bridge.shown.job

    _press(Qt.Key.Key_F3)
    table, detail = sheets.results.table, sheets.results.detail
    rows = [table.cells(row) for row in range(table.rowCount())]
    assert [row[0] for row in rows] == [item.name for item in job.characteristics]
    for row, item in zip(rows, job.characteristics, strict=True):
        assert row[3] == f"{item.measured:.3f}"
        assert row[-1].endswith(item.verdict.value)
    qtbot.waitUntil(lambda: not detail.is_busy(), timeout=PATIENCE_MS)
    shares = [float(detail.budget.cells(row)[3].rstrip(" %"))
              for row in range(detail.budget.rowCount())]  # fmt: skip
    assert len(shares) >= 3
    # Rounded to whole percents.
    assert sum(shares) == pytest.approx(100.0, abs=4.0)

    # Trials can be given up at once, and the window stays as it is.
    _press(Qt.Key.Key_F6)
    assert detail.is_busy()
    _press(Qt.Key.Key_F6)
    assert not detail.is_busy()
    assert "cancelled" in detail.check.text()
    _press(Qt.Key.Key_F6)
    qtbot.waitUntil(lambda: not detail.is_busy(), timeout=PATIENCE_MS)
    assert "trials" in detail.check.text()

    _press(Qt.Key.Key_F8)
    qtbot.waitUntil(lambda: "Points" in sheets.report.text.toPlainText(), timeout=PATIENCE_MS)
    assert sheets.report.marked() == ("polyworks",)
    _press(Qt.Key.Key_Space)
    assert sheets.report.marked() == ()
    _press(Qt.Key.Key_Escape, Qt.Key.Key_Escape)
    assert window.desk.isVisible()

    first = bench.built.station.job.path
    _press(Qt.Key.Key_J, Qt.Key.Key_F6)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.header.serial == "2", timeout=PATIENCE_MS)
    assert bench.built.station.job.path != first
    # The sheet closes with its own signal, behind the new job's view.
    qtbot.waitUntil(window.desk.isVisible, timeout=PATIENCE_MS)
    closed = reopen_job(first)
    assert closed.doubts == ()
    assert len(closed.points) == sum(len(item.points) for item in job.features)
    # The first part is viewed from its file, which stays unchanged.
    before = first.read_bytes()
    source = JobSource.of_opened(opened_job(first, lambda what, share: None))
    assert [item.measured for item in source.view().characteristics] == [
        item.measured for item in job.characteristics
    ]
    assert first.read_bytes() == before
