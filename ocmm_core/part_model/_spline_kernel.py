"""Compiled: from the poles of a spline to those of its knot spans."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int


@compiled()
def to_bezier(knots: Float, degree: int, spans: Int, found: Float) -> None:
    """Fill in ``found`` (k, p + 1, p + 1): pole of each span by the p + 1 poles that it has.

    ``spans`` (k,): the knot where each begins. Pole j is the blossom f(a, ..., a, b, ..., b) with
    the end b of the span j times: de Boor's scheme with an argument of its own in each step, the
    first j of them b. Row j of ``values`` is what it has in place of a pole, as weights of the
    poles; after p steps the last row is the answer.
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
