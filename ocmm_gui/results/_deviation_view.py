"""The part with its deviations as whiskers, and their scale."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QRectF
from PySide6.QtGui import QPaintEvent, QResizeEvent

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.rendering import RenderMode
from ocmm_core.tolerances.decisions import NO_DEVIATIONS
from ocmm_gui.kit import Theme, text_font, tr
from ocmm_gui.scene import (
    Item,
    KeptScene,
    Orbit,
    OrbitView,
    SceneLayer,
    StillScene,
    Tag,
    paint_scene,
)
from ocmm_gui.views import SCALE_PX, PlacedScene, deviations_of, job_items, paint_scale, scale_words

_START = np.radians(38.0)
_UP = np.array([0.0, 0.0, 1.0])


class DeviationView(OrbitView):
    """A 3-D view of a job: arrow keys or the mouse turn it, plus and minus or the wheel zoom."""

    def __init__(self) -> None:
        start = Orbit(np.zeros(3), 0.5, float(_START), 100.0, _UP)
        super().__init__(tr("Deviations of the touched places"), (420, 260), (240, 170), start)
        self._job: JobView | None = None
        self._seen = NO_DEVIATIONS
        self._items: tuple[Item, ...] = ()
        self._reach = np.empty((0, 3))
        self._part = PlacedScene(self)
        self._part.changed.connect(self.update)
        self._layer = SceneLayer(self)
        self._layer.changed.connect(self.update)
        self._still = KeptScene()
        self.hide()

    def show_job(self, job: JobView, up: Float | None) -> None:
        """Show the deviations of a job; hidden without any.

        `up`: (3,), unit, world, upright in the picture; None leaves it unchanged.
        """
        if job is self._job:
            return
        self._job = job
        self._seen = deviations_of(job)
        # An unaligned part does not coincide with the points.
        placed = job.placed_part
        self._part.place(None if placed is None or placed.is_rough else placed)
        self._part.show_deviations(self._seen)
        if up is not None:
            self._orbit = Orbit(np.zeros(3), 0.5, float(_START), 100.0, up)
        self._make()
        self._fit()
        self.setVisible(bool(self._seen.whiskers))
        self.setAccessibleDescription(
            ". ".join(
                (*scale_words(self._seen), tr("Arrow keys rotate the view, plus and minus zoom."))
            )
            if self._seen.whiskers
            else ""
        )
        self.update()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._make()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        self._paint_panel(painter)
        inside = self._inside()
        box = self._scene_box(inside)
        font = text_font(13)
        seen = self._layer.picture(self._still_scene(box), font)
        painter.drawImage(box.topLeft(), seen.image)
        tags = tuple(item for item in self._items if isinstance(item, Tag))
        paint_scene(painter, tags, self._orbit, box, font, self._theme.panel)
        wide, high = min(SCALE_PX[0] + 120.0, inside.width() - 16.0), SCALE_PX[1]
        below = QRectF(inside.left() + 8.0, inside.bottom() - high, wide, high)
        paint_scale(painter, below, self._seen, self._theme, reach_mm=self._part.reach_mm)

    def is_painted(self) -> bool:
        """Return whether painting is complete; for tests and screenshots."""
        still = self._still_scene(self._scene_box(self._inside()))
        return self._part.is_coloured() and self._layer.shows(still)

    def _still_scene(self, box: QRectF) -> StillScene:
        size, ratio = box.size().toSize(), self.devicePixelRatioF()
        part = self._part.part(self._theme, RenderMode.SHADED, "", moving=self.is_moving())

        def make() -> StillScene:
            items = tuple(item for item in self._items if not isinstance(item, Tag))
            return StillScene(items, self._orbit, size, ratio, self._theme.panel, part)

        return self._still.made((self._items, self._orbit, part), (size, ratio), make)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def fit(self) -> None:
        self._fit()
        self.update()

    def _scene_box(self, inside: QRectF) -> QRectF:
        return inside.adjusted(0.0, 0.0, 0.0, -SCALE_PX[1] - 4.0)

    def _make(self) -> None:
        if self._job is None:
            return
        self._items, reach = job_items(self._job, self._theme)
        ends = [whisker.end_world for whisker in self._seen.whiskers]
        self._reach = np.concatenate([reach, np.array(ends).reshape(-1, 3), self._part.corners()])

    def _fit(self) -> None:
        if len(self._reach):
            box = self._scene_box(QRectF(self.rect()))
            self._orbit = self._orbit.fitted(
                self._reach, box.width(), max(box.height(), 10.0), margin=1.2
            )
