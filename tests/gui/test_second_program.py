"""A job in use by another program is opened read-only, with a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.storage import JobFile
from ocmm_gui.kit import Level
from tests.gui.long_job import make_long_job
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

pytestmark = pytest.mark.slow


def test_a_job_of_another_program_is_opened_to_look_at(
    qtbot: QtBot, open_window: OpenWindow, tmp_path: Path
) -> None:
    path = make_long_job(tmp_path)
    bench = open_window(speed=0.1, stay=True, out=tmp_path / "report")
    measured = bench.bridge.shown.job.job
    results = bench.window.sheets.results
    told: list[str] = []
    bench.notices.posted.connect(
        lambda notice: told.append(notice.what) if notice.level is Level.ERROR else None
    )
    with JobFile.open(path):
        bench.bridge.jobs.go_on(path)
        qtbot.waitUntil(lambda: results.isVisible() and results.is_opening(), timeout=HANG_MS)
        qtbot.waitUntil(lambda: not results.is_opening(), timeout=HANG_MS)
    assert told == [f"{path}: the job is in use by another program."]
    assert "CONFORM" in results.summary.text()
    # The job that this window measures is as it was.
    assert bench.bridge.shown.job.job == measured
    assert bench.bridge.station.job.path != path
