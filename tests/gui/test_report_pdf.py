"""The report on paper: its content, and the integrity of the file."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QImage, QPainter
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import StorageError
from ocmm_core.export import EXPORTERS
from ocmm_core.export.report import Element, ReportData, polyworks_profile, report_of_job
from ocmm_core.inspection.evaluation import FeatureState
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.tolerances.decisions import U_LABEL, PartWord, Verdict
from ocmm_core.tolerances.kinds import KINDS
from ocmm_gui.kit import NumberStyle, numbers_in_use
from ocmm_gui.reports import _batch as batch
from ocmm_gui.reports import _paper as pdf_writer
from ocmm_gui.reports import _pdf as pdf
from ocmm_gui.reports import _sections as sections
from ocmm_gui.reports._archival import attached
from ocmm_gui.reports._canvas import BODY, PAGE, PageCanvas, text_height, whole_words
from ocmm_gui.reports._sections import paint_symbol
from tests.gui.pdf_texts import pages, texts
from tests.host import HANG_S


@pytest.fixture(scope="module")
def job_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the job of the quick plan, measured on the virtual rig."""
    folder = tmp_path_factory.mktemp("job")
    request = StationRequest(plan=resource("plans", "quick.toml"), out=folder, frame_rate_hz=500)
    built = build_station(request)
    try:
        built.station.start()
        assert built.station.wait_finished(HANG_S)
    finally:
        built.station.close()
    return built.job_path


@pytest.fixture(scope="module")
def data(job_path: Path) -> ReportData:
    """Return the report data of a job."""
    return report_of_job(reopen_job(job_path))


def of_a_real_part(data: ReportData) -> ReportData:
    """Return the report as if cameras had seen the part."""
    return replace(data, view=replace(data.view, simulated=False))


@pytest.mark.usefixtures("qapp")
def test_every_number_of_every_characteristic_is_on_the_pages(data: ReportData) -> None:
    said = texts(pdf.lay_out(data))
    assert data.results
    for result in data.results:
        assert result.name in said
        assert result.verdict.value in said
        assert result.measured is not None
        assert result.uncertainty is not None
        for number in (f"{result.measured:.4f}", f"{result.uncertainty:.4f}"):
            assert number in said
    for word in (data.head.part, data.head.operator, data.head.job_uuid, data.head.plan_identity):
        assert word in said


@pytest.mark.usefixtures("qapp")
def test_what_is_not_proven_is_said_large_and_first(data: ReportData) -> None:
    doubtful = tuple(replace(item, verdict=Verdict.NOT_PROVEN) for item in data.results[:1])
    view = replace(
        data.view, unproven="Measured without a calibration.",
        characteristics=(*doubtful, *data.results[1:]),
    )  # fmt: skip
    spoiled = replace(data, view=view, notes=("The observation 3 was changed.",))
    assert spoiled.view.part_verdict.word is PartWord.NOT_PROVEN
    first = PageCanvas(pages=pdf.lay_out(spoiled).pages[:1])
    said = texts(first)
    assert said.index("NOT PROVEN") < said.index("Part")
    assert "Measured without a calibration." in said
    assert "The observation 3 was changed." in said


@pytest.mark.usefixtures("qapp")
def test_every_page_says_simulated_and_incomplete_and_only_where_it_is_so(data: ReportData) -> None:
    last = data.view.features[-1]
    undone = replace(last, state=FeatureState.SKIPPED)
    view = replace(data.view, features=(*data.view.features[:-1], undone))
    shown = tuple(
        replace(item, seen=undone) if item.name == last.name else item for item in data.features
    )
    incomplete = replace(data, view=view, features=shown)
    for report, words, others in (
        (data, ["SIMULATED", "No real part was measured."], ["INCOMPLETE"]),
        (incomplete, ["SIMULATED", "INCOMPLETE"], []),
        (of_a_real_part(incomplete), ["INCOMPLETE"], ["SIMULATED", "No real part"]),
        (of_a_real_part(data), [], ["SIMULATED", "INCOMPLETE", "No real part"]),
    ):
        said = pages(report)
        assert len(said) > 1
        for page in said:
            # Above all else, and in the foot.
            for word in words[:1]:
                assert page.count(word) >= 2
            assert all(word in page for word in words)
            assert not any(word in page for word in others)
    front = pages(incomplete)[0]
    assert "NOT COMPLETE" in front
    assert f"INCOMPLETE: {last.name}" in front


@pytest.mark.usefixtures("qapp")
def test_the_band_covers_nothing_and_is_not_where_there_is_nothing_to_say(data: ReportData) -> None:
    real = of_a_real_part(data)
    banded, plain = (pdf.page_picture(pdf.lay_out(one), 1, one, 840) for one in (data, real))
    top = round(840 * 140.0 / PAGE[0])
    assert banded.pixelColor(420, 28) != plain.pixelColor(420, 28)
    lowest = max(y for y in range(top) if banded.pixelColor(70, y) != plain.pixelColor(70, y))
    # The layout begins at the upper margin.
    assert lowest < top


