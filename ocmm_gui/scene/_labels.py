"""Where words stand in a picture: beside their place, over nothing, and the same every time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF

from ocmm_core.geometry import Float

_NEAR_PX = 8.0
_RINGS_PX = (26.0, 46.0, 70.0, 100.0, 140.0, 190.0)
_TURN = 16
_GAP_PX = 1.0
"""Between two words."""

_MARK_PX = 3.0
"""A mark reaches so far round its place."""

_DETOUR = 0.4
"""To stand one ring farther away is as bad as to cover so much of a mark."""

_DETOURS = _DETOUR * np.repeat(np.arange(1 + len(_RINGS_PX)), (4, *(_TURN for _ in _RINGS_PX)))
LEADER_PX = 14.0
"""A word that stands farther from its place gets a line to it."""


def place_labels(
    anchors: Sequence[tuple[float, float]],
    sizes: Sequence[tuple[float, float]],
    bounds: QRectF,
    taken: Iterable[QRectF] = (),
    marks: Float | None = None,
) -> list[QRectF | None]:
    """Return where each word stands, px; None for one that has no room anywhere near its place.

    Parameters
    ----------
    anchors, sizes
        The place that a word belongs to, and its width and height, px. The first words have the
        right of way.
    bounds
        Words stand inside; one whose place lies outside is left out.
    taken
        Where no word may stand.
    marks
        Places (n, 2), px, of marks that a word covers only where it has no other room nearby.
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
    """Return where a line from the place ends at its word; None where it stands beside it."""
    end = QPointF(
        min(max(anchor.x(), rect.left()), rect.right()),
        min(max(anchor.y(), rect.top()), rect.bottom()),
    )
    away = float(np.hypot(end.x() - anchor.x(), end.y() - anchor.y()))
    return end if away > LEADER_PX else None


def _covered(corners: Float, wide: float, high: float, marks: Float) -> Float:
    """Return how many marks a word would cover at each of its corners (n, 2)."""
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
    """Return upper left corners (n, 2) of a word round its place, the best first."""
    found = [
        (x + _NEAR_PX, y - high - 2.0),
        (x + _NEAR_PX, y + 4.0),
        (x - _NEAR_PX - wide, y - high - 2.0),
        (x - _NEAR_PX - wide, y + 4.0),
    ]
    # Right above first, then round: the word stands with its nearest point on the ring.
    angles = np.radians(45.0) + np.arange(_TURN) * 2.0 * np.pi / _TURN
    angles = angles[np.argsort(np.abs(np.arange(_TURN) - 0.25), kind="stable")]
    for ring in _RINGS_PX:
        for across, along in zip(np.cos(angles).tolist(), np.sin(angles).tolist(), strict=True):
            left = x + ring * across + (0.5 * across - 0.5) * wide
            top = y - ring * along - (0.5 * along + 0.5) * high
            found.append((left, top))
    return np.array(found)
