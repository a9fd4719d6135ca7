"""Where words stand in a picture: beside their place, over nothing, and the same every time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF

from ocmm_core.geometry import Float

_NEAR_PX = 8.0
_RINGS_PX = (26.0, 46.0, 70.0, 100.0, 140.0, 190.0)
_TURN = 16
LEADER_PX = 14.0
"""A word that stands farther from its place gets a line to it."""


def place_labels(
    anchors: Sequence[tuple[float, float]],
    sizes: Sequence[tuple[float, float]],
    bounds: QRectF,
    taken: Iterable[QRectF] = (),
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
        left, top = corners[int(np.argmax(free))].tolist()
        rect = QRectF(left, top, wide, high)
        walls.append(_edges(rect))
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
