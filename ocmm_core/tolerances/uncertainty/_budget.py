"""Uncertainty budget of a result: contributions of all sources as a table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import MeasuringError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.geometry import Float
from ocmm_core.measuring import Contribution, PointFactors
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.uncertainty._first_order import NOT_DETERMINED, WHAT_TO_DO
from ocmm_core.tolerances.uncertainty._interval import Length, expanded
from ocmm_core.tolerances.uncertainty._sampling import FormSample, widened
from ocmm_core.tolerances.uncertainty._spread import contributing_samples, gradients_of, spreads_of
from ocmm_core.tolerances.zones import Characteristic, Evaluation

_NOTHING = 1e-12
"""Share of the variance below which a source is omitted as rounding."""


@dataclass(frozen=True, slots=True)
class BudgetRow:
    name: str
    standard: float
    """Its standard uncertainty contribution, in the unit of the value."""
    share: float
    """Share of the variance, 0 to 1."""
    kind: str
    """``"A"``: from repeated observations of this job; ``"B"``: others."""
    distribution: str
    """Distribution of the quantity: normal, uniform or Student's."""
    origin: str
    """Reference of its data."""


@dataclass(frozen=True, slots=True)
class Budget:
    """Uncertainty budget of one value."""

    characteristic: str
    value: float
    unit: str
    rows: tuple[BudgetRow, ...]
    """Greatest first; the sum of their squares is the square of ``standard``."""
    standard: float
    """Combined standard uncertainty u."""
    expanded: float
    """U: 2 u, or more if noise increases the value."""
    degrees: float
    """Effective degrees of freedom; infinite without contributions from few observations."""


def budget_of(
    characteristic: Characteristic,
    evaluation: Evaluation,
    actual: Mapping[str, ActualFeature],
    parts: Sequence[Contribution],
    factors: PointFactors,
    samples: Sequence[FormSample],
) -> Budget:
    """Return the budget of a value from all ``parts``; MeasuringError if poorly determined."""
    spreads = spreads_of(characteristic, evaluation, actual, factors, samples)
    if not math.isfinite(spreads.growth):
        raise MeasuringError("uncertainty.curved", NOT_DETERMINED, WHAT_TO_DO)
    spread = spreads.of_value
    gradients = gradients_of(evaluation, bonus=False)
    way = spread.way if isinstance(spread, Length) else np.ones(1)
    form = widened(gradients, factors, contributing_samples(characteristic, actual, samples))

    def row(name: str, of: Float, kind: str, distribution: str, origin: str) -> BudgetRow:
        # Differences of nearly equal parts may be negative by rounding.
        variance = max(float(way @ of @ way), 0.0)
        share = variance / spread.sigma**2
        return BudgetRow(name, float(np.sqrt(variance)), share, kind, distribution, origin)

    rows = [
        row(
            part.source.name,
            part.covariance_of(gradients),
            part.source.kind,
            part.source.distribution,
            part.source.origin,
        )
        for part in parts
    ]
    rows += [
        row(f"Form of {name}", of, "A", "Student's", "residuals of its points beyond their noise")
        for name, of in form.of_form.items()
    ]
    if spreads.growth > 1.0:
        bent = (1.0 - spreads.growth**-2) * spread.sigma**2
        rows.append(
            BudgetRow(
                "Curvature of the fit", math.sqrt(bent), bent / spread.sigma**2, "B",
                "normal", "the element fitted again at both ends of the interval",
            )
        )  # fmt: skip
    rows.sort(key=lambda item: item.standard, reverse=True)
    return Budget(
        characteristic=characteristic.name,
        value=evaluation.value,
        unit=spec_of(characteristic.kind).unit,
        rows=tuple(item for item in rows if item.share > _NOTHING),
        standard=spread.sigma,
        expanded=expanded(spread, evaluation.value),
        degrees=form.degrees,
    )
