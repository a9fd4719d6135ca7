"""Why and what now: on the results page, on paper, in the JSON file and in the printed table."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_cli.measure import print_explanations
from ocmm_cli.terminal import PlainConsole
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.export import EXPORTERS
from ocmm_core.export.report import ReportData, polyworks_profile, report_of_job
from ocmm_core.inspection.causes import Cause, Explanation
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.reports import _pdf as pdf
from ocmm_gui.results import JobSource, ResultsSheet
from ocmm_gui.results._job_source import opened_job
from ocmm_gui.results._results_sheet import DrivingPoints
from tests.gui.pdf_texts import texts
from tests.host import HANG_MS

PATIENCE_MS = HANG_MS
STEP, BALL = "Block step", "Ball diameter"


@pytest.fixture(scope="module")
def job_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a job of the quick plan in which the block is drawn lower."""
    folder = tmp_path_factory.mktemp("why")
    text = resource("plans", "quick.toml").read_text()
    assert "nominal = 20.34" in text
    plan = folder / "plan.toml"
    plan.write_text(text.replace("20.34", "20.15"))
    built = build_station(StationRequest(plan=plan, out=folder, frame_rate_hz=500))
    try:
        built.station.start()
        assert built.station.wait_finished(60.0)
        live = built.station.job.explanations()
        # Nothing has changed: nothing is computed again.
        assert built.station.job.explanations() is live
    finally:
        built.station.close()
    assert report_of_job(reopen_job(built.job_path)).explanations == live
    return built.job_path


@pytest.fixture(scope="module")
def data(job_path: Path) -> ReportData:
    return report_of_job(reopen_job(job_path))


@pytest.fixture(scope="module")
def step(data: ReportData) -> Explanation:
    (found,) = data.explanations
    return found


def test_a_step_that_is_out_is_the_part(data: ReportData, step: Explanation) -> None:
    result = data.view.result(STEP)
    assert result is not None
    assert result.measured is not None
    assert (step.characteristic, step.verdict) == (STEP, Verdict.NOT_CONFORM)
    assert step.cause is Cause.PART
    assert 0 < len(step.points) <= 5
    limit = result.nominal + result.upper
    assert step.beyond == pytest.approx(result.measured - limit, abs=1e-12)
    assert f"beyond the upper limit {limit:.4f} mm" in step.why
    assert step.suggestion.startswith(f"Most likely the part: {step.beyond:.3f} mm out")


@pytest.mark.usefixtures("qapp")
def test_paper_says_it_below_the_results(data: ReportData, step: Explanation) -> None:
    said = " ".join(texts(pdf.lay_out(data)).split())
    assert said.index("Results") < said.index("Why, and what to do") < said.index("Features")
    for words in (step.why, step.suggestion):
        assert words.split(";")[0].split(":")[0] in said
    assert ", ".join(str(number) for number in step.points) in said


def test_the_json_file_holds_all_of_it(data: ReportData, step: Explanation) -> None:
    contents = EXPORTERS["json"].contents((data,), polyworks_profile())
    (content,) = contents.values()
    told = {item["name"]: item["explanation"] for item in json.loads(content)["results"]}
    assert told[BALL] is None
    assert told[STEP] == {
        "cause": "the part", "beyond": step.beyond, "why": step.why,
        "suggestion": step.suggestion, "evidence": step.finding.evidence,
        "features": list(step.finding.features), "points": list(step.points),
    }  # fmt: skip
    assert EXPORTERS["json"].differences((data,), polyworks_profile(), contents) == []


def test_the_table_ends_with_a_line_for_it(step: Explanation) -> None:
    console = PlainConsole(width=400)
    with console.capture() as captured:
        print_explanations(console, (step,))
    assert captured.get() == f"{STEP}: {step.why} {step.suggestion}\n"


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_page_says_it_and_marks_the_points(
    qtbot: QtBot, job_path: Path, step: Explanation
) -> None:
    source = JobSource.of_opened(opened_job(job_path, lambda _what, _share: None))
    sheet = ResultsSheet(source, lambda: "")
    qtbot.addWidget(sheet)
    sheet.resize(1260, 660)
    sheet.show()
    sheet.open()
    sheet.table.choose(STEP)
    detail = sheet.detail
    qtbot.waitUntil(lambda: detail.explanation() is not None, timeout=PATIENCE_MS)
    assert detail.explanation() == step
    assert sheet.points.isVisible()
    assert sheet.points.marked() == step.points
    assert "Marked: point" in sheet.points.accessibleDescription()
    # A good result has nothing to explain, and its picture shows no marks of another.
    sheet.table.choose(BALL)
    assert detail.explanation() is None
    assert not sheet.points.isVisible()
    assert sheet.points.marked() == ()
    qtbot.waitUntil(lambda: not detail.is_busy(), timeout=PATIENCE_MS)


def test_the_marks_have_a_shape_of_their_own_and_the_picture_turns(
    qtbot: QtBot, data: ReportData, step: Explanation
) -> None:
    view = DrivingPoints()
    qtbot.addWidget(view)
    view.resize(400, 240)
    up = np.array([0.0, 0.0, 1.0])
    view.show_points(data.view, step, up)
    marked = view.grab().toImage()
    QTest.keyClick(view, Qt.Key.Key_Left)
    assert view.grab().toImage() != marked
    # A changed job without the points: their marks are gone.
    view.show_points(None, None, up)
    assert view.marked() == ()
    assert not view.isVisible()
