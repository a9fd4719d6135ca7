"""Marks: one shape per outcome, so that nothing depends on colour."""

from __future__ import annotations

from enum import Enum

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from ocmm_core.inspection.evaluation import FeatureState, FeatureView, StatusWord
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.kit._theme import Theme


class Mark(Enum):
    """A shape in a circle, a square or a triangle."""

    OPEN = "empty circle"
    ACTIVE = "arrow"
    DONE = "full circle"
    GOOD = "tick"
    BAD = "cross"
    DOUBT = "triangle"


def feature_mark(feature: FeatureView, verdict: Verdict | None) -> Mark:
    """Return the mark of a feature in the plan; ``verdict`` is that of the feature."""
    if feature.state is FeatureState.ACTIVE:
        return Mark.ACTIVE
    if feature.state in (FeatureState.PENDING, FeatureState.SKIPPED):
        return Mark.OPEN
    return verdict_mark(verdict)


def verdict_mark(verdict: Verdict | None) -> Mark:
    return {
        Verdict.CONFORM: Mark.GOOD,
        Verdict.NOT_CONFORM: Mark.BAD,
        Verdict.NOT_PROVEN: Mark.DOUBT,
        Verdict.NOT_MEASURED: Mark.OPEN,
        Verdict.PROVISIONAL: Mark.OPEN,
        None: Mark.DONE,
    }[verdict]


def status_mark(status: StatusWord) -> Mark:
    return {
        StatusWord.READY: Mark.GOOD,
        StatusWord.MEASURING: Mark.ACTIVE,
        StatusWord.NOT_READY: Mark.DOUBT,
        StatusWord.INACCURATE: Mark.DOUBT,
        StatusWord.LOST: Mark.BAD,
        StatusWord.FAILED: Mark.BAD,
    }[status]


def mark_colour(theme: Theme, mark: Mark) -> str:
    return {
        Mark.GOOD: theme.good,
        Mark.BAD: theme.bad,
        Mark.DOUBT: theme.warn,
        Mark.ACTIVE: theme.accent,
        Mark.DONE: theme.text,
        Mark.OPEN: theme.muted,
    }[mark]


def paint_mark(painter: QPainter, mark: Mark, box: QRectF, colour: str, inside: str) -> None:
    """Paint a mark into a square box; ``inside`` is the colour of its cut-outs."""
    size = box.width()
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(box.topLeft())
    painter.scale(size, size)
    fill, hole = QColor(colour), QPen(QColor(inside), 0.12)
    hole.setCapStyle(Qt.PenCapStyle.RoundCap)
    hole.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(fill)
    if mark is Mark.OPEN:
        painter.setPen(QPen(fill, 0.1))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(QRectF(0.12, 0.12, 0.76, 0.76))
    elif mark is Mark.ACTIVE:
        painter.drawPolygon(_polygon((0.15, 0.08), (0.92, 0.5), (0.15, 0.92)))
    elif mark is Mark.DONE:
        painter.drawEllipse(QRectF(0.12, 0.12, 0.76, 0.76))
    elif mark is Mark.GOOD:
        painter.drawEllipse(QRectF(0.04, 0.04, 0.92, 0.92))
        painter.setPen(hole)
        painter.drawPolyline(_polygon((0.28, 0.53), (0.44, 0.69), (0.73, 0.33)))
    elif mark is Mark.BAD:
        painter.drawRoundedRect(QRectF(0.06, 0.06, 0.88, 0.88), 0.12, 0.12)
        painter.setPen(hole)
        painter.drawLine(QPointF(0.3, 0.3), QPointF(0.7, 0.7))
        painter.drawLine(QPointF(0.7, 0.3), QPointF(0.3, 0.7))
    else:
        painter.drawPolygon(_polygon((0.5, 0.04), (0.98, 0.94), (0.02, 0.94)))
        painter.setPen(hole)
        painter.drawLine(QPointF(0.5, 0.38), QPointF(0.5, 0.62))
        painter.drawPoint(QPointF(0.5, 0.8))
    painter.restore()


def _polygon(*corners: tuple[float, float]) -> QPolygonF:
    return QPolygonF([QPointF(x, y) for x, y in corners])
