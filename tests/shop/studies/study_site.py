"""Jobs of a gauge study as they are read, without measuring them."""

from __future__ import annotations

import numpy as np

from ocmm_core.inspection.finished import Comparison, PartValue, Trend
from ocmm_core.tolerances.decisions import Verdict
from ocmm_shop.studies import StudyPlan


def jobs_of(
    plan: StudyPlan, *, u: float = 0.006, factor: float = 1.0, left_out: int = 0
) -> Comparison:
    """Return jobs: parts differ, operators a little, and every result scatters."""
    rng = np.random.default_rng(2)
    of_part = dict(zip(plan.parts, 0.05 * rng.standard_normal(10), strict=True))
    of_operator = dict(zip(plan.operators, (0.0, 0.002, -0.002), strict=True))
    values = tuple(
        PartValue(
            job=one.code, serial=one.code, created_utc="", verdict=Verdict.CONFORM, uncertainty=u,
            value=10.0 + of_part[one.part] + of_operator[one.operator]
            + factor * 0.003 * float(rng.standard_normal()),
        )
        for one in plan.runs[left_out:]
    )  # fmt: skip
    trend = Trend("WIDTH", "distance", 9.8, 10.2, values, (), None, None, "")
    return Comparison("P", (), (), (trend,), (), (), simulated=True)
