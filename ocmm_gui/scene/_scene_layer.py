"""Cached picture of the static part of a scene.

A probe moves thirty times a second over features that change only with points or view changes.
Lengthy painting is done in slices so that keys stay responsive; a hundred features are painted at
once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from PySide6.QtCore import QObject, QPointF, QRectF, QTimer, Signal
from PySide6.QtGui import QColor, QFont, QImage, QPainter

from ocmm_core.geometry import Float
from ocmm_gui.rendering import Canvas, RenderMode, Wires, blend_flat
from ocmm_gui.scene._part_scene import StillScene
from ocmm_gui.scene._scene import Dots, Face, Item, Lines
from ocmm_gui.scene._scene_painter import RIM_PX, Depth, ScenePainter

_SLICE_S = 0.012
"""One frame at a refresh rate of 80 Hz."""

_FRAME_S = 0.020
"""Slower pictures of a moving view are followed by ones of lower resolution."""
_KEPT_PIXELS = 4_500_000
"""The part in a larger picture is not cached: 12 bytes per pixel."""
_SHARES = (1.0, 0.7, 0.5)
"""Resolution steps per side."""
_ITEM_PX = 3.0
"""Depth tolerance at the rim for lines and marks on the part seen at 70 degrees."""
_THROUGH = 0.5
"""Opacity of items behind a transparent part."""


@dataclass(frozen=True, slots=True, eq=False)
class StillPicture:
    """A picture, and the depths of its part; None without a part."""

    image: QImage
    depth: Depth | None


class _Drawing:
    """A picture in progress, and the remaining work."""

    def __init__(
        self, scene: StillScene, font: QFont, canvases: _Canvases, share: float = 1.0
    ) -> None:
        self.scene = scene
        self._font, self._canvases = font, canvases
        self._box = QRectF(0.0, 0.0, scene.size.width(), scene.size.height())
        self._depth: Depth | None = None
        self._is_seen = False
        self._until = math.inf
        part = scene.part
        self._scale = scale = (
            scene.ratio if part is None else part.scale(scene.size, scene.ratio, share)
        )
        # Reuse memory of an earlier picture: allocating or copying megabytes would take
        # milliseconds.
        self.canvas = canvas = canvases.canvas(
            max(round(scene.size.width() * scale), 1), max(round(scene.size.height() * scale), 1)
        )
        self.image = _image_of(canvas, scale, opaque=part is not None)
        self._steps = self._paint()
        self.is_done = False

    @property
    def is_moving(self) -> bool:
        """Return whether another picture follows at once."""
        return self.scene.part is not None and self.scene.part.moving

    @property
    def seen(self) -> StillPicture:
        """Return the picture so far, without a half-painted part."""
        if not self._is_seen:
            nothing = QImage(1, 1, QImage.Format.Format_RGB32)
            nothing.fill(QColor(self.scene.background))
            return StillPicture(nothing, None)
        return StillPicture(self.image, self._depth)

    def go_on(self) -> None:
        """Paint for a slice of time; completely during motion."""
        self._until = math.inf if self.is_moving else perf_counter() + _SLICE_S
        self.is_done = next(self._steps, True)

    def _paint(self) -> Iterator[bool]:
        """Paint part, faces, lines, dots and other marks; yield False after each slice."""
        scene, canvas = self.scene, self.canvas
        if scene.part is None:
            canvas.clear()
            self.image.fill(QColor(scene.background))
        elif not self._canvases.has_part(scene, canvas):
            part = scene.part.rendering(scene.orbit, scene.size, canvas, self._scale)
            while not part.go_on(self._until):
                yield False
            self._canvases.keep_part(scene, canvas)
        self._is_seen = True
        bias = 0.0
        if scene.part is not None:
            px_mm = 2.0 * scene.orbit.radius / min(canvas.width, canvas.height)
            bias = _ITEM_PX * px_mm + scene.part.slack_mm
            self._depth = Depth(canvas, self._scale, bias)
        below = scene.below
        items = scene.items if below is None else (*below.items, *scene.items)
        self._blend([item for item in items if isinstance(item, Face)], bias)
        drawn = [self._canvases.wires(scene.items)]
        style = (self._pixels, self._scale, bias, self._hidden())
        if below is not None:
            drawn.insert(0, self._canvases.wires(below.items))
            self._lay_lines(below, drawn[0], bias)
        if perf_counter() > self._until:
            yield False
        drawn[-1].draw_lines(canvas, *style)
        for wires in drawn:
            wires.draw_dots(canvas, *style, RIM_PX)
        if rest := [item for item in items if not isinstance(item, Face | Lines | Dots)]:
            painter = QPainter(self.image)
            ScenePainter(
                rest, scene.orbit, self._box, self._font, scene.background,
                depth=self._depth, ghost=self._hidden(),
            ).paint(painter)  # fmt: skip
            painter.end()

    def _lay_lines(self, below: StillScene, wires: Wires, bias: float) -> None:
        """Paint the lines of the scene below from a picture that is kept."""
        lain = self._canvases.lain_over(below)
        if lain is None:
            lain = self._canvases.new_over(self.canvas)
            wires.draw_lines(lain, self._pixels, self._scale, bias, self._hidden())
            self._canvases.keep_over(below, lain)
        painter = QPainter(self.image)
        painter.drawImage(QPointF(), _image_of(lain, self._scale, opaque=False))
        painter.end()

    def _pixels(self, places: Float) -> Float:
        size = self.scene.size
        projection = self.scene.orbit.projection(size.width(), size.height())
        pixels: Float = projection.apply(places) * np.array([self._scale, self._scale, 1.0])
        return pixels

    def _blend(self, faces: Sequence[Face], bias: float) -> None:
        corners = [self._pixels(face.corners) for face in faces]
        # Translucent: the farthest first.
        heights = [float(places[:, 2].mean()) for places in corners]
        for k in np.argsort(heights, kind="stable"):
            blend_flat(self.canvas, corners[k], faces[k].colour, faces[k].alpha / 255.0, bias)

    def _hidden(self) -> float:
        """Return the opacity of items hidden by the part, 0 to 1."""
        part = self.scene.part
        return _THROUGH if part is not None and part.style.mode is RenderMode.TRANSPARENT else 0.0


class _Canvases:
    """Buffers for two pictures, shown and in progress, to avoid slow allocation."""

    def __init__(self) -> None:
        self._free: list[Canvas] = []
        self._part: tuple[StillScene, Canvas] | None = None
        self._over: tuple[StillScene, Canvas] | None = None
        self._wires: list[tuple[tuple[Item, ...], Wires]] = []

    def wires(self, items: tuple[Item, ...]) -> Wires:
        """Return lines and dots as arrays; those of the last two scenes are kept."""
        found = next((wires for known, wires in self._wires if known is items), None)
        if found is None:
            lines = [one for one in items if isinstance(one, Lines) and len(one.segments)]
            dots = [one for one in items if isinstance(one, Dots) and len(one.points)]
            found = Wires(
                [(one.segments, one.width, one.colour) for one in lines],
                [(one.points, one.size, one.colour, one.outline) for one in dots],
            )
        self._wires = [*(kept for kept in self._wires if kept[0] is not items), (items, found)][-2:]
        return found

    def keep_part(self, scene: StillScene, canvas: Canvas) -> None:
        """Cache a static part without the items drawn over it."""
        if scene.part is None or scene.part.moving:
            return
        if canvas.width * canvas.height > _KEPT_PIXELS:
            self._part = None
            return
        kept = self._part
        own = None if kept is None else kept[1]
        if own is None or (own.width, own.height) != (canvas.width, canvas.height):
            own = Canvas(canvas.width, canvas.height)
        own.copy_from(canvas)
        self._part = (scene, own)

    def has_part(self, scene: StillScene, canvas: Canvas) -> bool:
        """Copy the cached part into a canvas if it matches; return whether it does."""
        kept = self._part
        if kept is None or not scene.has_part_of(kept[0]):
            return False
        canvas.copy_from(kept[1])
        return True

    def lain_over(self, below: StillScene) -> Canvas | None:
        """Return the cached lines of the scene below; None without."""
        return None if self._over is None or self._over[0] is not below else self._over[1]

    def new_over(self, part: Canvas) -> Canvas:
        """Return a transparent picture with the depths of a part, in memory that is free."""
        over = None if self._over is None else self._over[1]
        self._over = None
        if over is None or (over.width, over.height) != (part.width, part.height):
            over = Canvas(part.width, part.height)
        over.copy_from(part)
        over.image.fill(0)
        return over

    def keep_over(self, below: StillScene, over: Canvas) -> None:
        """Cache the lines of the scene below."""
        self._over = (below, over)

    def canvas(self, width: int, height: int) -> Canvas:
        for canvas in self._free:
            if (canvas.width, canvas.height) == (width, height):
                self._free.remove(canvas)
                return canvas
        self._free.clear()
        return Canvas(width, height)

    def give_back(self, canvas: Canvas) -> None:
        if len(self._free) < 2:
            self._free.append(canvas)


def _image_of(canvas: Canvas, ratio: float, *, opaque: bool) -> QImage:
    formats = QImage.Format
    image = QImage(
        canvas.image.data, canvas.width, canvas.height, 4 * canvas.width,
        formats.Format_RGB32 if opaque else formats.Format_ARGB32_Premultiplied,
    )  # fmt: skip
    image.setDevicePixelRatio(ratio)
    return image


def painted_still(scene: StillScene, font: QFont) -> StillPicture:
    """Return the complete picture of a scene, for reports."""
    drawing = _Drawing(scene, font, _Canvases())
    while not drawing.is_done:
        drawing.go_on()
    return drawing.seen


class SceneLayer(QObject):
    """Cache of a static scene's picture."""

    changed = Signal()
    """More of a slow picture is ready."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._shown: _Drawing | None = None
        self._next: _Drawing | None = None
        self._canvases = _Canvases()
        self._share = 0
        self._timer = QTimer(self, singleShot=True)
        self._timer.timeout.connect(self._finish)

    def picture(self, scene: StillScene, font: QFont) -> StillPicture:
        """Return the picture of a scene; while painting, the previous or partial one."""
        before = self._shown
        if before is not None and before.scene is scene:
            self._drop_next()
            return before.seen
        drawing = self._next
        if drawing is None or drawing.scene is not scene:
            self._drop_next()
            drawing = self._next = _Drawing(scene, font, self._canvases, _SHARES[self._share])
            self._go_on()
        if drawing.is_done or before is None or not before.scene.is_seen_as(scene):
            return drawing.seen
        return before.seen

    def is_done(self) -> bool:
        """Return whether the last requested picture is shown."""
        return self._shown is not None and self._next is None

    def shows(self, scene: StillScene) -> bool:
        """Return whether a scene is shown completely."""
        return self._shown is not None and self._shown.scene is scene

    def canvas(self) -> Canvas | None:
        """Return the buffers of the shown picture, or None."""
        return None if self._shown is None else self._shown.canvas

    def _drop_next(self) -> None:
        if self._next is not None:
            self._canvases.give_back(self._next.canvas)
            self._next = None

    def _go_on(self) -> None:
        drawing = self._next
        if drawing is None:
            return
        began = perf_counter()
        drawing.go_on()
        # Keep for this motion; the next one may have more CPU time.
        slow = perf_counter() - began > _FRAME_S
        self._share = min(self._share + slow, len(_SHARES) - 1) if drawing.is_moving else 0
        if drawing.is_done:
            if self._shown is not None:
                self._canvases.give_back(self._shown.canvas)
            self._shown, self._next = drawing, None
        else:
            self._timer.start(0)

    def _finish(self) -> None:
        self._go_on()
        shown, drawing = self._shown, self._next
        # While incomplete only if shown: painting the window again takes longer than a slice.
        if drawing is None or shown is None or not shown.scene.is_seen_as(drawing.scene):
            self.changed.emit()
