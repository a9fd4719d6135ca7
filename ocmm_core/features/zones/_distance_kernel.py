"""Compiled distances from zone elements; see `_surfaces`.

All formulas hold for complex numbers, so that one code gives distances and, by an imaginary step,
the derivatives of their jacobian. Outlines are those of `flat_kernel`, positive outside.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.search import ellipse_foot, ellipse_kernel
from ocmm_core.features.zones._steps import FIRST_SIZE, SECOND_SIZE, TURN, Values
from ocmm_core.geometry import Float

HEIGHT, AXIS, CENTRE, SLOPE, RING, ELLIPSE, ROUND_ENDS, SQUARE_ENDS = range(8)
"""Kinds of distance."""

_NEAREST, _NO_LENGTH = 1e-12, 1e-200


@compiled(ellipse_kernel)
def zone_distances(
    kind: int,
    sign: float,
    local: Values,
    sizes: Float,
    step: Values,
    found: Values,
    jacobian: Values,
) -> None:
    """Write distances (n,) at a step (8,) to ``found``, and their ``jacobian`` (n, 8)."""
    jacobian[:] = 0.0
    if kind >= ELLIPSE:
        _from_outline(kind, local, sizes, step, found, jacobian)
        return
    a, b = step[3], step[4]
    square = a * a + b * b + 1.0
    length = np.sqrt(square)
    size = sizes[0] + step[FIRST_SIZE]
    cosine, sine = np.cos(size), np.sin(size)
    for i in range(len(local)):
        qx, qy, qz = local[i, 0] - step[0], local[i, 1] - step[1], local[i, 2] - step[2]
        row = jacobian[i]
        if kind == CENTRE:
            rho = np.sqrt(qx * qx + qy * qy + qz * qz)
            found[i] = sign * rho
            # At the centre itself the distance has no slope.
            rho = rho if abs(rho) > _NO_LENGTH else rho + _NO_LENGTH
            row[0], row[1], row[2] = -sign * qx / rho, -sign * qy / rho, -sign * qz / rho
            continue
        # The axis (a, b, 1) is not of unit length: heights are measured along it, over its square.
        along = (qx * a + qy * b + qz) / square
        height = along * length
        cx, cy, cz = qx - along * a, qy - along * b, qz - along
        if kind == HEIGHT:
            found[i] = sign * height
            row[0], row[1], row[2] = -sign * a / length, -sign * b / length, -sign / length
            # A unit tilt moves the height of a point by its lateral position.
            row[3], row[4] = sign * cx / length, sign * cy / length
            continue
        rho = np.sqrt(cx * cx + cy * cy + cz * cz)
        safe = rho if abs(rho) > _NO_LENGTH else rho + _NO_LENGTH
        ox, oy, oz = cx / safe, cy / safe, cz / safe
        if kind == AXIS:
            found[i] = sign * rho
            row[0], row[1], row[2] = -sign * ox, -sign * oy, -sign * oz
            # A tilt moves the axis at the height of the point by that height.
            row[3], row[4] = -sign * along * ox, -sign * along * oy
            continue
        # Components of the distance from the axis and of the height, used by both kinds.
        if kind == SLOPE:
            by_rho, by_height = cosine, -sine
            found[i] = rho * cosine - height * sine
            row[FIRST_SIZE] = -rho * sine - height * cosine
        else:
            beyond = rho - size
            tube = np.sqrt(beyond * beyond + height * height)
            found[i] = tube
            tube = tube if abs(tube) > _NO_LENGTH else tube + _NO_LENGTH
            by_rho, by_height = beyond / tube, height / tube
            row[FIRST_SIZE] = -by_rho
        row[0] = -by_rho * ox - by_height * a / length
        row[1] = -by_rho * oy - by_height * b / length
        row[2] = -by_rho * oz - by_height / length
        row[3] = -by_rho * along * ox + by_height * cx / length
        row[4] = -by_rho * along * oy + by_height * cy / length


@compiled(ellipse_kernel)
def _from_outline(
    kind: int, local: Values, sizes: Float, step: Values, found: Values, jacobian: Values
) -> None:
    """Do the same as `zone_distances` for an ellipse, a slot and a rectangle."""
    c, s = np.cos(step[TURN]), np.sin(step[TURN])
    a, b = sizes[0] + step[FIRST_SIZE], sizes[1] + step[SECOND_SIZE]
    for i in range(len(local)):
        arm_x, arm_y = local[i, 0] - step[0], local[i, 1] - step[1]
        x, y = c * arm_x + s * arm_y, c * arm_y - s * arm_x
        side_x, side_y = np.copysign(1.0, x.real), np.copysign(1.0, y.real)
        row = jacobian[i]
        if kind == ELLIPSE:
            cosine, sine = ellipse_foot(x.real, y.real, a.real, b.real)
            # One Newton step propagates the imaginary part to the foot. The sum of forces along the
            # ellipse, and its derivative by the anomaly.
            slide = b * cosine * (y - b * sine) - a * sine * (x - a * cosine)
            bend = -a * cosine * (x - a * cosine) - b * sine * (y - b * sine)
            bend = bend - (a * sine) * (a * sine) - (b * cosine) * (b * cosine)
            turn = -(slide - slide.real) / bend
            foot_c, foot_s = cosine - sine * turn, sine + cosine * turn
            nx, ny = b * foot_c, a * foot_s
            length = np.sqrt(nx * nx + ny * ny)
            nx, ny = nx / length, ny / length
            found[i] = nx * (x - a * foot_c) + ny * (y - b * foot_s) - sizes[2]
            row[FIRST_SIZE], row[SECOND_SIZE] = -nx * foot_c, -ny * foot_s
        elif kind == ROUND_ENDS:
            beyond = x * side_x - (a - b)
            # Next to the straight sides the nearest point of the middle line is level with it.
            reach = beyond if beyond.real > 0.0 else 0.0 * beyond
            length = np.sqrt(reach * reach + y * y)
            length = length if abs(length) > _NEAREST else 0.0 * length + _NEAREST
            nx, ny = side_x * reach / length, y / length
            found[i] = length - b
            row[FIRST_SIZE], row[SECOND_SIZE] = -reach / length, reach / length - 1.0
        else:
            over_x, over_y = x * side_x - a, y * side_y - b
            share_x, share_y = 0.0 * over_x, 0.0 * over_y
            # Away from the corners only the nearer side counts.
            if over_x.real > 0.0 and over_y.real > 0.0:
                length = np.sqrt(over_x * over_x + over_y * over_y)
                share_x, share_y = over_x / length, over_y / length
            elif over_x.real > over_y.real:
                share_x += 1.0
            else:
                share_y += 1.0
            found[i] = share_x * over_x + share_y * over_y
            nx, ny = side_x * share_x, side_y * share_y
            row[FIRST_SIZE], row[SECOND_SIZE] = -share_x, -share_y
        row[0], row[1] = s * ny - c * nx, -s * nx - c * ny
        row[TURN] = nx * y - ny * x
