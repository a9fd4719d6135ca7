"""Live camera images: spots, slots and LEDs of each camera."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QWidget

from ocmm_core.camera import CameraModel, Rig
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import LiveView
from ocmm_gui.kit import FitText, Themed, slot_names, text_font, tr, vbox

TRAIL = 60
"""Snapshots in the trail: two seconds."""

_GAP_S = 0.3
"""After a longer pause, such as in the far view, the trail restarts."""

_FADE_STEPS = 4
_SIDES_PX = tuple(280.0 * 2.0 ** (step / 2.0) for step in range(7))
"""Heights of the picture, sensor px; steps keep the scale from creeping."""

_FILL = 0.62
"""Share of the picture that the spots may fill."""

_EDGE = 0.1
"""A spot this near to the edge, relative to the side, moves the picture."""


_MARK_PX, _MANY_MARK_PX = 11, 6
_MOST_WORDS = 16
"""Beyond it labels are illegible and trails alike; the title counts labelled spots."""

_ROW = 4
"""Up to this many cameras are in a row, with axes; more in a square, without."""

_WAYS = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
"""Label positions relative to the spot; the first free one is used."""

_Box = tuple[float, float, float, float]


class CameraPlot(Themed, QWidget):
    """One camera: spots as crosses with slot, LED, and trail.

    The region moves only when a spot reaches its edge, so that spot motion is visible.
    """

    def __init__(self, camera: CameraModel, *, small: bool = False) -> None:
        super().__init__()
        self._camera = camera
        self._trail: deque[Float] = deque(maxlen=TRAIL)
        self._shown_at = 0.0
        self._middle = np.array([0.5 * camera.width, 0.5 * camera.height])
        self._side = _SIDES_PX[-1]
        self._title = FitText(tr("Camera {name}").format(name=camera.name), limit=14, high=20)
        # View box and axes only: a PlotItem adds unwanted menus and buttons.
        self._plot: Any = pg.GraphicsLayoutWidget()
        self._plot.setAccessibleName(tr("Image of camera {name}").format(name=camera.name))
        self._plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._plot.ci.layout.setContentsMargins(0, 0, 0, 0)
        self._plot.ci.layout.setSpacing(0)
        self._box: Any = pg.ViewBox(
            lockAspect=True, enableMouse=False, enableMenu=False, invertY=True
        )
        self._box.disableAutoRange()
        self._plot.addItem(self._box, row=0, col=1)
        self._axes: list[Any] = [pg.AxisItem("left"), pg.AxisItem("bottom")]
        for axis, (row, column) in zip(self._axes, ((0, 0), (1, 1)), strict=True):
            axis.linkToView(self._box)
            axis.setStyle(tickFont=text_font(11), tickLength=-5)
            axis.setVisible(not small)
            self._plot.addItem(axis, row=row, col=column)
        self._sensor: Any = pg.PlotCurveItem(
            [0, camera.width, camera.width, 0, 0], [0, 0, camera.height, camera.height, 0]
        )
        self._fading: list[Any] = [pg.PlotCurveItem(connect="finite") for _ in range(_FADE_STEPS)]
        self._spots: Any = pg.ScatterPlotItem(size=_MARK_PX, symbol="+")
        self._labels: list[Any] = []
        for item in (self._sensor, *self._fading, self._spots):
            self._box.addItem(item, ignoreBounds=True)
        vbox(self._title, (self._plot, 1), parent=self, spacing=2, margins=0)
        self._paint()
        self._move()

    def show_spots(self, spots: Float, names: Sequence[str]) -> None:
        """Show the spots (S, 2), px, of the slots with their labels."""
        seen = np.asarray(np.isfinite(spots).all(axis=1))
        count = int(seen.sum())
        told = tr("{name}:  %n spots", "{name}:  1 spot", count).format(name=self._camera.name)
        if count > _MOST_WORDS:
            named = sum(
                bool(there) and name != "?" for there, name in zip(seen, names, strict=True)
            )
            told = tr("{told}, {named} named").format(told=told, named=named)
        self._title.show_text(told)
        now = time.monotonic()
        if now - self._shown_at > _GAP_S or (
            len(self._trail) and self._trail[-1].shape != spots.shape
        ):
            self._trail.clear()
        self._shown_at = now
        self._trail.append(spots)
        size = _MARK_PX if count <= _MOST_WORDS else _MANY_MARK_PX
        self._spots.setData(spots[seen, 0], spots[seen, 1], size=size)
        self._place_labels(spots, names, seen)
        self._draw_trail()
        if seen.any():
            self._keep_in_sight(spots[seen])

    def labels(self) -> tuple[str, ...]:
        return tuple(label.toPlainText().strip() for label in self._labels if label.isVisible())

    def _place_labels(self, spots: Float, names: Sequence[str], seen: NDArray[np.bool_]) -> None:
        self._add_labels(len(spots))
        if int(seen.sum()) > _MOST_WORDS:
            seen = np.zeros_like(seen)
        scale = self._side / max(float(self._box.height()), 1.0)
        taken = [(u, v, 0.5 * _MARK_PX * scale, 0.5 * _MARK_PX * scale) for u, v in spots[seen]]
        for slot, label in enumerate(self._labels):
            label.setVisible(bool(seen[slot]))
            if not seen[slot]:
                continue
            text = f" {names[slot]} ·s{slot} "
            if label.toPlainText() != text:
                label.setText(text)
            size = label.boundingRect()
            half = np.array([size.width(), size.height()]) * 0.5 * scale
            reach = half + 0.55 * _MARK_PX * scale
            boxes = [(*(spots[slot] + way * reach), 0.9 * half[0], 0.7 * half[1]) for way in _WAYS]
            free = [not any(_overlap(box, other) for other in taken) for box in boxes]
            choice = free.index(True) if any(free) else 0
            taken.append(boxes[choice])
            # The anchor is the point of the label at the spot.
            label.setAnchor(0.5 * (1.0 - _WAYS[choice]))
            label.setPos(*spots[slot])

    def _add_labels(self, count: int) -> None:
        while len(self._labels) < count:
            label = pg.TextItem()
            label.setFont(text_font(12, bold=True))
            label.setColor(QColor(self._theme.text))
            label.hide()
            self._box.addItem(label, ignoreBounds=True)
            self._labels.append(label)

    def _draw_trail(self) -> None:
        if np.count_nonzero(np.isfinite(self._trail[-1][:, 0])) > _MOST_WORDS:
            for curve in self._fading:
                curve.setData(np.empty(0), np.empty(0))
            return
        history = np.stack(self._trail)
        # One curve per age: they share a sample, so that the trail has no gaps.
        bounds = np.linspace(0, len(history) - 1, _FADE_STEPS + 1).astype(int)
        gap = np.full((1, *history.shape[1:]), np.nan)
        for curve, first, last in zip(self._fading, bounds[:-1], bounds[1:], strict=True):
            part = np.concatenate([history[first : last + 1], gap]).transpose(1, 0, 2)
            if not np.isfinite(part).any():
                # pyqtgraph would silence numpy's warning for all threads at once, which leaks.
                part = np.empty((0, 0, 2))
            curve.setData(part[..., 0].ravel(), part[..., 1].ravel())

    def _keep_in_sight(self, spots: Float) -> None:
        low, high = spots.min(axis=0), spots.max(axis=0)
        shape = np.array([max(self._box.width() / max(self._box.height(), 1.0), 1.0), 1.0])
        spread = float(((high - low) / shape).max())
        wanted = next((s for s in _SIDES_PX if spread < _FILL * s), _SIDES_PX[-1])
        reach = 0.5 * self._side * (1.0 - 2.0 * _EDGE) * shape
        outside = bool((np.abs(spots - self._middle) > reach).any())
        if outside or wanted > self._side or wanted < 0.4 * self._side:
            self._middle, self._side = 0.5 * (low + high), wanted
            self._move()

    def _move(self) -> None:
        half = 0.5 * self._side
        (x, y) = self._middle
        self._box.setRange(xRange=(x - half, x + half), yRange=(y - half, y + half), padding=0)

    def _paint(self) -> None:
        theme = self._theme
        self._plot.setBackground(QColor(theme.panel))
        for axis in self._axes:
            axis.setPen(QColor(theme.border))
            axis.setTextPen(QColor(theme.muted))
        self._sensor.setPen(pg.mkPen(QColor(theme.border), width=2))
        for step, curve in enumerate(self._fading):
            colour = QColor(theme.accent)
            colour.setAlpha(int(230 * (step + 1) / _FADE_STEPS))
            curve.setPen(pg.mkPen(colour, width=1))
        self._spots.setPen(pg.mkPen(QColor(theme.text), width=2))
        for label in self._labels:
            label.setColor(QColor(theme.text))


def _overlap(first: _Box, second: _Box) -> bool:
    """Return whether two boxes (middle x, middle y, half width, half height) overlap."""
    return (
        abs(first[0] - second[0]) < first[2] + second[2]
        and abs(first[1] - second[1]) < first[3] + second[3]
    )


class CameraViews(QWidget):
    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.setAccessibleName(tr("Camera images"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self._turn = 0
        count = len(rig.cameras)
        small = count > _ROW
        columns = math.ceil(math.sqrt(count)) if small else count
        self._plots = tuple(CameraPlot(camera, small=small) for camera in rig.cameras)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for number, plot in enumerate(self._plots):
            row, column = divmod(number, columns)
            layout.addWidget(plot, row, column)
            layout.setRowStretch(row, 1)
            layout.setColumnStretch(column, 1)

    def show_live(self, live: LiveView) -> None:
        """Show the spots of every camera; with many, a few at a time in turn.

        A picture takes milliseconds to draw: sixteen would block the window.
        """
        turns = math.ceil(len(self._plots) / _ROW)
        for camera in range(self._turn, len(self._plots), turns):
            self._plots[camera].show_spots(live.spots[camera], slot_names(live, camera))
        self._turn = (self._turn + 1) % turns

    def plots(self) -> tuple[CameraPlot, ...]:
        return self._plots
