"""Slots and rectangles by orthogonal distance, in a plane.

Which side or end a point belongs to follows from the point: its distance is that from the whole
outline. The outline is tried at many turns, each framed by the points, before it is refined.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.features.fit.ball import LARGEST_RADIUS, WORST_CONDITION
from ocmm_core.features.fit.common import degenerate
from ocmm_core.features.fit.ellipse import oblong
from ocmm_core.features.fit.flat import Outline, OutlineFit, fit_in_given_plane, fit_in_own_plane
from ocmm_core.features.fit.flat_kernel import ROUND_ENDS, SQUARE_ENDS
from ocmm_core.features.fit.search import chosen, minima, near_sizes
from ocmm_core.features.fit.solver import derivatives, gains
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3

TURNS = 60
"""Trial turns over half a circle."""


def fit_slot(
    shape: Shape,
    points: Points3,
    direction_hint: Float | None = None,
    sizes_hint: tuple[float, float] | None = None,
) -> Fit:
    """Return the slot or rectangle in the orthogonal-distance plane of ``points`` (n, 3), mm.

    Residuals are in the plane, positive outside.

    Parameters
    ----------
    shape
        ``ROUND_SLOT``, ``SQUARE_SLOT`` or ``RECTANGLE``.
    points
        (n, 3), mm, on both sides and both ends.
    direction_hint
        (3,): orients the normal.
    sizes_hint
        mm, half length and half width: decides only where several outlines pass through all
        points; where it does not, FitError. Without a hint any one of them is given.

    Raises
    ------
    FitError
        Too few points, or they do not determine the shape.
    """
    return fit_in_own_plane(shape, points, direction_hint, _outline_fit(shape, sizes_hint))


def fit_slot_projected(
    shape: Shape,
    points: Points3,
    plane_normal: Float,
    sizes_hint: tuple[float, float] | None = None,
) -> tuple[Fit, Float]:
    """Return the slot or rectangle of ``points`` projected along ``plane_normal``.

    See `flat.fit_in_given_plane` and `fit_slot`.
    """
    return fit_in_given_plane(shape, points, plane_normal, _outline_fit(shape, sizes_hint))


def _outline_fit(shape: Shape, sizes_hint: tuple[float, float] | None) -> OutlineFit:
    return partial(_outline, shape=shape, sizes_hint=sizes_hint)


def _outline(
    points: Float, size: float, *, shape: Shape, sizes_hint: tuple[float, float] | None
) -> Outline:
    flat = degenerate(
        shape,
        "they do not lie on both sides and both ends of it",
        "Take at least two points on one side, and one on the other side and on each end.",
    )
    round_ends = shape is Shape.ROUND_SLOT
    kind = ROUND_ENDS if round_ends else SQUARE_ENDS
    solutions = minima(kind, points, _starts(points), _long if round_ends else _open)
    if not solutions:
        raise flat
    expected = None
    if sizes_hint is not None:
        expected = partial(near_sizes, expected=(sizes_hint[0] / size, sizes_hint[1] / size))
    p = chosen(shape, solutions, len(points), expected)
    residuals, jacobian, _ = derivatives(kind, points, p)
    gain, shifts, condition = gains(jacobian)
    if condition > WORST_CONDITION:
        raise flat
    return oblong(p, residuals, jacobian, -gain, shifts)


def _long(p: Float) -> bool:
    return bool(0.0 < p[4] < p[3] < LARGEST_RADIUS)


def _open(p: Float) -> bool:
    return bool(0.0 < p[4] < LARGEST_RADIUS and 0.0 < p[3] < LARGEST_RADIUS)


def _starts(points: Float) -> Float:
    """Return start parameters (m, 8): the frame around the points at every trial turn."""
    turns = np.arange(TURNS) * np.pi / TURNS
    along = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    beside = np.stack([-np.sin(turns), np.cos(turns)], axis=1)
    x, y = along @ points.T, beside @ points.T
    low, high = np.stack([x.min(1), y.min(1)]), np.stack([x.max(1), y.max(1)])
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    centres = middle[0][:, None] * along + middle[1][:, None] * beside
    zero = np.zeros((TURNS, 3))
    return np.column_stack([centres, turns, half[0], half[1], zero])
