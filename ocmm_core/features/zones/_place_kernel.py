"""Compiled poses of zone elements: points in their frame, steps, bounds."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.zones import _distance_kernel as distance_kernel
from ocmm_core.features.zones._distance_kernel import ELLIPSE, ROUND_ENDS, zone_distances
from ocmm_core.features.zones._steps import FIRST_SIZE, SECOND_SIZE, STEP_SIZE, TURN
from ocmm_core.geometry import Float


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


@compiled(distance_kernel)
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
