"""Residuals of a calibration on the sensors, and vectors at points in space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QGridLayout, QWidget

from ocmm_core.calibration.guided import CameraResiduals
from ocmm_core.camera import CameraModel, Rig
from ocmm_core.geometry import Float, Points3
from ocmm_gui.charts._plot import ARROW_SHARE, LEGEND_PX, Plot, arrow_lines, rms_of, scale_arrows
from ocmm_gui.kit import digit_font, ink, localised, text_font, tr
from ocmm_gui.views import upright

_MOST_ARROWS, _CELLS = 300, 18
"""More arrows overlap: then one per cell of a grid with this many cells per side."""

_BINS = 41


class SensorArrows(Plot):
    """Residuals of one camera as arrows on its sensor; omitted ones are marked."""

    def __init__(self, camera: CameraModel) -> None:
        super().__init__(tr("Camera {name}").format(name=camera.name))
        self._size = (float(camera.width), float(camera.height))
        self._residuals: CameraResiduals | None = None
        self._places: Float = np.empty((0, 2))
        self._arrows: Float = np.empty((0, 2))

    def show_residuals(self, residuals: CameraResiduals) -> None:
        self._residuals = residuals
        used = residuals.residuals_px[residuals.used]
        left_out = int(np.count_nonzero(~residuals.used))
        rms = rms_of(used)
        self._places, self._arrows = residuals.uv[residuals.used], used
        kind = ""
        if len(used) > _MOST_ARROWS:
            self._places, self._arrows = _cell_means(self._places, used, self._size)
            kind = "; " + tr("arrows: means")
        spots = tr(
            "%n spots, {left_out} left out", "1 spot, {left_out} left out", len(used)
        ).format(left_out=left_out or tr("none"))
        self._show_message(localised(f"RMS {rms:.4f} px, {spots}{kind}"))

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter, lines=2).adjusted(1.0, 0.0, -1.0, -LEGEND_PX)
        wide, high = self._size
        scale = min(box.width() / wide, box.height() / high)
        sensor = QRectF(
            box.center().x() - 0.5 * scale * wide, box.top(), scale * wide, scale * high
        )
        theme = self._theme
        ink(painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background))
        painter.drawRect(sensor)
        shown = self._residuals
        if shown is None or not len(shown.uv):
            return
        origin = np.array([sensor.left(), sensor.top()])
        rms = rms_of(self._arrows)
        nice, pixels = scale_arrows(rms, ARROW_SHARE * min(sensor.width(), sensor.height()))
        if not nice:
            return
        arrows = self._arrows * (pixels / nice)
        painter.setClipRect(sensor)
        painter.setPen(QPen(QColor(theme.accent), 1.2))
        painter.drawLines(arrow_lines(origin + scale * self._places, arrows))
        ink(painter, QPen(QColor(theme.bad), 2.0), Qt.BrushStyle.NoBrush)
        for x, y in (origin + scale * shown.uv[~shown.used]).tolist():
            painter.drawLine(QPointF(x - 4.0, y - 4.0), QPointF(x + 4.0, y + 4.0))
            painter.drawLine(QPointF(x - 4.0, y + 4.0), QPointF(x + 4.0, y - 4.0))
        painter.setClipping(False)
        self._paint_legend(painter, QRectF(self.rect()), pixels, localised(f"{nice:g} px"))


class AllSensors(QWidget):
    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.setAccessibleName(tr("Residuals on the sensors"))
        self.plots = tuple(SensorArrows(camera) for camera in rig.cameras)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(12)
        for index, plot in enumerate(self.plots):
            layout.addWidget(plot, index // 2, index % 2)

    def show_residuals(self, residuals: Sequence[CameraResiduals]) -> None:
        for plot, of_camera in zip(self.plots, residuals, strict=True):
            plot.show_residuals(of_camera)


class ResidualHistogram(Plot):
    """Histogram of the residuals, with the normal distribution of the same width."""

    def __init__(self) -> None:
        super().__init__(tr("Residuals, px"))
        self._counts: Float = np.empty(0)
        self._reach = 0.0
        self._sigma = 0.0

    def show_residuals(self, residuals: Sequence[CameraResiduals]) -> None:
        values = np.concatenate([one.residuals_px[one.used].ravel() for one in residuals])
        self._sigma = rms_of(values)
        self._reach = 4.5 * self._sigma
        self._counts = np.empty(0)
        if self._sigma > 0.0:
            counts, _ = np.histogram(values, _BINS, (-self._reach, self._reach))
            self._counts = counts.astype(np.float64)
        beyond = int(np.count_nonzero(np.abs(values) > 3.0 * self._sigma))
        expected = 0.0027 * len(values)
        self._show_message(
            tr(
                "RMS {sigma:.4f} px, {beyond} of {count} beyond 3 sigma ({expected:.0f} expected)"
            ).format(sigma=self._sigma, beyond=beyond, count=len(values), expected=expected)
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(8.0, 8.0, -8.0, -26.0)
        theme = self._theme
        painter.setPen(QPen(QColor(theme.border), max(theme.border_px, 1)))
        painter.drawLine(box.bottomLeft(), box.bottomRight())
        if not len(self._counts):
            return
        pitch = box.width() / _BINS
        normal = self._counts.sum() * 2.0 * self._reach / _BINS / (np.sqrt(2 * np.pi) * self._sigma)
        top = max(float(self._counts.max()), float(normal))
        for index, count in enumerate(self._counts.tolist()):
            tall = box.height() * count / top
            bar = QRectF(
                box.left() + (index + 0.08) * pitch, box.bottom() - tall, 0.84 * pitch, tall
            )
            painter.fillRect(bar, QColor(theme.accent))
        at = np.linspace(-self._reach, self._reach, 121)
        curve = normal * np.exp(-0.5 * (at / self._sigma) ** 2)
        points = [
            QPointF(box.center().x() + 0.5 * box.width() * x, box.bottom() - box.height() * y)
            for x, y in zip((at / self._reach).tolist(), (curve / top).tolist(), strict=True)
        ]
        painter.setPen(QPen(QColor(theme.text), 2.0))
        painter.drawPolyline(points)
        painter.setFont(digit_font(13, bold=False))
        for sigmas in (-3, 0, 3):
            x = box.center().x() + 0.5 * box.width() * sigmas * self._sigma / self._reach
            painter.drawLine(QPointF(x, box.bottom()), QPointF(x, box.bottom() + 5.0))
            place = QRectF(x - 70.0, box.bottom() + 6.0, 140.0, 20.0)
            text = localised(f"{sigmas * self._sigma:+.3f}") if sigmas else "0"
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, text)


def _cell_means(uv: Float, residuals: Float, size: tuple[float, float]) -> tuple[Float, Float]:
    """Return mean places and residuals of a sensor's non-empty cells, px."""
    cell = np.clip((uv / np.array(size) * _CELLS).astype(np.int64), 0, _CELLS - 1)
    _, index = np.unique(cell @ np.array([1, _CELLS]), return_inverse=True)
    count = np.bincount(index)[:, None]
    means = [
        np.stack([np.bincount(index, values[:, axis]) for axis in range(2)], axis=1) / count
        for values in (uv, residuals)
    ]
    return means[0], means[1]


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
            self._show_message(absent)
            return
        rms = 1e3 * np.sqrt(np.mean(vectors_world**2, axis=0))
        worst = 1e3 * float(np.linalg.norm(vectors_world, axis=1).max())
        axes = ", ".join(
            localised(f"{name} {value:.1f}") for name, value in zip("XYZ", rms, strict=True)
        )
        self._show_message(
            tr("RMS {axes} µm, largest {worst:.1f} µm").format(axes=axes, worst=worst)
        )

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
        ink(painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background))
        painter.drawRect(part)
        ink(painter, QColor(theme.muted), font=text_font(13))
        painter.drawText(part.adjusted(8.0, 2.0, -8.0, -2.0), _LEFT, title)
        names = f"{'XYZ'[self._across]} → , {'XYZ'[axis]} {'↑' if sign > 0 else '↓'}"
        painter.drawText(part.adjusted(8.0, 2.0, -8.0, -2.0), _RIGHT, names)
        centre = np.array([part.center().x(), part.center().y() + 10.0])
        turn = np.array([1.0, -sign])
        pick = [self._across, axis]
        places = centre + scale * turn * (self._places[:, pick] - middle[pick])
        painter.setClipRect(part)
        corners = centre + scale * turn * (self._volume[:, pick] - middle[pick])
        ink(painter, QPen(QColor(theme.muted), 1.0, Qt.PenStyle.DashLine), Qt.BrushStyle.NoBrush)
        painter.drawRect(QRectF(QPointF(*corners[0]), QPointF(*corners[1])).normalized())
        ink(painter, Qt.PenStyle.NoPen, QColor(theme.muted))
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
