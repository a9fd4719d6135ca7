"""The report as PDF, with the same numbers inside as a file that programs can read."""

from __future__ import annotations

import re
import zlib
from collections.abc import Mapping
from pathlib import Path

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QMarginsF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPageLayout, QPageSize, QPainter, QPdfWriter

from ocmm_core.errors import StorageError
from ocmm_core.export.files import write_together
from ocmm_core.export.profile import polyworks_profile
from ocmm_core.export.registry import EXPORTERS
from ocmm_core.export.report_data import ReportData
from ocmm_core.inspection.job_words import NO_REAL_PART, SIMULATED
from ocmm_gui.reports.canvas import (
    BOTTOM,
    INK,
    LEFT,
    PAGE,
    SMALL,
    WIDTH,
    Canvas,
    Style,
    paint_text,
)
from ocmm_gui.reports.plots import deviations, picture
from ocmm_gui.reports.sections import basis, features, records, title, verdicts, why_not

_BAND_TOP, _BAND_HIGH = 40.0, 72.0
"""Above what is laid out, so that it covers no number; tenths of a millimetre."""
_RESOLUTION = 1200
_UNITS_PER_INCH = 254.0


def lay_out(data: ReportData) -> Canvas:
    """Return the pages of the report."""
    canvas = Canvas()
    title(canvas, data)
    verdicts(canvas, data)
    why_not(canvas, data)
    deviations(canvas, data)
    picture(canvas, data)
    features(canvas, data)
    basis(canvas, data)
    records(canvas, data)
    return canvas


def page_picture(canvas: Canvas, index: int, data: ReportData, width: int = 1240) -> QImage:
    """Return one page as a picture, as for a preview."""
    scale = width / PAGE[0]
    image = QImage(width, round(scale * PAGE[1]), QImage.Format.Format_RGB32)
    image.fill(QColor("white"))
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.scale(scale, scale)
    paint_page(painter, canvas, index, data)
    painter.end()
    return image


def pdf_bytes(data: ReportData, attachments: Mapping[str, bytes]) -> bytes:
    """Return the report as a PDF file with other files inside.

    Raises
    ------
    StorageError
        What was read back from it is not what was put in.
    """
    canvas = lay_out(data)
    content = QByteArray()
    buffer = QBuffer(content)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setPageSize(QPageSize(QPageSize.PageSizeId.A4))
    writer.setPageMargins(QMarginsF(0.0, 0.0, 0.0, 0.0), QPageLayout.Unit.Millimeter)
    writer.setResolution(_RESOLUTION)
    writer.setTitle(f"{data.head.part} {data.head.serial}: {data.job}")
    writer.setCreator(f"OCMM {data.written_by}")
    for name, attached in attachments.items():
        writer.addFileAttachment(name, QByteArray(attached), "application/json")
    painter = QPainter(writer)
    painter.scale(_RESOLUTION / _UNITS_PER_INCH, _RESOLUTION / _UNITS_PER_INCH)
    for index in range(len(canvas.pages)):
        if index:
            writer.newPage()
        paint_page(painter, canvas, index, data)
    painter.end()
    buffer.close()
    made = bytes(content.data())
    _require_whole(made, len(canvas.pages), attachments)
    return made


def write_pdf(data: ReportData, folder: Path) -> Path:
    """Write ``<job>_report.pdf`` with the JSON report inside, and return its path.

    Raises
    ------
    StorageError
        As `pdf_bytes`, or the folder cannot be written.
    """
    path = Path(folder) / f"{data.stem}_report.pdf"
    attachments = EXPORTERS["json"].contents((data,), polyworks_profile())
    write_together({path: pdf_bytes(data, attachments)})
    return path


def streams(pdf: bytes) -> list[bytes]:
    """Return all streams of a PDF file that can be unpacked."""
    found = []
    for match in re.finditer(rb"stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL):
        try:
            found.append(zlib.decompress(match.group(1)))
        except zlib.error:
            found.append(match.group(1))
    return found


def _require_whole(pdf: bytes, pages: int, attachments: Mapping[str, bytes]) -> None:
    inside = streams(pdf)
    missing = [name for name, content in attachments.items() if content not in inside]
    counted = len(re.findall(rb"/Type\s*/Page\b", pdf))
    if missing or counted != pages or not pdf.rstrip().endswith(b"%%EOF"):
        raise StorageError(
            "export.pdf",
            f"The PDF that was made is not whole: {counted} of {pages} pages"
            f"{', without ' + ', '.join(missing) if missing else ''}.",
            "Export it again; the other formats are not affected.",
        )


def paint_page(painter: QPainter, canvas: Canvas, index: int, data: ReportData) -> None:
    """Paint a page with its foot, and with what the report must not be taken for above it."""
    if data.states:
        _paint_band(painter, data)
    for draw in canvas.pages[index]:
        draw(painter)
    foot = QRectF(LEFT, BOTTOM + 30.0, WIDTH, 60.0)
    uuid = data.head.job_uuid
    named = "   ".join((data.job, *data.states, uuid, f"OCMM {data.written_by}"))
    paint_text(painter, foot, named, SMALL)
    paint_text(
        painter, foot, f"{index + 1} / {len(canvas.pages)}", SMALL,
        Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop,
    )  # fmt: skip


def _paint_band(painter: QPainter, data: ReportData) -> None:
    """Paint what the report must not be taken for across the top of a page, above all else."""
    band = QRectF(LEFT, _BAND_TOP, WIDTH, _BAND_HIGH)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(INK.warn))
    painter.drawRect(band)
    words = "   ·   ".join(data.states)
    if SIMULATED in data.states:
        words += f"   ({NO_REAL_PART})"
    style = Style(44.0, bold=True, colour="#ffffff")
    paint_text(painter, band, words, style, Qt.AlignmentFlag.AlignCenter)
