"""The table of results shows the whole verdict, however narrow it is."""

from __future__ import annotations

from dataclasses import replace

import pytest
from PySide6.QtGui import QFontMetricsF
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.evaluation import JobView
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.results._result_table import ResultTable
from tests.gui.long_job import make_long_job
from tests.host import HANG_MS


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> JobView:
    """Return a finished job; to make it takes a second."""
    folder = tmp_path_factory.mktemp("long")
    return reopen_job(make_long_job(folder), folder, calibrations=folder).view


@pytest.mark.parametrize("width", [600, 640, 680, 760, 1100])
def test_the_verdict_is_whole(width: int, job: JobView, qtbot: QtBot) -> None:
    results = tuple(
        replace(result, name="Boss circumscribed", verdict=Verdict.NOT_MEASURED)
        for result in job.characteristics * 20
    )
    assert results
    table = ResultTable()
    qtbot.addWidget(table)
    table.resize(width, 120)
    table.show()
    table.show_job(replace(job, characteristics=results))
    # The bar at the side takes of the width.
    qtbot.waitUntil(table.verticalScrollBar().isVisible, timeout=HANG_MS)
    assert not table.horizontalScrollBar().isVisible()
    item = table.item(0, table.columnCount() - 1)
    assert item is not None
    words = QFontMetricsF(item.font()).horizontalAdvance(item.text())
    assert words < table.columnWidth(table.columnCount() - 1)
