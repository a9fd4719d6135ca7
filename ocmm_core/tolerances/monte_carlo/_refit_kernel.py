"""Compiled refits of a Monte Carlo evaluation: the same element through moved points.

Every trial starts at the element of the measured points: two or three Newton steps on the terms of
the ordinary fits (`features.search`) reach the minimum. Planes and lines turn their
direction to an eigenvector of the moments.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.search import (
    BALL,
    CONE,
    DISC,
    STEP_SIZE,
    TORUS,
    across,
    axis_kernel,
    ellipse_kernel,
    flat_kernel,
    move,
    newton_kernel,
    solve_step,
    terms,
)
from ocmm_core.geometry import Float, Int

POINT_KIND, LINE_KIND, PLANE_KIND, PROJECTED_KIND = -1, -2, -3, -4
"""Kinds in addition to those of the fits; a `DISC` is in the plane of its points."""

_SETTLED = 1e-6
"""Length of a step, in sizes of the feature, with a negligible square."""
_MOST_STEPS = 12


@compiled(axis_kernel, ellipse_kernel, flat_kernel, newton_kernel)
def _settle(
    kind: int, points: Float, p: Float, residuals: Float, jacobian: Float, curvature: Float,
    normal: Float, gradient: Float, step: Float, moved: Float,
) -> bool:  # fmt: skip
    """Move ``p`` (8,) to the minimum near it, in place, with ``residuals`` there."""
    n, k = jacobian.shape
    for _ in range(_MOST_STEPS):
        # Second derivatives from the start: the element of the measured points is near enough for a
        # convex cost.
        terms(kind, points, p, residuals, jacobian, curvature)
        for i in range(k):
            gradient[i] = 0.0
            for j in range(i + 1):
                normal[i, j] = curvature[i, j]
        for row in range(n):
            for i in range(k):
                value = jacobian[row, i]
                gradient[i] += value * residuals[row]
                for j in range(i + 1):
                    normal[i, j] += value * jacobian[row, j]
        # The curvature is already in `normal`, hence a share of zero; no damping, and the factor
        # replaces the matrix.
        if not solve_step(normal, curvature, gradient, 0.0, 0.0, normal, step):
            return False
        move(kind, p, step, moved)
        square = 0.0
        for i in range(k):
            square += step[i] * step[i]
        for i in range(8):
            p[i] = moved[i]
        # A step as long as the feature leads to another element; NaN also ends here.
        if not square < 1.0:
            return False
        if square < _SETTLED * _SETTLED:
            # The residuals precede the last step; its first order updates them, as the square of
            # 1e-6 is negligible.
            for row in range(n):
                for i in range(k):
                    residuals[row] += jacobian[row, i] * step[i]
            return True
    return False


@compiled(axis_kernel)
def _moments(points: Float, x: Float, e: Float, most: bool) -> bool:
    """Turn ``x`` (3,) to the nearby eigenvector of the largest (``most``) or least moment."""
    s = np.zeros((3, 3))
    for row in range(len(points)):
        for i in range(3):
            for j in range(i + 1):
                s[i, j] += points[row, i] * points[row, j]
    for i in range(3):
        for j in range(i):
            s[j, i] = s[i, j]
    # Two or three rotations suffice; the bound is for directions that no moment determines.
    for _ in range(30):
        across(x[0], x[1], x[2], e)
        m = np.zeros((3, 3))
        for a in range(3):
            for b in range(3):
                total = 0.0
                for i in range(3):
                    # Moments along the two directions across x and along x: x' S x is the last
                    # element.
                    left = x[i] if a == 2 else e[a, i]
                    for j in range(3):
                        right = x[j] if b == 2 else e[b, j]
                        total += left * s[i, j] * right
                m[a, b] = total
        # Newton's step for the eigenvector: (M - lambda) t = -M x, across x, with the eigenvalue of
        # M estimated by x' M x.
        a, b, d = m[0, 0] - m[2, 2], m[0, 1], m[1, 1] - m[2, 2]
        determinant = a * d - b * b
        # Both its eigenvalues must have one sign: negative for the greatest moment, positive for
        # the smallest. Otherwise x is near another axis.
        if determinant <= 0.0 or (a > 0.0) == most:
            return False
        t0 = -(d * m[0, 2] - b * m[1, 2]) / determinant
        t1 = -(a * m[1, 2] - b * m[0, 2]) / determinant
        length = 0.0
        for i in range(3):
            x[i] += t0 * e[0, i] + t1 * e[1, i]
            length += x[i] * x[i]
        length = np.sqrt(length)
        for i in range(3):
            x[i] /= length
        # The rotation was below 1e-6 rad; the next one would be its third power.
        if t0 * t0 + t1 * t1 < 1e-12:
            return True
    return False


@compiled(axis_kernel, ellipse_kernel, flat_kernel, newton_kernel)
def refit(
    kind: int, base: Float, size: float, places: Int, deviations: Float, start: Float,
    normals: Float, geometry: Float, ranges: Float,
) -> int:  # fmt: skip
    """Fit the element of ``kind`` through the points of every trial.

    `kind`: of `newton_kernel`, or one of the kinds here. `base`: (n, 3): measured points about
    their centroid, mm. `size`: mm: scale of the points. `places`: (n,): indices of the points among
    all. `deviations`: (m, >= 3 N), mm: of all points in every trial. `start`: (8,): element of the
    measured points, about their centroid, in sizes; for lines and planes the direction is at the
    axis entries. `normals`: (m, 3): of the plane of a projected circle; otherwise unused.
    `geometry`: (m, 12), out: as `shapes.element`, mm, about the centroid of the measured points.
    `ranges`: (m,), out: greatest less smallest residual, mm. Returns trials without a fit (NaN).
    """
    n = len(base)
    flat = kind in (DISC, PROJECTED_KIND)
    solver = DISC if flat else max(kind, 0)
    k = STEP_SIZE[solver]
    about = np.empty((n, 3))
    disc = np.empty((n, 2))
    e = np.empty((2, 3))
    p, moved, step, gradient = np.empty(8), np.empty(8), np.empty(k), np.empty(k)
    residuals, jacobian = np.empty(n), np.empty((n, k))
    curvature, normal = np.empty((k, k)), np.empty((k, k))
    middle, axis = np.empty(3), np.empty(3)
    failed = 0
    for trial in range(len(deviations)):
        for i in range(3):
            total = 0.0
            for row in range(n):
                # Points of the trial: measured ones with drawn errors, mm, then in sizes.
                value = base[row, i] + deviations[trial, 3 * places[row] + i]
                about[row, i] = value / size
                total += about[row, i]
            # Centroid of the trial, in sizes; the place of elements about it.
            middle[i] = total / n
        for i in range(12):
            geometry[trial, i] = 0.0
        for i in range(8):
            p[i] = start[i]
        for i in range(3):
            axis[i] = normals[trial, i] if kind == PROJECTED_KIND else start[3 + i]
        ok = True
        # Planes, lines and discs are fitted about the centroid of the trial, the others about that
        # of the measured points, as their start.
        if kind < 0 or flat:
            for row in range(n):
                for i in range(3):
                    about[row, i] -= middle[i]
            if kind == LINE_KIND:
                ok = _moments(about, axis, e, True)
            elif kind in (PLANE_KIND, DISC):
                ok = _moments(about, axis, e, False)
        if kind == POINT_KIND:
            for row in range(n):
                residuals[row] = 0.0
        elif kind == LINE_KIND:
            across(axis[0], axis[1], axis[2], e)
            for row in range(n):
                # Without the sides of the ordinary fit; the range of a line is unused.
                residuals[row] = np.hypot(
                    about[row, 0] * e[0, 0] + about[row, 1] * e[0, 1] + about[row, 2] * e[0, 2],
                    about[row, 0] * e[1, 0] + about[row, 1] * e[1, 1] + about[row, 2] * e[1, 2],
                )
        # Signed, by the axis of the start: the sum is zero, the range the flatness.
        elif kind == PLANE_KIND:
            for row in range(n):
                residuals[row] = (
                    about[row, 0] * axis[0] + about[row, 1] * axis[1] + about[row, 2] * axis[2]
                )
        elif flat:
            across(axis[0], axis[1], axis[2], e)
            for row in range(n):
                for a in range(2):
                    disc[row, a] = (
                        about[row, 0] * e[a, 0] + about[row, 1] * e[a, 1] + about[row, 2] * e[a, 2]
                    )
            for a in range(2):
                p[a] = 0.0
                for i in range(3):
                    # The start's centre in the plane of this trial.
                    p[a] += (start[i] - middle[i]) * e[a, i]
            p[2] = start[6]
            ok = ok and _settle(
                DISC, disc, p, residuals, jacobian, curvature, normal, gradient, step, moved
            )
        else:
            ok = _settle(
                solver, about, p, residuals, jacobian, curvature, normal, gradient, step, moved
            )
        if not ok:
            failed += 1
            for i in range(12):
                geometry[trial, i] = np.nan
            ranges[trial] = np.nan
            continue
        least = most = residuals[0]
        for row in range(1, n):
            least = min(least, residuals[row])
            most = max(most, residuals[row])
        # Back from sizes to mm.
        ranges[trial] = size * (most - least)
        if kind < 0 or flat:
            for i in range(3):
                # In sizes for now; the loop at the end converts all places to mm.
                geometry[trial, i] = middle[i]
                if kind != POINT_KIND:
                    geometry[trial, 3 + i] = axis[i]
                if flat:
                    geometry[trial, i] += p[0] * e[0, i] + p[1] * e[1, i]
            if flat:
                geometry[trial, 6] = size * p[2]
        elif kind == BALL:
            for i in range(3):
                geometry[trial, i] = p[i]
            geometry[trial, 6] = size * p[3]
        else:
            along = 0.0
            for i in range(3):
                # Position of the centroid along the axis, the place of the element: a cylinder is
                # unlocated along its axis. A torus has its centre.
                along += (middle[i] - p[i]) * p[3 + i]
            if kind == TORUS:
                along = 0.0
            for i in range(3):
                geometry[trial, i] = p[i] + along * p[3 + i]
                geometry[trial, 3 + i] = p[3 + i]
            geometry[trial, 6] = size * p[6]
            if kind == TORUS:
                geometry[trial, 7] = size * p[7]
            elif kind == CONE:
                # rho cos f - t sin f - s = 0 on the surface: the radius at the height t is (s + t
                # sin f) / cos f.
                sine, cosine = np.sin(p[6]), np.cos(p[6])
                geometry[trial, 6] = size * (p[7] + along * sine) / cosine
                geometry[trial, 8] = p[6]
        for i in range(3):
            geometry[trial, i] *= size
    return failed
