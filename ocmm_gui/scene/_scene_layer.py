"""Cached picture of the static part of a scene.

A probe moves thirty times a second over features that change only with points or view changes.
Lengthy painting is done in slices so that keys stay responsive; a hundred features are painted at
once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from operator import is_
from time import perf_counter

import numpy as np
from PySide6.QtCore import QObject, QPointF, QRectF, QSize, QTimer, Signal
from PySide6.QtGui import QColor, QFont, QImage, QPainter

from ocmm_core.geometry import Float
from ocmm_gui.rendering import Bundle, Canvas, RenderMode, blend_flat, draw_bundles
from ocmm_gui.scene._part_scene import PartScene
from ocmm_gui.scene._scene import Face, Item, Lines, Orbit
from ocmm_gui.scene._scene_painter import Depth, ScenePainter

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
class StillScene:
    """Immutable scene; compared by identity."""

    items: tuple[Item, ...]
    orbit: Orbit
    size: QSize
    ratio: float
    """`size`, `ratio`: picture, px of the window, and screen pixels per window pixel."""
    background: str
    part: PartScene | None = None
    """Part that may hide items; None for none."""
    below: StillScene | None = None
    """Scene of the same view and part whose lines and marks are painted below and cached: its items
    change less often. None for none."""

    def is_seen_as(self, other: StillScene) -> bool:
        """Return whether view, picture size and background are equal: labels depend on all."""
        same = self.size == other.size and self.ratio == other.ratio
        return same and self.orbit is other.orbit and self.background == other.background

    def has_part_of(self, other: StillScene) -> bool:
        """Return whether the part looks the same in both."""
        return self.part is not None and self.part is other.part and self.is_seen_as(other)


class SceneCache:
    """Returns the same scene for unchanged inputs, for comparison by identity."""

    def __init__(self) -> None:
        self.scene: StillScene | None = None
        self._made_of: tuple[object, ...] = ()

    def made(
        self, things: tuple[object, ...], values: tuple[object, ...], make: Callable[[], StillScene]
    ) -> StillScene:
        """Return the scene, remade if ``things`` (by identity) or ``values`` have changed."""
        made_of = (*things, *values)
        count = len(things)
        same = len(made_of) == len(self._made_of) and all(map(is_, things, self._made_of[:count]))
        if self.scene is None or not same or values != self._made_of[count:]:
            self.scene = make()
            self._made_of = made_of
        return self.scene


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
        self.canvas = canvas = canvases.take(
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
        """Paint part, faces, what lies below, and the items; yield False after each slice."""
        scene, canvas = self.scene, self.canvas
        if scene.part is None:
            self.image.fill(QColor(scene.background))
        elif not self._canvases.has_part(scene, canvas):
            part = scene.part.rendering(scene.orbit, scene.size, canvas, self._scale)
            while not part.go_on(self._until):
                yield False
            self._canvases.keep_part(scene, canvas)
        self._is_seen = True
        if scene.part is not None:
            px_mm = 2.0 * scene.orbit.radius / min(canvas.width, canvas.height)
            bias = _ITEM_PX * px_mm + scene.part.slack_mm
            self._depth = Depth(canvas, self._scale, bias)
        below = () if scene.below is None else scene.below.items
        faces = [item for item in (*below, *scene.items) if isinstance(item, Face)]
        if self._depth is None:
            yield from self._paint_marks(faces, self.image)
        else:
            self._blend(faces, self._depth)
        if scene.below is not None:
            yield from self._paint_below(scene.below)
        yield from self._paint_items(scene.items, canvas, self.image)

    def _paint_below(self, below: StillScene) -> Iterator[bool]:
        """Paint its lines and marks: the first time at once, then as a picture that is kept."""
        canvases, canvas = self._canvases, self.canvas
        lain = canvases.lain_over(below)
        if lain is None and (self.is_moving or not canvases.is_repeated(below)):
            yield from self._paint_items(below.items, canvas, self.image)
            return
        if lain is None:
            lain = canvases.new_over(canvas)
            image = _image_of(lain, self._scale, opaque=False)
            yield from self._paint_items(below.items, lain, image)
            canvases.keep_over(below, lain)
        painter = QPainter(self.image)
        painter.drawImage(QPointF(), _image_of(lain, self._scale, opaque=False))
        painter.end()

    def _paint_items(self, items: Sequence[Item], canvas: Canvas, image: QImage) -> Iterator[bool]:
        """Paint lines, then marks and labels."""
        items = [item for item in items if not isinstance(item, Face)]
        if self._depth is not None:
            self._draw_lines(items, canvas, self._depth)
            items = [item for item in items if not isinstance(item, Lines)]
        yield from self._paint_marks(items, image)

    def _paint_marks(self, items: Sequence[Item], image: QImage) -> Iterator[bool]:
        scene = self.scene
        left = ScenePainter(
            items, scene.orbit, self._box, self._font, scene.background,
            depth=self._depth, ghost=self._hidden(),
        )  # fmt: skip
        done = False
        while not done:
            painter = QPainter(image)
            done = left.paint(painter, self._until)
            painter.end()
            if not done or perf_counter() > self._until:
                yield False

    def _pixels(self, places: Float) -> Float:
        size = self.scene.size
        projection = self.scene.orbit.projection(size.width(), size.height())
        pixels: Float = projection.apply(places) * np.array([self._scale, self._scale, 1.0])
        return pixels

    def _blend(self, faces: Sequence[Face], depth: Depth) -> None:
        for face in faces:
            corners = self._pixels(face.corners)
            blend_flat(self.canvas, corners, face.colour, face.alpha / 255.0, depth.bias)

    def _draw_lines(self, items: Sequence[Item], canvas: Canvas, depth: Depth) -> None:
        bundles = [
            Bundle(self._pixels(item.segments), 0.5 * self._scale * item.width, item.colour)
            for item in items
            if isinstance(item, Lines) and len(item.segments)
        ]
        draw_bundles(canvas, bundles, depth.bias, self._hidden())

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
        self._below: StillScene | None = None

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

    def is_repeated(self, below: StillScene) -> bool:
        """Return whether the scene below was the same the last time."""
        before, self._below = self._below, below
        return before is below

    def lain_over(self, below: StillScene) -> Canvas | None:
        """Return the cached lines and marks of the scene below; None without."""
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
        """Cache lines and marks of the scene below."""
        self._over = (below, over)

    def take(self, width: int, height: int) -> Canvas:
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
