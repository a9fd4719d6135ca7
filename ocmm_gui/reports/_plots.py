"""Plots of the report: deviations in their tolerances."""

from __future__ import annotations

import math
from functools import partial

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.export.report import ReportData, ReportedResult
from ocmm_core.tolerances.decisions import U_LABEL
from ocmm_gui.kit import verdict_colour
from ocmm_gui.reports._canvas import INK, SMALL, Canvas, Style, paint_text

_ROW = 52.0
_NAME = 520.0
_BEYOND = 1.5
"""Deviations are drawn up to so many half tolerances; farther ones get an arrow."""


def deviations(canvas: Canvas, data: ReportData) -> None:
    """Draw every deviation in its tolerance, with its uncertainty as a whisker."""
    shown = [item for item in data.reported if _place(item) is not None]
    if not shown:
        return
    canvas.heading("Deviations within their tolerances", 4.0 * _ROW)
    canvas.text(canvas.speech.say(f"Band: tolerance about its middle. Whisker: {U_LABEL}."), SMALL)
    for item in shown:
        canvas.draw(_ROW, partial(_paint_deviation, item=item, canvas=canvas))


def _place(item: ReportedResult) -> tuple[float, float] | None:
    """Return deviation and U in half tolerances from the middle; None where there is no such."""
    result = item.result
    half = 0.5 * (result.upper - result.lower)
    if result.stated is None or half <= 0.0:
        return None
    _, deviation, uncertainty = result.stated
    middle = 0.5 * (result.upper + result.lower)
    return (deviation - middle) / half, uncertainty / half


def _paint_deviation(
    painter: QPainter, box: QRectF, *, item: ReportedResult, canvas: Canvas
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
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(INK.zone_bad))
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
