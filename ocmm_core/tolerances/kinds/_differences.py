"""Value of a characteristic from geometry, with gradient by central differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import GEOMETRY_SIZE
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.zones import Characteristic, Evaluation, moved_geometry

STEP = 1e-5
"""Step of the central differences over geometry: mm, and for directions a fraction of one."""


def by_differences(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    value_of: Callable[[Mapping[str, Float]], float],
) -> Evaluation:
    """Return the value of geometry vectors (12,) by name, with its gradient by points."""
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    gradient = Rows.nothing()
    for name in (*characteristic.features, *characteristic.datums):
        feature = actual[name]
        slope = np.zeros(GEOMETRY_SIZE)
        for k in np.flatnonzero(feature.jacobian.moving()).tolist():
            ahead, behind = (
                value_of(moved_geometry(geometries, name, k, step)) for step in (STEP, -STEP)
            )
            slope[k] = (ahead - behind) / (2.0 * STEP)
        gradient += slope @ feature.jacobian
    return Evaluation(value_of(geometries), gradient)
