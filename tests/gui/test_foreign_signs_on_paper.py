"""Names in any script on paper: each sign has a glyph, or its code point is printed."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path

import pypdfium2  # type: ignore[import-untyped]
import pytest
from PySide6.QtGui import QTextLayout

from ocmm_gui.kit import text_font
from ocmm_gui.reports import _pdf as report
from ocmm_gui.reports._canvas import printable
from tests.core.export.sample_report import HEAD, sample_report
from tests.gui.pdf_texts import pages
from tests.gui.pdf_validity import verapdf

pytestmark = pytest.mark.usefixtures("qapp")
NAMES = {
    "Chinese": "缸体 7", "Japanese": "シリンダー", "Korean": "실린더", "Greek": "Κύλινδρος",
    "Cyrillic": "Цилиндр Ж", "Hindi": "सिलेंडर", "Thai": "กระบอก", "sign": "Ø 12 µm ± 0,1°",
    "picture": "A 🙂 B", "private": "A \ue000 B",
}  # fmt: skip


def boxes(text: str) -> int:
    """Return the number of glyphs drawn as the box of a font."""
    layout = QTextLayout(text, text_font(20))
    layout.beginLayout()
    layout.createLine()
    layout.endLayout()
    return sum(list(run.glyphIndexes()).count(0) for run in layout.glyphRuns())


@pytest.mark.parametrize("name", NAMES)
def test_no_sign_is_printed_as_a_box(name: str) -> None:
    text = NAMES[name]
    shown = printable(text)
    assert boxes(shown) == 0
    assert re.sub(r"\[U\+([0-9A-F]{4,6})\]", lambda one: chr(int(one[1], 16)), shown) == text
    if not boxes(text):
        assert shown == text
    assert printable("Κύλινδρος Жук Ø") == "Κύλινδρος Жук Ø"


def test_a_report_with_foreign_names_has_no_boxes_and_stays_valid(tmp_path: Path) -> None:
    head = replace(HEAD, operator="Ж. Ωμέγα 山田", part="缸体")
    data = sample_report(head=head)
    words = " ".join(pages(data))
    assert boxes(words) == 0
    assert printable("缸体") in words
    assert ("are in no font" in words) == (printable("缸体山田") != "缸体山田")
    content = report.pdf_file(data)[1]
    first = pypdfium2.PdfDocument(io.BytesIO(content))[0].get_textpage().get_text_range()
    assert "Ωμέγα" in first
    (tmp_path / "report.pdf").write_bytes(content)
    assert verapdf([tmp_path / "report.pdf"]) == ["VALID"]
