"""Compiled loops of the virtual rig: probe motion, and camera views of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.cpu_features import njit
from ocmm_core.geometry import Float, Int

MOVE, TOUCH, REST, SLIDE = 0, 1, 2, 3
"""Kinds of segments of the motion; a slide is even, in contact, with the button held."""

# Columns of a motion segment. Times in s, places in mm, attitudes as rotation vectors (rad), world
# frame.
T0, T1, KIND, TOP, SWAY0, SWAY1 = range(6)
P0, P1, W0, W1, NORMAL = 6, 9, 12, 15, 18
N_COLUMNS = 21

BUTTON_DOWN_S, BUTTON_UP_S = 0.10, 0.14
"""Button press and release after contact."""

SETTLE_S, SETTLE_MM = 0.08, 0.02
"""Time and height of the single bounce on contact."""


@njit(cache=True, nogil=True, inline="always")
def _minimum_jerk(x: float) -> float:
    """Return a smooth 0 to 1 with zero velocity and acceleration at both ends."""
    if x <= 0.0:
        return 0.0
    if x >= 1.0:
        return 1.0
    # 10 x^3 - 15 x^4 + 6 x^5: minimum jerk (Flash and Hogan 1985).
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@njit(cache=True, nogil=True)
def move(
    times: Float,
    segments: Float,
    tremor: Float,
    rotation: Float,
    tip: Float,
    button: NDArray[np.bool_],
    contact: NDArray[np.bool_],
) -> None:
    """Fill in attitude, ball centre, button and contact at each time.

    ``times`` (n,), s, ascending. ``segments`` (S, N_COLUMNS), consecutive; after the last one the
    probe stays at its end. ``tremor`` (2, 3, K, 3): for attitude (rad) and place (mm), each axis
    and wave: amplitude, angular frequency, phase. ``rotation`` (n, 3, 3), ``tip`` (n, 3),
    ``button`` and ``contact`` (n,) bool are outputs.
    """
    last = len(segments) - 1
    k = 0
    w = np.empty(3)
    for i in range(len(times)):
        t = times[i]
        if i == 0:
            k = min(max(np.searchsorted(segments[:, T0], t, side="right") - 1, 0), last)
        while k < last and t >= segments[k + 1, T0]:
            k += 1
        s = segments[k]
        x = min(max((t - s[T0]) / (s[T1] - s[T0]), 0.0), 1.0)
        way = x if s[KIND] == SLIDE else _minimum_jerk(x)
        lateral = way
        # False for NaN: no height to rise to.
        lifted = s[TOP] == s[TOP]
        if lifted:
            # Sideways between 0.2 and 0.8 of the time; up in the first 0.4 and down in the last
            # 0.4, so that the ball clears the part.
            lateral = _minimum_jerk((x - 0.2) / 0.6)
        sway = s[SWAY0] + (s[SWAY1] - s[SWAY0]) * way
        for a in range(3):
            turn = 0.0
            drift = 0.0
            for j in range(tremor.shape[2]):
                # A sum of sines with fixed phases: independent of how frames are grouped.
                turn += tremor[0, a, j, 0] * np.sin(tremor[0, a, j, 1] * t + tremor[0, a, j, 2])
                drift += tremor[1, a, j, 0] * np.sin(tremor[1, a, j, 1] * t + tremor[1, a, j, 2])
            w[a] = s[W0 + a] + (s[W1 + a] - s[W0 + a]) * way + turn
            tip[i, a] = s[P0 + a] + (s[P1 + a] - s[P0 + a]) * lateral
            if a == 2 and lifted:
                tip[i, 2] = s[P0 + 2] + (s[TOP] - s[P0 + 2]) * _minimum_jerk(x / 0.4)
                tip[i, 2] += (s[P1 + 2] - s[TOP]) * _minimum_jerk((x - 0.6) / 0.4)
            if sway != 0.0:
                tip[i, a] += sway * drift
        since = t - s[T0]
        # In a touch segment the ball is on the surface throughout.
        contact[i] = s[KIND] == TOUCH and t < s[T1]
        button[i] = contact[i] and since >= BUTTON_DOWN_S and since < BUTTON_UP_S
        if s[KIND] == SLIDE and t < s[T1]:
            contact[i] = button[i] = True
        if contact[i] and since < SETTLE_S:
            y = since / SETTLE_S
            # (y (1 - y))^3 is 1/64 in the middle: one hop of SETTLE_MM, smooth at both ends.
            hop = SETTLE_MM * 64.0 * (y * (1.0 - y)) ** 3
            for a in range(3):
                tip[i, a] += hop * s[NORMAL + a]
        angle = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        # Limits of sin(x) / x and (1 - cos x) / x^2; the next terms, x^2 / 6 and x^2 / 24, vanish.
        if angle < 1e-9:
            sinc, versed = 1.0, 0.5
        else:
            sinc = np.sin(angle) / angle
            versed = (1.0 - np.cos(angle)) / (angle * angle)
        for a in range(3):
            for b in range(3):
                # Rodrigues: R = cos I + (sin / angle) skew(w) + ((1 - cos) / angle^2) w w', active,
                # world from probe.
                rotation[i, a, b] = versed * w[a] * w[b]
            rotation[i, a, a] += 1.0 - versed * angle * angle
        rotation[i, 0, 1] -= sinc * w[2]
        rotation[i, 1, 0] += sinc * w[2]
        rotation[i, 0, 2] += sinc * w[1]
        rotation[i, 2, 0] -= sinc * w[1]
        rotation[i, 1, 2] -= sinc * w[0]
        rotation[i, 2, 1] += sinc * w[0]


@njit(cache=True, nogil=True, error_model="numpy")
def see(
    rotation: Float, origin: Float, leds: Float, directions: Float, cos_emission: float,
    camera: Float, slots: Int, nodes: Float, white: Float, hidden: NDArray[np.uint64],
    valid: NDArray[np.uint64], uv: Float,
) -> None:  # fmt: skip
    """Fill in one camera's spots of the probe in each frame.

    ``rotation`` (n, 3, 3) and ``origin`` (n, 3): world from probe. ``leds`` and ``directions``
    (L, 3), probe frame. ``camera`` (24,): `World.packed`. ``slots`` (L,). ``nodes`` (2, rows,
    columns): fixed pattern, px. ``white`` (n, L, 2), px. ``hidden`` (n,): bit l for a hidden LED l.
    ``valid`` (n,) and ``uv`` (n, S, 2) are outputs.
    """
    r, f = camera[0:9], camera[12]
    sx, sy, u0, v0 = camera[13], camera[14], camera[15], camera[16]
    k1, k2, p1, p2 = camera[17], camera[18], camera[19], camera[20]
    width, height, step = camera[21], camera[22], camera[23]
    centre = np.empty(3)
    for a in range(3):
        # C = -R't, mm, world.
        centre[a] = -(r[a] * camera[9] + r[3 + a] * camera[10] + r[6 + a] * camera[11])
    p = np.empty(3)
    for i in range(len(origin)):
        valid[i] = 0
        for slot in range(uv.shape[1]):
            uv[i, slot, 0] = np.nan
            uv[i, slot, 1] = np.nan
        for n in range(len(leds)):
            if (hidden[i] >> np.uint64(n)) & np.uint64(1):
                continue
            towards = 0.0
            distance2 = 0.0
            for a in range(3):
                q = rotation[i, a]
                p[a] = origin[i, a] + q[0] * leds[n, 0] + q[1] * leds[n, 1] + q[2] * leds[n, 2]
                light = q[0] * directions[n, 0] + q[1] * directions[n, 1] + q[2] * directions[n, 2]
                ray = centre[a] - p[a]
                # direction . ray; divided by the ray length it is the cosine of the emission angle.
                towards += light * ray
                distance2 += ray * ray
            if towards < cos_emission * np.sqrt(distance2):
                continue
            z = r[6] * p[0] + r[7] * p[1] + r[8] * p[2] + camera[11]
            if z <= 0.0:
                continue
            # Ideal image, mm; then distortion, then pixels, as in `camera.project`.
            x = f * (r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + camera[9]) / z
            y = f * (r[3] * p[0] + r[4] * p[1] + r[5] * p[2] + camera[10]) / z
            r2 = x * x + y * y
            radial = r2 * (k1 + k2 * r2)
            u = u0 + sx * (x + x * radial + 2.0 * p1 * x * y + p2 * (3.0 * x * x + y * y))
            v = v0 + sy * (y + y * radial + p1 * (x * x + 3.0 * y * y) + 2.0 * p2 * x * y)
            # Pixel centres are integers: the image ends at width - 1.
            if not (u >= 0.0 and u <= width - 1.0 and v >= 0.0 and v <= height - 1.0):
                continue
            # The fixed pattern is bilinear between nodes `step` px apart: an error fixed to the
            # sensor position, which averaging in time does not reduce.
            column = int(u / step)
            row = int(v / step)
            g = u / step - column
            h = v / step - row
            w00, w01 = (1.0 - g) * (1.0 - h), g * (1.0 - h)
            w10, w11 = (1.0 - g) * h, g * h
            slot = slots[n]
            uv[i, slot, 0] = u + white[i, n, 0] + (
                w00 * nodes[0, row, column] + w01 * nodes[0, row, column + 1]
                + w10 * nodes[0, row + 1, column] + w11 * nodes[0, row + 1, column + 1]
            )  # fmt: skip
            uv[i, slot, 1] = v + white[i, n, 1] + (
                w00 * nodes[1, row, column] + w01 * nodes[1, row, column + 1]
                + w10 * nodes[1, row + 1, column] + w11 * nodes[1, row + 1, column + 1]
            )  # fmt: skip
            valid[i] |= np.uint64(1) << np.uint64(slot)
