"""A workbook on paper: by its page set-up, and by the print of LibreOffice."""

from __future__ import annotations

import re
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import openpyxl
import pytest
from openpyxl.utils import column_index_from_string
from openpyxl.worksheet.worksheet import Worksheet

from ocmm_core.export import write_report
from ocmm_core.export.report import ReportData
from ocmm_core.features.shapes import Shape, element
from tests.core.export.sample_report import feature, point, sample_report, sample_view
from tests.host import HANG_S, needs_tools

DEMO_POINTS = 88
MOST_PAGES = 4


def job_as_large_as_the_demo() -> ReportData:
    angles = np.linspace(0.0, 6.0, DEMO_POINTS)
    points = [
        point(
            number, "BORE 1", (10.0 * np.cos(a), 10.0 * np.sin(a), 1000.0),
            (-np.cos(a), -np.sin(a), 0.0),
        )
        for number, a in enumerate(angles, start=1)
    ]  # fmt: skip
    bore = feature(
        "BORE 1", Shape.CIRCLE, points, element([0.0, 0.0, 1000.0], [0.0, 0.0, 1.0], 10.0),
        [0.0] * DEMO_POINTS,
    )  # fmt: skip
    view = sample_view()
    return sample_report(replace(view, features=(bore, *view.features[1:])))


def xml_of(book: Path, sheet: Worksheet) -> str:
    number = openpyxl.load_workbook(book).sheetnames.index(sheet.title) + 1
    with zipfile.ZipFile(book) as archive:
        return archive.read(f"xl/worksheets/sheet{number}.xml").decode()


