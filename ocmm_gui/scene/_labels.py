"""Places of labels in a picture: apart, near their points, the same again for the same scene."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPixmap

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_gui.scene._scene import Orbit, Tag

_NEAR_PX = 8.0
_RINGS_PX = (26.0, 46.0, 70.0, 100.0, 140.0, 190.0)
_TURN = 16
_GAP_PX = 1.0
"""Between two labels."""

_MARK_PX = 3.0
"""Extent of a mark around its place."""

_DETOUR = 0.4
"""Cost of one ring farther, relative to covering a mark."""

_DETOURS: Float = np.repeat(
    _DETOUR * np.arange(1.0 + len(_RINGS_PX)), (4, *(_TURN for _ in _RINGS_PX))
)
_CELL_PX = 2.0
"""Marks are counted in cells of this size: a sum over any area is four of their running sums."""
LEADER_PX = 14.0
"""A label farther from its place gets a leader line."""


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


@compiled()
def place_among(
    x: float, y: float, wide: float, high: float, offsets: Float, shares: Float, detours: Float,
    bounds: Float, walls: Float, sums: Int, cell: float, mark: float,
) -> int:  # fmt: skip
    """Return the candidate of the least cost for a label of a point, or -1.

    `offsets`, `shares`, `detours`: (k, 2) px, (k, 2) of the size, and (k,) costs of the candidates.
    `bounds`: (4,) edges, px, to stay inside. `walls`: (m, 4) edges of taken areas. `sums`: marks
    left of and above each corner of cells of ``cell`` px; a covered one costs one, if nearer than
    ``mark`` px.
    """
    best, least = -1, np.inf
    rows, columns = sums.shape[0] - 1, sums.shape[1] - 1
    for k in range(len(detours)):
        if detours[k] >= least:
            continue
        left = x + offsets[k, 0] + shares[k, 0] * wide
        top = y + offsets[k, 1] + shares[k, 1] * high
        right, bottom = left + wide, top + high
        if left < bounds[0] or top < bounds[1] or right > bounds[2] or bottom > bounds[3]:
            continue
        free = True
        for m in range(len(walls)):
            if (left < walls[m, 2] and right > walls[m, 0] and top < walls[m, 3]
                    and bottom > walls[m, 1]):  # fmt: skip
                free = False
                break
        if not free:
            continue
        x0 = int(min(max(np.rint((left - mark - bounds[0]) / cell), 0), columns))
        x1 = int(min(max(np.rint((right + mark - bounds[0]) / cell), 0), columns))
        y0 = int(min(max(np.rint((top - mark - bounds[1]) / cell), 0), rows))
        y1 = int(min(max(np.rint((bottom + mark - bounds[1]) / cell), 0), rows))
        cost = detours[k] + (sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0])
        if cost < least:
            best, least = k, cost
    return best


@compiled()
def count_marks(marks: Float, left: float, top: float, cell: float, sums: Int) -> None:
    """Fill ``sums`` (rows + 1, columns + 1) with the marks (n, 2), px, left of and above."""
    for k in range(len(marks)):
        column = np.floor((marks[k, 0] - left) / cell)
        row = np.floor((marks[k, 1] - top) / cell)
        if 0 <= column < sums.shape[1] - 1 and 0 <= row < sums.shape[0] - 1:
            sums[int(row) + 1, int(column) + 1] += 1
    for row in range(1, sums.shape[0]):
        line = 0
        for column in range(1, sums.shape[1]):
            line += sums[row, column]
            sums[row, column] = sums[row - 1, column] + line


class LabelPlaces:
    """Places of labels, px, one after the other: earlier ones have priority.

    ``taken``: label-free areas; ``marks`` (n, 2), px, are covered only without other room nearby.
    """

    def __init__(
        self, bounds: QRectF, taken: Iterable[QRectF] = (), marks: Float | None = None
    ) -> None:
        self._bounds = bounds
        self._edges = np.array(bounds.getCoords())
        self._walls = np.empty((16, 4))
        self._n_walls = 0
        for rect in taken:
            self._wall(rect)
        self._marks = marks
        self._sums: Int | None = None

    def place(self, x: float, y: float, wide: float, high: float) -> QRectF | None:
        """Return the place of a label of a point; None without room near it, or out of bounds."""
        bounds = self._bounds
        if not bounds.contains(QPointF(x, y)):
            return None
        best = place_among(
            x, y, wide, high, _OFFSETS, _SHARES, _DETOURS, self._edges,
            self._walls[: self._n_walls], self._marks_in(bounds), _CELL_PX, _MARK_PX,
        )  # fmt: skip
        if best < 0:
            return None
        left, top = np.array([x, y]) + _OFFSETS[best] + _SHARES[best] * np.array([wide, high])
        rect = QRectF(float(left), float(top), wide, high)
        self._wall(rect.adjusted(-_GAP_PX, -_GAP_PX, _GAP_PX, _GAP_PX))
        return rect

    def keep(self, rects: Float) -> NDArray[np.bool_]:
        """Keep labels (n, 4), edges in px, where they are; return which: those in no one's way."""
        walls = self._walls[: self._n_walls]
        left, top, right, bottom = rects.T
        free = _are_apart(left, top, right, bottom, walls)
        gap = np.array([-_GAP_PX, -_GAP_PX, _GAP_PX, _GAP_PX])
        self._walls = np.concatenate([walls, rects[free] + gap, np.empty((16, 4))])
        self._n_walls += int(free.sum())
        return free

    def _wall(self, rect: QRectF) -> None:
        if self._n_walls == len(self._walls):
            self._walls = np.concatenate([self._walls, np.empty_like(self._walls)])
        self._walls[self._n_walls] = rect.left(), rect.top(), rect.right(), rect.bottom()
        self._n_walls += 1

    def _marks_in(self, bounds: QRectF) -> Int:
        """Return how many marks lie left of and above each corner of the cells."""
        if self._sums is None:
            marks = self._marks
            shape = np.ceil(np.array([bounds.height(), bounds.width()]) / _CELL_PX).astype(int) + 1
            self._sums = np.zeros(shape if marks is not None else (1, 1), dtype=np.int64)
            if marks is not None:
                count_marks(
                    np.ascontiguousarray(marks), bounds.left(), bounds.top(), _CELL_PX, self._sums
                )
        return self._sums


