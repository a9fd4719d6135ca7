"""Distances of points from an outline in its plane, and how a step changes them.

They are those of `flat_kernel`, positive outside, in a form that holds for complex steps too; see
`_surfaces`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_core.features.search import ellipse_feet

Values = NDArray[Any]
"""float64, or complex128 where a derivative is taken."""

STEP_SIZE = 8
FIRST_SIZE, SECOND_SIZE, TURN = 5, 6, 7
"""Entries of a step; the first ones are a shift (3) and a lean (2)."""

_NEAREST = 1e-12


def ellipse_distances(local: Values, sizes: Values, step: Values) -> tuple[Values, Values]:
    """Return distances (n,), less the offset, and slopes (n, 8) of an ellipse at a step."""
    x, y, c, s = _places(local, step)
    a, b = sizes[0] + step[FIRST_SIZE], sizes[1] + step[SECOND_SIZE]
    feet = np.empty((len(local), 2))
    places = np.ascontiguousarray(np.stack([x.real, y.real]))
    ellipse_feet(places[0], places[1], float(a.real), float(b.real), feet)
    cosine, sine = feet.T
    if np.iscomplexobj(x) or np.iscomplexobj(a + b):
        # One step of Newton's takes the foot along with what is imaginary.
        along = b * cosine * (y - b * sine) - a * sine * (x - a * cosine)
        bend = -a * cosine * (x - a * cosine) - b * sine * (y - b * sine)
        bend = bend - (a * sine) ** 2 - (b * cosine) ** 2
        turn = 1j * (-along / bend).imag
        cosine, sine = cosine - sine * turn, sine + cosine * turn
    normal_x, normal_y = b * cosine, a * sine
    length = np.sqrt(normal_x * normal_x + normal_y * normal_y)
    normal_x, normal_y = normal_x / length, normal_y / length
    found = normal_x * (x - a * cosine) + normal_y * (y - b * sine) - sizes[2]
    by_sizes = (-normal_x * cosine, -normal_y * sine)
    return found, _slopes((x, y), (normal_x, normal_y), by_sizes, (c, s))


def slot_distances(local: Values, sizes: Values, step: Values) -> tuple[Values, Values]:
    """Return distances (n,) and slopes (n, 8) of a slot with round ends at a step."""
    x, y, c, s = _places(local, step)
    a, b = sizes[0] + step[FIRST_SIZE], sizes[1] + step[SECOND_SIZE]
    side = np.copysign(1.0, x.real)
    beyond = x * side - (a - b)
    # Beside the straight sides the nearest point of the middle line is level with the point.
    reach = np.where(beyond.real > 0.0, beyond, 0.0)
    length = np.sqrt(reach * reach + y * y)
    length = np.where(np.abs(length) < _NEAREST, _NEAREST, length)
    normal_x, normal_y = side * reach / length, y / length
    by_sizes = (-reach / length, reach / length - 1.0)
    return length - b, _slopes((x, y), (normal_x, normal_y), by_sizes, (c, s))


def rectangle_distances(local: Values, sizes: Values, step: Values) -> tuple[Values, Values]:
    """Return distances (n,) and slopes (n, 8) of a rectangle at a step."""
    x, y, c, s = _places(local, step)
    a, b = sizes[0] + step[FIRST_SIZE], sizes[1] + step[SECOND_SIZE]
    side_x, side_y = np.copysign(1.0, x.real), np.copysign(1.0, y.real)
    over_x, over_y = x * side_x - a, y * side_y - b
    corner = (over_x.real > 0.0) & (over_y.real > 0.0)
    end = over_x.real > over_y.real
    # Away from the corners only the nearer side counts.
    length = np.sqrt(np.where(corner, over_x * over_x + over_y * over_y, 1.0))
    share_x = np.where(corner, over_x / length, np.where(end, 1.0, 0.0))
    share_y = np.where(corner, over_y / length, np.where(end, 0.0, 1.0))
    found = share_x * over_x + share_y * over_y
    normal = (side_x * share_x, side_y * share_y)
    return found, _slopes((x, y), normal, (-share_x, -share_y), (c, s))


def _places(local: Values, step: Values) -> tuple[Values, Values, Values, Values]:
    """Return places x, y (n,) in the frame after a step, and cosine and sine of its turn."""
    c, s = np.cos(step[TURN]), np.sin(step[TURN])
    arm_x, arm_y = local[:, 0] - step[0], local[:, 1] - step[1]
    return c * arm_x + s * arm_y, c * arm_y - s * arm_x, c, s


def _slopes(
    place: tuple[Values, Values],
    normal: tuple[Values, Values],
    by_sizes: tuple[Values, Values],
    turned: tuple[Values, Values],
) -> Values:
    """Return the slopes (n, 8) by a step, from places and normals in the frame after it."""
    (x, y), (normal_x, normal_y), (c, s) = place, normal, turned
    jacobian = np.zeros((len(x), STEP_SIZE), dtype=np.result_type(x, normal_x, *by_sizes))
    jacobian[:, 0] = s * normal_y - c * normal_x
    jacobian[:, 1] = -s * normal_x - c * normal_y
    jacobian[:, FIRST_SIZE], jacobian[:, SECOND_SIZE] = by_sizes
    jacobian[:, TURN] = normal_x * y - normal_y * x
    return jacobian
