"""Painting of the probe in the inspector's view, ball ellipse, and turn arrows."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen, QPolygonF

from ocmm_core.coach import Ellipsoid, ProbePicture, Turn, Way
from ocmm_core.geometry import Float
from ocmm_gui.kit import Theme

_ROOM = 0.76
"""Share of the box for the probe; the rest is for the arrow."""
_STEPS_UM = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)
_FULL = 16 * 360


def paint_probe(painter: QPainter, picture: ProbePicture, box: QRectF, theme: Theme) -> None:
    """Paint the probe: LEDs with a sector per camera, filled if visible."""
    points = np.vstack([picture.leds, picture.outline, picture.foot, [[0.0, 0.0]]])
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-6)
    scale = _ROOM * min(box.width() / size[0], box.height() / size[1])
    middle = 0.5 * (low + high)

    def at(point: Float) -> QPointF:
        x, y = (point - middle) * scale
        return QPointF(box.center().x() + x, box.center().y() - y)

    small = max(4.0, 0.055 * min(box.width(), box.height()))
    line = QColor(theme.text if picture.known else theme.muted)
    painter.setPen(QPen(line, max(2.0, 0.5 * small), Qt.PenStyle.SolidLine,
                        Qt.PenCapStyle.RoundCap))  # fmt: skip
    ball = at(np.zeros(2))
    painter.drawLine(ball, at(picture.foot))
    body = QColor(theme.muted)
    body.setAlphaF(0.35)
    painter.setPen(QPen(body, 2.6 * small, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap,
                        Qt.PenJoinStyle.RoundJoin))  # fmt: skip
    painter.setBrush(body)
    painter.drawPolygon(QPolygonF([at(point) for point in picture.outline]))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(line)
    radius = max(0.8 * small, picture.ball_radius * scale)
    painter.drawEllipse(ball, radius, radius)
    for number, led in enumerate(picture.leds):
        _paint_led(painter, at(led), small, picture.seen[:, number].tolist(), theme)
    if picture.turn is not None:
        top = at(np.array([picture.leds[:, 0].mean(), high[1]]))
        _paint_turn(painter, picture.turn, ball, top, box, theme)


def _paint_led(
    painter: QPainter, place: QPointF, radius: float, seen: list[bool], theme: Theme
) -> None:
    """Paint a disc with a sector per camera, in their order from left to right."""
    disc = QRectF(place.x() - radius, place.y() - radius, 2.0 * radius, 2.0 * radius)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(theme.panel))
    painter.drawEllipse(disc)
    share = _FULL // max(len(seen), 1)
    painter.setBrush(QColor(theme.good))
    for number, sees in enumerate(seen):
        if sees:
            # Counter-clockwise from the top: the first camera has the left half.
            painter.drawPie(disc, _FULL // 4 + number * share, share)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(QColor(theme.good if all(seen) else theme.bad), max(1.5, 0.25 * radius)))
    painter.drawEllipse(disc)


def _paint_turn(
    painter: QPainter, turn: Turn, ball: QPointF, top: QPointF, box: QRectF, theme: Theme
) -> None:
    thick = max(3.0, 0.035 * min(box.width(), box.height()))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    pen = QPen(QColor(theme.accent), thick)
    pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    painter.setPen(pen)
    left = turn.way in (Way.TURN_LEFT, Way.LEAN_LEFT)
    side = -1.0 if left else 1.0
    if turn.way in (Way.TURN_LEFT, Way.TURN_RIGHT):
        # The far half of a ring about the probe: there the LEDs move to that side.
        wide, high = 0.42 * box.width(), 0.2 * box.height()
        middle = QPointF(top.x(), 0.6 * top.y() + 0.4 * ball.y())
        turns = np.radians(np.linspace(25.0, 155.0, 25))
        arc = [QPointF(middle.x() - side * wide * math.cos(a), middle.y() - high * math.sin(a))
               for a in turns]  # fmt: skip
    elif turn.way in (Way.LEAN_LEFT, Way.LEAN_RIGHT):
        reach = math.hypot(top.x() - ball.x(), top.y() - ball.y()) * 1.08
        begin = math.atan2(ball.y() - top.y(), top.x() - ball.x())
        span = math.radians(34.0)
        arc = [QPointF(ball.x() + reach * math.cos(begin - side * part * span),
                       ball.y() - reach * math.sin(begin - side * part * span))
               for part in np.linspace(-0.3, 0.9, 25)]  # fmt: skip
    else:
        x = box.right() - 2.5 * thick
        ends = (box.top() + 0.2 * box.height(), box.top() + 0.75 * box.height())
        if turn.way is Way.TILT_AWAY:
            ends = (ends[1], ends[0])
        arc = [QPointF(x, y) for y in np.linspace(*ends, 12)]
    _paint_arrow(painter, arc, thick, theme)


def _paint_arrow(painter: QPainter, line: list[QPointF], thick: float, theme: Theme) -> None:
    path = QPainterPath(line[0])
    for point in line[1:-2]:
        path.lineTo(point)
    painter.drawPath(path)
    end, before = line[-1], line[-4]
    length = math.hypot(end.x() - before.x(), end.y() - before.y()) or 1.0
    x, y = (end.x() - before.x()) / length, (end.y() - before.y()) / length
    head = 2.2 * thick
    base = QPointF(end.x() - 0.6 * head * x, end.y() - 0.6 * head * y)
    tip = QPointF(end.x() + 0.9 * head * x, end.y() + 0.9 * head * y)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(theme.accent))
    painter.drawPolygon(
        QPolygonF([tip, QPointF(base.x() - head * y, base.y() + head * x),
                   QPointF(base.x() + head * y, base.y() - head * x)])
    )  # fmt: skip


def scale_um(ellipsoid: Ellipsoid) -> int:
    """Return the scale length next to an ellipse, um: the whole U, rounded up."""
    wanted = 1e3 * float(ellipsoid.outline_mm[0])
    return next((step for step in _STEPS_UM if step >= wanted), _STEPS_UM[-1])


def paint_ellipse(painter: QPainter, ellipsoid: Ellipsoid, box: QRectF, theme: Theme) -> None:
    """Paint the ellipsoid's outline with rings of the full and half scale."""
    middle, scale = box.center(), scale_um(ellipsoid)
    radius = 0.46 * min(box.width(), box.height())
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(QColor(theme.border), 1.0))
    for part in (0.5, 1.0):
        painter.drawEllipse(middle, part * radius, part * radius)
    painter.drawLine(QPointF(middle.x() - radius, middle.y()),
                     QPointF(middle.x() + radius, middle.y()))  # fmt: skip
    painter.drawLine(QPointF(middle.x(), middle.y() - radius),
                     QPointF(middle.x(), middle.y() + radius))  # fmt: skip
    longer, shorter, angle = ellipsoid.outline_mm
    painter.save()
    painter.translate(middle)
    # Screen coordinates point down.
    painter.rotate(-math.degrees(float(angle)))
    fill = QColor(theme.accent)
    fill.setAlphaF(0.35)
    painter.setBrush(fill)
    painter.setPen(QPen(QColor(theme.accent), 2.0))
    per_mm = 1e3 * radius / scale
    painter.drawEllipse(QPointF(0.0, 0.0), max(per_mm * longer, 1.5), max(per_mm * shorter, 1.5))
    painter.restore()
