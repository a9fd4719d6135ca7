"""View control and frame of the 3-D scene.

The view keeps the work in view with minimal motion. Its frame is axes, grid step, rig overview, and
a line of text.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from PySide6.QtCore import QObject, QPointF, QRectF, QSize, QSizeF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPen

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import Target
from ocmm_gui.kit import WRAPPED, Theme, ink, text_font, tr, wrapped_pixels
from ocmm_gui.rendering import choose_side
from ocmm_gui.scene import Dots, Item, Lines, Orbit, Tag, paint_scene
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views._deviations import SCALE_PX

EASE_S = 0.4
_FRAME_MS = 25


class Easing(QObject):
    """Transition between two views, slow at both ends."""

    moved = Signal(object)
    """Emits the current view, an `Orbit`."""

    def __init__(self, parent: QObject, *, animated: bool) -> None:
        super().__init__(parent)
        self._animated = animated
        self._start: Orbit | None = None
        self.goal: Orbit | None = None
        """Target; None while at rest."""
        self._began_s = 0.0
        self._timer = QTimer(self, interval=_FRAME_MS)
        self._timer.timeout.connect(self._go_on)

    def is_running(self) -> bool:
        return self.goal is not None

    def start(self, start: Orbit, goal: Orbit) -> None:
        """Start a transition, replacing a running one."""
        self._start, self.goal, self._began_s = start, goal, perf_counter()
        if self._animated and not start.is_like(goal):
            self._timer.start()
        else:
            self.finish()

    def finish(self) -> None:
        goal = self.goal
        self.stop()
        if goal is not None:
            self.moved.emit(goal)

    def stop(self) -> None:
        self._timer.stop()
        self._start = self.goal = None

    def _go_on(self) -> None:
        if self._start is None or self.goal is None:
            return
        share = (perf_counter() - self._began_s) / EASE_S
        if share >= 1.0:
            self.finish()
        else:
            # Smoothstep: zero speed at both ends.
            self.moved.emit(self._start.toward(self.goal, share * share * (3.0 - 2.0 * share)))


_MARGIN = 1.18
_CHASE = 1.4
"""Extra room after the ball left the view: a view that moves along is illegible."""
_CALM = 1.45
"""A view wider than necessary by this factor zooms in."""
_LATER = 8
_RIM = 0.03
"""Relative edge zone that is about to be left."""


class ViewedPlaces:
    """Places (n, 3), mm, world, and their extent in the last view."""

    def __init__(self, places: Float | None = None) -> None:
        self.all = np.empty((0, 3)) if places is None else places
        self._axes: Float | None = None
        self._extent = np.empty((0, 3))

    def extent(self, axes: Float) -> Float:
        """Return the least and greatest coordinates (2, 3), mm, along axes; (0, 3) of none."""
        if len(self.all) and (self._axes is None or not np.array_equal(axes, self._axes)):
            along = self.all @ axes.T
            self._axes, self._extent = axes, np.stack([along.min(axis=0), along.max(axis=0)])
        return self._extent


@dataclass(frozen=True, slots=True, eq=False)
class WorkExtent:
    """Contents to be shown."""

    ball: Float = field(default_factory=lambda: np.empty((0, 3)))
    """(0 or 1, 3), mm, world."""
    target: Target | None = None
    active: ViewedPlaces = field(default_factory=ViewedPlaces)
    whole: ViewedPlaces = field(default_factory=ViewedPlaces)
    """The part, as far as known."""

    def needed(self) -> Float:
        """Return what must stay in view: places (n, 3), mm, world."""
        return np.concatenate([self.ball, self._at_target(), self.active.all])

    def needed_extent(self, axes: Float) -> Float:
        """Return places (n, 3), mm, along axes, whose extent is that of `needed`."""
        few = np.concatenate([self.ball, self._at_target()]) @ axes.T
        return np.concatenate([few, self.active.extent(axes)])

    def _at_target(self) -> Float:
        return np.empty((0, 3)) if self.target is None else self.target.surface_world[None]


def side_for(
    orbit: Orbit, target: Target, later: Sequence[Target], is_hidden: Callable[[Float], bool]
) -> Orbit:
    """Return the view turned to make the next place visible; the same object if it is.

    `is_hidden`: Whether the part is between the next place and an eye in a direction (3,).
    """
    toward = orbit.axes()[2]
    normals = np.array([one.normal_world for one in later[:_LATER]]).reshape(-1, 3)
    side = choose_side(toward, target.normal_world, orbit.up, is_hidden, normals)
    return orbit if side is toward else orbit.looking_from(side)


def following(
    orbit: Orbit, work: WorkExtent, width: float, height: float, *, turned: bool
) -> Orbit:
    """Return a view that shows the work; the same if sufficient and not just `turned`."""
    axes = orbit.axes()
    needed, whole = work.needed_extent(axes), work.whole.extent(axes)
    everything = np.concatenate([needed, whole])
    if not len(everything):
        return orbit
    wanted = orbit.fitted(everything @ axes, width, height, _MARGIN)
    if turned:
        return wanted
    if not in_picture(orbit, needed @ axes, width, height, _RIM):
        left = len(work.ball) and not in_picture(orbit, work.ball, width, height, _RIM)
        return orbit.fitted(everything @ axes, width, height, _CHASE) if left else wanted
    calm = orbit.radius <= _CALM * wanted.radius
    return orbit if calm and in_picture(orbit, whole @ axes, width, height, 0.0) else wanted


def in_picture(orbit: Orbit, places: Float, width: float, height: float, rim: float) -> bool:
    """Return whether places (n, 3) are in view with a relative margin ``rim``."""
    seen = orbit.project(places, width, height)[:, :2] / np.array([width, height])
    return bool(((seen >= rim) & (seen <= 1.0 - rim)).all())


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
            within = (avoided >= (x, y)) & (avoided <= (x + wide, y + side))
            if not within.all(axis=1).any():
                return QRectF(x, y, wide, side)
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
        ink(painter, QPen(QColor(theme.border), theme.border_px), QColor(theme.background))
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


def grid_step(orbit: Orbit) -> float:
    """Return the grid spacing, mm: the power of ten that suits the view."""
    return float(10.0 ** np.floor(np.log10(orbit.radius)))


def grid_items(orbit: Orbit, low: float | None, theme: Theme) -> tuple[Item, ...]:
    """Return a level grid at the lowest point of the work, mm, or through the target."""
    up, step = orbit.up, grid_step(orbit)
    level = float(orbit.target @ up) if low is None else low
    first, second = (np.eye(3)[i] for i in range(3) if i != int(np.argmax(np.abs(up))))
    count = int(np.ceil(1.6 * orbit.radius / step))
    middle = np.round(np.array([orbit.target @ axis for axis in (first, second)]) / step)
    ticks = np.arange(-count, count + 1)
    lines = []
    for along, across, a, b in ((first, second, 0, 1), (second, first, 1, 0)):
        offset = (middle[b] + ticks)[:, None] * step * across + level * up
        ends = [(middle[a] + sign * count) * step * along for sign in (-1, 1)]
        lines.append(np.stack([offset + ends[0], offset + ends[1]], axis=1))
    return (Lines(np.concatenate(lines), theme.border, 0.6),)


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
    ink(painter, QPen(QColor(theme.warn), 1.4), QColor(theme.panel))
    painter.drawRoundedRect(place, 4, 4)
    room = place.adjusted(6.0, 0.0, -6.0, 0.0)
    painter.setFont(text_font(wrapped_pixels(words, room, 14, bold=True), bold=True))
    painter.setPen(QColor(theme.warn))
    painter.drawText(room, WRAPPED, words)
