"""QPainter draws a scene, before, in or behind a part that was painted already."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen, QPolygonF

from ocmm_core.geometry import Float
from ocmm_core.rendering import Canvas
from ocmm_gui.scene._labels import leader, place_labels
from ocmm_gui.scene._scene import Diamonds, Dots, Face, Item, Lines, Orbit, Tag

_PIECE_PX = 5.0
_MOST_PIECES = 400
"""A line is seen or hidden by pieces of this length, but is not cut into more of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Depth:
    """The part that may hide what is drawn."""

    canvas: Canvas
    """What was painted."""
    scale: float
    """Its pixels for each of the scene's."""
    bias: float
    """mm: what lies so deep behind the surface still counts as on it."""

    def in_sight(self, places: Float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which places (n, 3), px of the scene and mm, the part does not hide."""
        return self.canvas.in_sight(places * np.array([self.scale, self.scale, 1.0]), self.bias)


def paint_scene(
    painter: QPainter, items: Iterable[Item], orbit: Orbit, box: QRectF, font: QFont, halo: str
) -> None:
    """Paint items at once; see `ScenePainter`."""
    ScenePainter(items, orbit, box, font, halo).paint(painter)


class ScenePainter:
    """Paint faces, then lines, then dots, then words, at once or a few at a time.

    Faces and dots are painted from far to near. A word stands where it covers no other one, and no
    mark if there is room nearby; it has a line to its place where that is not beside it. The first
    ones have the right of way.

    Parameters
    ----------
    items
        What is painted.
    orbit
        From where.
    box
        Where, px.
    font, halo
        Of the words, and the colour behind them.
    taken
        Where no words may stand, px from the upper left corner of ``box``.
    depth
        What hides lines and dots; None hides nothing.
    ghost
        How much of the colour is left of what is hidden, 0 to 1.

    Attributes
    ----------
    words
        Where the words that were painted stand, with what they say.
    """

    def __init__(
        self,
        items: Iterable[Item],
        orbit: Orbit,
        box: QRectF,
        font: QFont,
        halo: str,
        *,
        taken: Iterable[QRectF] = (),
        depth: Depth | None = None,
        ghost: float = 0.0,
    ) -> None:
        self._box, self._font, self._halo = box, font, halo
        self._picture = orbit.projection(box.width(), box.height())
        self._taken = tuple(taken)
        self._depth, self._ghost = depth, ghost
        self._marks: list[Float] = []
        self.words: list[tuple[str, QRectF]] = []
        items = tuple(items)
        faces = [item for item in items if isinstance(item, Face)]
        heights = [float(self._picture.apply(item.corners)[:, 2].mean()) for item in faces]
        marks = [item for item in items if isinstance(item, Dots | Diamonds)]
        self._left: deque[Item] = deque(
            (
                *(faces[k] for k in np.argsort(heights, kind="stable")),
                *(item for item in items if isinstance(item, Lines) and len(item.segments)),
                *(item for item in marks if len(item.points)),
            )
        )
        self._tags = [item for item in items if isinstance(item, Tag)]

    def paint(self, painter: QPainter, until_s: float = math.inf) -> bool:
        """Paint what is left, until a time of `time.perf_counter`; return whether all is painted.

        One item at least is painted.
        """
        painter.save()
        painter.setClipRect(self._box)
        painter.translate(self._box.topLeft())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        while self._left:
            self._paint(painter, self._left.popleft())
            if perf_counter() > until_s:
                break
        if not self._left and self._tags:
            self._paint_tags(painter)
        painter.restore()
        return not self._left

    def _paint(self, painter: QPainter, item: Item) -> None:
        match item:
            case Face():
                self._paint_face(painter, item)
            case Lines():
                ends = self._picture.apply(item.segments)
                painter.setPen(QPen(QColor(item.colour), item.width, c=Qt.PenCapStyle.RoundCap))
                if self._depth is None:
                    _draw_lines(painter, ends)
                    return
                shown, hidden = _cut(ends, self._depth, self._box)
                if self._ghost > 0.0:
                    painter.setOpacity(self._ghost)
                    _draw_lines(painter, hidden)
                    painter.setOpacity(1.0)
                _draw_lines(painter, shown)
            case Dots():
                self._paint_dots(painter, item, self._picture.apply(item.points))
            case Diamonds():
                places = self._picture.apply(item.points)
                self._marks.append(places[:, :2])
                _paint_diamonds(painter, item, places, self._halo)

    def _paint_face(self, painter: QPainter, face: Face) -> None:
        colour = QColor(face.colour)
        colour.setAlpha(face.alpha)
        # Their edges are drawn as lines: smoothing large translucent areas would only cost time.
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        corners = self._picture.apply(face.corners)
        painter.drawPolygon(QPolygonF([QPointF(x, y) for x, y, _ in corners.tolist()]))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)

    def _paint_dots(self, painter: QPainter, item: Dots, places: Float) -> None:
        seen = np.ones(len(places), bool) if self._depth is None else self._depth.in_sight(places)
        outline = QPen(QColor(item.outline), 1.2) if item.outline else QPen(Qt.PenStyle.NoPen)
        painter.setPen(outline)
        painter.setBrush(QColor(item.colour))
        radius = 0.5 * item.size
        self._marks.append(places[seen, :2])
        for k in np.argsort(places[:, 2]).tolist():
            if not seen[k]:
                if self._ghost <= 0.0:
                    continue
                painter.setOpacity(self._ghost)
            painter.drawEllipse(QPointF(*places[k, :2].tolist()), radius, radius)
            painter.setOpacity(1.0)

    def _paint_tags(self, painter: QPainter) -> None:
        painter.setFont(self._font)
        metrics = QFontMetricsF(self._font)
        places = self._picture.apply(np.stack([tag.point for tag in self._tags]))
        sizes = [(metrics.horizontalAdvance(t.text) + 8.0, metrics.height()) for t in self._tags]
        bounds = QRectF(0.0, 0.0, self._box.width(), self._box.height())
        anchors = [(x, y) for x, y, _ in places.tolist()]
        marks = np.concatenate([places[:, :2], *self._marks])
        rects = place_labels(anchors, sizes, bounds, self._taken, marks)
        behind = QColor(self._halo)
        behind.setAlpha(190)
        shown = [
            (tag, QPointF(*anchor), rect)
            for tag, anchor, rect in zip(self._tags, anchors, rects, strict=True)
            if rect is not None
        ]
        for tag, anchor, rect in shown:
            if (end := leader(anchor, rect)) is not None:
                painter.setPen(QPen(QColor(tag.colour), 1.0))
                painter.drawLine(anchor, end)
        for tag, _, rect in shown:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(behind)
            painter.drawRoundedRect(rect, 3, 3)
            painter.setPen(QColor(tag.colour))
            painter.drawText(rect, Qt.AlignmentFlag.AlignCenter, tag.text)
            self.words.append((tag.text, rect))
        self._tags = []


def _draw_lines(painter: QPainter, ends: Float) -> None:
    painter.drawLines([QLineF(*end) for end in ends[..., :2].reshape(-1, 4).tolist()])


def _cut(ends: Float, depth: Depth, box: QRectF) -> tuple[Float, Float]:
    """Return the stretches of lines (n, 2, 3), px, that are in sight and those that are hidden."""
    start, run = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.hypot(run[:, 0], run[:, 1])
    limit = min(_MOST_PIECES, int((box.width() + box.height()) / _PIECE_PX) + 1)
    pieces = np.clip(np.ceil(length / _PIECE_PX), 1, limit).astype(np.int64)
    line = np.repeat(np.arange(len(ends)), pieces)
    first = np.cumsum(pieces) - pieces
    number = np.arange(len(line)) - first[line]
    count = pieces[line]
    seen = depth.in_sight(start[line] + ((number + 0.5) / count)[:, None] * run[line])
    # A stretch begins where the line does or where it comes into sight or leaves it.
    begins = np.ones(len(line), dtype=bool)
    begins[1:] = (line[1:] != line[:-1]) | (seen[1:] != seen[:-1])
    at = np.flatnonzero(begins)
    after = np.append(at[1:], len(line)) - 1
    low = (number[at] / count[at])[:, None]
    high = ((number[after] + 1) / count[at])[:, None]
    of = line[at]
    stretches = np.stack([start[of] + low * run[of], start[of] + high * run[of]], axis=1)
    return stretches[seen[at]], stretches[~seen[at]]


def _paint_diamonds(painter: QPainter, item: Diamonds, places: Float, halo: str) -> None:
    half = 0.5 * item.size
    painter.setBrush(Qt.BrushStyle.NoBrush)
    # The halo keeps the mark in sight on lines and dots of its own colour.
    for pen in (QPen(QColor(halo), 6.0), QPen(QColor(item.colour), 2.6)):
        painter.setPen(pen)
        for x, y, _ in places.tolist():
            painter.drawPolygon(
                QPolygonF(
                    [
                        QPointF(x, y - half), QPointF(x + half, y),
                        QPointF(x, y + half), QPointF(x - half, y),
                    ]
                )
            )  # fmt: skip
