"""Page layout from top to bottom, in tenths of a millimetre.

Drawings are kept as functions and painted later, so that the same pages go into a PDF, a preview
and a test picture, and every page knows the total number. The process that draws has no
application and no screen.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QGuiApplication, QPainter, QPen, QTextLayout

from ocmm_core.errors import InternalError
from ocmm_core.export.template import PaperLengths
from ocmm_core.failure import EXIT_INTERNAL, contained
from ocmm_core.wording import Speech
from ocmm_gui.kit import THEMES, ink, text_font
from ocmm_gui.reports._archival import PageTag, paint_tag

INK = THEMES["light"]
"""Paper is white in every theme of the window."""

PAGE = (2100.0, 2970.0)
_LEAST = 0.6
"""Minimum relative type size of words in narrow places."""
LEFT, RIGHT, TOP, BOTTOM = 150.0, 1950.0, 140.0, 2800.0
WIDTH = RIGHT - LEFT

Draw = Callable[[QPainter], None]


@dataclass(frozen=True, slots=True)
class Style:
    """Style of a text: height of letters in tenths of a millimetre, weight and colour."""

    size: float = 30.0
    bold: bool = False
    colour: str = INK.text


BODY, SMALL, STRONG = Style(), Style(25.0, colour=INK.muted), Style(bold=True)
TITLE, HEADING = Style(58.0, bold=True), Style(38.0, bold=True)


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table; the unit of lengths is in the heading."""

    title: str
    width: float
    right: bool = False
    length: bool = False


@dataclass(frozen=True, slots=True)
class PageField:
    """A cell: text in a style, or a drawing in its box."""

    text: str = ""
    style: Style = BODY
    draw: Callable[[QPainter, QRectF], None] | None = None


