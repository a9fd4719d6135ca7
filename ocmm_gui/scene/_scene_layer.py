"""Cached picture of the static part of a scene.

A probe moves thirty times a second over features that change only with points or view changes.
Lengthy painting is done in slices so that keys stay responsive; a hundred features are painted at
once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import is_
from time import perf_counter

import numpy as np
from PySide6.QtCore import QObject, QRectF, QSize, QTimer, Signal
from PySide6.QtGui import QColor, QFont, QImage, QPainter

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
    """Scene of the same view and part that is painted first and cached: its items change less
    often. None for none."""

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
        self._has_part = False
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
        self.image = QImage(
            canvas.image.data, canvas.width, canvas.height, 4 * canvas.width,
            QImage.Format.Format_ARGB32_Premultiplied if part is None
            else QImage.Format.Format_RGB32,
        )  # fmt: skip
        self.image.setDevicePixelRatio(scale)
        self._steps = self._paint()
        self.is_done = False

    @property
    def is_moving(self) -> bool:
        """Return whether another picture follows at once."""
        return self.scene.part is not None and self.scene.part.moving

    @property
    def seen(self) -> StillPicture:
        """Return the picture so far, without a half-painted part."""
        if not self._has_part:
            nothing = QImage(1, 1, QImage.Format.Format_RGB32)
            nothing.fill(QColor(self.scene.background))
            return StillPicture(nothing, None)
        return StillPicture(self.image, self._depth)

    def go_on(self) -> None:
        """Paint for a slice of time; completely during motion."""
        self._until = math.inf if self.is_moving else perf_counter() + _SLICE_S
        self.is_done = next(self._steps, True)

    def _paint(self) -> Iterator[bool]:
        """Paint what lies below unless cached, then the items; yield False after each slice."""
        scene, canvases, canvas = self.scene, self._canvases, self.canvas
        below = scene.below
        if below is None or not canvases.has_scene(below, canvas):
            yield from self._paint_part(scene if below is None else below)
            if below is not None:
                yield from self._paint_items(below)
                canvases.keep_scene(below, canvas)
        self._show_part()
        yield from self._paint_items(scene)

    def _paint_part(self, scene: StillScene) -> Iterator[bool]:
        canvas = self.canvas
        if scene.part is None:
            self.image.fill(QColor(scene.background))
        elif not self._canvases.has_part(scene, canvas):
            part = scene.part.rendering(scene.orbit, scene.size, canvas, self._scale)
            while not part.go_on(self._until):
                yield False
            self._canvases.keep_part(scene, canvas)
        self._show_part()

    def _show_part(self) -> None:
        part = self.scene.part
        self._has_part = True
        if part is not None:
            px_mm = 2.0 * self.scene.orbit.radius / min(self.canvas.width, self.canvas.height)
            self._depth = Depth(self.canvas, self._scale, _ITEM_PX * px_mm + part.slack_mm)

    def _paint_items(self, scene: StillScene) -> Iterator[bool]:
        items = scene.items
        if self._depth is not None:
            self._lay_on_part(scene, self._depth)
            items = tuple(item for item in items if not isinstance(item, Face | Lines))
        left = ScenePainter(
            items, scene.orbit, self._box, self._font, scene.background,
            depth=self._depth, ghost=self._hidden(),
        )  # fmt: skip
        while True:
            painter = QPainter(self.image)
            done = left.paint(painter, self._until)
            painter.end()
            if done:
                return
            yield False

    def _lay_on_part(self, scene: StillScene, depth: Depth) -> None:
        projection = scene.orbit.projection(scene.size.width(), scene.size.height())
        pixels = np.array([self._scale, self._scale, 1.0])
        bundles = []
        for item in scene.items:
            if isinstance(item, Face):
                corners = projection.apply(item.corners) * pixels
                blend_flat(self.canvas, corners, item.colour, item.alpha / 255.0, depth.bias)
            elif isinstance(item, Lines) and len(item.segments):
                ends = projection.apply(item.segments) * pixels
                bundles.append(Bundle(ends, 0.5 * self._scale * item.width, item.colour))
        draw_bundles(self.canvas, bundles, depth.bias, self._hidden())

    def _hidden(self) -> float:
        """Return the opacity of items hidden by the part, 0 to 1."""
        part = self.scene.part
        return _THROUGH if part is not None and part.style.mode is RenderMode.TRANSPARENT else 0.0


class _Canvases:
    """Buffers for two pictures, shown and in progress, to avoid slow allocation."""

    def __init__(self) -> None:
        self._free: list[Canvas] = []
        self._part: tuple[StillScene, Canvas] | None = None
        self._whole: tuple[StillScene, Canvas] | None = None

    def keep_part(self, scene: StillScene, canvas: Canvas) -> None:
        """Cache a static part without the items drawn over it."""
        self._part = _kept(scene, canvas, self._part)

    def has_part(self, scene: StillScene, canvas: Canvas) -> bool:
        """Copy the cached part into a canvas if it matches; return whether it does."""
        kept = self._part
        if kept is None or not scene.has_part_of(kept[0]):
            return False
        canvas.copy_from(kept[1])
        return True

    def keep_scene(self, scene: StillScene, canvas: Canvas) -> None:
        """Cache a scene with its items."""
        self._whole = _kept(scene, canvas, self._whole)

    def has_scene(self, scene: StillScene, canvas: Canvas) -> bool:
        """Copy a cached scene into a canvas; return whether it is the cached one."""
        kept = self._whole
        if kept is None or kept[0] is not scene:
            return False
        canvas.copy_from(kept[1])
        return True

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


def _kept(
    scene: StillScene, canvas: Canvas, before: tuple[StillScene, Canvas] | None
) -> tuple[StillScene, Canvas] | None:
    """Return a copy of a picture to be cached, in the memory of ``before`` if it fits."""
    if scene.part is not None and scene.part.moving:
        return before
    if canvas.width * canvas.height > _KEPT_PIXELS:
        return None
    own = None if before is None else before[1]
    if own is None or (own.width, own.height) != (canvas.width, canvas.height):
        own = Canvas(canvas.width, canvas.height)
    own.copy_from(canvas)
    return scene, own


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
