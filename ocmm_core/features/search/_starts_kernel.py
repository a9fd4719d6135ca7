"""Compiled starts of elements about trial axes.

Trial axes come by hundreds, and a fit of few points takes most of its time here.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.search import _axis_kernel as axis_kernel
from ocmm_core.features.search import _newton_kernel as newton_kernel
from ocmm_core.features.search import _point_kernel as point_kernel
from ocmm_core.features.search._axis_kernel import across
from ocmm_core.features.search._newton_kernel import solve_step
from ocmm_core.features.search._point_kernel import diagonalise, places, taubin
from ocmm_core.geometry import Float

STRAIGHT = 2e-12
"""Twice the curvature, relative to the size of the points, below which a ball is straight: callers
recognise the far centre."""
_RIDGE = 1e-12
"""Relative to the trace of normal equations: keeps them invertible."""


@compiled(axis_kernel, point_kernel)
def circles(points: Float, axes: Float, starts: Float) -> None:
    """Write axis, foot and radius of Taubin's circle seen along each of ``axes`` (m, 3).

    ``points`` (n, 3); ``starts`` (m, 8).
    """
    e, gram, turned = np.empty((2, 3)), np.empty((3, 3)), np.empty((3, 3))
    flat = np.empty((len(points), 2))
    for row in range(len(axes)):
        across(axes[row, 0], axes[row, 1], axes[row, 2], e)
        places(points, e, flat)
        x, y = flat[:, 0].mean(), flat[:, 1].mean()
        flat[:, 0] -= x
        flat[:, 1] -= y
        square = taubin(flat, gram)
        turned[:] = np.eye(3)
        diagonalise(gram, turned)
        least = np.argmin(np.diag(gram))
        # As `ball.taubin_ball`.
        curvature = turned[least, 0] / np.sqrt(square)
        if abs(curvature) < STRAIGHT:
            curvature = STRAIGHT
        u, v = -turned[least, 1] / curvature, -turned[least, 2] / curvature
        for k in range(3):
            starts[row, k] = (x + u) * e[0, k] + (y + v) * e[1, k]
            starts[row, 3 + k] = axes[row, k]
        starts[row, 6], starts[row, 7] = np.sqrt(u * u + v * v + square), 0.0


@compiled(axis_kernel, newton_kernel, point_kernel)
def quadric_feet(points: Float, axes: Float, starts: Float) -> None:
    """Write axis and foot of the quadric of revolution seen along each of ``axes`` (m, 3).

    Its radius squared is a polynomial of second order in the height t: with x and y across the
    axis, x^2 + y^2 = 2 a x + 2 b y + c + d t + e t^2 is linear in the foot (a, b).
    """
    e, normal, factor = np.empty((3, 3)), np.empty((5, 5)), np.zeros((5, 5))
    against, found, terms = np.empty(5), np.empty(5), np.ones(5)
    along = np.empty((len(points), 3))
    for row in range(len(axes)):
        across(axes[row, 0], axes[row, 1], axes[row, 2], e)
        e[2] = axes[row]
        places(points, e, along)
        normal[:] = 0.0
        against[:] = 0.0
        for i in range(len(points)):
            x, y, t = along[i, 0], along[i, 1], along[i, 2]
            terms[0], terms[1], terms[3], terms[4] = 2.0 * x, 2.0 * y, t, t * t
            for j in range(5):
                # `solve_step` returns minus the solution.
                against[j] -= terms[j] * (x * x + y * y)
                for k in range(j + 1):
                    normal[j, k] += terms[j] * terms[k]
        ridge = _RIDGE * np.trace(normal)
        for j in range(5):
            normal[j, j] += ridge
        solved = solve_step(normal, normal, against, 0.0, 0.0, factor, found)
        for k in range(3):
            foot = found[0] * e[0, k] + found[1] * e[1, k]
            starts[row, k], starts[row, 3 + k] = foot if solved else np.nan, axes[row, k]


@compiled()
def flanks(points: Float, starts: Float) -> None:
    """Set half angle and size of cones around the axes of ``starts`` (m, 8), in place.

    The flank is the straight line nearest to distances from the axis by heights of the points.
    """
    n = len(points)
    for row in range(len(starts)):
        p = starts[row]
        st = sr = stt = str_ = t0 = r0 = 0.0
        for i in range(n):
            qx, qy, qz = points[i, 0] - p[0], points[i, 1] - p[1], points[i, 2] - p[2]
            t = qx * p[3] + qy * p[4] + qz * p[5]
            qx, qy, qz = qx - t * p[3], qy - t * p[4], qz - t * p[5]
            rho = np.sqrt(qx * qx + qy * qy + qz * qz)
            # About the first point, as in `tubes`.
            if i == 0:
                t0, r0 = t, rho
            t -= t0
            rho -= r0
            st += t
            sr += rho
            stt += t * t
            str_ += t * rho
        spread = max(stt - st * st / n, 1e-12)
        angle = np.arctan((str_ - st * sr / n) / spread)
        radius = r0 + sr / n - np.tan(angle) * (t0 + st / n)
        p[6], p[7] = angle, radius * np.cos(angle)


@compiled()
def tubes(points: Float, starts: Float) -> None:
    """Set height and sizes of tori around the axes of ``starts`` (m, 8), in place.

    Distances from the axis and heights of the points (n, 3) are on a circle, the section of the
    tube, from linear equations (its algebraic fit).
    """
    n = len(points)
    for row in range(len(starts)):
        p = starts[row]
        # Sums of u = rho, t, their squares and products, about the first point.
        u0 = t0 = 0.0
        su = st = suu = sut = stt = szu = szt = sz = 0.0
        for i in range(n):
            qx, qy, qz = points[i, 0] - p[0], points[i, 1] - p[1], points[i, 2] - p[2]
            t = qx * p[3] + qy * p[4] + qz * p[5]
            u = np.sqrt(max(qx * qx + qy * qy + qz * qz - t * t, 0.0))
            # About the first point: squares of large numbers would lose the digits of a small
            # section.
            if i == 0:
                u0, t0 = u, t
            u -= u0
            t -= t0
            z = u * u + t * t
            su += u
            st += t
            suu += u * u
            sut += u * t
            stt += t * t
            sz += z
            szu += z * u
            szt += z * t
        # About the mean: of the circle z = 2 u0 u + 2 t0 t + const the constant cancels.
        suu -= su * su / n
        sut -= su * st / n
        stt -= st * st / n
        szu -= sz * su / n
        szt -= sz * st / n
        # A straight section has no centre: the ridge puts it far away, and the start is a poor one.
        determinant = suu * stt - sut * sut + 1e-12 * (suu + stt) ** 2
        u = 0.5 * (szu * stt - szt * sut) / determinant
        t = 0.5 * (szt * suu - szu * sut) / determinant
        # r^2 = mean of (u - u0)^2 + (t - t0)^2.
        square = (sz - 2.0 * (u * su + t * st)) / n + u * u + t * t
        p[6], p[7] = u + u0, np.sqrt(max(square, 0.0))
        for k in range(3):
            p[k] += (t + t0) * p[3 + k]


# Factor of a squared distance: points on the circle count as inside despite rounding.
_INSIDE = 1.0 + 1e-14


@compiled()
def narrowest_tube(about: Float, axes: Float) -> float:
    """Return the diameter of the thinnest cylinder along the first axis about points.

    It is the smallest circle about their projections, found from a few points, extended by the
    farthest one outside until none is left; takes a few rounds.
    """
    n = len(about)
    places, few = np.empty((n, 2)), np.empty((n, 2))
    for row in range(n):
        a, b, c = about[row, 0], about[row, 1], about[row, 2]
        # The coordinate along the axis is irrelevant; axes are unit vectors by rows.
        places[row, 0] = a * axes[1, 0] + b * axes[1, 1] + c * axes[1, 2]
        places[row, 1] = a * axes[2, 0] + b * axes[2, 1] + c * axes[2, 2]
    # No circle yet: the first round adds the place farthest from the origin.
    x, y, square = 0.0, 0.0, -1.0
    for count in range(n):
        farthest, worst = 0, -1.0
        for row in range(n):
            dx, dy = places[row, 0] - x, places[row, 1] - y
            distance = dx * dx + dy * dy
            if distance > worst:
                farthest, worst = row, distance
        # Every point is within the smallest circle of some of them, which is a lower bound.
        if count > 0 and worst <= square * _INSIDE:
            break
        few[count] = places[farthest]
        x, y, square = _smallest_circle(few[: count + 1])
    return float(2.0 * np.sqrt(max(square, 0.0)))


@compiled()
def _smallest_circle(places: Float) -> tuple[float, float, float]:
    """Return centre and squared radius of the smallest circle (E. Welzl, 1991)."""
    x, y, square = places[0, 0], places[0, 1], 0.0
    for i in range(1, len(places)):
        # A point outside the smallest circle of its predecessors is on the rim of the next one; so
        # is a second one, and a third closes the circle.
        if not _outside(places, i, x, y, square):
            continue
        x, y, square = places[i, 0], places[i, 1], 0.0
        for j in range(i):
            if not _outside(places, j, x, y, square):
                continue
            x, y, square = _circle_of_two(places, i, j)
            for k in range(j):
                if _outside(places, k, x, y, square):
                    x, y, square = _circle_of_three(places, i, j, k)
    return x, y, square


@compiled()
def _outside(places: Float, row: int, x: float, y: float, square: float) -> bool:
    dx, dy = places[row, 0] - x, places[row, 1] - y
    return bool(dx * dx + dy * dy > square * _INSIDE)


@compiled()
def _circle_of_two(places: Float, i: int, j: int) -> tuple[float, float, float]:
    dx, dy = 0.5 * (places[j, 0] - places[i, 0]), 0.5 * (places[j, 1] - places[i, 1])
    return places[i, 0] + dx, places[i, 1] + dy, dx * dx + dy * dy


@compiled()
def _circle_of_three(places: Float, i: int, j: int, k: int) -> tuple[float, float, float]:
    bx, by = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
    cx, cy = places[k, 0] - places[i, 0], places[k, 1] - places[i, 1]
    area = 2.0 * (bx * cy - by * cx)
    # Three collinear places have no circle through them; only by rounding.
    if area == 0.0:
        return _circle_of_two(places, i, j)
    b, c = bx * bx + by * by, cx * cx + cy * cy
    # Intersection of the perpendicular bisectors, relative to the first place: 2 b . d = |b|^2 and
    # 2 c . d = |c|^2, by Cramer.
    dx, dy = (cy * b - by * c) / area, (bx * c - cx * b) / area
    return places[i, 0] + dx, places[i, 1] + dy, dx * dx + dy * dy