@pytest.mark.usefixtures("qapp")
def test_the_title_says_which_fail_which_are_not_proven_and_every_feature_its_verdict(
    data: ReportData,
) -> None:
    first, second = data.results
    bad = (
        replace(first, verdict=Verdict.NOT_CONFORM), replace(second, verdict=Verdict.NOT_PROVEN)
    )  # fmt: skip
    spoiled = replace(data, view=replace(data.view, characteristics=bad))
    said = " ".join(pages(spoiled)[0].split())
    assert "PART DOES NOT CONFORM" in said
    assert f"NOT CONFORM: {first.name}" in said
    assert f"NOT PROVEN: {second.name}" in said
    assert said.index("NOT PROVEN:") < said.index("Item measured")
    everything = " ".join(texts(pdf.lay_out(spoiled)).split())
    table = everything[everything.index("Actual element") :]
    for result in bad:
        assert f"{result.verdict.value} {result.name}" in table


@pytest.mark.usefixtures("qapp")
def test_a_provisional_number_is_on_no_page(data: ReportData) -> None:
    first, *others = data.results
    waiting = replace(first, verdict=Verdict.NOT_MEASURED, measured=123.4567, note="Provisional.")
    spoiled = replace(data, view=replace(data.view, characteristics=(waiting, *others)))
    said = texts(pdf.lay_out(spoiled))
    assert "NOT MEASURED" in said
    assert "123.4567" not in said
    # Its deviation is also absent: it is in the table and next to the plot.
    assert said.count(f"{first.deviation:+.4f}") == 0


@pytest.mark.usefixtures("qapp")
def test_what_rounds_to_zero_has_no_sign_and_what_is_not_done_says_so(data: ReportData) -> None:
    bed = data.features[0]
    tilted = Element(np.array([-1e-9, 2.0, -0.00004]), np.array([-1e-9, 0.0, 1.0]))
    seen = replace(bed.seen, state=FeatureState.ACTIVE, needed=9)
    near = replace(data.results[0], measured=20.0, deviation=-1e-9, nominal=20.0)
    view = replace(data.view, characteristics=(near, *data.results[1:]))
    features = (replace(bed, seen=seen, actual_element=tilted), *data.features[1:])
    said = texts(pdf.lay_out(replace(data, view=view, features=features)))
    assert not re.search(r"-0\.0+(?![\d])", said)
    assert "x 0.0000 y 2.0000 z 0.0000" in " ".join(said.split())
    assert "4 of 9" in said


@pytest.mark.usefixtures("qapp")
def test_a_part_without_tolerances_does_not_conform_to_any(data: ReportData) -> None:
    said = texts(pdf.lay_out(replace(data, view=replace(data.view, characteristics=()))))
    assert "NO TOLERANCE" in said
    assert "CONFORM" not in said


@pytest.mark.usefixtures("qapp")
def test_the_file_is_whole_and_holds_the_numbers_for_programs(
    data: ReportData, tmp_path: Path
) -> None:
    path = pdf.write_pdf(data, tmp_path)
    made = path.read_bytes()
    assert path.name == f"{data.stem}_report.pdf"
    assert made.startswith(b"%PDF-")
    _, files = attached(made)
    (inside,) = (content for content in files.values() if b"ocmm.report/" in content)
    assert json.loads(inside)["job"]["uuid"] == data.head.job_uuid


