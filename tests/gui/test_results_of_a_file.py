"""Results of a file are never taken for those of the job that goes on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.results import JobSource, ResultsSheet
from tests.generated_jobs import generated_job


def test_a_file_that_was_left_gives_way_to_the_job_that_goes_on(qtbot: QtBot) -> None:
    # Without characteristics nothing is computed aside.
    job = next(
        replace(made, characteristics=())
        for made, _ in map(generated_job, range(20))
        if made.features[0].points
    )
    now = [job]
    running = JobSource(lambda: Path("now.ocmm"), lambda: now[0], lambda _done, _failed: None)
    sheet = ResultsSheet(running, lambda: "")
    qtbot.addWidget(sheet)
    sheet.show_source(replace(running, file=lambda: Path("old.ocmm"), read_only=True))

    def shown() -> str:
        sheet.show()
        sheet.open()
        return sheet.about()

    assert "old.ocmm, read-only" in shown()
    assert _role(sheet) == "warn"
    # Told again, and nothing was measured: whoever looked something up finds it again.
    sheet.hide()
    sheet.job_changed()
    assert "old.ocmm, read-only" in shown()
    # While it is looked at it stays.
    now[0] = _one_point_less(job)
    sheet.job_changed()
    assert "old.ocmm, read-only" in sheet.about()
    sheet.hide()
    now[0] = job
    sheet.job_changed()
    assert shown().startswith("Current job")
    assert _role(sheet) == "muted"


def _role(sheet: ResultsSheet) -> object:
    (line,) = (one for one in sheet.findChildren(QLabel) if one.text() == sheet.about())
    return line.property("role")


def _one_point_less(job: JobView) -> JobView:
    first, *others = job.features
    return replace(job, features=(replace(first, points=first.points[1:]), *others))
