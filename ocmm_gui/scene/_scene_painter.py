"""Drawing of a scene by QPainter, before, in or behind a part; labels placed reproducibly."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen, QPolygonF

from ocmm_core.geometry import Float, Int
from ocmm_core.rendering import Canvas
from ocmm_gui.scene._scene import Diamonds, Dots, Face, Item, Lines, Orbit, Tag

_NEAR_PX = 8.0
_RINGS_PX = (26.0, 46.0, 70.0, 100.0, 140.0, 190.0)
_TURN = 16
_GAP_PX = 1.0
"""Between two labels."""

_MARK_PX = 3.0
"""Extent of a mark around its place."""

_DETOUR = 0.4
"""Cost of one ring farther, relative to covering a mark."""

_DETOURS = _DETOUR * np.repeat(np.arange(1 + len(_RINGS_PX)), (4, *(_TURN for _ in _RINGS_PX)))
_CELL_PX = 2.0
"""Marks are counted in cells of this size: a sum over any area is four of their running sums."""
LEADER_PX = 14.0
"""A label farther from its place gets a leader line."""


class LabelPlaces:
    """Places of labels, px, one after the other: earlier ones have priority.

    ``taken``: label-free areas; ``marks`` (n, 2), px, are covered only without other room nearby.
    """

    def __init__(
        self, bounds: QRectF, taken: Iterable[QRectF] = (), marks: Float | None = None
    ) -> None:
        self._bounds = bounds
        self._walls = np.empty((16, 4))
        self._n_walls = 0
        for rect in taken:
            self._wall(rect)
        self._sums = None if marks is None else _sums_of(marks, bounds)

    def place(self, x: float, y: float, wide: float, high: float) -> QRectF | None:
        """Return the place of a label of a point; None without room near it, or out of bounds."""
        bounds = self._bounds
        if not bounds.contains(QPointF(x, y)):
            return None
        corners = np.array([x, y]) + _OFFSETS + _SHARES * np.array([wide, high])
        left, top = corners.T
        right, bottom = left + wide, top + high
        free = (left >= bounds.left()) & (top >= bounds.top())
        free &= (right <= bounds.right()) & (bottom <= bounds.bottom())
        wall = self._walls[: self._n_walls]
        near = (wall[:, 0] < right.max()) & (wall[:, 2] > left.min())
        near &= (wall[:, 1] < bottom.max()) & (wall[:, 3] > top.min())
        wall = wall[near]
        free &= ~(
            (left[:, None] < wall[:, 2])
            & (right[:, None] > wall[:, 0])
            & (top[:, None] < wall[:, 3])
            & (bottom[:, None] > wall[:, 1])
        ).any(axis=1)
        if not free.any():
            return None
        cost = np.where(free, _DETOURS, np.inf)
        if self._sums is not None:
            cost += self._covered(self._sums, left, top, right, bottom)
        best = int(np.argmin(cost))
        rect = QRectF(float(left[best]), float(top[best]), wide, high)
        self._wall(rect.adjusted(-_GAP_PX, -_GAP_PX, _GAP_PX, _GAP_PX))
        return rect

    def _wall(self, rect: QRectF) -> None:
        if self._n_walls == len(self._walls):
            self._walls = np.concatenate([self._walls, np.empty_like(self._walls)])
        self._walls[self._n_walls] = rect.left(), rect.top(), rect.right(), rect.bottom()
        self._n_walls += 1

    def _covered(self, sums: Int, left: Float, top: Float, right: Float, bottom: Float) -> Int:
        """Return the number of marks covered by a label at each corner."""
        x0, y0 = self._bounds.left(), self._bounds.top()
        rows, columns = np.array(sums.shape)[:, None] - 1
        low, high = np.clip(
            np.rint((np.stack([left - _MARK_PX, right + _MARK_PX]) - x0) / _CELL_PX), 0, columns
        ).astype(np.int64)
        up, down = np.clip(
            np.rint((np.stack([top - _MARK_PX, bottom + _MARK_PX]) - y0) / _CELL_PX), 0, rows
        ).astype(np.int64)
        covered: Int = sums[down, high] - sums[up, high] - sums[down, low] + sums[up, low]
        return covered


def _sums_of(marks: Float, bounds: QRectF) -> Int:
    """Return how many marks lie left of and above each corner of the cells."""
    shape = np.ceil(np.array([bounds.height(), bounds.width()]) / _CELL_PX).astype(int)
    cells = np.floor((marks - [bounds.left(), bounds.top()]) / _CELL_PX)[:, ::-1]
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)].astype(np.int64)
    counts = np.bincount(cells @ [shape[1], 1], minlength=int(shape.prod())).reshape(shape)
    return np.pad(counts, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)


def leader(anchor: QPointF, rect: QRectF) -> QPointF | None:
    """Return the end of a leader line at its label; None if adjacent."""
    end = QPointF(
        min(max(anchor.x(), rect.left()), rect.right()),
        min(max(anchor.y(), rect.top()), rect.bottom()),
    )
    away = float(np.hypot(end.x() - anchor.x(), end.y() - anchor.y()))
    return end if away > LEADER_PX else None


def _candidates() -> tuple[Float, Float]:
    """Return offsets, px, and shares of its size, by which a label lies off its point, best first.

    Both (n, 2), of upper left corners.
    """
    # Upper right first, then around: the label touches the ring with its nearest point.
    angles = np.radians(45.0) + np.arange(_TURN) * 2.0 * np.pi / _TURN
    angles = angles[np.argsort(np.abs(np.arange(_TURN) - 0.25), kind="stable")]
    around = np.stack([np.cos(angles), -np.sin(angles)], axis=1)
    near = np.array([[_NEAR_PX, -2.0], [_NEAR_PX, 4.0], [-_NEAR_PX, -2.0], [-_NEAR_PX, 4.0]])
    beside = np.array([[0.0, -1.0], [0.0, 0.0], [-1.0, -1.0], [-1.0, 0.0]])
    return (
        np.concatenate([near, *(ring * around for ring in _RINGS_PX)]),
        np.concatenate([beside, *(0.5 * around - 0.5 for _ in _RINGS_PX)]),
    )


_OFFSETS, _SHARES = _candidates()

_PIECE_PX = 5.0
_MOST_PIECES = 400
"""Visibility of lines is tested in pieces, at most this many."""


@dataclass(frozen=True, slots=True, eq=False)
class Depth:
    """Part that may hide items."""

    canvas: Canvas
    scale: float
    """Its pixels per scene pixel."""
    bias: float
    """mm: depth below the surface that still counts as on it."""

    def in_sight(self, places: Float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which places (n, 3), px of the scene and mm, are not hidden."""
        return self.canvas.in_sight(places * np.array([self.scale, self.scale, 1.0]), self.bias)


