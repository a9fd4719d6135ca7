"""Pictures of the nominal part, with selectable faces, and of a step."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QImageReader, QKeyEvent, QPaintEvent

from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.part_model import PartModel
from ocmm_gui import kit, scene
from ocmm_gui.kit import tr
from ocmm_gui.rendering import NO_FACE, Colours, RenderMode
from ocmm_gui.views._contents import nominal_items

_START = scene.Orbit(
    np.zeros(3), np.radians(-35.0), np.radians(30.0), 50.0, np.array([0.0, 0.0, 1.0])
)
_IN_PLACE = RigidTransform.identity()


class PartPicture(scene.OrbitView):
    """Shows a part shaded, as hidden lines or transparent, z upwards, model frame.

    Faces are indices of ``model.faces``, as in ``model.triangle_faces``. Turn with the left button
    or arrow keys, pan with the right one, zoom with wheel or plus and minus; F fits.
    """

    face_clicked = Signal(int)
    """Face index in the model; `NO_FACE` (-1) next to the part."""
    face_hovered = Signal(int)
    """Emits the face under the mouse when it changes."""

    def __init__(self, name: str = "") -> None:
        super().__init__(name or tr("Picture of the part"), kit.SCENE_SIZE, kit.SCENE_LEAST, _START)
        self.setAccessibleDescription(
            tr("Arrow keys rotate the view, plus and minus zoom, F fits it to the part")
        )
        self.setMouseTracking(True)
        self._drawing = scene.PartDrawing(self)
        self._drawing.changed.connect(self.update)
        self._layer = scene.SceneLayer(self)
        self._layer.changed.connect(self.update)
        self._model: PartModel | None = None
        self._marked: dict[int, str] = {}
        self._colours: Colours | None = None
        self._mode = RenderMode.SHADED
        self._words = ""
        self._still = scene.SceneCache()
        self._face = NO_FACE
        self._fits = True

    def show_part(self, model: PartModel | None, colours: Colours | None = None) -> None:
        """Show and fit a part, None for none; vertex `colours` (n, 3) have priority."""
        self._model, self._colours = model, colours
        self._marked = {}
        self._drawing.use(model)
        self._fits = True
        self.update()

    def colour(self, colours: Colours | None) -> None:
        """Set vertex colours (n, 3); None restores the face colours."""
        self._colours = colours
        self.update()

    def highlight(self, marked: Mapping[int, str]) -> None:
        """Show only these faces in other colours, ``#rrggbb`` by index in the model."""
        self._marked = dict(marked)
        self.update()

    def show_message(self, words: str) -> None:
        """Show a line of text below the part."""
        self._words = words
        self.setToolTip(kit.literal(words))
        self.update()

    def set_mode(self, mode: RenderMode) -> None:
        self._mode = mode
        self.update()

    def mode(self) -> RenderMode:
        return self._mode

    def face_at(self, place: QPointF) -> int:
        """Return the face index at a place, or `NO_FACE`; None before the first picture."""
        canvas, inside = self._layer.canvas(), self._inside()
        if canvas is None or self._model is None:
            return NO_FACE
        return canvas.face_at(
            (place.x() - inside.left()) * canvas.width / max(inside.width(), 1.0),
            (place.y() - inside.top()) * canvas.height / max(inside.height(), 1.0),
        )

    def is_painted(self) -> bool:
        if self._model is None:
            return True
        return self._layer.shows(self._still_scene(self._inside()))

    def look_at(self, normal: Float) -> None:
        """Turn to a good view of a face with this outward normal (3,)."""
        flat = scene.Orbit(np.zeros(3), 0.0, 0.0, 1.0, self._orbit.up).axes()
        right, up, out = (flat @ normal).tolist()
        azimuth = self._orbit.azimuth
        if np.hypot(right, out) > 0.2:
            # Not perpendicular: the edges around it show its orientation.
            azimuth = float(np.arctan2(right, out)) - np.radians(25.0)
        elevation = float(np.arcsin(np.clip(up, -0.85, 0.85)))
        elevation += np.radians(20.0) if elevation < np.radians(45.0) else 0.0
        turned = self._orbit.turned(
            azimuth - self._orbit.azimuth, elevation - self._orbit.elevation
        )
        self._fits = True
        self._moved(turned)

    def fit(self) -> None:
        self._fits = True
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        self._paint_panel(painter)
        inside, theme = self._inside(), self._theme
        if self._model is None:
            kit.ink(painter, QColor(theme.muted), font=kit.text_font(13))
            painter.drawText(inside, Qt.AlignmentFlag.AlignCenter, self._words or tr("No model"))
            return
        if self._fits:
            wanted = self._orbit.fitted(_corners(self._model), inside.width(), inside.height())
            if not wanted.is_like(self._orbit):
                self._orbit = wanted
        font = kit.text_font(12)
        seen = self._layer.picture(self._still_scene(inside), font)
        painter.drawImage(inside.topLeft(), seen.image)
        line = QRectF(inside.left() + 10, inside.bottom() - 26, inside.width() - 20, 22)
        kit.ink(painter, QColor(theme.muted), font=kit.text_font(13))
        painter.drawText(line, Qt.AlignmentFlag.AlignLeft, self._words)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_F:
            self.fit()
        else:
            super().keyPressEvent(event)

    def _still_scene(self, inside: QRectF) -> scene.StillScene:
        size, ratio = inside.size().toSize(), self.devicePixelRatioF()
        part = self._drawing.scene(
            _IN_PLACE, self._theme, self._mode, self._marked, self._colours,
            moving=self.is_moving(),
        )  # fmt: skip

        def make() -> scene.StillScene:
            return scene.StillScene((), self._orbit, size, ratio, self._theme.panel, part)

        return self._still.made((part, self._orbit), (size, ratio), make)

    def _moved(self, orbit: scene.Orbit) -> None:
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
    """Return the corners (8, 3) of the bounding box of a part, mm."""
    low, high = model.box
    return np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )


