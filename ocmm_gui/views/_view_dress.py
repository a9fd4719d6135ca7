"""Frame of the 3-D scene: axes, grid step, rig overview, and a line of text."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, QSizeF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPen

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_gui.kit import WRAPPED, Theme, text_font, tr, wrapped_pixels
from ocmm_gui.scene import Dots, Lines, Orbit, Tag, paint_scene
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views._contents import grid_step
from ocmm_gui.views._deviations import SCALE_PX

OVERVIEW_ASPECT = 1.25
_GAP_PX = 8.0
_WORDS_PX = 26.0


class Overview:
    """Small overview of the rig in a free corner; `lines`: (n, 2, 3), mm, world."""

    def __init__(self, rig: Rig, orbit: Orbit, lines: Float) -> None:
        self._rig, self._orbit, self._lines = rig, orbit, lines
        self._kept: QImage | None = None
        self._kept_of: tuple[object, ...] = ()

    def place(self, inside: QRectF, avoided: Float) -> QRectF | None:
        """Return a free corner that covers no ``avoided`` (n, 2), px; never the lower left."""
        side = min(190.0, 0.24 * inside.width(), 0.34 * inside.height())
        wide = OVERVIEW_ASPECT * side
        left, right = inside.left() + _GAP_PX, inside.right() - wide - _GAP_PX
        top, bottom = inside.top() + _GAP_PX, inside.bottom() - side - _GAP_PX
        for x, y in ((right, top), (right, bottom), (left, top + 2.0 * _WORDS_PX + _GAP_PX)):
            room = QRectF(x, y, wide, side)
            if not any(room.contains(QPointF(*one)) for one in avoided.tolist()):
                return room
        return None

    def paint(self, painter: QPainter, corner: QRectF, probe: Float, theme: Theme) -> None:
        """Paint the rig with the probe at places (n, 3)."""
        ratio = painter.device().devicePixelRatio()
        made_of = (theme, corner.size(), ratio)
        if self._kept is None or made_of != self._kept_of:
            self._kept, self._kept_of = self._picture(corner.size(), ratio, theme), made_of
        painter.drawImage(corner.topLeft(), self._kept)
        dots = (Dots(probe, theme.accent, 5.0),)
        paint_scene(painter, dots, self._orbit, corner, text_font(10), theme.background)

    def _picture(self, size: QSizeF, ratio: float, theme: Theme) -> QImage:
        image = QImage(
            (size * ratio).toSize() + QSize(1, 1), QImage.Format.Format_ARGB32_Premultiplied
        )
        image.setDevicePixelRatio(ratio)
        image.fill(Qt.GlobalColor.transparent)
        painter = QPainter(image)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QRectF(QPointF(), size)
        painter.setPen(QPen(QColor(theme.border), theme.border_px))
        painter.setBrush(QColor(theme.background))
        painter.drawRoundedRect(box.adjusted(0.5, 0.5, -0.5, -0.5), 4, 4)
        volume = Lines(shapes.box(self._rig.volume_world), theme.border, 1.0)
        rig = Lines(self._lines, theme.muted, 1.0)
        tags = tuple(
            Tag(camera.centre_world, camera.name, theme.muted) for camera in self._rig.cameras
        )
        paint_scene(
            painter, (volume, rig, *tags), self._orbit, box, text_font(10), theme.background
        )
        painter.end()
        return image


def triad_place(box: QRectF) -> QRectF:
    return QRectF(box.left(), box.bottom() - 96, 100, 96)


def paint_triad(painter: QPainter, box: QRectF, orbit: Orbit, theme: Theme) -> None:
    """Paint the world directions, with the grid step next to them."""
    axes = orbit.axes()
    centre = QPointF(box.left() + 46, box.bottom() - 46)
    painter.setPen(QColor(theme.muted))
    words = tr("world axes, grid {grid_step:.0f} mm").format(grid_step=grid_step(orbit))
    place = grid_place(box)
    painter.setFont(text_font(wrapped_pixels(words, place, 12)))
    painter.drawText(
        place,
        Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap,
        words,
    )
    painter.setFont(text_font(13, bold=True))
    for name, direction in zip("XYZ", np.eye(3), strict=True):
        x, y, _ = (axes @ direction).tolist()
        end = QPointF(centre.x() + 30 * x, centre.y() - 30 * y)
        painter.setPen(QPen(QColor(theme.text), 2.0))
        painter.drawLine(centre, end)
        letter = QPointF(centre.x() + 41 * x, centre.y() - 41 * y)
        painter.drawText(
            QRectF(letter.x() - 9, letter.y() - 9, 18, 18), Qt.AlignmentFlag.AlignCenter, name
        )


def grid_place(box: QRectF) -> QRectF:
    """Return the place of the grid step, two lines if narrow."""
    wide = min(180.0, box.width() - SCALE_PX[0] - 118.0)
    return QRectF(box.left() + 100, box.bottom() - 40, max(wide, 60.0), 34)


def words_place(box: QRectF, words: str) -> QRectF:
    """Return the place of a sentence: the upper left corner, two lines if long."""
    metrics, most = QFontMetricsF(text_font(14, bold=True)), 0.66 * box.width()
    wide = metrics.horizontalAdvance(words) + 20.0
    lines = 1 if wide <= most else 2
    place = QRectF(box.left() + _GAP_PX, box.top() + _GAP_PX, min(wide, most), _WORDS_PX)
    return place.adjusted(0.0, 0.0, 0.0, (lines - 1) * metrics.lineSpacing())


def paint_words(painter: QPainter, place: QRectF, words: str, theme: Theme) -> None:
    painter.setPen(QPen(QColor(theme.warn), 1.4))
    painter.setBrush(QColor(theme.panel))
    painter.drawRoundedRect(place, 4, 4)
    room = place.adjusted(6.0, 0.0, -6.0, 0.0)
    painter.setFont(text_font(wrapped_pixels(words, room, 14, bold=True), bold=True))
    painter.setPen(QColor(theme.warn))
    painter.drawText(room, WRAPPED, words)
