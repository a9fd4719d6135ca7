"""Symbols of geometrical tolerances as paths (ISO 1101, ISO 7083): fonts lack most of them."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QPainter, QPainterPath, QPen, QPolygonF

from ocmm_core.tolerances.kinds import Symbol

_STROKE = 0.07
"""Width of a line against the height of the symbol (ISO 7083: a tenth of the letters)."""

_BOW = QRectF(0.1, 0.3, 0.8, 0.8)


def paint_symbol(painter: QPainter, symbol: Symbol, box: QRectF, colour: Qt.GlobalColor) -> None:
    """Paint the symbol of a kind of characteristic into a box."""
    side = min(box.width(), box.height())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(box.center().x() - 0.5 * side, box.center().y() - 0.5 * side)
    painter.scale(side, side)
    painter.setPen(QPen(colour, _STROKE, c=Qt.PenCapStyle.RoundCap, j=Qt.PenJoinStyle.RoundJoin))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawPath(_path(symbol))
    painter.restore()


def _path(symbol: Symbol) -> QPainterPath:
    path = QPainterPath()
    for points in symbol.lines:
        path.addPolygon(QPolygonF([QPointF(x, y) for x, y in points]))
    for x, y, radius in symbol.circles:
        path.addEllipse(QPointF(x, y), radius, radius)
    if symbol.bow:
        path.arcMoveTo(_BOW, 0.0)
        path.arcTo(_BOW, 0.0, 180.0)
    if symbol.bow == "closed":
        path.closeSubpath()
    return path
