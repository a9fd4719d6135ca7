"""Compiled distances from zone elements, and their poses; see `_surfaces`.

All formulas hold for complex numbers, so that one code gives distances and, by an imaginary step,
the derivatives of their jacobian. Outlines are those of `flat_kernel`, positive outside.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.features.search import ellipse_foot, ellipse_kernel
from ocmm_core.geometry import Float

Values = NDArray[Any]
"""float64, or complex128 for derivatives."""

STEP_SIZE = 8
FIRST_SIZE, SECOND_SIZE, TURN = 5, 6, 7
"""Entries of a step; the first ones are a shift (3) and a lean (2)."""


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


@compiled()
def to_local(points: Float, frame: Float, origin: Float, local: Float) -> None:
    """Write the points (n, 3) in the frame of an element to ``local``."""
    for i in range(len(points)):
        x, y, z = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        for j in range(3):
            local[i, j] = x * frame[0, j] + y * frame[1, j] + z * frame[2, j]


@compiled()
def move_zone(
    frame: Float, origin: Float, sizes: Float, step: Float,
    to_frame: Float, to_origin: Float, to_sizes: Float,
) -> None:  # fmt: skip
    """Write the element after a step (8,) to frame (3, 3), origin (3,) and sizes (3,)."""
    length = np.sqrt(step[3] * step[3] + step[4] * step[4] + 1.0)
    ax, ay = step[3] / length, step[4] / length
    # Rotation from z to the new axis, about z cross axis; then one about the axis.
    vx, vy, vz = -ay, ax, step[TURN]
    lean = np.sqrt(vx * vx + vy * vy)
    if lean > 0.0:
        angle = np.arcsin(min(lean, 1.0)) / lean
        vx, vy = vx * angle, vy * angle
    turn = np.sqrt(vx * vx + vy * vy + vz * vz)
    # Rodrigues: R = 1 + s [v] + c [v]^2, with the quotients of sine and cosine by their limits.
    s, c = 1.0, 0.5
    if turn > 1e-30:
        s = np.sin(turn) / turn
        half = np.sin(0.5 * turn) / turn
        c = 2.0 * half * half
    for i in range(3):
        x, y, z = frame[i, 0], frame[i, 1], frame[i, 2]
        # A row times [v] is minus row cross v: (row [v])_j = (v x e_j) . row.
        first_x, first_y, first_z = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
        second_x = first_y * vz - first_z * vy
        second_y, second_z = first_z * vx - first_x * vz, first_x * vy - first_y * vx
        to_frame[i, 0] = x + s * first_x + c * second_x
        to_frame[i, 1] = y + s * first_y + c * second_y
        to_frame[i, 2] = z + s * first_z + c * second_z
        to_origin[i] = origin[i] + x * step[0] + y * step[1] + z * step[2]
    # Gram-Schmidt: keep the frame orthonormal over many rotations.
    for j in range(3):
        for k in range(j):
            along = 0.0
            for i in range(3):
                along += to_frame[i, j] * to_frame[i, k]
            for i in range(3):
                to_frame[i, j] -= along * to_frame[i, k]
        square = 0.0
        for i in range(3):
            square += to_frame[i, j] * to_frame[i, j]
        square = np.sqrt(square)
        for i in range(3):
            to_frame[i, j] /= square
    to_sizes[0], to_sizes[1] = sizes[0] + step[FIRST_SIZE], sizes[1] + step[SECOND_SIZE]
    to_sizes[2] = sizes[2]


@compiled()
def possible_sizes(kind: int, sizes: Float) -> bool:
    """Return whether an element with these sizes exists."""
    long, short, offset = sizes[0], sizes[1], sizes[2]
    if kind == ROUND_ENDS:
        return bool(0.0 < short < long)
    least = min(long, short)
    if kind == ELLIPSE:
        # A ball rolling inside must fit into the sharper ends.
        return bool(least > 0.0 and -offset * max(long, short) < least * least)
    return bool(least > 0.0 or kind < ELLIPSE)


@compiled()
def bounds_of(found: Float, lower: bool, even: bool) -> tuple[float, float]:
    """Return the greatest distance (absolute if even), and the smallest or zero."""
    greatest, least = -np.inf, np.inf
    for value in found:
        greatest = max(greatest, abs(value) if even else value)
        least = min(least, value)
    return greatest, least if lower else 0.0


@compiled()
def zone_about(
    kind: int, sign: float, lower: bool, even: bool, points: Float, frame: Float, origin: Float,
    sizes: Float, local: Float, found: Float, jacobian: Float,
) -> tuple[float, float]:  # fmt: skip
    """Return the bounds of the zone about an element; infinite if it does not exist."""
    if not possible_sizes(kind, sizes):
        return np.inf, 0.0
    to_local(points, frame, origin, local)
    zone_distances(kind, sign, local, sizes, np.zeros(STEP_SIZE), found, jacobian)
    return bounds_of(found, lower, even)
