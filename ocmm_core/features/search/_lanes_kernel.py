"""Compiled descent of many starts about an axis in parallel: one start per lane.

Cylinder, cone and torus through few points have many minima, searched by hundreds of starts. All
starts use the same points and operations, so they run side by side: every loop below runs over
lanes, and a finished lane takes the next start. Parameters, steps, distances and derivations are
those of `axis_kernel`.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.features.search._axis_kernel import CONE, CYLINDER, TORUS
from ocmm_core.geometry import Float

LANES = 32
"""Starts in parallel: their data stay in the fastest memory."""
ENOUGH = 1e-4
"""Relative gain of a step that ends a descent."""
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e8

# Rows of the block, one element a lane: parameters, trial parameters, two directions across the
# axis, derivatives of a distance, the distance; gradient and normal matrix (lower half) at the
# parameters and at the trial; factor, step; cost, trial cost, damping, solvable flag, cosine and
# sine of a cone's angle.
_P, _Q, _E, _J, _R = 0, 8, 16, 22, 29
_G, _N, _NEW_G, _NEW_N, _L, _S = 30, 37, 65, 72, 100, 128
_COST, _NEW, _DAMPING, _SOLVED, _COS, _SIN, _ROWS = 135, 136, 137, 138, 139, 140, 141
_MATRIX = 28
_NEAREST, _UNMOVED = 1e-12, 1e-60


@compiled()
def _distances(kind: int, x: float, y: float, z: float, lanes: int, b: Float) -> None:
    """Write distance and derivatives of one point in every lane; see `axis_kernel.axis_terms`."""
    for w in range(min(lanes, LANES)):
        q = x - b[_Q * LANES + w], y - b[(_Q + 1) * LANES + w], z - b[(_Q + 2) * LANES + w]
        a = b[(_Q + 3) * LANES + w], b[(_Q + 4) * LANES + w], b[(_Q + 5) * LANES + w]
        e = b[_E * LANES + w], b[(_E + 1) * LANES + w], b[(_E + 2) * LANES + w]
        f = b[(_E + 3) * LANES + w], b[(_E + 4) * LANES + w], b[(_E + 5) * LANES + w]
        u = q[0] * e[0] + q[1] * e[1] + q[2] * e[2]
        v = q[0] * f[0] + q[1] * f[1] + q[2] * f[2]
        t = q[0] * a[0] + q[1] * a[1] + q[2] * a[2]
        rho = np.sqrt(u * u + v * v)
        # NaN stays NaN.
        rho = _NEAREST if rho < _NEAREST else rho
        nu, nv = u / rho, v / rho
        first, second = b[(_Q + 6) * LANES + w], b[(_Q + 7) * LANES + w]
        if kind == CYLINDER:
            d = rho - first
            b[_J * LANES + w], b[(_J + 1) * LANES + w] = -nu, -nv
            b[(_J + 2) * LANES + w], b[(_J + 3) * LANES + w] = -nu * t, -nv * t
            b[(_J + 4) * LANES + w] = -1.0
        elif kind == CONE:
            c, s = b[_COS * LANES + w], b[_SIN * LANES + w]
            d = rho * c - t * s - second
            b[_J * LANES + w], b[(_J + 1) * LANES + w] = -nu * c, -nv * c
            b[(_J + 2) * LANES + w] = -nu * t * c - u * s
            b[(_J + 3) * LANES + w] = -nv * t * c - v * s
            b[(_J + 4) * LANES + w], b[(_J + 5) * LANES + w] = -rho * s - t * c, -1.0
        else:
            beyond = rho - first
            tube = np.sqrt(beyond * beyond + t * t)
            tube = _NEAREST if tube < _NEAREST else tube
            d = tube - second
            radial, lift = beyond / tube, t / tube
            b[_J * LANES + w], b[(_J + 1) * LANES + w] = -nu * radial, -nv * radial
            b[(_J + 2) * LANES + w] = -lift
            b[(_J + 3) * LANES + w] = lift * u - radial * nu * t
            b[(_J + 4) * LANES + w] = lift * v - radial * nv * t
            b[(_J + 5) * LANES + w], b[(_J + 6) * LANES + w] = -radial, -1.0
        b[_R * LANES + w] = d
        b[_NEW * LANES + w] += d * d


@compiled()
def _evaluate(kind: int, k: int, points: Float, lanes: int, b: Float) -> None:
    """Write cost, gradient and normal matrix at the trial parameters."""
    flat = b.reshape(-1)
    b[_NEW_G : _NEW_N + _MATRIX, :lanes] = 0.0
    for w in range(min(lanes, LANES)):
        flat[_NEW * LANES + w] = 0.0
        ax, ay, az = (
            flat[(_Q + 3) * LANES + w],
            flat[(_Q + 4) * LANES + w],
            flat[(_Q + 5) * LANES + w],
        )
        # As `axis_kernel.across`.
        sign = 1.0 if az >= 0.0 else -1.0
        a = -1.0 / (sign + az)
        shared = ax * ay * a
        flat[_E * LANES + w] = 1.0 + sign * ax * ax * a
        flat[(_E + 1) * LANES + w], flat[(_E + 2) * LANES + w] = sign * shared, -sign * ax
        flat[(_E + 3) * LANES + w], flat[(_E + 4) * LANES + w] = shared, sign + ay * ay * a
        flat[(_E + 5) * LANES + w] = -ay
    if kind == CONE:
        for w in range(min(lanes, LANES)):
            angle = flat[(_Q + 6) * LANES + w]
            flat[_COS * LANES + w], flat[_SIN * LANES + w] = np.cos(angle), np.sin(angle)
    for row in range(len(points)):
        x, y, z = points[row, 0], points[row, 1], points[row, 2]
        # The kind is a literal, so that the loop over the lanes has no branch.
        if kind == CYLINDER:
            _distances(CYLINDER, x, y, z, lanes, flat)
        elif kind == CONE:
            _distances(CONE, x, y, z, lanes, flat)
        else:
            _distances(TORUS, x, y, z, lanes, flat)
        place = _NEW_N
        for i in range(k):
            own, gradient = _J + i, _NEW_G + i
            for w in range(lanes):
                b[gradient, w] += b[own, w] * b[_R, w]
            for j in range(i + 1):
                other = _J + j
                for w in range(lanes):
                    b[place, w] += b[own, w] * b[other, w]
                place += 1


@compiled()
def _solve(k: int, lanes: int, b: Float) -> None:
    """Write minus the solution of the damped normal equations to the step of every lane."""
    for w in range(lanes):
        b[_SOLVED, w] = 1.0
    for i in range(k):
        for j in range(i + 1):
            place = i * (i + 1) // 2 + j
            total, of = _L + place, _N + place
            for w in range(lanes):
                b[total, w] = b[of, w]
            if i == j:
                for w in range(lanes):
                    b[total, w] += b[_DAMPING, w] * b[of, w] + _UNMOVED
            for m in range(j):
                first = _L + i * (i + 1) // 2 + m
                second = _L + j * (j + 1) // 2 + m
                for w in range(lanes):
                    b[total, w] -= b[first, w] * b[second, w]
            if i == j:
                for w in range(lanes):
                    # No Cholesky factor: rounding, or NaN.
                    sound = b[total, w] > 0.0
                    b[_SOLVED, w] = b[_SOLVED, w] if sound else 0.0
                    # The inverse of the root, as it is only divided by.
                    b[total, w] = 1.0 / np.sqrt(b[total, w] if sound else 1.0)
            else:
                root = _L + j * (j + 1) // 2 + j
                for w in range(lanes):
                    b[total, w] *= b[root, w]
    for i in range(k):
        step, root = _S + i, _L + i * (i + 1) // 2 + i
        for w in range(lanes):
            b[step, w] = -b[_G + i, w]
        for m in range(i):
            factor, other = _L + i * (i + 1) // 2 + m, _S + m
            for w in range(lanes):
                b[step, w] -= b[factor, w] * b[other, w]
        for w in range(lanes):
            b[step, w] *= b[root, w]
    for i in range(k - 1, -1, -1):
        step, root = _S + i, _L + i * (i + 1) // 2 + i
        for m in range(i + 1, k):
            factor, other = _L + m * (m + 1) // 2 + i, _S + m
            for w in range(lanes):
                b[step, w] -= b[factor, w] * b[other, w]
        for w in range(lanes):
            b[step, w] *= b[root, w]


@compiled()
def _move(kind: int, lanes: int, b: Float) -> None:
    """Write the parameters after the step of every lane to the trial ones."""
    along = 0 if kind <= CONE else 1
    for w in range(min(lanes, LANES)):
        # Recompute directions across the axis: those in the block are of the last trial.
        ax, ay, az = b[(_P + 3) * LANES + w], b[(_P + 4) * LANES + w], b[(_P + 5) * LANES + w]
        sign = 1.0 if az >= 0.0 else -1.0
        a = -1.0 / (sign + az)
        shared = ax * ay * a
        ex, ey, ez = 1.0 + sign * ax * ax * a, sign * shared, -sign * ax
        fx, fy, fz = shared, sign + ay * ay * a, -ay
        s1, s2 = b[_S * LANES + w], b[(_S + 1) * LANES + w]
        sa = b[(_S + 2) * LANES + w] if along else 0.0
        t1, t2 = b[(_S + 2 + along) * LANES + w], b[(_S + 3 + along) * LANES + w]
        px = b[_P * LANES + w] + s1 * ex + s2 * fx + sa * ax
        py = b[(_P + 1) * LANES + w] + s1 * ey + s2 * fy + sa * ay
        pz = b[(_P + 2) * LANES + w] + s1 * ez + s2 * fz + sa * az
        # By twice the angle with tangent |t| / 2: |t| itself to third order, at most half a turn,
        # and without a sine.
        quarter = 0.25 * (t1 * t1 + t2 * t2)
        c, s = (1.0 - quarter) / (1.0 + quarter), 1.0 / (1.0 + quarter)
        nx = c * ax + s * (t1 * ex + t2 * fx)
        ny = c * ay + s * (t1 * ey + t2 * fy)
        nz = c * az + s * (t1 * ez + t2 * fz)
        scale = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        # The axis point of cylinder and cone stays the foot of the origin.
        foot = 0.0 if along else px * nx + py * ny + pz * nz
        b[_Q * LANES + w], b[(_Q + 1) * LANES + w] = px - foot * nx, py - foot * ny
        b[(_Q + 2) * LANES + w], b[(_Q + 3) * LANES + w] = pz - foot * nz, nx
        b[(_Q + 4) * LANES + w], b[(_Q + 5) * LANES + w] = ny, nz
        b[(_Q + 6) * LANES + w] = b[(_P + 6) * LANES + w] + b[(_S + 4 + along) * LANES + w]
        b[(_Q + 7) * LANES + w] = b[(_P + 7) * LANES + w]
        b[_COS * LANES + w] = foot
    if kind != CYLINDER:
        for w in range(min(lanes, LANES)):
            b[(_Q + 7) * LANES + w] += b[(_S + 5 + along) * LANES + w]
    if kind == CONE:
        for w in range(min(lanes, LANES)):
            b[(_Q + 7) * LANES + w] -= b[_COS * LANES + w] * np.sin(b[(_Q + 6) * LANES + w])


@compiled()
def _load_start(start: Float, w: int, b: Float) -> None:
    """Load a start into a lane; its first trial is the start itself, always accepted."""
    for i in range(8):
        b[_Q + i, w] = start[i]
    b[_COST, w], b[_DAMPING, w] = np.inf, FIRST_DAMPING


@compiled()
def _accept(k: int, lanes: int, b: Float) -> None:
    for shift, first, last in (
        (_Q - _P, _P, _P + 8), (_NEW_G - _G, _G, _G + k), (_NEW_N - _N, _N, _N + k * (k + 1) // 2)
    ):  # fmt: skip
        for row in range(first, last):
            old, new = row, row + shift
            for w in range(lanes):
                better = b[_NEW, w] < b[_COST, w]
                b[old, w] = b[new, w] if better else b[old, w]


@compiled()
def descend_lanes(
    kind: int, k: int, points: Float, starts: Float, steps: int, costs: Float
) -> None:
    """Apply some damped Gauss-Newton steps to every start (8,), in place.

    For cylinder, cone and torus with steps of length ``k`` and points (n, 3). ``costs`` (m,) are
    written: sums of squared residuals.
    """
    b = np.zeros((_ROWS, LANES))
    which, tries = np.empty(LANES, np.int64), np.empty(LANES, np.int64)
    lanes = min(LANES, len(starts))
    for w in range(lanes):
        which[w], tries[w] = w, steps
        _load_start(starts[w], w, b)
    following = lanes
    while lanes > 0:
        _evaluate(kind, k, points, lanes, b)
        _accept(k, lanes, b)
        for w in range(lanes):
            cost, new = b[_COST, w], b[_NEW, w]
            better, first = new < cost, cost == np.inf
            # Only order and basin matter: a step of little gain ends the descent, as does a place
            # that no damping improves.
            if tries[w] == 0 or (first and not better) or (new > cost * (1.0 - ENOUGH) and better):
                tries[w] = 0
            if not first:
                b[_DAMPING, w] *= 0.1 if better else 10.0
            b[_COST, w] = new if better or first else cost
        _solve(k, lanes, b)
        _move(kind, lanes, b.reshape(-1))
        for w in range(lanes - 1, -1, -1):
            sound = b[_SOLVED, w] > 0.0 and b[_DAMPING, w] <= MOST_DAMPING
            if sound and tries[w] > 0:
                tries[w] -= 1
                continue
            costs[which[w]] = b[_COST, w]
            # A start with NaN stays unchanged.
            for i in range(8 if np.isfinite(b[_COST, w]) else 0):
                starts[which[w], i] = b[_P + i, w]
            if following < len(starts):
                which[w], tries[w] = following, steps
                _load_start(starts[following], w, b)
                following += 1
                continue
            # No start is waiting: the last lane moves here, and there is one less.
            lanes -= 1
            which[w], tries[w] = which[lanes], tries[lanes]
            for row in range(_ROWS):
                b[row, w] = b[row, lanes]
