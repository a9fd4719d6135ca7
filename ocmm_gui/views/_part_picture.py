"""A picture of the nominal part by itself, to look at and to choose faces on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPaintEvent

from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.part_model import PartModel
from ocmm_core.rendering import NO_FACE, Colours, RenderMode
from ocmm_gui.kit import SCENE_LEAST, SCENE_SIZE, literal, text_font, tr
from ocmm_gui.scene import KeptScene, Orbit, OrbitView, PartDrawing, SceneLayer, StillScene

_START = Orbit(np.zeros(3), np.radians(-35.0), np.radians(30.0), 50.0, np.array([0.0, 0.0, 1.0]))
_IN_PLACE = RigidTransform.identity()


class PartPicture(OrbitView):
    """Shows a part shaded, as hidden lines or transparent, z upwards, in the frame of its model.

    A face is known by its place in ``model.faces``, which is what ``model.triangle_faces`` holds.
    Turn it with the left button or the arrow keys, move it with the right one, zoom with the wheel
    or plus and minus; F shows all of it.

    Parameters
    ----------
    name
        Accessible name; empty for that of a part.
    """

    face_clicked = Signal(int)
    """Place of the face in the model; `NO_FACE` (-1) beside the part."""
    face_hovered = Signal(int)
    """The same, of the face under the mouse, when it becomes another one."""

    def __init__(self, name: str = "") -> None:
        super().__init__(name or tr("Picture of the part"), SCENE_SIZE, SCENE_LEAST, _START)
        self.setAccessibleDescription(
            tr("Arrow keys rotate the view, plus and minus zoom, F fits it to the part")
        )
        self.setMouseTracking(True)
        self._drawing = PartDrawing(self)
        self._drawing.changed.connect(self.update)
        self._layer = SceneLayer(self)
        self._layer.changed.connect(self.update)
        self._model: PartModel | None = None
        self._marked: dict[int, str] = {}
        self._colours: Colours | None = None
        self._mode = RenderMode.SHADED
        self._words = ""
        self._still = KeptScene()
        self._face = NO_FACE
        self._fits = True

    def show_part(self, model: PartModel | None, colours: Colours | None = None) -> None:
        """Show a part, all of it; ``colours`` (n, 3) are those of its vertices, else of its faces.

        None shows none.
        """
        self._model, self._colours = model, colours
        self._marked = {}
        self._drawing.use(model)
        self._fits = True
        self.update()

    def colour(self, colours: Colours | None) -> None:
        """Show another colour (n, 3) at each vertex; None gives the faces theirs back."""
        self._colours = colours
        self.update()

    def highlight(self, marked: Mapping[int, str]) -> None:
        """Show faces in other colours, ``#rrggbb`` by their place in the model, and no others."""
        self._marked = dict(marked)
        self.update()

    def say(self, words: str) -> None:
        """Write a line into the picture, below the part."""
        self._words = words
        self.setToolTip(literal(words))
        self.update()

    def set_mode(self, mode: RenderMode) -> None:
        """Paint it in another way."""
        self._mode = mode
        self.update()

    def mode(self) -> RenderMode:
        """Return how it is painted."""
        return self._mode

    def face_at(self, place: QPointF) -> int:
        """Return the place in the model of the face at a place of the widget; `NO_FACE` for none.

        Before the first picture is painted there is none.
        """
        canvas, inside = self._layer.canvas(), self._inside()
        if canvas is None or self._model is None:
            return NO_FACE
        return canvas.face_at(
            (place.x() - inside.left()) * canvas.width / max(inside.width(), 1.0),
            (place.y() - inside.top()) * canvas.height / max(inside.height(), 1.0),
        )

    def is_painted(self) -> bool:
        """Return whether what is shown is all there is to show; for tests and screenshots."""
        if self._model is None:
            return True
        return self._layer.shows(self._still_scene(self._inside()))

    def look_at(self, normal: Float) -> None:
        """Turn so that a face with this outward normal (3,) is seen well."""
        flat = Orbit(np.zeros(3), 0.0, 0.0, 1.0, self._orbit.up).axes()
        right, up, out = (flat @ normal).tolist()
        azimuth = self._orbit.azimuth
        if np.hypot(right, out) > 0.2:
            # Not square to it: the edges round it show how it lies.
            azimuth = float(np.arctan2(right, out)) - np.radians(25.0)
        elevation = float(np.arcsin(np.clip(up, -0.85, 0.85)))
        elevation += np.radians(20.0) if elevation < np.radians(45.0) else 0.0
        turned = self._orbit.turned(
            azimuth - self._orbit.azimuth, elevation - self._orbit.elevation
        )
        self._fits = True
        self._moved(turned)

    def fit(self) -> None:
        """Show all of the part."""
        self._fits = True
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the part and its marks."""
        painter = self._painter()
        self._paint_panel(painter)
        inside, theme = self._inside(), self._theme
        if self._model is None:
            painter.setFont(text_font(13))
            painter.setPen(QColor(theme.muted))
            painter.drawText(inside, Qt.AlignmentFlag.AlignCenter, self._words or tr("No model"))
            return
        if self._fits:
            reach = _corners(self._model)
            wanted = self._orbit.fitted(reach, inside.width(), inside.height())
            if not wanted.is_like(self._orbit):
                self._orbit = wanted
        font = text_font(12)
        seen = self._layer.picture(self._still_scene(inside), font)
        painter.drawImage(inside.topLeft(), seen.image)
        line = QRectF(inside.left() + 10, inside.bottom() - 26, inside.width() - 20, 22)
        painter.setFont(text_font(13))
        painter.setPen(QColor(theme.muted))
        painter.drawText(line, Qt.AlignmentFlag.AlignLeft, self._words)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Show all with F, else as every view."""
        if event.key() == Qt.Key.Key_F:
            self.fit()
        else:
            super().keyPressEvent(event)

    def _still_scene(self, inside: QRectF) -> StillScene:
        size, ratio = inside.size().toSize(), self.devicePixelRatioF()
        part = self._drawing.scene(
            _IN_PLACE, self._theme, self._mode, self._marked, self._colours,
            moving=self.is_moving(),
        )  # fmt: skip

        def make() -> StillScene:
            return StillScene((), self._orbit, size, ratio, self._theme.panel, part)

        return self._still.made((part, self._orbit), (size, ratio), make)

    def _moved(self, orbit: Orbit) -> None:
        self._fits = self._fits and orbit.radius == self._orbit.radius
        super()._moved(orbit)

    def _clicked(self, place: QPointF) -> None:
        self.face_clicked.emit(self.face_at(place))

    def _hovered(self, place: QPointF) -> None:
        face = self.face_at(place)
        if face != self._face:
            self._face = face
            self.face_hovered.emit(face)


def _corners(model: PartModel) -> Float:
    """Return the corners (8, 3) of the upright box round a part, mm."""
    low, high = model.box
    return np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
