"""Rotations and small matrices of eight frames in parallel; see `_lanes`.

Numbers are passed individually and in tuples, so that they stay in registers; of symmetric matrices
the lower triangle by rows.
"""

from __future__ import annotations

from ocmm_core.camera import compiled
from ocmm_core.tracking.kernels import _lanes as lanes
from ocmm_core.tracking.kernels._lanes import Number, any_above, choose, spread

_NEWTON_STEPS = 40
_SETTLED = 1e-14


@compiled()
def rotation_of_quaternion(w: Number, x: Number, y: Number, z: Number) -> tuple[Number, ...]:
    """Return the rotation, by rows, of a quaternion of any length."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    sx, sy, sz = s * x, s * y, s * z
    xx, yy, zz = sx * x, sy * y, sz * z
    xy, xz, yz = sx * y, sx * z, sy * z
    wx, wy, wz = sx * w, sy * w, sz * w
    return (
        1.0 - (yy + zz), xy - wz, xz + wy,
        xy + wz, 1.0 - (xx + zz), yz - wx,
        xz - wy, yz + wx, 1.0 - (xx + yy),
    )  # fmt: skip


@compiled()
def product(a: tuple[Number, ...], b: tuple[Number, ...]) -> tuple[Number, ...]:
    """Return the product of two matrices (3, 3), by rows."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@compiled()
def rotation_of_vector(wx: Number, wy: Number, wz: Number) -> tuple[Number, ...]:
    """Return exp(w), by rows.

    The quaternion of a sixteenth of the half angle's double, squared four times. Up to a whole turn
    the series starts at 0.2 rad, and its first missing term is 0.2^12 / 12! = 9e-18; larger
    rotations in one step are invalid poses, and still give a rotation.
    """
    # Half the angle over 16 is the angle over 32.
    t = (wx * wx + wy * wy + wz * wz) * (1.0 / 1024.0)
    sine = 1.0 - t * (1.0 / 6.0) * (
        1.0 - t * (1.0 / 20.0) * (1.0 - t * (1.0 / 42.0) * (1.0 - t * (1.0 / 72.0)))
    )
    cosine = 1.0 - t * 0.5 * (
        1.0 - t * (1.0 / 12.0) * (
            1.0 - t * (1.0 / 30.0) * (1.0 - t * (1.0 / 56.0) * (1.0 - t * (1.0 / 90.0)))
        )
    )  # fmt: skip
    w = cosine
    x, y, z = wx * sine * (1.0 / 32.0), wy * sine * (1.0 / 32.0), wz * sine * (1.0 / 32.0)
    for _ in range(4):
        w, x, y, z = w * w - (x * x + y * y + z * z), 2.0 * w * x, 2.0 * w * y, 2.0 * w * z
    return rotation_of_quaternion(w, x, y, z)


@compiled()
def inverse3(
    a00: Number, a10: Number, a11: Number, a20: Number, a21: Number, a22: Number
) -> tuple[Number, ...]:
    """Return the inverse of a symmetric matrix (3, 3), by LDL', and its least pivot.

    The pivots are positive for a positive definite matrix; else the inverse is meaningless.
    """
    i0 = 1.0 / a00
    l10, l20 = a10 * i0, a20 * i0
    d1 = a11 - l10 * a10
    i1 = 1.0 / d1
    b21 = a21 - l20 * a10
    l21 = b21 * i1
    d2 = a22 - l20 * a20 - l21 * b21
    i2 = 1.0 / d2
    # L^-1 is unit lower: its elements below the diagonal are -l10, m20 and -l21.
    m20 = l10 * l21 - l20
    # The inverse is L^-T D^-1 L^-1.
    c20, c21 = m20 * i2, (0.0 - l21) * i2
    c10 = (0.0 - l10) * i1 - c20 * l21
    least = choose(a00, d1, d1, a00)
    least = choose(least, d2, d2, least)
    return (
        i0 + l10 * l10 * i1 + m20 * c20, c10, i1 - l21 * c21, c20, c21, i2, least,
    )  # fmt: skip


