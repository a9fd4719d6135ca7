"""Forms 1 to 3 of AS9102: filled blocks, blank ones with the reason, units, and safe texts."""

from __future__ import annotations

import io
import zipfile
from dataclasses import replace

import msgspec
from lxml import etree

from ocmm_core.export import EXPORTERS
from ocmm_core.export.report import ReportData, polyworks_profile
from tests.core.export.sample_report import sample_report

_SPACE = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
FAI = EXPORTERS["fai"]


def in_inch(data: ReportData) -> ReportData:
    template = msgspec.structs.replace(data.paper.template, lengths="inch")
    return replace(data, paper=replace(data.paper, template=template))


def workbook(data: ReportData) -> bytes:
    files = FAI.contents((data,), polyworks_profile())
    assert not FAI.differences((data,), polyworks_profile(), files)
    (book,) = (content for name, content in files.items() if name.endswith(".xlsx"))
    return book


def test_blank_blocks_have_a_reason_and_known_ones_have_none() -> None:
    first, second, third = FAI.preview((sample_report(),), polyworks_profile())
    assert [one.title for one in (first, second, third)] == ["Form 1", "Form 2", "Form 3"]
    for form in (first, second):
        for block, content, why in form.rows:
            assert bool(content) != bool(why), block
    blocks = {str(row[0]).partition(".")[0]: row for row in first.rows}
    assert blocks["1"][1] == "Block"
    assert str(blocks["14"][1]).startswith("Partial: NOT CONFORM")
    assert (blocks["19"][1], blocks["20-25"][1]) == ("no", "")
    assert all(row[1] == "" for row in second.rows[4:])


def test_results_are_in_the_unit_of_the_paper() -> None:
    metric, inch = (
        FAI.preview((data,), polyworks_profile())[2].rows[0]
        for data in (sample_report(), in_inch(sample_report()))
    )
    assert "20.0025 mm (U 0.0038)" in str(metric[4])
    # 20.0025 / 25.4 and 0.0038 / 25.4, five digits.
    assert "0.78750 in (U 0.00015)" in str(inch[4])
    assert "0.787402 +0.000787402" in str(inch[3])


def test_texts_that_look_like_formulas_stay_texts() -> None:
    """Even after a person edits the cell: its format has the quotation prefix."""
    with zipfile.ZipFile(io.BytesIO(workbook(sample_report()))) as archive:
        styles = etree.fromstring(archive.read("xl/styles.xml"))
        texts = [
            "".join(map(str, item.itertext()))
            for item in etree.fromstring(archive.read("xl/sharedStrings.xml")).iter(f"{_SPACE}si")
        ]
        sheet = etree.fromstring(archive.read("xl/worksheets/sheet1.xml"))
    formats = styles.find(f"{_SPACE}cellXfs")
    assert formats is not None
    quoted = {place for place, one in enumerate(formats) if one.get("quotePrefix") == "1"}
    found = 0
    for cell in sheet.iter(f"{_SPACE}c"):
        value = cell.findtext(f"{_SPACE}v")
        if cell.get("t") == "s" and value is not None and texts[int(value)][:1] in "=+-@":
            assert int(cell.get("s", "0")) in quoted
            found += 1
    assert found
