"""The end of a report: what it relates to, who signs it, and that nothing comes after."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.export.report import ReportData, report_number, statements
from ocmm_gui.reports._canvas import INK, SMALL, WIDTH, Canvas, Style, paint_text

_LINES = 200.0
"""Room to sign in, with the words below."""


def closing(canvas: Canvas, data: ReportData) -> None:
    """Write statements, signatures and the end, together on one page."""
    canvas.skip(30.0)
    told = statements(data)
    canvas.room(60.0 * len(told) + _LINES + 60.0)
    for sentence in told:
        canvas.text(canvas.speech.say(sentence), Style(26.0))
    canvas.draw(
        _LINES,
        partial(
            paint_signatures,
            words=[canvas.speech.say(one) for one in data.paper.template.signatures],
        ),
    )
    end = canvas.speech.say(f"End of report {report_number(data)}")
    canvas.draw(50.0, lambda painter, box: paint_text(painter, box, end, SMALL))


def paint_signatures(painter: QPainter, box: QRectF, *, words: list[str]) -> None:
    """Draw lines to sign on, with the words below each."""
    each = WIDTH / len(words)
    y = box.bottom() - 60.0
    for index, signer in enumerate(words):
        left, right = box.left() + index * each, box.left() + (index + 1) * each - 60.0
        painter.setPen(QPen(QColor(INK.text), 2.0))
        painter.drawLine(int(left), int(y), int(right), int(y))
        paint_text(painter, QRectF(left, y + 8.0, right - left, 50.0), signer, SMALL)
