from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QImage, QImageReader, QPaintEvent

from ocmm_core.features.shapes import NominalFeature
from ocmm_gui.kit import Painted, literal, shape_word, text_font, tr
from ocmm_gui.scene import Orbit, paint_scene
from ocmm_gui.views._nominal_items import nominal_items

_LARGEST_PX = 4000
"""Pictures with longer sides are read at reduced scale."""
_VIEW = (np.radians(35.0), np.radians(28.0))


class StepPicture(Painted):
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
            what = f"{shape_word(nominal.shape)} {nominal.name}. {nominal.text}".strip()
        self.setAccessibleDescription(what)
        self.setToolTip(literal(what))
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
        start = Orbit(np.zeros(3), *_VIEW, 50.0, np.array([0.0, 0.0, 1.0]))
        orbit = start.fitted(reach, frame.width(), frame.height(), margin=1.25)
        paint_scene(painter, items, orbit, frame, text_font(11), self._theme.panel)


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