@dataclass(slots=True)
class PageCanvas:
    """Pages under construction."""

    speech: Speech = field(default_factory=Speech)
    lengths: PaperLengths = field(default_factory=PaperLengths)
    """Unit of the report, shown in every heading above lengths."""
    pages: list[list[Draw]] = field(default_factory=lambda: [[]])
    tags: list[PageTag] = field(default_factory=list)
    y: float = TOP
    """Next position on the last page."""
    last: tuple[int, float] = (0, TOP)
    """Index and top of the last drawing on the last page."""

    def room(self, height: float) -> None:
        """Start a new page if ``height`` does not fit on this one."""
        if self.y + height > BOTTOM and self.pages[-1]:
            self.pages.append([])
            self.y = TOP
        self.last = len(self.pages[-1]), self.y

    def room_with_last(self, height: float) -> None:
        """Start a new page if necessary, moving the last drawing to it: no orphans."""
        first, top = self.last
        if self.y + height <= BOTTOM or not first or self.y - top + height > BOTTOM - TOP:
            self.room(height)
            return
        moved, self.pages[-1][first:] = self.pages[-1][first:], []
        self.pages.append([_shifted(draw, TOP - top) for draw in moved])
        self.y += TOP - top

    def tagged(self, draw: Draw, role: str, *, parent: int = -1, words: str = "") -> Draw:
        """Return a drawing as an element of the structure, see `PageTag`."""
        self.tags.append(PageTag(role, parent, words))
        index = len(self.tags) - 1

        def paint(painter: QPainter) -> None:
            paint_tag(painter, index)
            draw(painter)
            paint_tag(painter, -1)

        return paint

    def skip(self, height: float) -> None:
        self.y += height

    def draw(
        self, height: float, paint: Callable[[QPainter, QRectF], None], words: str = "", *,
        role: str = "",
    ) -> None:  # fmt: skip
        """Give ``paint`` a box of the full width; ``words`` describe a figure."""
        self.room(height)
        box = QRectF(LEFT, self.y, WIDTH, height)
        role = role or ("Figure" if words else "P")
        self.pages[-1].append(self.tagged(lambda painter: paint(painter, box), role, words=words))
        self.y += height

    def text(self, text: str, style: Style = BODY, *, left: float = LEFT) -> None:
        def paint(painter: QPainter, box: QRectF) -> None:
            paint_text(painter, box.adjusted(left - LEFT, 0.0, 0.0, 0.0), text, style)

        role = {TITLE: "H1", HEADING: "H2"}.get(style, "P")
        self.draw(text_height(text, style, RIGHT - left), paint, role=role)
        self.skip(6.0)

    def write_sentence(self, sentence: str, style: Style = BODY) -> None:
        """Write a sentence of the core in the language of the report."""
        self.text(self.speech.text(sentence), style)

    def heading(self, text: str, below: float) -> None:
        """Write a heading, kept together with ``below`` of the following content."""
        self.skip(24.0)
        self.room(60.0 + below)
        self.text(self.speech.word(text), HEADING)
        self.skip(4.0)

    def table(self, columns: Sequence[Column], rows: Sequence[Sequence[PageField]]) -> None:
        """Write a table; its headings are repeated on every page."""
        self.tags.append(PageTag("Table"))
        table = len(self.tags) - 1
        self._heads(columns, table)
        for told in rows:
            row = [_unbroken(cell, column) for cell, column in zip(told, columns, strict=True)]
            height = max(
                44.0,
                *(
                    text_height(cell.text, cell.style, column.width - 16.0) + 12.0
                    for cell, column in zip(row, columns, strict=True)
                    if cell.text
                ),
            )
            if self.y + height > BOTTOM:
                self.room(height)
                self._heads(columns, -1)
            self._row(columns, row, height, table)

    def _heads(self, columns: Sequence[Column], table: int) -> None:
        style = Style(24.0, bold=True, colour=INK.muted)
        titles = [
            f"{self.speech.word(column.title)}, {self.lengths.word}"
            if column.length
            else self.speech.word(column.title)
            for column in columns
        ]
        heads = [
            PageField(title, whole_words(title, style, column.width - 16.0))
            for title, column in zip(titles, columns, strict=True)
        ]
        height = 10.0 + max(
            text_height(head.text, head.style, column.width - 16.0)
            for head, column in zip(heads, columns, strict=True)
        )
        self.room(height + 60.0)
        self._row(columns, heads, height, table, "TH", 3.0)

    def _row(
        self, columns: Sequence[Column], row: Sequence[PageField], height: float, table: int,
        role: str = "TD", line: float = 1.0,
    ) -> None:  # fmt: skip
        """Draw a row; without a table its cells are decoration, like repeated headings."""
        x, y = LEFT, self.y
        self.last = len(self.pages[-1]), y
        if table >= 0:
            self.tags.append(PageTag("TR", table))
        inside = len(self.tags) - 1
        for column, cell in zip(columns, row, strict=True):
            box = QRectF(x + 8.0, y, column.width - 16.0, height)
            draw = _cell_painter(cell, box, right=column.right)
            self.pages[-1].append(self.tagged(draw, role, parent=inside) if table >= 0 else draw)
            x += column.width
        self.pages[-1].append(_ruler(QPointF(LEFT, y + height), QPointF(x, y + height), line))
        self.y += height


def whole_words(text: str, style: Style, width: float) -> Style:
    """Return a style, reduced if necessary, in which no word is broken."""
    return on_one_line(max(text.split(), key=len, default=""), style, width)


def on_one_line(text: str, style: Style, width: float) -> Style:
    """Return a style, reduced if necessary, in which a text fits on one line."""
    smaller = style
    while smaller.size > _LEAST * style.size:
        if _face(smaller.size, smaller.bold)[1].horizontalAdvance(text) <= width:
            break
        smaller = replace(smaller, size=0.95 * smaller.size)
    return smaller


def _unbroken(cell: PageField, column: Column) -> PageField:
    # A broken number reads as another one without its last digits.
    if not column.right or not cell.text:
        return cell
    return replace(cell, style=whole_words(cell.text, cell.style, column.width - 16.0))


@lru_cache(maxsize=64)
def _face(size: float, bold: bool) -> tuple[QFont, QFontMetricsF]:
    """Return font and metrics of a style, cached: large reports query 50,000 times."""
    font = text_font(size, bold=bold)
    return font, QFontMetricsF(font)


@contextmanager
def drawing() -> Iterator[None]:
    """Provide the application that fonts and painters need, while held."""
    if sys.platform == "linux":
        # A report needs no screen, and there may be none.
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    application = None if QGuiApplication.instance() else QGuiApplication([])
    # The many parts of pages start searches for cycles, which need not go through the job.
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        if application is not None:
            for cached in (_face, _has_glyph, _lines_height):
                cached.cache_clear()
            # Deleting the last reference does not suffice: PySide keeps one.
            application.shutdown()


