"""Symbols of geometrical tolerances as paths (ISO 1101, ISO 7083): fonts lack most of them."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QPainter, QPainterPath, QPen, QPolygonF

_STROKE = 0.07
"""Width of a line against the height of the symbol (ISO 7083: a tenth of the letters)."""


def paint_symbol(painter: QPainter, kind: str, box: QRectF, colour: Qt.GlobalColor) -> bool:
    """Paint the symbol of a kind of characteristic into a box; say whether it has one."""
    make = _SYMBOLS.get(kind)
    if make is None:
        return False
    side = min(box.width(), box.height())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(box.center().x() - 0.5 * side, box.center().y() - 0.5 * side)
    painter.scale(side, side)
    painter.setPen(QPen(colour, _STROKE, c=Qt.PenCapStyle.RoundCap, j=Qt.PenJoinStyle.RoundJoin))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawPath(make())
    painter.restore()
    return True


def has_symbol(kind: str) -> bool:
    """Return whether a kind of characteristic has a symbol of its own."""
    return kind in _SYMBOLS


def _lines(*polygons: tuple[tuple[float, float], ...]) -> QPainterPath:
    path = QPainterPath()
    for points in polygons:
        path.addPolygon(QPolygonF([QPointF(x, y) for x, y in points]))
    return path


def _circle(path: QPainterPath, x: float, y: float, radius: float) -> QPainterPath:
    path.addEllipse(QPointF(x, y), radius, radius)
    return path


def _straightness() -> QPainterPath:
    return _lines(((0.05, 0.5), (0.95, 0.5)))


def _flatness() -> QPainterPath:
    return _lines(((0.05, 0.75), (0.3, 0.25), (0.95, 0.25), (0.7, 0.75), (0.05, 0.75)))


def _roundness() -> QPainterPath:
    return _circle(QPainterPath(), 0.5, 0.5, 0.38)


def _cylindricity() -> QPainterPath:
    sides = _lines(((0.05, 0.92), (0.38, 0.12)), ((0.62, 0.88), (0.95, 0.08)))
    return _circle(sides, 0.5, 0.5, 0.27)


def _line_profile() -> QPainterPath:
    path = QPainterPath()
    path.arcMoveTo(QRectF(0.1, 0.3, 0.8, 0.8), 0.0)
    path.arcTo(QRectF(0.1, 0.3, 0.8, 0.8), 0.0, 180.0)
    return path


def _surface_profile() -> QPainterPath:
    path = _line_profile()
    path.closeSubpath()
    return path


def _parallelism() -> QPainterPath:
    return _lines(((0.2, 0.9), (0.5, 0.1)), ((0.5, 0.9), (0.8, 0.1)))


def _perpendicularity() -> QPainterPath:
    return _lines(((0.1, 0.85), (0.9, 0.85)), ((0.5, 0.85), (0.5, 0.12)))


def _angularity() -> QPainterPath:
    return _lines(((0.9, 0.2), (0.08, 0.82), (0.95, 0.82)))


def _position() -> QPainterPath:
    cross = _lines(((0.05, 0.5), (0.95, 0.5)), ((0.5, 0.05), (0.5, 0.95)))
    return _circle(cross, 0.5, 0.5, 0.28)


def _concentricity() -> QPainterPath:
    return _circle(_circle(QPainterPath(), 0.5, 0.5, 0.4), 0.5, 0.5, 0.2)


def _symmetry() -> QPainterPath:
    return _lines(
        ((0.05, 0.5), (0.95, 0.5)), ((0.22, 0.27), (0.78, 0.27)), ((0.22, 0.73), (0.78, 0.73))
    )


def _arrow(shift: float) -> QPainterPath:
    return _lines(
        ((0.1 + shift, 0.9), (0.55 + shift, 0.12)),
        ((0.37 + shift, 0.24), (0.55 + shift, 0.12), (0.55 + shift, 0.34)),
    )


def _circular_runout() -> QPainterPath:
    return _arrow(0.15)


def _total_runout() -> QPainterPath:
    path = _arrow(-0.05)
    path.addPath(_arrow(0.35))
    path.addPath(_lines(((0.05, 0.9), (0.45, 0.9))))
    return path


def _diameter() -> QPainterPath:
    return _circle(_lines(((0.15, 0.9), (0.85, 0.1))), 0.5, 0.5, 0.32)


_SYMBOLS: dict[str, Callable[[], QPainterPath]] = {
    "straightness": _straightness,
    "flatness": _flatness,
    "roundness": _roundness,
    "cylindricity": _cylindricity,
    "line profile": _line_profile,
    "surface profile": _surface_profile,
    "parallelism": _parallelism,
    "perpendicularity": _perpendicularity,
    "angularity": _angularity,
    "position": _position,
    "concentricity": _concentricity,
    "coaxiality": _concentricity,
    "symmetry": _symmetry,
    "circular runout": _circular_runout,
    "total runout": _total_runout,
    "diameter": _diameter,
}
"""By the kind of the characteristic; coordinates, distances and angles are written as words."""