@pytest.fixture(name="book", scope="module")
def _book(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a workbook that the tests only read."""
    folder = tmp_path_factory.mktemp("book")
    (path,) = write_report(job_as_large_as_the_demo(), ("xlsx",), folder, incomplete=True)
    return path


def test_every_sheet_is_set_up_for_a_page(book: Path) -> None:
    sheets = openpyxl.load_workbook(book).worksheets
    pages = 0
    for sheet in sheets:
        setup = sheet.page_setup
        # A sheet that fits a page and names no other width is one page wide.
        assert (setup.paperSize, setup.fitToWidth or 1) == (9, 1), sheet.title
        assert "<pageSetUpPr fitToPage=" in xml_of(book, sheet)
        assert "Page &amp;P of &amp;N" in xml_of(book, sheet)
        assert "INCOMPLETE" in xml_of(book, sheet).partition("<oddHeader>")[2].partition("<")[0]
        pages += 1 if setup.fitToHeight is None else setup.fitToHeight or 1
        if sheet.title != "Verdict":
            # The row of the heads, below the state of the job, on every page.
            assert sheet.print_title_rows == "$2:$2"
            assert sheet.print_area
    # With the three points of the other feature, the same number as in the demonstration.
    assert pages <= MOST_PAGES


def test_what_is_printed_says_the_verdict_and_its_limits(book: Path) -> None:
    sheet = openpyxl.load_workbook(book)["Characteristics"]
    (area,) = re.findall(r"\$A\$1:\$([A-Z]+)\$\d+", str(sheet.print_area))
    width = column_index_from_string(area)
    printed = [cell.value for cell in sheet[2]][:width]
    assert {"Name", "Nominal", "TolLower", "TolUpper", "Measured", "Uncertainty", "Verdict"} <= set(
        printed
    )
    # Nothing was lost: values equal in every row are behind the page.
    assert "Calibration" in [cell.value for cell in sheet[2]][width:]


@pytest.mark.slow
def test_libreoffice_prints_the_demo_on_four_pages(book: Path, tmp_path: Path) -> None:
    needs_tools("soffice")
    home = f"-env:UserInstallation=file://{tmp_path / 'office'}"
    subprocess.run(
        ["soffice", home, "--headless", "--convert-to", "pdf", "--outdir", tmp_path, book],
        check=True, capture_output=True, timeout=HANG_S,
    )  # fmt: skip
    pdf = (tmp_path / book.with_suffix(".pdf").name).read_bytes()
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) <= MOST_PAGES


@pytest.mark.parametrize(("unit", "word", "scale"), [("mm", "mm", 1.0), ("inch", "in", 25.4)])
def test_a_workbook_is_in_the_unit_of_the_paper_and_says_it_for_every_number(
    tmp_path: Path, unit: str, word: str, scale: float
) -> None:
    report = job_as_large_as_the_demo()
    template = msgspec.structs.replace(report.paper.template, lengths=unit)
    report = replace(report, paper=replace(report.paper, template=template))
    (path,) = write_report(report, ("xlsx",), tmp_path, incomplete=True)
    book = openpyxl.load_workbook(path)
    rows = [
        dict(zip([cell.value for cell in sheet[2]], [cell.value for cell in row], strict=True))
        for sheet in (book["Characteristics"], book["Features"])
        for row in sheet.iter_rows(min_row=3)
    ]
    # Angles say themselves that they are none.
    assert {row["Unit"] for row in rows} <= {unit, "deg"}
    stated = [item for item in report.reported if item.unit == "mm" and item.result.stated]
    assert stated
    for item in stated:
        assert item.result.stated is not None
        row = next(row for row in rows if row["Name"] == item.result.name and "Control" in row)
        assert row["Measured"] == pytest.approx(item.result.stated[0] / scale, rel=1e-12)
        assert row["Uncertainty"] == pytest.approx(item.result.stated[2] / scale, rel=1e-12)
    heads = [cell.value for cell in book["Points"][2]]
    assert heads[1:4] == [f"X, {word}", f"Y, {word}", f"Z, {word}"]
    place = report.features[0].seen.points[0].surface_world
    cells = next(book["Points"].iter_rows(min_row=3, max_row=3))
    expected = report.frame.apply(place)
    for cell, value in zip(cells[1:4], expected, strict=True):
        assert cell.value == pytest.approx(float(value) / scale, rel=1e-12, abs=1e-12)


def test_a_line_of_the_front_sheet_is_as_high_as_its_text(book: Path) -> None:
    front = openpyxl.load_workbook(book)["Verdict"]
    wide = front.column_dimensions["B"].width
    long = 0
    for number in range(1, front.max_row + 1):
        text = str(front.cell(number, 2).value or "")
        if len(text) > wide:
            long += 1
            assert (front.row_dimensions[number].height or 0.0) >= 30.0, text
    # The decision rule, at least.
    assert long > 0


def test_a_german_report_has_a_german_workbook_and_says_the_same(tmp_path: Path) -> None:
    report = job_as_large_as_the_demo()
    template = msgspec.structs.replace(report.paper.template, language="de")
    german = replace(report, paper=replace(report.paper, template=template))
    (path,) = write_report(german, ("xlsx",), tmp_path, incomplete=True)
    book = openpyxl.load_workbook(path)
    assert book.sheetnames == ["Urteil", "Merkmale", "Elemente", "Punkte"]
    heads = [cell.value for cell in book["Merkmale"][2]]
    assert {"Nennwert", "Unteres Abmaß", "Oberes Abmaß", "Istwert", "Urteil"} <= set(heads)
    front = [[cell.value for cell in row] for row in book["Urteil"].iter_rows()]
    said = {row[0]: row[1] for row in front}
    assert said["Gegenstand"] == "Wert"
    # Names of people and parts are theirs in every language.
    assert said["Bediener"] == report.head.operator
    (other,) = write_report(report, ("xlsx",), tmp_path / "en", incomplete=True)
    english = openpyxl.load_workbook(other)
    words = {"CONFORM": "KONFORM", "NOT CONFORM": "NICHT KONFORM"}
    pairs = list(
        zip(
            english["Characteristics"].iter_rows(min_row=3),
            book["Merkmale"].iter_rows(min_row=3),
            strict=True,
        )
    )
    place = [cell.value for cell in english["Characteristics"][2]].index("Verdict")
    assert pairs
    for mine, theirs in pairs:
        assert words.get(str(mine[place].value), "") in (theirs[place].value, "")
        for one, same in zip(mine, theirs, strict=True):
            if isinstance(one.value, float):
                assert one.value == same.value
