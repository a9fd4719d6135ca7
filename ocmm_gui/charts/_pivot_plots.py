"""Plots of a pivot calibration: paths of the LEDs about the ball, tip course and spot residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from ocmm_core.calibration.guided import CameraResiduals
from ocmm_core.calibration.pivot import PivotCalibration
from ocmm_core.calibration.sweeping import led_paths
from ocmm_core.camera import Rig, project
from ocmm_core.geometry import Float, Points3
from ocmm_gui.charts._plot import Plot, rms_of
from ocmm_gui.charts._residual_plots import AllSensors, ResidualHistogram
from ocmm_gui.kit import ARROWS, RIGHT, digit_font, ink, localised, text_font, tr, vbox
from ocmm_gui.scene import Dots, Item, Lines, Tag, paint_scene
from ocmm_gui.views import seen_from, upright

_SCALE_PX, _MOST = 58.0, 3000
_REACH_SIGMAS = 5.0


class TipCourse(Plot):
    """Tip position of each frame by axis; omitted frames are marked."""

    def __init__(self) -> None:
        super().__init__(tr("Tip of every frame, µm"))
        self._off_um: Float = np.empty((0, 3))
        self._used = np.empty(0, dtype=np.bool_)
        self._borders: tuple[int, ...] = ()

    def show_sweeps(self, sweeps: Sequence[PivotCalibration]) -> None:
        """Show consecutive sweeps, each relative to its ball centre."""
        self._off_um = np.concatenate([1e3 * (one.tips_world - one.centre_world) for one in sweeps])
        self._used = np.concatenate([one.used for one in sweeps])
        self._borders = tuple(np.cumsum([len(one.used) for one in sweeps])[:-1].tolist())
        used = self._off_um[self._used]
        rms = [rms_of(axis[np.isfinite(axis)]) for axis in used.T]
        left_out = int(np.count_nonzero(~self._used))
        axes = ", ".join(
            localised(f"{name} {value:.1f}") for name, value in zip("XYZ", rms, strict=True)
        )
        self._show_message(
            tr("RMS {axes}; {left_out} left out").format(axes=axes, left_out=left_out or tr("none"))
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_SCALE_PX, 2.0, -2.0, -24.0)
        if not len(self._used):
            return
        high = box.height() / 3.0
        finite = self._off_um[self._used]
        reach = _REACH_SIGMAS * rms_of(finite[np.isfinite(finite)]) or 1.0
        for axis in range(3):
            strip = QRectF(box.left(), box.top() + axis * high, box.width(), high - 8.0)
            self._paint_axis(painter, strip, axis, reach)
        ink(painter, QColor(self._theme.muted), font=text_font(13))
        foot = QRectF(box.left(), box.bottom() + 2.0, box.width(), 20.0)
        painter.drawText(foot, Qt.AlignmentFlag.AlignCenter, tr("frames of both sweeps"))

    def _paint_axis(self, painter: QPainter, strip: QRectF, axis: int, reach: float) -> None:
        theme, count = self._theme, len(self._used)
        ink(painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background))
        painter.drawRect(strip)
        middle = strip.center().y()
        painter.drawLine(QPointF(strip.left(), middle), QPointF(strip.right(), middle))
        for border in self._borders:
            x = strip.left() + strip.width() * border / count
            painter.drawLine(QPointF(x, strip.top()), QPointF(x, strip.bottom()))
        ink(painter, QColor(theme.muted), font=digit_font(13, bold=False))
        scale = strip.adjusted(-_SCALE_PX, 0.0, 0.0, 0.0)
        scale.setWidth(_SCALE_PX - 6.0)
        painter.drawText(scale, RIGHT, f"{'XYZ'[axis]}  0")
        top = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop
        painter.drawText(scale, top, f"{reach:+.0f}")
        values = self._off_um[:, axis]
        at = strip.left() + strip.width() * (np.arange(count) + 0.5) / count
        tall = middle - 0.5 * strip.height() * np.clip(values / reach, -1.0, 1.0)
        step = max(count // _MOST, 1)
        shown = (self._used & np.isfinite(values))[::step]
        painter.setPen(QPen(QColor(theme.accent), 2.5, c=Qt.PenCapStyle.RoundCap))
        pairs = np.stack([at[::step][shown], tall[::step][shown]], axis=1).tolist()
        painter.drawPoints(QPolygonF([QPointF(x, y) for x, y in pairs]))
        painter.setPen(QPen(QColor(theme.bad), 1.5))
        lost = ~self._used & np.isfinite(values)
        for x, y in np.stack([at[lost], tall[lost]], axis=1).tolist():
            painter.drawLine(QPointF(x - 3.0, y - 3.0), QPointF(x + 3.0, y + 3.0))
            painter.drawLine(QPointF(x - 3.0, y + 3.0), QPointF(x + 3.0, y - 3.0))


class SpotResiduals(QWidget):
    """Spot residuals: arrows on the sensors above their histogram."""

    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.setAccessibleName(tr("Residuals of the spots"))
        self._rig = rig
        self.sensors = AllSensors(rig)
        self.histogram = ResidualHistogram()
        vbox((self.sensors, 3), (self.histogram, 2), parent=self, spacing=8, margins=0)

    def show_sweep(self, found: PivotCalibration) -> None:
        residuals = residuals_of(self._rig, found)
        self.sensors.show_residuals(residuals)
        self.histogram.show_residuals(residuals)


def residuals_of(rig: Rig, found: PivotCalibration) -> tuple[CameraResiduals, ...]:
    """Return the residuals of a sweep with spot positions, by camera."""
    paths = led_paths(found)
    shown = []
    for index, camera in enumerate(rig.cameras):
        residuals = found.residuals_px[:, index]
        seen = np.isfinite(residuals).all(axis=2) & np.isfinite(paths).all(axis=2)
        uv = project(camera, paths[seen]) + residuals[seen]
        shown.append(
            CameraResiduals(camera.name, uv, residuals[seen], np.ones(len(uv), dtype=np.bool_))
        )
    return tuple(shown)


_MOST_POSES = 1200
"""More are indistinguishable."""

_TURN_PER_PX, _TURN_PER_KEY = 0.008, np.radians(10.0)


@dataclass(frozen=True, slots=True)
class Trail:
    name: str
    paths_world: Float
    """(n, L, 3), mm; NaN for omitted frames."""
    centre_world: Float
    """(3,), mm: the ball."""


class TrailPlot(Plot):
    """Every LED on its sphere; drag or arrow keys turn the picture."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(tr("Paths of the LEDs about the ball"))
        self._orbit = seen_from(rig, upright(rig))
        self._trails: tuple[Trail, ...] = ()
        self._pulled: QPointF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)

    def show_trails(self, trails: Sequence[Trail]) -> None:
        self._trails = tuple(_thinned(trail) for trail in trails)
        poses = sum(int(np.isfinite(one.paths_world[:, 0, 0]).sum()) for one in trails)
        leds = trails[0].paths_world.shape[1] if trails else 0
        self._show_message(
            tr(
                "%n poses, {leds} LEDs; drag to rotate",
                "1 pose, {leds} LEDs; drag to rotate",
                poses,
            ).format(leds=leds)
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter)
        if not self._trails:
            return
        theme, items = self._theme, list[Item]()
        reach: list[Points3] = []
        for index, trail in enumerate(self._trails):
            colour = (theme.accent, theme.warn)[index % 2]
            places = trail.paths_world.reshape(-1, 3)
            reach += [places[np.isfinite(places).all(axis=1)], trail.centre_world[None]]
            pieces = np.stack([trail.paths_world[:-1], trail.paths_world[1:]], axis=2)
            pieces = pieces.reshape(-1, 2, 3)
            items.append(Lines(pieces[np.isfinite(pieces).all(axis=(1, 2))], colour, 1.0))
            # Spokes from the ball to the LEDs of one pose show the rotation.
            whole = trail.paths_world[np.isfinite(trail.paths_world).all(axis=(1, 2))]
            if len(whole):
                leds = whole[len(whole) // 2]
                spokes = np.stack([np.broadcast_to(trail.centre_world, leds.shape), leds], axis=1)
                items.append(Lines(spokes, theme.muted, 1.0))
                items.append(Dots(leds, colour, 9.0, theme.text))
            items.append(Dots(trail.centre_world[None], colour, 14.0, theme.text))
            items.append(Tag(trail.centre_world, trail.name, theme.text))
        orbit = self._orbit.fitted(np.concatenate(reach), box.width(), box.height(), 1.1)
        paint_scene(painter, items, orbit, box, text_font(15, bold=True), theme.panel)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._pulled = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pulled is not None:
            by = event.position() - self._pulled
            self._pulled = event.position()
            self._turn(-_TURN_PER_PX * by.x(), _TURN_PER_PX * by.y())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._pulled = None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        right, up = ARROWS.get(Qt.Key(event.key()), (0.0, 0.0))
        if right or up:
            self._turn(_TURN_PER_KEY * right, _TURN_PER_KEY * up)
        else:
            super().keyPressEvent(event)

    def _turn(self, azimuth: float, elevation: float) -> None:
        self._orbit = self._orbit.turned(azimuth, elevation)
        self.update()


def _thinned(trail: Trail) -> Trail:
    step = max(len(trail.paths_world) // _MOST_POSES, 1)
    return Trail(trail.name, trail.paths_world[::step], trail.centre_world)
