"""Compiled: convert the poles of a spline to those of its knot spans."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int


@compiled()
def to_bezier(knots: Float, degree: int, spans: Int, found: Float) -> None:
    """Fill in ``found`` (k, p + 1, p + 1): weights of the p + 1 spline poles for each span pole.

    ``spans`` (k,) is the first knot of each. Pole j is the blossom f(a, ..., a, b, ..., b) with the
    end b of the span j times: de Boor's scheme with a separate argument in each step, the first j
    of them b. Row j of ``values`` is a pole as weights of the poles; the last row is the result.
    """
    values = np.empty((degree + 1, degree + 1))
    for s in range(len(spans)):
        span = spans[s]
        for pole in range(degree + 1):
            values[:] = 0.0
            for j in range(degree + 1):
                values[j, j] = 1.0
            for step in range(1, degree + 1):
                argument = knots[span + 1] if step <= pole else knots[span]
                for j in range(degree, step - 1, -1):
                    low, high = knots[j + span - degree], knots[j + 1 + span - step]
                    share = (argument - low) / (high - low)
                    for i in range(degree + 1):
                        values[j, i] = (1.0 - share) * values[j - 1, i] + share * values[j, i]
            found[s, pole] = values[degree]
