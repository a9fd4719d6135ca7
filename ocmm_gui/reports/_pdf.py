"""The report as PDF, with its numbers in machine-readable attachments, and deviation plots."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen

from ocmm_core.export import EXPORTERS, PDF, report, require_complete, write_report
from ocmm_core.export.template import Section
from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED
from ocmm_core.tolerances.decisions import U_LABEL
from ocmm_gui.kit import ink, verdict_colour
from ocmm_gui.reports._canvas import INK, LEFT, PAGE, SMALL, WIDTH, PageCanvas, Style, paint_text
from ocmm_gui.reports._messages import lengths_of, numbers_of, speech_of
from ocmm_gui.reports._paper import closing, head_facts, letterhead, records
from ocmm_gui.reports._part_picture import picture
from ocmm_gui.reports._pdf_writer import paint_with_foot, written_pdf
from ocmm_gui.reports._sections import basis, features, title, verdicts, why_not

_ROW = 52.0
_NAME = 520.0
_BEYOND = 1.5
"""Deviations beyond this many half tolerances are drawn as an arrow."""


def deviations(canvas: PageCanvas, data: report.ReportData) -> None:
    """Draw every deviation in its tolerance, with its uncertainty as a whisker."""
    shown = [item for item in data.reported if _place(item) is not None]
    if not shown:
        return
    canvas.heading("Deviations within their tolerances", 4.0 * _ROW)
    canvas.text(canvas.speech.say(f"Band: tolerance about its middle. Whisker: {U_LABEL}."), SMALL)
    for item in shown:
        paint = partial(_paint_deviation, item=item, canvas=canvas)
        canvas.draw(_ROW, paint, item.result.name)


def _place(item: report.ReportedResult) -> tuple[float, float] | None:
    """Return deviation and U in half tolerances from the middle; None if undefined."""
    result = item.result
    half = 0.5 * (result.upper - result.lower)
    if result.stated is None or half <= 0.0:
        return None
    _, deviation, uncertainty = result.stated
    middle = 0.5 * (result.upper + result.lower)
    return (deviation - middle) / half, uncertainty / half


def _paint_deviation(
    painter: QPainter, box: QRectF, *, item: report.ReportedResult, canvas: PageCanvas
) -> None:
    found, result = _place(item), item.result
    if found is None or result.deviation is None:
        return
    where, u = found
    paint_text(
        painter, QRectF(box.left(), box.top(), _NAME, box.height()), result.name, Style(28.0),
        Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter,
    )  # fmt: skip
    plot = box.adjusted(_NAME, 8.0, -360.0, -8.0)
    scale = 0.5 * plot.width() / _BEYOND
    centre = plot.center()
    ink(painter, Qt.PenStyle.NoPen, QColor(INK.zone_bad))
    painter.drawRect(plot)
    painter.setBrush(QColor(INK.zone_good))
    painter.drawRect(QRectF(centre.x() - scale, plot.top(), 2.0 * scale, plot.height()))
    painter.setPen(QPen(QColor(INK.border), 2.0))
    painter.drawLine(QPointF(centre.x(), plot.top()), QPointF(centre.x(), plot.bottom()))
    painter.setPen(QPen(QColor(INK.text), 3.0))
    ends = [centre.x() + scale * max(-_BEYOND, min(_BEYOND, where + s * u)) for s in (-1.0, 1.0)]
    painter.drawLine(QPointF(ends[0], centre.y()), QPointF(ends[1], centre.y()))
    x = centre.x() + scale * max(-_BEYOND, min(_BEYOND, where))
    painter.setBrush(QColor(INK.text))
    if abs(where) <= _BEYOND:
        painter.drawEllipse(QPointF(x, centre.y()), 9.0, 9.0)
    else:
        sense = math.copysign(1.0, where)
        painter.drawPolygon(
            [
                QPointF(x, centre.y()),
                QPointF(x - 22.0 * sense, centre.y() - 14.0),
                QPointF(x - 22.0 * sense, centre.y() + 14.0),
            ]
        )
    unit = "" if item.unit == "deg" else f" {canvas.lengths.word}"
    told = canvas.lengths.quantity(result.deviation, item.unit, signed=True)
    paint_text(
        painter, QRectF(plot.right() + 20.0, box.top(), 340.0, box.height()),
        canvas.speech.number(f"{told}{unit}"),
        Style(28.0, bold=True, colour=verdict_colour(INK, result.verdict)),
        Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter,
    )  # fmt: skip


_LONGEST_TITLE, _LONGEST_NUMBER = 200, 60

_BAND_TOP, _BAND_HIGH = 40.0, 72.0
"""Above the layout, so that it covers no number; tenths of a millimetre."""


SECTION_PAINTERS: dict[Section, Callable[[PageCanvas, report.ReportData], None]] = {
    "results": verdicts,
    "why": why_not,
    "deviations": deviations,
    "picture": picture,
    "features": features,
    "basis": basis,
}
"""Sections of a template; a test compares them with `export.report.SECTIONS`."""


def lay_out(data: report.ReportData) -> PageCanvas:
    canvas = PageCanvas(speech_of(data), lengths_of(data))
    with numbers_of(data):
        letterhead(canvas, data)
        title(canvas, data)
        head_facts(canvas, data)
        for name in data.paper.template.sections:
            SECTION_PAINTERS[name](canvas, data)
        records(canvas, data)
        closing(canvas, data)
    return canvas


def page_picture(
    canvas: PageCanvas, index: int, data: report.ReportData, width: int = 1240
) -> QImage:
    scale = width / PAGE[0]
    image = QImage(width, round(scale * PAGE[1]), QImage.Format.Format_RGB32)
    image.fill(QColor("white"))
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.scale(scale, scale)
    paint_page(painter, canvas, index, data)
    painter.end()
    return image


def _told_nobody(_page: int, _pages: int) -> None:
    """Ignore the progress."""


def pdf_bytes(
    data: report.ReportData,
    attachments: Mapping[str, bytes],
    progress: Callable[[int, int], None] = _told_nobody,
) -> bytes:
    """Return the report as a PDF file with other files inside.

    `progress`: receives index and number of pages before each is painted. Raises StorageError if
    the file read back differs from the input.
    """
    canvas = lay_out(data)

    def paint(painter: QPainter, index: int) -> None:
        progress(index + 1, len(canvas.pages))
        paint_page(painter, canvas, index, data)

    return written_pdf(
        canvas,
        paint,
        attachments,
        title=report.one_line(f"{data.head.part} {data.head.serial}: {data.job}")[:_LONGEST_TITLE],
        software=data.written_by,
        utc=data.last_taken_utc or data.head.created_utc,
    )


def pdf_file(
    data: report.ReportData, progress: Callable[[int, int], None] = _told_nobody
) -> tuple[str, bytes]:
    """Return name and content of ``<job>_report.pdf``; arguments and errors as `pdf_bytes`."""
    attachments = EXPORTERS["json"].contents((data,), report.polyworks_profile())
    return f"{data.stem}{PDF.suffixes[0]}", pdf_bytes(data, attachments, progress)


def write_pdf(data: report.ReportData, folder: Path, *, incomplete: bool = False) -> Path:
    """Write ``<job>_report.pdf`` with the JSON report inside, and its seal; return its path.

    Raises MeasuringError for an incomplete job without ``incomplete``, StorageError as `pdf_bytes`
    or if the folder cannot be written.
    """
    if not incomplete:
        # Before the pages are made, which takes a second.
        require_complete((data,))
    name, content = pdf_file(data)
    path, *_ = write_report(data, (), folder, incomplete=incomplete, beside={name: content})
    return path


def paint_page(painter: QPainter, canvas: PageCanvas, index: int, data: report.ReportData) -> None:
    if data.states:
        _paint_band(painter, data)
    # Every page identifies its report (ISO/IEC 17025, 7.8.2.1 d).
    number = report.report_number(data)
    # Shortened, so that the states after it fit on every page; complete among the facts.
    short = number if len(number) <= _LONGEST_NUMBER else f"{number[: _LONGEST_NUMBER - 1]}…"
    named = "   ".join((short, *map(speech_of(data).word, data.states), f"OCMM {data.written_by}"))
    with numbers_of(data):
        paint_with_foot(painter, canvas, index, named)


def _paint_band(painter: QPainter, data: report.ReportData) -> None:
    """Paint the states of the report across the top of a page, above all else."""
    band = QRectF(LEFT, _BAND_TOP, WIDTH, _BAND_HIGH)
    ink(painter, Qt.PenStyle.NoPen, QColor(INK.warn))
    painter.drawRect(band)
    speech = speech_of(data)
    words = "   ·   ".join(map(speech.word, data.states))
    if SIMULATED in data.states:
        words += f"   ({speech.say(NO_REAL_PART)})"
    style = Style(44.0, bold=True, colour="#ffffff")
    paint_text(painter, band, words, style, Qt.AlignmentFlag.AlignCenter)
