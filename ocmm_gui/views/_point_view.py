"""The 3-D view: cameras, probe, measured points and fitted features."""

from __future__ import annotations

from operator import is_

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView, LiveView
from ocmm_core.tracking import ProbeBody
from ocmm_gui.kit import DEFAULT_THEME, THEMES, Theme, text_font, tr
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views._contents import (
    JobDrawing,
    grid_items,
    grid_step,
    probe_items,
    probe_places,
    reference_items,
    target_items,
)
from ocmm_gui.views._deviations import SCALE_PX, paint_scale
from ocmm_gui.views._scene import Dots, Item, Lines, Orbit, ScenePainter, Tag, paint_scene
from ocmm_gui.views._scene_layer import SceneLayer, StillScene

_NAMED_MM = 250.0
"""In a wider view the names of the LEDs would cover each other."""

_CALM = 1.6
_CHASE = 1.4
"""So much more room a view takes that the ball has left: it will go on, and a view that moves with
it cannot be read."""
_OVERVIEW_ASPECT = 1.25
_KEY_TURN = np.radians(10.0)


class PointView(QWidget):
    """Orbit with the left button or the arrow keys, pan with the right one, zoom with the wheel.

    The view fits itself to the work until somebody turns it; the key F gives it back.

    Parameters
    ----------
    rig, body
        What measures.
    """

    def __init__(self, rig: Rig, body: ProbeBody) -> None:
        super().__init__()
        self._rig = rig
        self._body = body
        self._theme = THEMES[DEFAULT_THEME]
        self._live: LiveView | None = None
        self._probe = np.empty((0, 3))
        self._job: JobView | None = None
        self._chosen = 0
        self._drawing = JobDrawing()
        self._job_items: tuple[Item, ...] = ()
        self._layer = SceneLayer(self)
        self._layer.changed.connect(self.update)
        self._still: StillScene | None = None
        self._still_of: tuple[object, ...] = ()
        self._job_reach = np.empty((0, 3))
        self._job_low: float | None = None
        self._probe_reach = np.empty((0, 3))
        self._follows = True
        self._mouse: QPointF | None = None
        up = upright(rig)
        start = seen_from(rig, up)
        self._orbit = start.fitted(rig.volume_world, 1.0, 1.0)
        pyramids = [shapes.camera_pyramid(camera, 0.18 * _distance(rig)) for camera in rig.cameras]
        self._rig_lines = np.concatenate(pyramids)
        reach = np.concatenate([self._rig_lines.reshape(-1, 3), rig.volume_world])
        self._overview = start.fitted(reach, _OVERVIEW_ASPECT, 1.0)
        self.setAccessibleName(tr("3-D view"))
        self.setAccessibleDescription(
            tr("Arrow keys rotate the view, plus and minus zoom, F fits it to the part")
        )
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_live(self, live: LiveView) -> None:
        """Show where the probe is; without a trusted pose it is not drawn."""
        self._live = live
        self._probe = probe_places(live, self._body)
        if len(self._probe):
            first_sight = not len(self._probe_reach)
            self._probe_reach = self._probe
            # The ball is the last of them. Who moves it looks for it first of all.
            if self._follows and (first_sight or not self.shows(self._probe[-1:])):
                self._fit(_CHASE)
        self.update()

    def show_job(self, job: JobView) -> None:
        """Show points and features as they stand."""
        self._job = job
        self._draw_job(job)
        if self._follows:
            self._fit()
        self.update()

    def choose(self, number: int) -> None:
        """Mark a point; zero marks none."""
        self._chosen = number
        if self._job is not None:
            self.show_job(self._job)

    def projected(self, places: Float) -> Float:
        """Return where places (n, 3), mm, world, are in the picture, (n, 2), px."""
        return self._orbit.project(places, float(self.width()), float(self.height()))[:, :2]

    def shows(self, places: Float) -> bool:
        """Return whether places (n, 3), mm, world, all lie in the picture."""
        seen = self.projected(places)
        return bool(((seen > 0.0) & (seen < (self.width(), self.height()))).all())

    def fit(self) -> None:
        """Show the whole work, and keep doing so."""
        self._follows = True
        reach = np.concatenate([self._job_reach, self._probe_reach])
        if len(reach):
            self._orbit = self._orbit.fitted(reach, float(self.width()), float(self.height()))
        self.update()

    def close_up(self) -> None:
        """Show the feature that is being measured, until F gives the view back."""
        feature = None if self._job is None else self._job.shown
        if feature is not None and feature.points:
            self._follows = False
            tips = np.stack([point.tip_world for point in feature.points])
            surface = np.stack([point.surface_world for point in feature.points])
            size = (float(self.width()), float(self.height()))
            self._orbit = self._orbit.fitted(np.concatenate([tips, surface]), *size, margin=1.6)
            self.update()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        if self._job is not None:
            self._draw_job(self._job)
        self.update()

    def _draw_job(self, job: JobView) -> None:
        self._job_items, self._job_reach = self._drawing.items(job, self._theme, self._chosen)
        reach = self._job_reach @ self._orbit.up
        self._job_low = float(reach.min()) if len(reach) else None

    def sizeHint(self) -> QSize:
        """Return a size for the desk view."""
        return QSize(600, 420)

    def minimumSizeHint(self) -> QSize:
        """Return the size below which nothing can be told apart."""
        return QSize(240, 160)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the work, and the whole rig small in a corner."""
        painter = QPainter(self)
        theme = self._theme
        frame = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.setPen(QPen(QColor(theme.border), theme.border_px))
        painter.setBrush(QColor(theme.panel))
        painter.drawRoundedRect(frame, 6, 6)
        inside = frame.adjusted(2, 2, -2, -2)
        font = text_font(12)
        picture, words = self._layer.picture(self._still_scene(inside), font)
        painter.drawImage(inside.topLeft(), picture)
        named = self._orbit.radius < _NAMED_MM
        tip = None if self._live is None else self._live.tip_world
        moving = (
            *target_items(self._job, tip, theme, self._orbit.up),
            *reference_items(self._live, theme, named=named),
            *probe_items(self._probe, self._body, theme, named=named),
        )
        ScenePainter(moving, self._orbit, inside, font, theme.panel, words).paint(painter)
        rig = Lines(self._rig_lines, theme.muted, 1.0)
        self._paint_triad(painter, inside)
        wide, high = SCALE_PX
        below = QRectF(inside.right() - wide - 10, inside.bottom() - high - 6, wide, high)
        paint_scale(painter, below, self._drawing.deviations, theme)
        side = min(190.0, 0.24 * inside.width(), 0.34 * inside.height())
        wide = _OVERVIEW_ASPECT * side
        corner = QRectF(inside.right() - wide - 8, inside.top() + 8, wide, side)
        painter.setPen(QPen(QColor(theme.border), theme.border_px))
        painter.setBrush(QColor(theme.background))
        painter.drawRoundedRect(corner, 4, 4)
        volume = Lines(shapes.box(self._rig.volume_world), theme.border, 1.0)
        work = Dots(self._probe, theme.accent, 5.0)
        tags = tuple(
            Tag(camera.centre_world, camera.name, theme.muted) for camera in self._rig.cameras
        )
        paint_scene(
            painter, (volume, rig, work, *tags), self._overview, corner, text_font(10),
            theme.background,
        )  # fmt: skip

    def _still_scene(self, inside: QRectF) -> StillScene:
        """Return what does not move with the probe; the same object while it is the same."""
        theme, orbit, size = self._theme, self._orbit, inside.size().toSize()
        ratio = self.devicePixelRatioF()
        made_of = (self._job_items, orbit, theme.name, self._job_low, size, ratio)
        # Orbits and items hold arrays: they are the same, or they are others.
        same = all(map(is_, made_of[:2], self._still_of[:2])) and made_of[2:] == self._still_of[2:]
        if self._still is None or not same:
            rig = Lines(self._rig_lines, theme.muted, 1.0)
            grid = grid_items(orbit, self._job_low, theme)
            items = (*grid, rig, *self._job_items)
            self._still = StillScene(items, orbit, size, ratio, theme.panel)
            self._still_of = made_of
        return self._still

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin to turn or to move."""
        self._mouse = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn with the left button, move with another."""
        if self._mouse is None:
            return
        delta = event.position() - self._mouse
        self._mouse = event.position()
        self._follows = False
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._turn(-0.008 * delta.x(), 0.008 * delta.y())
        else:
            scale = 2.0 * self._orbit.radius / min(self.width(), self.height())
            right, up, _ = self._orbit.axes()
            moved = self._orbit.target - scale * (delta.x() * right - delta.y() * up)
            self._orbit = Orbit(
                moved, self._orbit.azimuth, self._orbit.elevation, self._orbit.radius,
                self._orbit.up,
            )  # fmt: skip
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End turning."""
        self._mouse = None

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Fit the view to the work again."""
        self.fit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom."""
        self._zoom(0.999 ** event.angleDelta().y())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Turn with the arrows, zoom with plus and minus."""
        turns = {
            Qt.Key.Key_Left: (-_KEY_TURN, 0.0),
            Qt.Key.Key_Right: (_KEY_TURN, 0.0),
            Qt.Key.Key_Up: (0.0, _KEY_TURN),
            Qt.Key.Key_Down: (0.0, -_KEY_TURN),
        }
        key = Qt.Key(event.key())
        if key in turns:
            self._turn(*turns[key])
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._zoom(1.0 / 1.2)
        elif key is Qt.Key.Key_Minus:
            self._zoom(1.2)
        else:
            super().keyPressEvent(event)

    def _turn(self, azimuth: float, elevation: float) -> None:
        self._follows = False
        self._orbit = self._orbit.turned(azimuth, elevation)
        self.update()

    def _zoom(self, factor: float) -> None:
        self._follows = False
        self._orbit = self._orbit.zoomed(factor)
        self.update()

    def _fit(self, margin: float = 1.15) -> None:
        reach = np.concatenate([self._job_reach, self._probe_reach])
        if not len(reach):
            return
        width, height = float(self.width()), float(self.height())
        wanted = self._orbit.fitted(reach, width, height, margin)
        # A view that moves with every point is no help: it stays while it shows all, large enough.
        if not self.shows(reach) or self._orbit.radius > _CALM * wanted.radius:
            self._orbit = wanted

    def _paint_triad(self, painter: QPainter, box: QRectF) -> None:
        axes = self._orbit.axes()
        centre = QPointF(box.left() + 46, box.bottom() - 46)
        painter.setFont(text_font(12))
        painter.setPen(QColor(self._theme.muted))
        painter.drawText(
            QRectF(box.left() + 100, box.bottom() - 26, 200, 20),
            Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter,
            tr("grid {grid_step:.0f} mm").format(grid_step=grid_step(self._orbit)),
        )
        painter.setFont(text_font(13, bold=True))
        for name, direction in zip("XYZ", np.eye(3), strict=True):
            x, y, _ = (axes @ direction).tolist()
            end = QPointF(centre.x() + 30 * x, centre.y() - 30 * y)
            painter.setPen(QPen(QColor(self._theme.text), 2.0))
            painter.drawLine(centre, end)
            place = QPointF(centre.x() + 41 * x, centre.y() - 41 * y)
            painter.drawText(
                QRectF(place.x() - 9, place.y() - 9, 18, 18), Qt.AlignmentFlag.AlignCenter, name
            )


def upright(rig: Rig) -> Float:
    """Return the world axis that is upright: opposite to the sensors' columns, (3,), unit."""
    columns = np.mean([camera.T_camera_from_world.rotation[1] for camera in rig.cameras], axis=0)
    axis = int(np.argmax(np.abs(columns)))
    up: Float = -np.sign(columns[axis]) * np.eye(3)[axis]
    return up


def seen_from(rig: Rig, up: Float) -> Orbit:
    """Return a view from the cameras' side, turned and raised enough to see depth."""
    start = Orbit(np.zeros(3), 0.0, 0.0, 200.0, up)
    centre = rig.volume_world.mean(axis=0)
    seat = np.mean([camera.centre_world for camera in rig.cameras], axis=0) - centre
    right, _, outward = start.axes()
    azimuth = float(np.arctan2(seat @ right, seat @ outward))
    return start.turned(azimuth + np.radians(25.0), np.radians(25.0))


def _distance(rig: Rig) -> float:
    centre = rig.volume_world.mean(axis=0)
    return float(np.mean([np.linalg.norm(c.centre_world - centre) for c in rig.cameras]))
