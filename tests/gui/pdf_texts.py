"""The words that are drawn on the pages of a report."""

from __future__ import annotations

import re
from functools import partial

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QSizeF
from PySide6.QtGui import QPainter
from PySide6.QtSvg import QSvgGenerator

from ocmm_core.export.report import ReportData
from ocmm_gui.reports import _pdf as pdf
from ocmm_gui.reports._canvas import PAGE, Draw, PageCanvas


def texts(canvas: PageCanvas) -> str:
    """Return every word that is laid out, page by page; lines as they are broken."""

    def paint(painter: QPainter, page: list[Draw]) -> None:
        for draw in page:
            draw(painter)

    return " ".join(drawn(partial(paint, page=page)) for page in canvas.pages)


def drawn(paint: Draw) -> str:
    """Return every word that something draws."""
    content = QByteArray()
    buffer = QBuffer(content)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    generator = QSvgGenerator()
    generator.setOutputDevice(buffer)
    generator.setSize(QSizeF(*PAGE).toSize())
    painter = QPainter(generator)
    paint(painter)
    painter.end()
    return " ".join(re.findall(r"<text[^>]*>([^<]*)</text>", bytes(content.data()).decode()))


def pages(data: ReportData) -> list[str]:
    """Return every word of every page as printed, with its foot and head."""
    canvas = pdf.lay_out(data)
    return [
        drawn(partial(pdf.paint_page, canvas=canvas, index=index, data=data))
        for index in range(len(canvas.pages))
    ]
