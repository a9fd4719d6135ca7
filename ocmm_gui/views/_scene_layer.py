"""What of a scene stands still, painted once and kept as a picture.

A probe moves thirty times a second over features that change with every point, or when somebody
turns the view. What takes long to paint is painted a little at a time, so that no key waits for
it; nobody notices that with a hundred features, which are painted at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

from PySide6.QtCore import QObject, QRectF, QSize, QTimer, Signal
from PySide6.QtGui import QColor, QFont, QImage, QPainter

from ocmm_gui.views._scene import Item, Orbit, ScenePainter

_SLICE_S = 0.012
"""As long as a frame of a screen that is refreshed 80 times a second."""


@dataclass(frozen=True, slots=True, eq=False)
class StillScene:
    """What is painted: nobody changes it, another scene is another object.

    Attributes
    ----------
    items, orbit
        What, and from where.
    size, ratio
        Of the picture, px of the window, and how many of the screen each of them has.
    background
        Its colour, which is also behind words.
    """

    items: tuple[Item, ...]
    orbit: Orbit
    size: QSize
    ratio: float
    background: str

    def is_seen_as(self, other: StillScene) -> bool:
        """Return whether the other scene is seen from the same place, in a picture of this size."""
        return self.orbit is other.orbit and self.size == other.size and self.ratio == other.ratio


class _Drawing:
    """A picture, and what of its scene is left to paint."""

    def __init__(self, scene: StillScene, font: QFont) -> None:
        self.scene = scene
        self.image = QImage(scene.size * scene.ratio, QImage.Format.Format_ARGB32_Premultiplied)
        self.image.setDevicePixelRatio(scene.ratio)
        self.image.fill(QColor(scene.background))
        box = QRectF(0.0, 0.0, scene.size.width(), scene.size.height())
        self.left = ScenePainter(scene.items, scene.orbit, box, font, scene.background)
        self.is_done = False

    @property
    def seen(self) -> tuple[QImage, list[QRectF]]:
        """Return the picture as far as it is, and where words stand in it."""
        return self.image, self.left.taken

    def go_on(self) -> None:
        """Paint for a slice of time."""
        painter = QPainter(self.image)
        self.is_done = self.left.paint(painter, perf_counter() + _SLICE_S)
        painter.end()


class SceneLayer(QObject):
    """Keep the picture of a still scene.

    Parameters
    ----------
    parent
        Whose scene it is.
    """

    changed = Signal()
    """There is more to show of a picture that takes longer."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._shown: _Drawing | None = None
        self._next: _Drawing | None = None
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._finish)

    def picture(self, scene: StillScene, font: QFont) -> tuple[QImage, list[QRectF]]:
        """Return the picture of a scene and where words stand in it, px.

        While a new one is painted it is that of the scene before, if that was seen from the same
        place, else as much as is painted.
        """
        before = self._shown
        if before is not None and before.scene is scene:
            self._next = None
            return before.seen
        drawing = self._next
        if drawing is None or drawing.scene is not scene:
            drawing = self._next = _Drawing(scene, font)
            self._go_on()
        if drawing.is_done or before is None or not before.scene.is_seen_as(scene):
            return drawing.seen
        return before.seen

    def _go_on(self) -> None:
        """Paint a little more; what is done is shown."""
        drawing = self._next
        if drawing is None:
            return
        drawing.go_on()
        if drawing.is_done:
            self._shown, self._next = drawing, None
        else:
            self._timer.start(0)

    def _finish(self) -> None:
        self._go_on()
        # Also while it grows: there may be nothing else to look at.
        self.changed.emit()