def test_the_command_line_writes_it(
    job_path: Path, data: ReportData, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = CliRunner().invoke(
        app, ["report", str(job_path), "--format", "pdf", "--out", str(tmp_path)]
    )
    assert said.exit_code == 0, said.output
    assert (tmp_path / f"{data.stem}_report.pdf").read_bytes().startswith(b"%PDF-")
    (tmp_path / "file").touch()
    said = CliRunner().invoke(
        app, ["report", str(job_path), "--format", "pdf", "--out", str(tmp_path / "file" / "x")]
    )
    assert isinstance(said.exception, StorageError)
    assert "cannot be written" in said.exception.what
    monkeypatch.setattr(pdf, "lay_out", lambda data: 1 // 0)
    said = CliRunner().invoke(
        app, ["report", str(job_path), "--format", "pdf", "--out", str(tmp_path)]
    )
    assert isinstance(said.exception, StorageError)
    assert "ZeroDivisionError" in said.exception.what


@pytest.mark.usefixtures("qapp")
def test_a_file_without_what_was_put_in_is_not_kept(
    data: ReportData, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pdf_writer, "attached", lambda made: (1, {}))
    with pytest.raises(StorageError) as caught:
        pdf.write_pdf(data, tmp_path)
    assert caught.value.code == "export.pdf"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("qapp")
def test_long_tables_go_on_over_pages_and_nothing_leaves_the_paper(data: ReportData) -> None:
    many = tuple(
        replace(data.results[0], name=f"A characteristic with a long name {i}") for i in range(200)
    )
    canvas = pdf.lay_out(replace(data, view=replace(data.view, characteristics=many)))
    assert len(canvas.pages) > 5
    said = texts(canvas)
    assert said.count("Deviation") >= 5
    for index in range(len(canvas.pages)):
        picture = pdf.page_picture(canvas, index, data, 420)
        # The margins stay white; the foot of the page lies in the lowest tenth.
        edge = {picture.pixel(x, y) for x in (4, 415) for y in range(picture.height())}
        assert edge == {0xFFFFFFFF}


@pytest.mark.usefixtures("qapp")
@pytest.mark.parametrize("kind", [name for name, spec in KINDS.items() if spec.one_sided])
def test_every_zone_has_a_symbol_that_stays_in_its_box(kind: str) -> None:
    symbol = KINDS[kind].symbol
    assert symbol is not None
    image = QImage(80, 80, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.white)
    painter = QPainter(image)
    paint_symbol(painter, symbol, QRectF(20.0, 20.0, 40.0, 40.0), Qt.GlobalColor.black)
    painter.end()
    dark = [
        (x, y) for x in range(80) for y in range(80) if image.pixelColor(x, y).lightness() < 128
    ]
    assert len(dark) > 30
    assert all(17 <= x <= 62 and 17 <= y <= 62 for x, y in dark)


@pytest.mark.usefixtures("qapp")
def test_a_german_report_says_the_same_numbers_in_german(data: ReportData) -> None:
    template = msgspec.structs.replace(data.paper.template, language="de")
    german = replace(data, paper=replace(data.paper, template=template))
    said, english = texts(pdf.lay_out(german)), texts(pdf.lay_out(data))
    assert "Ergebnisse" in said
    assert "SIMULIERT" in said
    assert not re.search(r"\b(NOT PROVEN|CONFORM|Results|Verdict|Deviation)\b", said)
    # Serial numbers are no denial, and inserted texts are German as well.
    assert not re.search(r"\bnein\b|\bno\.|\bleast squares\b|recommended|whisker|accepted", said)
    assert re.search(r"[+-]0,\d{4}", said)
    assert re.search(r"[+-]0\.\d{4}", english)
    for item in data.reported:
        if item.result.stated is not None:
            assert f"{item.result.stated[0]:z.4f}".replace(".", ",") in said


_WITHOUT_UNIT = {
    "Points", "T / 2U", "Parts", "Cp", "Cpk", "95 %", "Ppk", "Signals",
}  # fmt: skip
"""Columns of counts and ratios; the interval is that of Cpk."""


def test_every_column_of_numbers_is_of_lengths_or_a_count_or_ratio() -> None:
    """So no column of lengths is without the unit in its head."""
    for columns in (
        sections.RESULT_COLUMNS, sections.FEATURE_COLUMNS, sections.BASIS_COLUMNS,
        sections.WHY_COLUMNS, batch.COLUMNS,
    ):  # fmt: skip
        for column in columns:
            assert column.length or not column.right or column.title in _WITHOUT_UNIT, column


@pytest.mark.usefixtures("qapp")
@pytest.mark.parametrize(
    ("unit", "word", "scale", "places"), [("mm", "mm", 1.0, 4), ("inch", "in", 25.4, 5)]
)
def test_a_report_has_its_unit_in_every_head_and_its_numbers_and_u_in_it(
    data: ReportData, unit: str, word: str, scale: float, places: int
) -> None:
    template = msgspec.structs.replace(data.paper.template, lengths=unit)
    report = replace(data, paper=replace(data.paper, template=template))
    said = texts(pdf.lay_out(report))
    for head in ("Nominal", "Limits", "Measured", "Deviation", U_LABEL, "Actual element"):
        assert f"{head}, {word} " in said
    lengths = [
        item
        for item in report.reported
        if item.unit == "mm" and item.result.stated and not item.one_sided
    ]
    assert lengths
    for item in lengths:
        assert item.result.stated is not None
        measured, deviation, expanded = (value / scale for value in item.result.stated)
        for value in (measured, expanded, item.result.nominal / scale):
            assert f" {value:z.{places}f} " in said
        # In the plot the unit follows.
        assert f"{deviation:+z.{places}f} {word} " in said
    # Machine-readable output is independent of the language of the report.
    json_in = EXPORTERS["json"].contents((report,), polyworks_profile())
    assert b"Lengths in mm, angles in degrees." in next(iter(json_in.values()))
    assert numbers_in_use() == NumberStyle()


@pytest.mark.usefixtures("qapp")
@pytest.mark.parametrize("number", ["0.0017", "-136.3936", "+0,0800", "19.9859"])
def test_a_number_in_a_narrow_column_is_smaller_and_not_broken(number: str) -> None:
    line = text_height("0", BODY, 1000.0)
    wide = text_height(number, BODY, 1000.0)
    assert wide == pytest.approx(line)
    narrow = next(
        width for width in range(400, 10, -4) if text_height(number, BODY, width) > 1.5 * line
    )
    assert whole_words(number, BODY, 400.0) == BODY
    style = whole_words(number, BODY, narrow)
    assert style.size < BODY.size
    assert text_height(number, style, narrow) < 1.5 * line
