"""The paper that an auditor signs: head, sections by the template, words of the picture, end."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QImage

from ocmm_core.errors import InputError
from ocmm_core.export.report import ReportData, paper_facts, report_number
from ocmm_core.export.template import SECTIONS, Particulars, load_paper
from ocmm_gui.kit import text_font
from ocmm_gui.reports import _pdf as pdf
from ocmm_gui.reports._canvas import Style, printable, text_height
from ocmm_gui.reports._pdf import placed_words
from ocmm_gui.scene import Tag
from tests.core.export.sample_report import sample_report
from tests.gui.pdf_texts import texts

TEMPLATE = """
schema = "ocmm.report-template/1"
unit = "mm"
name = "lab"
title = "Test report"
sections = ["basis", "results"]
signatures = ["Inspector", "Head of laboratory", "Customer"]
[laboratory]
name = "Laboratory"
address = ["1 Street", "Town"]
logo = "logo.png"
"""


def on_paper(folder: Path, text: str = TEMPLATE, given: Particulars | None = None) -> ReportData:
    image = QImage(20, 10, QImage.Format.Format_RGB32)
    image.fill(0xFF336699)
    assert image.save(str(folder / "logo.png"))
    path = folder / "lab.toml"
    path.write_text(text, encoding="utf-8")
    return replace(sample_report(), paper=load_paper(path, given))


@pytest.mark.usefixtures("qapp")
def test_every_section_of_a_template_can_be_drawn() -> None:
    assert set(pdf.SECTION_PAINTERS) == set(SECTIONS)


@pytest.mark.usefixtures("qapp")
def test_the_paper_has_the_head_the_sections_and_the_signatures_of_its_template(
    tmp_path: Path,
) -> None:
    data = on_paper(tmp_path)
    said = " ".join(texts(pdf.lay_out(data)).split())
    assert said.startswith("Laboratory 1 Street · Town Test report")
    for fact in paper_facts(data):
        if fact.name != "Title":
            assert fact.value in said or fact.name in ("Signed by",), fact
    assert said.index("Basis of the results") < said.index("Results Characteristic")
    assert "Deviations within their tolerances" not in said
    assert "The results relate only to the items measured." in said
    assert said.endswith(
        f"Inspector Head of laboratory Customer End of report {report_number(data)}"
    )


@pytest.mark.usefixtures("qapp")
def test_the_logo_stands_in_its_corner(tmp_path: Path) -> None:
    data = on_paper(tmp_path)
    image = pdf.page_picture(pdf.lay_out(data), 0, data, 1050)
    colours = {image.pixelColor(x, y).name() for x in range(860, 970, 4) for y in range(60, 140, 4)}
    assert "#336699" in colours


@pytest.mark.usefixtures("qapp")
def test_long_facts_get_the_width_of_the_page(tmp_path: Path) -> None:
    long = Particulars(deviations=tuple(f"Deviation number {n} of many." for n in range(60)))
    data = on_paper(tmp_path, given=long)
    said = " ".join(texts(pdf.lay_out(data)).split())
    for number in range(60):
        assert f"Deviation number {number} of many." in said


@pytest.mark.usefixtures("qapp")
def test_words_of_the_picture_never_cover_each_other() -> None:
    rng = np.random.default_rng(7)
    box = QRectF(150.0, 400.0, 1800.0, 1000.0)
    for crowd in (5, 20, 40):
        points = rng.normal([900.0, 500.0], [260.0, 160.0], (crowd, 2))
        tags = [Tag(np.zeros(3), f"FEATURE {n}", "#000000") for n in range(crowd)]
        words = [word for _, _, word in placed_words(box, tags, points)]
        assert len(words) == crowd
        assert all(box.contains(word) for word in words)
        assert not any(one.intersects(other) for one, other in combinations(words, 2))


@pytest.mark.usefixtures("qapp")
def test_heights_of_texts_are_those_of_qt() -> None:
    rng = np.random.default_rng()
    signs = np.array(list("0123456789.-+ aWg≤Ø°✓\n\U0001f600中"))
    for _ in range(300):
        text = "".join(rng.choice(signs, rng.integers(20)))
        style = Style(float(rng.uniform(18.0, 60.0)), bold=bool(rng.integers(2)))
        width = float(rng.uniform(40.0, 800.0))
        shown, metrics = printable(text), QFontMetricsF(text_font(style.size, bold=style.bold))
        longest = metrics.horizontalAdvance(max(shown.split(), key=len, default=""))
        flag = Qt.TextFlag.TextWrapAnywhere if longest > width else Qt.TextFlag.TextWordWrap
        expected = metrics.boundingRect(QRectF(0.0, 0.0, width, 1e6), int(flag), shown).height()
        assert text_height(text, style, width) == expected, (text, style, width)


@pytest.mark.usefixtures("qapp")
def test_a_logo_that_is_no_picture_is_told_and_not_left_out(tmp_path: Path) -> None:
    data = on_paper(tmp_path)
    whole = data.paper.logo
    spoilt = whole[: len(whole) // 2] + bytes(len(whole))
    bomb = whole[:16] + (100_000).to_bytes(4, "big") * 2 + whole[24:]
    for logo in (whole[:8], spoilt, bomb):
        with pytest.raises(InputError, match=r"'laboratory\.logo'"):
            pdf.lay_out(replace(data, paper=replace(data.paper, logo=logo)))
    wide = QImage(5000, 10, QImage.Format.Format_RGB32)
    wide.fill(0)
    assert wide.save(str(tmp_path / "logo.png"))
    large = load_paper(tmp_path / "lab.toml")
    with pytest.raises(InputError, match="5000 × 10 pixels"):
        pdf.lay_out(replace(data, paper=large))


@pytest.mark.parametrize(
    "customer",
    [
        "x" * 1000,
        "שלום עולם " * 80,
        "مرحبا بالعالم " * 60,
        "\u202eGNORW si siht\u202c",
        "\U0001f4d0\U00012000\ue000" * 200,
        "a\u0301" * 500,
    ],
)
@pytest.mark.usefixtures("qapp")
def test_whatever_a_customer_is_called_stays_on_its_page(tmp_path: Path, customer: str) -> None:
    data = on_paper(tmp_path, given=Particulars(customer=customer))
    canvas = pdf.lay_out(data)
    # The head grows with its content, and ends above the foot; the end of the report is present.
    assert len(canvas.pages) <= 6
    assert texts(canvas).strip().endswith(f"End of report {report_number(data)}")
    told = next(fact.value for fact in paper_facts(data) if fact.name == "Customer")
    assert "\u202e" not in told
    page = pdf.page_picture(canvas, 0, data, 420)
    margin = page.copy(page.width() - 25, 0, 25, page.height())
    assert {margin.pixel(x, y) for x in range(0, 25, 3) for y in range(0, page.height(), 3)} == {
        0xFFFFFFFF
    }
