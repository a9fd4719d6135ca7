"""Which spots of some looks know nothing of each other, so that each group is weighed by itself."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ocmm_core.calibration.monitor._drift_design_matrix import SpotRows
from ocmm_core.geometry import Int

REACH_LENGTHS = 8.0
"""Further apart than so many lengths of the pattern, spots count as independent: they are alike by
exp(-32) = 1e-14. That moves no eigenvalue of the covariance by more than 1e-14 of n times the
pattern's variance, which is 1e-8 of the white noise that each has at the least."""


def independent_groups(spots: SpotRows, reach_px: float) -> list[Int]:
    """Return the spots, by their numbers, in groups that know nothing of each other.

    All spots of an LED are one group, for the floor is common to them. LEDs are put together whose
    fields of spots, as rectangles, come nearer than ``reach_px`` to each other. Time grows with the
    number of spots: what is compared by pairs is LEDs.
    """
    if not len(spots.led):
        return []
    leds = np.unique(spots.led)
    low, high = (
        np.array([f(spots.uv[spots.led == led], axis=0) for led in leds]) for f in (np.min, np.max)
    )
    gap = np.maximum(low[:, None] - high[None], low[None] - high[:, None]).max(axis=2)
    count, group = connected_components(csr_array(gap < reach_px), directed=False)
    of_led = np.zeros(int(leds[-1]) + 1, dtype=np.int64)
    of_led[leds] = group
    return [np.flatnonzero(of_led[spots.led] == number) for number in range(count)]