@compiled(lanes)
def best_rotation(like: Number, s: tuple[Number, ...], size: Number) -> tuple[Number, ...]:
    """Return the rotation, by rows, with the largest trace of its transpose times s'.

    ``s`` is the sum of ``a b'`` over pairs, the rotation maps a to b, and ``size`` is half the sum
    of ``|a|^2 + |b|^2``. Horn's quaternion (1987): that of the largest eigenvalue of his matrix N,
    a proper rotation for every s. The eigenvalue is at most ``size``, less by the misfit: Newton
    steps from there on the characteristic polynomial, whose roots are all real, descend to it
    without overshoot (Theobald, Acta Cryst. A61, 2005). The quaternion is a column of the adjoint
    of N less the eigenvalue, which has rank one.

    Rounding grows as the square of length over width of the LEDs, over 16. One more step on the
    rotation itself removes it: with P = R'S' the best remaining rotation is w = (tr P I - P)^-1 v,
    v the axis of P - P', exact to the third power of the remainder.
    """
    s00, s01, s02, s10, s11, s12, s20, s21, s22 = s
    a, b, c, d = s00 + s11 + s22, s12 - s21, s20 - s02, s01 - s10
    e, f, g = s00 - s11 - s22, s01 + s10, s20 + s02
    h, i, j = s11 - s00 - s22, s12 + s21, s22 - s00 - s11
    c2 = -2.0 * (
        s00 * s00 + s01 * s01 + s02 * s02 + s10 * s10 + s11 * s11 + s12 * s12
        + s20 * s20 + s21 * s21 + s22 * s22
    )  # fmt: skip
    c1 = -8.0 * (
        s00 * (s11 * s22 - s12 * s21) - s01 * (s10 * s22 - s12 * s20)
        + s02 * (s10 * s21 - s11 * s20)
    )  # fmt: skip
    # The determinant of N by its minors of the last two rows.
    c0 = (
        (a * e - b * b) * (h * j - i * i) - (a * f - c * b) * (f * j - g * i)
        + (a * g - d * b) * (f * i - g * h) + (b * f - c * e) * (c * j - d * i)
        - (b * g - d * e) * (c * i - d * h) + (c * g - d * f) * (c * g - d * f)
    )  # fmt: skip
    top = size
    for _ in range(_NEWTON_STEPS):
        square = top * top
        slope = (square + c2) * top
        whole = slope + c1
        # A converged frame stays unchanged, independent of its neighbours.
        step = (whole * top + c0) / (2.0 * square * top + slope + whole)
        least = _SETTLED * top
        moving = choose(step, least, step, choose(0.0 - step, least, step, spread(like, 0.0)))
        top = top - moving
        if not any_above(moving * moving, spread(like, 0.0)):
            break
    a, e, h, j = a - top, e - top, h - top, j - top
    hj, fj, fi = h * j - i * i, f * j - g * i, f * i - g * h
    cj, ci, cg = c * j - d * i, c * i - d * h, c * g - d * f
    q00 = e * hj - f * fj + g * fi
    q01 = f * cj - b * hj - g * ci
    q02 = b * fj - e * cj + g * cg
    q03 = e * ci - b * fi - f * cg
    q11 = a * hj - c * cj + d * ci
    q12 = b * cj - a * fj - d * cg
    q13 = a * fi - b * ci + c * cg
    q22 = a * (e * j - g * g) - b * (b * j - d * g) + d * (b * g - d * e)
    q23 = b * (b * i - f * d) - a * (e * i - f * g) - c * (b * g - e * d)
    q33 = a * (e * h - f * f) - b * (b * h - c * f) + c * (b * f - c * e)
    # Three eigenvalues are negative, and so is the diagonal: the column of its most negative
    # element has lost no digits.
    w, x, y, z, least = q00, q01, q02, q03, q00
    w, x = choose(least, q11, q01, w), choose(least, q11, q11, x)
    y, z = choose(least, q11, q12, y), choose(least, q11, q13, z)
    least = choose(least, q11, q11, least)
    w, x = choose(least, q22, q02, w), choose(least, q22, q12, x)
    y, z = choose(least, q22, q22, y), choose(least, q22, q23, z)
    least = choose(least, q22, q22, least)
    w, x = choose(least, q33, q03, w), choose(least, q33, q13, x)
    y, z = choose(least, q33, q23, y), choose(least, q33, q33, z)
    rotation = rotation_of_quaternion(w, x, y, z)
    # B = sum of b (R a)': at the best rotation it is symmetric.
    p = product((s00, s10, s20, s01, s11, s21, s02, s12, s22), (
        rotation[0], rotation[3], rotation[6], rotation[1], rotation[4], rotation[7],
        rotation[2], rotation[5], rotation[8],
    ))  # fmt: skip
    trace = p[0] + p[4] + p[8]
    k = inverse3(
        2.0 * (trace - p[0]), 0.0 - (p[1] + p[3]), 2.0 * (trace - p[4]),
        0.0 - (p[2] + p[6]), 0.0 - (p[5] + p[7]), 2.0 * (trace - p[8]),
    )  # fmt: skip
    vx, vy, vz = 2.0 * (p[7] - p[5]), 2.0 * (p[2] - p[6]), 2.0 * (p[3] - p[1])
    turn = rotation_of_vector(
        k[0] * vx + k[1] * vy + k[3] * vz,
        k[1] * vx + k[2] * vy + k[4] * vz,
        k[3] * vx + k[4] * vy + k[5] * vz,
    )
    return product(turn, rotation)