def paint_scene(
    painter: QPainter, items: Iterable[Item], orbit: Orbit, box: QRectF, font: QFont, halo: str
) -> None:
    """Paint items at once; see `ScenePainter`."""
    ScenePainter(items, orbit, box, font, halo).paint(painter)


class ScenePainter:
    """Paint faces, then lines, dots and labels, at once or in slices.

    Faces and dots are painted from far to near. Labels do not overlap, and cover marks only without
    other room nearby; distant ones have a leader line. Earlier ones have priority. ``taken``:
    label-free areas, px from the upper left corner of ``box``; ``depth``: part that hides lines and
    dots, or None; ``ghost``: opacity of hidden items, 0 to 1.
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
        """Painted labels with their places."""
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
        self._anchors: Float = np.empty((0, 2))
        self._labels: LabelPlaces | None = None
        self._rects: list[QRectF | None] = []

    def paint(self, painter: QPainter, until_s: float = math.inf) -> bool:
        """Paint until a `time.perf_counter` time, one item at least; return whether finished."""
        painter.save()
        painter.setClipRect(self._box)
        painter.translate(self._box.topLeft())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        while self._left:
            self._paint(painter, self._left.popleft())
            if perf_counter() > until_s:
                break
        if not self._left and self._tags and self._place_tags(until_s):
            self._paint_tags(painter)
        painter.restore()
        return not self._left and not self._tags

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
        # Edges are drawn as lines: antialiasing large translucent areas would only cost time.
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

    def _place_tags(self, until_s: float) -> bool:
        """Place labels until a time, one at least; return whether all have been."""
        metrics = QFontMetricsF(self._font)
        if self._labels is None:
            bounds = QRectF(0.0, 0.0, self._box.width(), self._box.height())
            self._anchors = self._picture.apply(np.stack([tag.point for tag in self._tags]))[:, :2]
            marks = np.concatenate([self._anchors, *self._marks])
            self._labels = LabelPlaces(bounds, self._taken, marks)
        while len(self._rects) < len(self._tags):
            number = len(self._rects)
            wide = metrics.horizontalAdvance(self._tags[number].text) + 8.0
            x, y = self._anchors[number].tolist()
            self._rects.append(self._labels.place(x, y, wide, metrics.height()))
            if perf_counter() > until_s:
                break
        return len(self._rects) == len(self._tags)

    def _paint_tags(self, painter: QPainter) -> None:
        painter.setFont(self._font)
        behind = QColor(self._halo)
        behind.setAlpha(190)
        shown = [
            (tag, QPointF(*anchor), rect)
            for tag, anchor, rect in zip(
                self._tags, self._anchors.tolist(), self._rects, strict=True
            )
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
    """Return visible and hidden sections of lines (n, 2, 3), px."""
    start, run = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.hypot(run[:, 0], run[:, 1])
    limit = min(_MOST_PIECES, int((box.width() + box.height()) / _PIECE_PX) + 1)
    pieces = np.clip(np.ceil(length / _PIECE_PX), 1, limit).astype(np.int64)
    line = np.repeat(np.arange(len(ends)), pieces)
    first = np.cumsum(pieces) - pieces
    number = np.arange(len(line)) - first[line]
    count = pieces[line]
    seen = depth.in_sight(start[line] + ((number + 0.5) / count)[:, None] * run[line])
    # A section starts with the line or at a change of visibility.
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
    # The halo separates the mark from lines and dots of the same colour.
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
