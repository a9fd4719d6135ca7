"""Slots and rectangles by orthogonal distance, in a plane.

The distance of a point is that from the whole outline, so its side or end follows. The outline is
tried at many turns, each framed by the points, before refinement.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ocmm_core.features import search
from ocmm_core.features.elements._ball import LARGEST_RADIUS
from ocmm_core.features.elements._ellipse import outlines
from ocmm_core.features.elements._flat import (
    Outline,
    OutlineFit,
    fit_in_given_plane,
    fit_in_own_plane,
)
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3

TURNS = 60
"""Trial turns over half a circle."""
SIDES, EXTENDED = 4, 2.0
"""Extension of one side beyond the points, relative to half the length."""
TOUCHED = 0.02
"""Relative to the size: no touched surface scatters more. With one redundant point, accidentally
small residuals would admit outlines that miss the points by a tenth of the size. Applied if the
sizes are those of the plan.
"""
SCATTER_MM = 0.05
"""RMS that no touched surface exceeds. Other outlines that miss the points by more are excluded if
the best one is well conditioned.
"""
WELL_CONDITIONED = 100.0
TRIMMED = (0.0, 0.1, 0.25)
"""Shares of points beyond each side of a frame: noise widens it."""


def fit_slot(
    shape: Shape,
    points: Points3,
    direction_hint: Float | None = None,
    sizes_hint: tuple[float, float] | None = None,
) -> Fit:
    """Return the slot or rectangle in the plane of ``points`` (n, 3), mm.

    Residuals are in the plane, positive outside. The points are on both sides and both ends.
    ``direction_hint`` (3,) orients the normal; ``sizes_hint``, mm, half length and half width, may
    decide between rivals, which exist for few points. FitError if the points do not determine it.
    """
    return fit_in_own_plane(shape, points, direction_hint, _outline_fit(shape, sizes_hint))


def fit_slot_projected(
    shape: Shape,
    points: Points3,
    plane_normal: Float,
    sizes_hint: tuple[float, float] | None = None,
) -> tuple[Fit, Float]:
    """Return the slot or rectangle as `flat.fit_in_given_plane`; for hints see `fit_slot`."""
    return fit_in_given_plane(shape, points, plane_normal, _outline_fit(shape, sizes_hint))


def _outline_fit(shape: Shape, sizes_hint: tuple[float, float] | None) -> OutlineFit:
    return partial(_outline, shape=shape, sizes_hint=sizes_hint)


def _outline(
    points: Float, size: float, *, shape: Shape, sizes_hint: tuple[float, float] | None
) -> list[Outline]:
    flat = search.degenerate(
        shape,
        "they do not lie on both sides and both ends of it",
        "Take at least two points on one side, and one on the other side and on each end.",
    )
    round_ends = shape is Shape.ROUND_SLOT
    kind = search.ROUND_ENDS if round_ends else search.SQUARE_ENDS
    families = (lambda: _framed(points, TURNS, (0.0,)), lambda: _framed(points, 2 * TURNS, TRIMMED))
    solutions = search.minima(kind, points, families, _long if round_ends else _open)
    if not solutions:
        raise flat
    expected = None
    if sizes_hint is not None:
        expected = partial(_from_plan, expected=np.array(sizes_hint) / size)
    as_planned = expected is not None and expected(solutions[0].parameters) <= 1.0
    best = solutions[0]
    noise = TOUCHED if as_planned else np.inf
    if search.gains(search.derivatives(kind, points, best.parameters)[1])[2] < WELL_CONDITIONED:
        noise = min(noise, SCATTER_MM / size)
    if _unbounded(kind, points, best, noise):
        raise flat
    likely = [item for item in solutions if item is best or item.cost <= len(points) * noise**2]
    possible = search.candidates(shape, likely, len(points), expected)
    return outlines(kind, points, possible, flat)


def _from_plan(p: Float, expected: Float) -> float:
    sizes = np.sort(p[3:5])[::-1]
    return float(np.max(np.abs(sizes - expected) / (search.NEAR * expected)))


def _long(p: Float) -> bool:
    return bool(0.0 < p[4] < p[3] < LARGEST_RADIUS)


def _open(p: Float) -> bool:
    return bool(0.0 < p[4] < LARGEST_RADIUS and 0.0 < p[3] < LARGEST_RADIUS)


def _framed(points: Float, turns: int, trimmed: Sequence[float]) -> Float:
    """Return start parameters (m, 8): turned frames that leave a share ``trimmed`` outside."""
    turn = np.arange(turns) * np.pi / turns
    along = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    beside = np.stack([-np.sin(turn), np.cos(turn)], axis=1)
    x, y = np.sort(along @ points.T, axis=1), np.sort(beside @ points.T, axis=1)
    last = len(points) - 1
    found = []
    for of_x in trimmed:
        for of_y in trimmed:
            off_x, off_y = round(of_x * last), round(of_y * last)
            low = np.stack([x[:, off_x], y[:, off_y]])
            high = np.stack([x[:, last - off_x], y[:, last - off_y]])
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            centres = middle[0][:, None] * along + middle[1][:, None] * beside
            zero = np.zeros((turns, 3))
            found.append(np.column_stack([centres, turn, half[0], half[1], zero]))
    return np.concatenate(found)


def _unbounded(kind: int, points: Float, best: search.Solution, noise: float) -> bool:
    """Return whether an open outline fits within ``noise``, so that the length is undetermined."""
    n, numbers = len(points), search.STEP_SIZE[kind]
    for end in search.best_ends(kind, points, _extended(best.parameters), SIDES):
        other = search.minimise(kind, points, end)
        likely = other.cost <= n * noise**2 and search.undecided(best.cost, other.cost, n, numbers)
        if likely and search.is_open(kind, points, other):
            return True
    return False


def _extended(p: Float) -> Float:
    """Return parameters (4, 8) of outlines that extend far beyond ``p`` (8,) on one side."""
    found = np.tile(p, (SIDES, 1))
    for row, (place, side) in enumerate(((3, 1.0), (3, -1.0), (4, 1.0), (4, -1.0))):
        turn = p[2] if place == 3 else p[2] + 0.5 * np.pi
        far = EXTENDED * max(p[3], p[4])
        found[row, place] += far
        found[row, 0] += side * far * np.cos(turn)
        found[row, 1] += side * far * np.sin(turn)
    return found
