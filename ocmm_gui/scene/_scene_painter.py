"""Drawing of a scene by QPainter, before, in or behind a part; labels placed reproducibly."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen, QPolygonF

from ocmm_core.geometry import Float
from ocmm_gui.rendering import Canvas
from ocmm_gui.scene._labels import LabelPlaces, PlacedLabel, StandingLabels, paint_label, place_tag
from ocmm_gui.scene._scene import Diamonds, Dots, Face, Item, Lines, Orbit, Tag

_FEW_SEGMENTS, _SHORT_PX, _SAME_PX = 24, 2.0, 1e-6
"""Rings of small features have segments of less than a pixel, and each costs the same."""
RIM_PX = 1.2
"""Outline of a dot."""
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
    """Paint faces, then lines, dots and labels.

    Faces and dots are painted from far to near. Labels do not overlap, and cover marks only without
    other room nearby; distant ones have a leader line. Earlier ones have priority. ``taken``:
    label-free areas, px from the upper left corner of ``box``; ``depth``: part that hides lines and
    dots, or None; ``ghost``: opacity of hidden items, 0 to 1; ``standing``: more labels, behind
    those of ``items`` in priority.
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
        standing: StandingLabels | None = None,
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
        self._left: tuple[Item, ...] = (
            *(faces[k] for k in np.argsort(heights, kind="stable")),
            *(item for item in items if isinstance(item, Lines) and len(item.segments)),
            *(item for item in marks if len(item.points)),
        )
        self._tags = [item for item in items if isinstance(item, Tag)]
        self._standing = standing
        self._orbit = orbit
        self._placed: list[PlacedLabel] = []
        self._stay: list[PlacedLabel] = []

    def paint(self, painter: QPainter) -> None:
        """Paint all items, then labels."""
        painter.save()
        painter.setClipRect(self._box)
        painter.translate(self._box.topLeft())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for item in self._left:
            self._paint(painter, item)
        self._place_tags()
        self._paint_tags(painter)
        painter.restore()

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
        outline = QPen(QColor(item.outline), RIM_PX) if item.outline else QPen(Qt.PenStyle.NoPen)
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

    def _place_tags(self) -> None:
        metrics = QFontMetricsF(self._font)
        standing = self._standing
        anchors = self._projected(self._tags)
        still = self._projected(() if standing is None else standing.tags)
        bounds = QRectF(0.0, 0.0, self._box.width(), self._box.height())
        labels = LabelPlaces(bounds, self._taken, np.concatenate([anchors, still, *self._marks]))
        for tag, anchor in zip(self._tags, anchors.tolist(), strict=True):
            if (one := place_tag(tag, QPointF(*anchor), labels, metrics)) is not None:
                self._placed.append(one)
        if standing is not None:
            self._stay = standing.placed(labels, still, metrics, self._orbit, self._box)

    def _projected(self, tags: Collection[Tag]) -> Float:
        """Return the points of labels, (n, 2), px."""
        return self._picture.apply(np.array([tag.point for tag in tags]).reshape(-1, 3))[:, :2]

    def _paint_tags(self, painter: QPainter) -> None:
        placed = (*self._placed, *self._stay)
        colour = ""
        for one in placed:
            if one.leader is not None:
                if one.tag.colour != colour:
                    colour = one.tag.colour
                    painter.setPen(QPen(QColor(colour), 1.0))
                painter.drawLine(one.anchor, one.leader)
        for one in self._placed:
            paint_label(painter, one, self._font, self._halo)
        if self._standing is not None:
            self._standing.paint(painter, self._stay, self._font, self._halo, self._box.topLeft())
        self.words += [(one.tag.text, one.rect) for one in placed]


def _draw_lines(painter: QPainter, ends: Float) -> None:
    lines = merge_short(ends[..., :2])
    painter.drawLines([QLineF(*end) for end in lines.reshape(-1, 4).tolist()])


def merge_short(ends: Float) -> Float:
    """Return segments (n, 2, 2), px, with those joined that continue one another within 2 px."""
    if len(ends) < _FEW_SEGMENTS:
        return ends
    run = np.hypot(*(ends[:, 1] - ends[:, 0]).T).cumsum()
    piece = np.concatenate([[0.0], np.floor(run[:-1] / _SHORT_PX)])
    begins = np.ones(len(ends), dtype=bool)
    begins[1:] = (piece[1:] != piece[:-1]) | (
        np.abs(ends[1:, 0] - ends[:-1, 1]).max(axis=1) > _SAME_PX
    )
    at = np.flatnonzero(begins)
    return np.stack([ends[at, 0], ends[np.append(at[1:], len(ends)) - 1, 1]], axis=1)


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
