"""Drawing of a scene by QPainter, before, in or behind a part; labels placed reproducibly."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen, QPolygonF

from ocmm_core.geometry import Float
from ocmm_gui.rendering import Canvas
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
LEADER_PX = 14.0
"""A label farther from its place gets a leader line."""


def place_labels(
    anchors: Sequence[tuple[float, float]],
    sizes: Sequence[tuple[float, float]],
    bounds: QRectF,
    taken: Iterable[QRectF] = (),
    marks: Float | None = None,
) -> list[QRectF | None]:
    """Return the place of each label, px; None without room near its point.

    ``anchors``, ``sizes``: point, width and height of each label, px; earlier ones have priority;
    points outside ``bounds`` get none; ``taken``: label-free areas; ``marks`` (n, 2), px, are
    covered only without other room nearby.
    """
    walls = [_edges(rect) for rect in taken]
    placed: list[QRectF | None] = []
    for (x, y), (wide, high) in zip(anchors, sizes, strict=True):
        if not bounds.contains(QPointF(x, y)):
            placed.append(None)
            continue
        corners = _corners(x, y, wide, high)
        free = (
            (corners[:, 0] >= bounds.left())
            & (corners[:, 1] >= bounds.top())
            & (corners[:, 0] + wide <= bounds.right())
            & (corners[:, 1] + high <= bounds.bottom())
        )
        if walls:
            wall = np.array(walls)
            free &= ~(
                (corners[:, None, 0] < wall[:, 2])
                & (corners[:, None, 0] + wide > wall[:, 0])
                & (corners[:, None, 1] < wall[:, 3])
                & (corners[:, None, 1] + high > wall[:, 1])
            ).any(axis=1)
        if not free.any():
            placed.append(None)
            continue
        cost = _DETOURS + np.where(free, 0.0, np.inf)
        if marks is not None:
            cost += _covered(corners, wide, high, marks)
        left, top = corners[int(np.argmin(cost))].tolist()
        rect = QRectF(left, top, wide, high)
        walls.append(_edges(rect.adjusted(-_GAP_PX, -_GAP_PX, _GAP_PX, _GAP_PX)))
        placed.append(rect)
    return placed


def leader(anchor: QPointF, rect: QRectF) -> QPointF | None:
    """Return the end of a leader line at its label; None if adjacent."""
    end = QPointF(
        min(max(anchor.x(), rect.left()), rect.right()),
        min(max(anchor.y(), rect.top()), rect.bottom()),
    )
    away = float(np.hypot(end.x() - anchor.x(), end.y() - anchor.y()))
    return end if away > LEADER_PX else None


def _covered(corners: Float, wide: float, high: float, marks: Float) -> Float:
    """Return the number of marks covered by a label at each corner (n, 2)."""
    low = corners.min(axis=0) - _MARK_PX
    high_most = corners.max(axis=0) + np.array([wide, high]) + _MARK_PX
    near = marks[np.all((marks > low) & (marks < high_most), axis=1)]
    away = near - corners[:, None]
    inside = (away > -_MARK_PX) & (away < np.array([wide, high]) + _MARK_PX)
    covered: Float = inside.all(axis=2).sum(axis=1).astype(np.float64)
    return covered


def _edges(rect: QRectF) -> tuple[float, float, float, float]:
    return rect.left(), rect.top(), rect.right(), rect.bottom()


def _corners(x: float, y: float, wide: float, high: float) -> Float:
    """Return candidate upper left corners (n, 2) of a label, best first."""
    found = [
        (x + _NEAR_PX, y - high - 2.0),
        (x + _NEAR_PX, y + 4.0),
        (x - _NEAR_PX - wide, y - high - 2.0),
        (x - _NEAR_PX - wide, y + 4.0),
    ]
    # Upper right first, then around: the label touches the ring with its nearest point.
    angles = np.radians(45.0) + np.arange(_TURN) * 2.0 * np.pi / _TURN
    angles = angles[np.argsort(np.abs(np.arange(_TURN) - 0.25), kind="stable")]
    for ring in _RINGS_PX:
        for across, along in zip(np.cos(angles).tolist(), np.sin(angles).tolist(), strict=True):
            left = x + ring * across + (0.5 * across - 0.5) * wide
            top = y - ring * along - (0.5 * along + 0.5) * high
            found.append((left, top))
    return np.array(found)


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
