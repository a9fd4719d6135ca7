"""Layouts of LEDs whose labels can be confused, because they were made so."""

from __future__ import annotations

import numpy as np

from ocmm_core.geometry import Float, rotation_from_vector, unit

JITTER_MM = 0.3
"""Offset of LEDs from their symmetric places, standard deviation, still too small to decide."""


def ambiguous_layout(rng: np.random.Generator) -> Float:
    """Return 3 to 8 LEDs, (L, 3), mm, with a part that is congruent after a turn.

    Either all of them, or all except one in a random place: while it is hidden the others are
    confused. In some, two LEDs are mirror images, which is a turn if all are flat.
    """
    kind = rng.integers(4)
    if kind == 0:
        # Half a turn: pairs, and a LED on the axis or not.
        leds = _orbit(rng, 2, int(rng.integers(2, 5)))
        if rng.random() < 0.5 and len(leds) < 8:
            leds = np.vstack([leds, [0.0, 0.0, rng.uniform(-60.0, 60.0)]])
    elif kind == 1:
        leds = _orbit(rng, 3, int(rng.integers(1, 3)))
    elif kind == 2:
        # Flat and its own mirror image.
        half = rng.uniform([15.0, 0.0, -60.0], [70.0, 0.0, 60.0], (int(rng.integers(2, 5)), 3))
        leds = np.vstack([half, half * [-1.0, 1.0, 1.0]])
    else:
        # One LED more breaks the symmetry, until it is hidden.
        leds = _orbit(rng, 2, int(rng.integers(2, 4)))
        leds = np.vstack([leds, rng.uniform(-80.0, 80.0, 3)])
    leds = leds + JITTER_MM * rng.standard_normal(leds.shape) / np.sqrt(3.0)
    turned: Float = leds @ rotation_from_vector(rng.uniform(-2.0, 2.0, 3)).T
    shuffled: Float = rng.permutation(turned + rng.uniform(-50.0, 50.0, 3))
    return shuffled


def _orbit(rng: np.random.Generator, order: int, count: int) -> Float:
    """Return ``count`` LEDs and where turns by a whole part of a circle take them."""
    leds = np.column_stack(
        [
            rng.uniform(15.0, 70.0, (count, 1)) * unit(rng.standard_normal((count, 2))),
            rng.uniform(-60.0, 60.0, count),
        ]
    )
    turn = rotation_from_vector(np.array([0.0, 0.0, 2.0 * np.pi / order]))
    orbit = [leds]
    for _ in range(order - 1):
        orbit.append(orbit[-1] @ turn.T)
    return np.vstack(orbit)
