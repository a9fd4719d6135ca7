"""Section of a surface: nominal and measured line with magnified deviations, in its plane."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from ocmm_core.geometry import Float, unit
from ocmm_core.tolerances.decisions import CharacteristicResult, deviation_picture
from ocmm_gui.kit import Theme, tr
from ocmm_gui.views._deviations import SCALE_PX, Translate, deviation_colour, paint_scale

_MARGIN_PX, _DOT_PX = 18.0, 2.6
_GAP = 5.0
"""Multiple of the usual step; a longer one parts the line."""
_UPRIGHT = 0.9


def is_section(result: CharacteristicResult | None) -> bool:
    """Return whether a result has deviations in the plane of a section."""
    seen = None if result is None else result.seen
    return seen is not None and seen.across is not None and len(seen.numbers) > 1


def section_axes(across: Float) -> Float:
    """Return both axes (2, 3), unit, world, of a section: the second as upright as possible."""
    up = np.eye(3)[2 if abs(across[2]) < _UPRIGHT else 1]
    up = unit(up - (up @ across) * across)
    return np.stack([np.cross(up, across), up])


def paint_section(
    painter: QPainter, box: QRectF, result: CharacteristicResult, theme: Theme,
    scale: float = 1.0, translate: Translate = tr,
) -> None:  # fmt: skip
    """Paint a section with its tolerance, magnified alike, and the scale of the deviations."""
    seen, picture = result.seen, deviation_picture((result,))
    if seen is None or seen.across is None or not picture.whiskers:
        return
    below = QRectF(box.left(), box.bottom() - SCALE_PX[1] * scale, box.width(), SCALE_PX[1] * scale)
    paint_scale(painter, below, picture, theme, scale, None, translate)
    axes, half = section_axes(seen.across), 0.5 * (result.upper - result.lower)
    kinds = {(one.feature, one.number): one.kind for one in picture.whiskers}
    base = (seen.points - seen.deviations[:, None] * seen.outward) @ axes.T
    outward = picture.factor * (seen.outward @ axes.T)
    lines = {by: base + by * outward for by in (-half, half)}
    measured = base + seen.deviations[:, None] * outward
    every = np.vstack([base, measured, *lines.values()])
    room = box.adjusted(0.0, 0.0, 0.0, -below.height())
    pad = _MARGIN_PX * scale
    room.adjust(pad, pad, -pad, -pad)
    size = np.maximum(np.ptp(every, axis=0), 1e-3)
    zoom = min(room.width() / size[0], room.height() / size[1])
    middle = 0.5 * (every.max(axis=0) + every.min(axis=0))

    def places(flat: Float) -> list[QPointF]:
        off = zoom * (flat - middle)
        return [QPointF(room.center().x() + x, room.center().y() - y) for x, y in off.tolist()]

    steps = np.linalg.norm(np.diff(base, axis=0), axis=1)
    names = np.array(seen.features)
    cuts = np.flatnonzero((steps > _GAP * np.median(steps)) | (names[1:] != names[:-1])) + 1
    for flat, colour, style in (
        (base, theme.muted, Qt.PenStyle.SolidLine),
        *((line, theme.muted, Qt.PenStyle.DashLine) for line in lines.values()),
        (measured, theme.text, Qt.PenStyle.SolidLine),
    ):
        painter.setPen(QPen(QColor(colour), 1.4 * scale, style))
        for piece in np.split(np.arange(len(flat)), cuts):
            painter.drawPolyline(places(flat[piece]))
    for key, start, end in zip(
        zip(seen.features, seen.numbers, strict=True), places(base), places(measured), strict=True
    ):
        ink = QColor(deviation_colour(theme, kinds[key]) if key in kinds else theme.muted)
        painter.setPen(QPen(ink, 1.4 * scale))
        painter.drawLine(start, end)
        painter.setBrush(ink)
        painter.drawEllipse(end, _DOT_PX * scale, _DOT_PX * scale)
