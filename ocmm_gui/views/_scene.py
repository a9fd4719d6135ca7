"""A small 3-D scene and its renderer: numpy projects, QPainter draws, no graphics card needed.

The projection is orthographic, so that lengths can be compared by eye wherever they stand.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPen, QPolygonF

from ocmm_core.geometry import Float

MAX_ELEVATION = np.radians(89.0)
"""Straight from above the view would have no upright direction."""


@dataclass(frozen=True, slots=True)
class Lines:
    """Line segments.

    Attributes
    ----------
    segments
        (n, 2, 3), mm, world frame.
    colour, width
        ``#rrggbb`` and px.
    """

    segments: Float
    colour: str
    width: float = 1.5


@dataclass(frozen=True, slots=True)
class Dots:
    """Round marks of constant size: (n, 3), mm, world frame; ``size`` in px."""

    points: Float
    colour: str
    size: float = 8.0
    outline: str = ""


@dataclass(frozen=True, slots=True)
class Diamonds:
    """Open squares on their corners, of constant size: (n, 3), mm, world frame; ``size`` in px."""

    points: Float
    colour: str
    size: float = 16.0


@dataclass(frozen=True, slots=True)
class Face:
    """A translucent polygon: corners (n, 3), mm, world frame; ``alpha`` 0 to 255."""

    corners: Float
    colour: str
    alpha: int = 50


@dataclass(frozen=True, slots=True)
class Tag:
    """A word beside a point (3,), mm, world frame."""

    point: Float
    text: str
    colour: str


Item = Lines | Dots | Diamonds | Face | Tag


@dataclass(frozen=True, slots=True)
class ScreenProjection:
    """World to picture: ``(points - target) @ matrix + middle``.

    Attributes
    ----------
    target
        (3,), mm, world.
    matrix
        (3, 3): px/mm for x and y of the picture; the third column is the height towards the eye.
    middle
        (3,), px.
    """

    target: Float
    matrix: Float
    middle: Float

    def apply(self, points: Float) -> Float:
        """Return (..., 3): x and y in px from the upper left corner, and height over the target."""
        projected: Float = (points - self.target) @ self.matrix + self.middle
        return projected


@dataclass(frozen=True, slots=True)
class Orbit:
    """Where the eye is.

    Attributes
    ----------
    target
        (3,), mm, world: what stands in the middle.
    azimuth, elevation
        rad: direction of the eye from the target, about ``up`` and above the plane across it.
    radius
        mm: what is that far from the target touches the edge of the shorter side of the picture.
    up
        (3,), unit, world: upright in the picture.
    """

    target: Float
    azimuth: float
    elevation: float
    radius: float
    up: Float

    def axes(self) -> Float:
        """Return the picture's right, up and outward directions as rows, (3, 3), world."""
        first = np.eye(3)[int(np.argmin(np.abs(self.up)))]
        east = np.cross(self.up, first)
        east /= np.linalg.norm(east)
        north = np.cross(self.up, east)
        flat = np.cos(self.azimuth) * east + np.sin(self.azimuth) * north
        outward = np.cos(self.elevation) * flat + np.sin(self.elevation) * self.up
        right = np.cross(self.up, outward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(outward, right), outward])

    def projection(self, width: float, height: float) -> ScreenProjection:
        """Return how world points come into a picture of that size, px."""
        scale = 0.5 * min(width, height) / self.radius
        return ScreenProjection(
            self.target,
            self.axes().T * np.array([scale, -scale, 1.0]),
            np.array([0.5 * width, 0.5 * height, 0.0]),
        )

    def project(self, points: Float, width: float, height: float) -> Float:
        """Return (..., 3): x and y in px from the upper left corner, and height over the target."""
        return self.projection(width, height).apply(points)

    def turned(self, azimuth: float, elevation: float) -> Orbit:
        """Return the view after a turn, rad."""
        limit = float(MAX_ELEVATION)
        return replace(
            self,
            azimuth=self.azimuth + azimuth,
            elevation=min(max(self.elevation + elevation, -limit), limit),
        )

    def zoomed(self, factor: float) -> Orbit:
        """Return the view with ``radius`` times ``factor``, kept between 2 mm and 5 m."""
        return replace(self, radius=min(max(self.radius * factor, 2.0), 5000.0))

    def fitted(self, points: Float, width: float, height: float, margin: float = 1.15) -> Orbit:
        """Return the view from the same side that shows all ``points`` (n, 3)."""
        axes = self.axes()
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        half = 0.5 * (high - low)[:2] * min(width, height) / np.array([width, height])
        target = axes.T @ (0.5 * (low + high))
        return replace(self, target=target, radius=max(margin * float(half.max()), 15.0))


