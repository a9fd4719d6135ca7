"""Sphere map of a sweep; cells are fixed in the world, so that drawing does not flicker."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.guided import viewer_axes
from ocmm_core.calibration.sweeping._views import MapCell
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3, unit

_CELLS = 600
CELL_RAD = float(np.sqrt(4.0 * np.pi / _CELLS))
"""Distance of neighbouring cells, about 8 degrees."""

_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
_AWAY = 0.3
"""Fraction of the largest direction above which a second one is named."""


def sphere_map(directions_world: Points3, reach: float) -> tuple[Float, tuple[MapCell, ...]]:
    """Return the middle of the map (3,) and its cells, required up to ``reach``, rad.

    ``directions_world`` (n, 3), unit, lead from the ball to the middle of the LEDs.
    """
    if not len(directions_world):
        return np.full(3, np.nan), ()
    grid = _grid()
    counts = np.bincount(np.argmax(directions_world @ grid.T, axis=1), minlength=_CELLS)
    middle = unit(grid[counts > 0].mean(axis=0))
    wanted = grid @ middle >= np.cos(reach)
    cells = tuple(
        MapCell(grid[cell], int(counts[cell]), bool(wanted[cell]))
        for cell in np.flatnonzero(wanted | (counts > 0))
    )
    return middle, cells


def where_missing(rig: Rig, middle_world: Float, cells: tuple[MapCell, ...]) -> str:
    """Return the sides, seen by the cameras, of missing cells ("left and away") or nothing."""
    empty = [cell.direction_world for cell in cells if cell.wanted and not cell.poses]
    if not empty:
        return ""
    right, away, up = viewer_axes(rig)
    aside = np.mean(empty, axis=0)
    aside -= (aside @ middle_world) * middle_world
    words = (("left", "right"), ("towards the cameras", "away from the cameras"), ("down", "up"))
    sizes = np.array([aside @ right, aside @ away, aside @ up])
    order = np.argsort(-np.abs(sizes))[:2]
    named = [
        words[axis][int(sizes[axis] > 0.0)]
        for axis in order
        if abs(sizes[axis]) > _AWAY * np.abs(sizes).max()
    ]
    return " and ".join(named)


def _grid() -> Points3:
    """Return evenly spread directions on the sphere (Fibonacci's spiral), (n, 3)."""
    number = np.arange(_CELLS)
    z = 1.0 - (2.0 * number + 1.0) / _CELLS
    radius, angle = np.sqrt(1.0 - z**2), _GOLDEN * number
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
