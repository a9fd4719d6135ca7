"""Results of a file are never shown as those of the current job."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.results import JobSource, ResultsSheet
from tests.generated_jobs import generated_job


def test_the_results_key_shows_the_current_job_whatever_file_was_open(qtbot: QtBot) -> None:
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
    old = replace(running, file=lambda: Path("old.ocmm"), view=lambda: job, read_only=True)

    for goes_on in ("while it is shown", "after it was left", "not at all"):
        now[0] = job
        sheet.show()
        sheet.show_source(old)
        assert "old.ocmm, read-only" in sheet.about()
        assert sheet.summary.text().startswith("old: ")
        assert _role(sheet) == "warn"
        if goes_on == "while it is shown":
            now[0] = _one_point_less(job)
            sheet.job_changed()
            assert "old.ocmm, read-only" in sheet.about()
        sheet.hide()
        if goes_on == "after it was left":
            now[0] = _one_point_less(job)
            sheet.job_changed()
        # Back from the report of the file: still the file.
        sheet.show()
        sheet.resume()
        assert "old.ocmm, read-only" in sheet.about()
        sheet.hide()
        sheet.show()
        sheet.open()
        assert sheet.about().startswith("Current job"), goes_on
        assert "old" not in sheet.summary.text()
        assert _role(sheet) == "muted"


def _role(sheet: ResultsSheet) -> object:
    (line,) = (one for one in sheet.findChildren(QLabel) if one.text() == sheet.about())
    return line.property("role")


def _one_point_less(job: JobView) -> JobView:
    first, *others = job.features
    return replace(job, features=(replace(first, points=first.points[1:]), *others))