_LARGEST_PX = 4000
"""Pictures with longer sides are read at reduced scale."""
_VIEW = (np.radians(35.0), np.radians(28.0))


class StepPicture(kit.PaintedWidget):
    """Shows where to touch; the feature is in the frame of the part, z upwards."""

    def __init__(self) -> None:
        super().__init__(tr("Picture of the step"), (240, 150), (120, 70))
        self._image: QImage | None = None
        self._nominal: NominalFeature | None = None
        self._shown: tuple[str, Path | None] = ("", None)

    def show_step(self, nominal: NominalFeature | None, folder: Path | None) -> None:
        """Show the step of a feature; ``folder`` has the plan's pictures."""
        file = None
        if nominal is not None and nominal.picture and folder is not None:
            file = folder / nominal.picture
        shown = ("" if nominal is None else nominal.name, file)
        if shown == self._shown and nominal == self._nominal:
            return
        self._shown, self._nominal = shown, nominal
        self._image = read_picture(file) if file is not None else None
        what = ""
        if nominal is not None:
            what = f"{kit.shape_word(nominal.shape)} {nominal.name}. {nominal.text}".strip()
        self.setAccessibleDescription(what)
        self.setToolTip(kit.literal(what))
        self.update()

    def has_picture(self) -> bool:
        """Return whether a file is shown instead of nominals; for tests."""
        return self._image is not None

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        frame = self._paint_panel(painter).adjusted(4, 4, -4, -4)
        if self._image is not None:
            size = self._image.size().scaled(
                frame.size().toSize(), Qt.AspectRatioMode.KeepAspectRatio
            )
            box = QRectF(QPointF(), size.toSizeF())
            box.moveCenter(frame.center())
            painter.drawImage(box, self._image)
            return
        if self._nominal is None:
            return
        items, reach = nominal_items(self._nominal, self._theme.accent, self._theme.text)
        start = scene.Orbit(np.zeros(3), *_VIEW, 50.0, np.array([0.0, 0.0, 1.0]))
        orbit = start.fitted(reach, frame.width(), frame.height(), margin=1.25)
        scene.paint_scene(painter, items, orbit, frame, kit.text_font(11), self._theme.panel)


def read_picture(path: Path) -> QImage | None:
    """Return a picture, or None if it cannot be read."""
    reader = QImageReader(str(path))
    reader.setAutoTransform(True)
    size = reader.size()
    if size.isValid() and max(size.width(), size.height()) > _LARGEST_PX:
        reader.setScaledSize(
            size.scaled(QSize(_LARGEST_PX, _LARGEST_PX), Qt.AspectRatioMode.KeepAspectRatio)
        )
    image = reader.read()
    return None if image.isNull() else image
