"""Compiled inner loop of the probe calibration study: LED paths with noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float


@compiled(reorder=True)
def add_paths(
    sines: NDArray[np.float32], cosines: NDArray[np.float32], noise: NDArray[np.float32],
    leds: Float, sigma: Float, first: int, turns: NDArray[np.float32], moments: Float,
    points: Float,
) -> None:  # fmt: skip
    """Turn the LEDs about the tip, add noise, and add to the moments of their paths.

    Data of a pose is one column, so that several poses are vectorised. Single precision serves
    turns and noise: it moves an LED by some 10 nm at random, a hundredth of the noise at most,
    which adds to it by its square.

    ``sines``, ``cosines`` (3, m): of alpha, beta and gamma; ``noise`` (3 L, m): standard normals;
    ``leds`` (L, 3), mm, from the tip; ``sigma`` (3,), mm, world; ``first``: number of the first
    pose; ``turns`` (9, m): scratch; ``moments`` (L, 13), added to: `pivot.add_moments` with the
    LEDs as reference; ``points`` (n, L, 3), mm, output: noisy targets, (0, L, 3) to skip them.
    """
    m = sines.shape[1]
    for i in range(m):
        sa, sb, sc = sines[0, i], sines[1, i], sines[2, i]
        ca, cb, cc = cosines[0, i], cosines[1, i], cosines[2, i]
        # R = Rz(gamma) Ry(beta) Rx(alpha), active, about the tip.
        turns[0, i] = cc * cb
        turns[1, i] = cc * sb * sa - sc * ca
        turns[2, i] = cc * sb * ca + sc * sa
        turns[3, i] = sc * cb
        turns[4, i] = sc * sb * sa + cc * ca
        turns[5, i] = sc * sb * ca - cc * sa
        turns[6, i] = -sb
        turns[7, i] = cb * sa
        turns[8, i] = cb * ca
    for led in range(leds.shape[0]):
        lx, ly, lz = leds[led, 0], leds[led, 1], leds[led, 2]
        noise_x, noise_y, noise_z = noise[3 * led], noise[3 * led + 1], noise[3 * led + 2]
        # Sums of y = target minus the LED at rest, for numerical precision: see `add_moments`.
        tx = ty = tz = 0.0
        xx = xy = xz = yy = yz = zz = qx = qy = qz = 0.0
        for i in range(m):
            # The tip is the origin of the world here: no translation.
            x = turns[0, i] * lx + turns[1, i] * ly + turns[2, i] * lz + sigma[0] * noise_x[i] - lx
            y = turns[3, i] * lx + turns[4, i] * ly + turns[5, i] * lz + sigma[1] * noise_y[i] - ly
            z = turns[6, i] * lx + turns[7, i] * ly + turns[8, i] * lz + sigma[2] * noise_z[i] - lz
            square = x * x + y * y + z * z
            tx += x
            ty += y
            tz += z
            xx += x * x
            xy += x * y
            xz += x * z
            yy += y * y
            yz += y * z
            zz += z * z
            qx += x * square
            qy += y * square
            qz += z * square
        own = moments[led]
        own[0] += m
        own[1] += tx
        own[2] += ty
        own[3] += tz
        own[4] += xx
        own[5] += xy
        own[6] += xz
        own[7] += yy
        own[8] += yz
        own[9] += zz
        own[10] += qx
        own[11] += qy
        own[12] += qz
        # Recomputed: few studies need the targets themselves.
        if points.shape[0] > 0:
            for i in range(m):
                at = points[first + i, led]
                x = turns[0, i] * lx + turns[1, i] * ly + turns[2, i] * lz
                y = turns[3, i] * lx + turns[4, i] * ly + turns[5, i] * lz
                z = turns[6, i] * lx + turns[7, i] * ly + turns[8, i] * lz
                at[0] = x + sigma[0] * noise_x[i]
                at[1] = y + sigma[1] * noise_y[i]
                at[2] = z + sigma[2] * noise_z[i]