def paint_scene(
    painter: QPainter, items: Iterable[Item], orbit: Orbit, box: QRectF, font: QFont, halo: str
) -> None:
    """Paint items at once; see `ScenePainter`."""
    ScenePainter(items, orbit, box, font, halo).paint(painter)


class ScenePainter:
    """Paint faces, then lines, then dots, then words, at once or a few at a time.

    Faces and dots are painted from far to near. A word that would cover another one is left out:
    the first one stays.

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
        Where words stand already, px from the upper left corner of ``box``.

    Attributes
    ----------
    taken
        The same, with those that were painted.
    """

    def __init__(
        self,
        items: Iterable[Item],
        orbit: Orbit,
        box: QRectF,
        font: QFont,
        halo: str,
        taken: Iterable[QRectF] = (),
    ) -> None:
        self._box, self._font, self._halo = box, font, halo
        self._picture = orbit.projection(box.width(), box.height())
        self.taken = list(taken)
        items = tuple(items)
        faces = [item for item in items if isinstance(item, Face)]
        depth = [float(self._picture.apply(item.corners)[:, 2].mean()) for item in faces]
        marks = [item for item in items if isinstance(item, Dots | Diamonds)]
        self._left: deque[Item] = deque(
            (
                *(faces[k] for k in np.argsort(depth, kind="stable")),
                *(item for item in items if isinstance(item, Lines) and len(item.segments)),
                *(item for item in marks if len(item.points)),
                *(item for item in items if isinstance(item, Tag)),
            )
        )

    def paint(self, painter: QPainter, until_s: float = math.inf) -> bool:
        """Paint what is left, until a time of `time.perf_counter`; return whether all is painted.

        One item at least is painted.
        """
        painter.save()
        painter.setClipRect(self._box)
        painter.translate(self._box.topLeft())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(self._font)
        while self._left:
            self._paint(painter, self._left.popleft())
            if perf_counter() > until_s:
                break
        painter.restore()
        return not self._left

    def _paint(self, painter: QPainter, item: Item) -> None:
        match item:
            case Face():
                self._paint_face(painter, item)
            case Lines():
                ends = self._picture.apply(item.segments)[..., :2].reshape(-1, 4)
                painter.setPen(QPen(QColor(item.colour), item.width, c=Qt.PenCapStyle.RoundCap))
                painter.drawLines([QLineF(*end) for end in ends.tolist()])
            case Dots():
                _paint_dots(painter, item, self._picture.apply(item.points))
            case Diamonds():
                _paint_diamonds(painter, item, self._picture.apply(item.points), self._halo)
            case Tag():
                x, y, _ = self._picture.apply(item.point).tolist()
                _paint_tag(painter, item, QPointF(x, y), self._halo, self.taken)

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


def _paint_dots(painter: QPainter, item: Dots, places: Float) -> None:
    outline = QPen(QColor(item.outline), 1.2) if item.outline else QPen(Qt.PenStyle.NoPen)
    painter.setPen(outline)
    painter.setBrush(QColor(item.colour))
    radius = 0.5 * item.size
    for x, y, _ in places[np.argsort(places[:, 2])].tolist():
        painter.drawEllipse(QPointF(x, y), radius, radius)


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


def _paint_tag(
    painter: QPainter, item: Tag, place: QPointF, halo: str, taken: list[QRectF]
) -> None:
    metrics = painter.fontMetrics()
    wide, high = metrics.horizontalAdvance(item.text) + 8.0, float(metrics.height())
    for right, above in ((True, True), (True, False), (False, True), (False, False)):
        x = place.x() + (8.0 if right else -8.0 - wide)
        y = place.y() + (-high - 2.0 if above else 4.0)
        box = QRectF(x, y, wide, high)
        if not any(box.intersects(other) for other in taken):
            break
    else:
        return
    taken.append(box)
    behind = QColor(halo)
    behind.setAlpha(190)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(behind)
    painter.drawRoundedRect(box, 3, 3)
    painter.setPen(QColor(item.colour))
    painter.drawText(box, Qt.AlignmentFlag.AlignCenter, item.text)