def _are_apart(
    left: Float, top: Float, right: Float, bottom: Float, walls: Float
) -> NDArray[np.bool_]:
    """Return which rectangles (n,) meet none of the walls (m, 4), px."""
    over = (left[:, None] < walls[:, 2]) & (right[:, None] > walls[:, 0])
    over &= (top[:, None] < walls[:, 3]) & (bottom[:, None] > walls[:, 1])
    return np.array(~over.any(axis=1))


_MOST_STANDING = 150
"""Standing labels in a picture: more cannot be read."""


class StandingLabels:
    """Labels that stay in place until the view changes; only covered ones are placed anew."""

    def __init__(self, tags: Sequence[Tag] = ()) -> None:
        self.tags = tuple(tags)
        """In the order of their priority."""
        self._placed_tags: tuple[Tag, ...] | None = None
        self._orbit: Orbit | None = None
        self._size = QSizeF()
        self._shown: list[PlacedLabel] = []
        self._edges: Float = np.empty((0, 4))
        self._pictures: dict[int, tuple[PlacedLabel, tuple[QPointF, QPixmap] | None]] = {}
        self._look: tuple[object, ...] = ()

    def placed(
        self, places: LabelPlaces, anchors: Float, metrics: QFontMetricsF, orbit: Orbit, box: QRectF
    ) -> list[PlacedLabel]:
        """Return the labels with their places; ``anchors``: (n, 2), px, in this view."""
        same = orbit is self._orbit and box.size() == self._size
        if not same or self.tags is not self._placed_tags:
            known = {id(one.tag): one for one in self._shown} if same else {}
            self._orbit, self._size, self._placed_tags = orbit, box.size(), self.tags
            self._place_all(places, anchors, metrics, known)
            return self._shown
        kept = places.keep(self._edges)
        found = [one for one, stays in zip(self._shown, kept, strict=True) if stays]
        for one in (one for one, stays in zip(self._shown, kept, strict=True) if not stays):
            if (moved := place_tag(one.tag, one.anchor, places, metrics)) is not None:
                found.append(moved)
        return found

    def _place_all(
        self, places: LabelPlaces, anchors: Float, metrics: QFontMetricsF,
        known: dict[int, PlacedLabel],
    ) -> None:  # fmt: skip
        """Place new labels of higher priority, those that have a place, then the others."""
        self._shown = []
        first = next((k for k, tag in enumerate(self.tags) if id(tag) in known), len(self.tags))
        new = list(zip(self.tags, anchors.tolist(), strict=True))
        self._place(new[:first], places, metrics)
        old = [known[id(tag)] for tag in self.tags[first:] if id(tag) in known]
        kept = places.keep(_edges_of(old))
        stay = {id(one.tag) for one, stays in zip(old, kept, strict=True) if stays}
        self._shown += [one for one in old if id(one.tag) in stay]
        self._place([one for one in new[first:] if id(one[0]) not in stay], places, metrics)
        self._edges = _edges_of(self._shown)
        shown = {id(one) for one in self._shown}
        self._pictures = {key: kept for key, kept in self._pictures.items() if key in shown}

    def _place(
        self, tags: Sequence[tuple[Tag, list[float]]], places: LabelPlaces, metrics: QFontMetricsF
    ) -> None:
        for tag, anchor in tags:
            if len(self._shown) >= _MOST_STANDING:
                return
            if (one := place_tag(tag, QPointF(*anchor), places, metrics)) is not None:
                self._shown.append(one)

    def paint(
        self, painter: QPainter, labels: Iterable[PlacedLabel], font: QFont, halo: str, at: QPointF
    ) -> None:
        """Paint `placed` labels; ``at``: origin of the painter, px of its device.

        Labels that stay are copied: painting text takes many times as long.
        """
        ratio = painter.device().devicePixelRatio()
        look = (font.key(), halo, ratio, at.x(), at.y())
        if look != self._look:
            self._look = look
            self._pictures.clear()
        stay = {id(one) for one in self._shown}
        for one in labels:
            if id(one) not in stay:
                paint_label(painter, one, font, halo)
                continue
            known = self._pictures.get(id(one))
            if known is None or known[0] is not one:
                # A label of a moving view is painted once: its picture would take longer.
                self._pictures[id(one)] = (one, None)
                paint_label(painter, one, font, halo)
                continue
            picture = known[1]
            if picture is None:
                picture = _picture(one, font, halo, at, ratio)
                self._pictures[id(one)] = (one, picture)
            painter.drawPixmap(*picture)


