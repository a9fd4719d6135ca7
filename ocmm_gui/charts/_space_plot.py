"""Vectors at points in space: point errors, and changes by a new calibration."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3
from ocmm_gui.charts._plot import ARROW_SHARE, LEGEND_PX, Plot, arrow_lines, scale_arrows
from ocmm_gui.kit import localised, text_font, tr
from ocmm_gui.views import upright

_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop


class SpaceArrows(Plot):
    """Vectors in space, from the front and from above, at one scale."""

    def __init__(self, name: str, rig: Rig) -> None:
        super().__init__(name)
        self._up = int(np.argmax(np.abs(upright(rig))))
        self._raised = float(np.sign(upright(rig)[self._up]))
        self._depth = _depth_axis(rig, self._up)
        self._across = 3 - self._up - self._depth
        self._volume = rig.volume_world
        self._places: Points3 = np.empty((0, 3))
        self._vectors: Points3 = np.empty((0, 3))

    def show_vectors(self, places_world: Points3, vectors_world: Points3, absent: str) -> None:
        """Show vectors, mm, at places, mm; ``absent`` is shown if there are none."""
        self._places, self._vectors = places_world, vectors_world
        if not len(places_world):
            self._say(absent)
            return
        rms = 1e3 * np.sqrt(np.mean(vectors_world**2, axis=0))
        worst = 1e3 * float(np.linalg.norm(vectors_world, axis=1).max())
        axes = ", ".join(
            localised(f"{name} {value:.1f}") for name, value in zip("XYZ", rms, strict=True)
        )
        self._say(tr("RMS {axes} µm, largest {worst:.1f} µm").format(axes=axes, worst=worst))

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(0.0, 0.0, 0.0, -LEGEND_PX)
        if not len(self._places):
            return
        low, high = self._volume
        middle, size = 0.5 * (low + high), np.maximum(high - low, 1.0)
        half = QRectF(box.left(), box.top(), 0.5 * box.width() - 6.0, box.height())
        other = half.translated(0.5 * box.width() + 6.0, 0.0)
        room = 0.86 * np.array([half.width(), half.height() - 20.0])
        sides = (size[[self._across, self._up]], size[[self._across, self._depth]])
        scale = min(float((room / side).min()) for side in sides)
        rms = float(np.sqrt(np.mean(np.sum(self._vectors**2, axis=1))))
        nice, pixels = scale_arrows(1e3 * rms, 1.3 * ARROW_SHARE * min(room))
        for part, axis, sign, title in (
            (half, self._up, self._raised, tr("from the front")),
            (other, self._depth, 1.0, tr("from above")),
        ):
            self._paint_side(painter, part, axis, sign, title, middle, scale, nice, pixels)
        if nice:
            self._paint_legend(painter, QRectF(self.rect()), pixels, localised(f"{nice:g} µm"))

    def _paint_side(
        self,
        painter: QPainter,
        part: QRectF,
        axis: int,
        sign: float,
        title: str,
        middle: Float,
        scale: float,
        nice: float,
        pixels: float,
    ) -> None:
        theme = self._theme
        painter.setPen(QPen(QColor(theme.border), max(theme.border_px, 1)))
        painter.setBrush(QColor(theme.background))
        painter.drawRect(part)
        painter.setPen(QColor(theme.muted))
        painter.setFont(text_font(13))
        painter.drawText(part.adjusted(8.0, 2.0, -8.0, -2.0), _LEFT, title)
        names = f"{'XYZ'[self._across]} → , {'XYZ'[axis]} {'↑' if sign > 0 else '↓'}"
        painter.drawText(part.adjusted(8.0, 2.0, -8.0, -2.0), _RIGHT, names)
        centre = np.array([part.center().x(), part.center().y() + 10.0])
        turn = np.array([1.0, -sign])
        pick = [self._across, axis]
        places = centre + scale * turn * (self._places[:, pick] - middle[pick])
        painter.setClipRect(part)
        corners = centre + scale * turn * (self._volume[:, pick] - middle[pick])
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.muted), 1.0, Qt.PenStyle.DashLine))
        painter.drawRect(QRectF(QPointF(*corners[0]), QPointF(*corners[1])).normalized())
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.muted))
        for x, y in places.tolist():
            painter.drawEllipse(QPointF(x, y), 1.6, 1.6)
        if nice:
            arrows = turn * self._vectors[:, pick] * (1e3 * pixels / nice)
            painter.setPen(QPen(QColor(theme.accent), 1.4))
            painter.drawLines(arrow_lines(places, arrows))
        painter.setClipping(False)


def _depth_axis(rig: Rig, up: int) -> int:
    """Return the world axis along which the cameras look."""
    views = np.mean([camera.T_camera_from_world.rotation[2] for camera in rig.cameras], axis=0)
    views[up] = 0.0
    return int(np.argmax(np.abs(views)))