def draw(write: Callable[[], None], part: str, safe: str) -> int:
    """Draw and write in a separate program, and return its exit code.

    0, 2 on failure, and 3 after an unexpected error, with a line on stderr. `part`, `safe`: the
    failed part and what is not lost, as for `contained`.
    """
    try:
        with drawing():
            write()
    except Exception as error:
        told = contained(error, part, safe)
        sys.stderr.write(f"{told.what} {told.remedy}\n")
        return EXIT_INTERNAL if isinstance(told, InternalError) else 2
    return 0


def printable(text: str) -> str:
    """Return text with ``[U+4E2D]`` for each sign that no font of this computer has."""
    if text.isascii() or all(map(_has_glyph, text)):
        return text
    return "".join(sign if _has_glyph(sign) else f"[U+{ord(sign):04X}]" for sign in text)


@lru_cache(maxsize=4096)
def _has_glyph(sign: str) -> bool:
    if sign.isascii() or sign.isspace():
        return True
    layout = QTextLayout(sign, _face(BODY.size, BODY.bold)[0])
    layout.beginLayout()
    layout.createLine()
    layout.endLayout()
    # Glyph 0 is the box of a font.
    return all(all(run.glyphIndexes()) for run in layout.glyphRuns())


def text_height(text: str, style: Style, width: float) -> float:
    _, metrics = _face(style.size, style.bold)
    text = printable(text)
    lines = text.split("\n")
    # Other signs may be of another font, whose lines are higher.
    if text.isascii() and all(metrics.horizontalAdvance(line) <= width for line in lines):
        return _lines_height(style.size, style.bold, len(lines))
    box = QRectF(0.0, 0.0, width, 1e6)
    return metrics.boundingRect(box, _wrapping(metrics, text, width), text).height()


@lru_cache(maxsize=256)
def _lines_height(size: float, bold: bool, count: int) -> float:
    """Return the height of lines without a break: most texts of tables."""
    box, text = QRectF(0.0, 0.0, 1e6, 1e6), "\n".join("x" * count)
    return _face(size, bold)[1].boundingRect(box, 0, text).height()


def _wrapping(metrics: QFontMetricsF, text: str, width: float) -> int:
    """Return the line breaking of a text: between words, or anywhere if a word does not fit."""
    # Most words are short: measuring each costs more than drawing.
    wide = metrics.horizontalAdvance(max(text.split(), key=len, default="")) > width
    return int(Qt.TextFlag.TextWrapAnywhere if wide else Qt.TextFlag.TextWordWrap)


def paint_line(
    painter: QPainter,
    box: QRectF,
    text: str,
    style: Style,
    align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop,
) -> None:
    """Write a text into one line of a box, elided if too long."""
    font, metrics = _face(style.size, style.bold)
    shown = metrics.elidedText(printable(text), Qt.TextElideMode.ElideRight, box.width())
    ink(painter, QColor(style.colour), font=font)
    painter.drawText(box, int(align) | int(Qt.TextFlag.TextSingleLine), shown)


def paint_text(
    painter: QPainter,
    box: QRectF,
    text: str,
    style: Style,
    align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop,
) -> None:
    font, metrics = _face(style.size, style.bold)
    text = printable(text)
    ink(painter, QColor(style.colour), font=font)
    painter.drawText(box, int(align) | _wrapping(metrics, text, box.width()), text)


def _cell_painter(cell: PageField, box: QRectF, *, right: bool) -> Draw:
    side = Qt.AlignmentFlag.AlignRight if right else Qt.AlignmentFlag.AlignLeft

    def paint(painter: QPainter) -> None:
        if cell.draw is not None:
            cell.draw(painter, box)
        if cell.text:
            paint_text(painter, box, cell.text, cell.style, side | Qt.AlignmentFlag.AlignVCenter)

    return paint


def _shifted(draw: Draw, down: float) -> Draw:
    def paint(painter: QPainter) -> None:
        painter.save()
        painter.translate(0.0, down)
        draw(painter)
        painter.restore()

    return paint


def _ruler(begin: QPointF, end: QPointF, width: float) -> Draw:
    def paint(painter: QPainter) -> None:
        painter.setPen(QPen(QColor(INK.border), width))
        painter.drawLine(begin, end)

    return paint