def _edges_of(labels: Sequence[PlacedLabel]) -> Float:
    """Return left, top, right and bottom of labels (n, 4), px."""
    return np.array([one.rect.getCoords() for one in labels], dtype=np.float64).reshape(-1, 4)


def _picture(
    one: PlacedLabel, font: QFont, halo: str, at: QPointF, ratio: float
) -> tuple[QPointF, QPixmap]:
    """Return where a picture of a label belongs, px, and the picture."""
    # In whole pixels of the screen; the fraction of the place is inside.
    first = (one.rect.topLeft() + at) * ratio - QPointF(1.0, 1.0)
    corner = QPointF(math.floor(first.x()), math.floor(first.y())) / ratio - at
    picture = QPixmap((one.rect.size() * ratio + QSizeF(4.0, 4.0)).toSize())
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(-corner)
    paint_label(painter, one, font, halo)
    painter.end()
    return corner, picture


@dataclass(frozen=True, slots=True)
class PlacedLabel:
    """A label with its point and its place, px."""

    tag: Tag
    anchor: QPointF
    rect: QRectF
    leader: QPointF | None
    """End of its leader line; None if adjacent."""


def place_tag(
    tag: Tag, anchor: QPointF, places: LabelPlaces, metrics: QFontMetricsF
) -> PlacedLabel | None:
    wide = metrics.horizontalAdvance(tag.text) + 8.0
    rect = places.place(anchor.x(), anchor.y(), wide, metrics.height())
    return None if rect is None else PlacedLabel(tag, anchor, rect, _leader(anchor, rect))


def paint_label(painter: QPainter, one: PlacedLabel, font: QFont, halo: str) -> None:
    behind = QColor(halo)
    behind.setAlpha(190)
    painter.setFont(font)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(behind)
    painter.drawRoundedRect(one.rect, 3, 3)
    painter.setPen(QColor(one.tag.colour))
    painter.drawText(one.rect, Qt.AlignmentFlag.AlignCenter, one.tag.text)


def _leader(anchor: QPointF, rect: QRectF) -> QPointF | None:
    """Return the end of a leader line at its label; None if adjacent."""
    end = QPointF(
        min(max(anchor.x(), rect.left()), rect.right()),
        min(max(anchor.y(), rect.top()), rect.bottom()),
    )
    away = float(np.hypot(end.x() - anchor.x(), end.y() - anchor.y()))
    return end if away > LEADER_PX else None
