"""The colour scale of tip error maps, on paper and on the screen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.calibration.probe_design import TipMap

_SCALE = np.array(
    [(68, 1, 84), (65, 68, 135), (42, 120, 142), (34, 168, 132), (122, 209, 81), (253, 231, 37)]
)
"""Dark is good, bright is bad; readable without colours, too."""


def colour_at(share: float) -> str:
    """Return the colour of a share from 0 to 1 of the scale, ``#rrggbb``."""
    place = min(max(share, 0.0), 1.0) * (len(_SCALE) - 1)
    low = min(int(place), len(_SCALE) - 2)
    mixed = _SCALE[low] + (place - low) * (_SCALE[low + 1] - _SCALE[low])
    return "#" + "".join(f"{round(float(part)):02x}" for part in mixed)


def map_range(maps: Sequence[TipMap]) -> tuple[float, float]:
    """Return smallest and largest value of maps that share a scale, µm."""
    values = np.concatenate([item.space_um.ravel() for item in maps])
    known = values[np.isfinite(values)]
    if not known.size:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    return low, max(high, low + 1e-3)
