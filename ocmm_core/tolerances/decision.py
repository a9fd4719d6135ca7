"""From a value and its uncertainty to a verdict.

The rule of ISO 14253-1 in its general form: a characteristic conforms where the probability that
the true value lies inside the limits is at least 95 %, does not where the probability that it lies
beyond one of them is, and is not proven otherwise. For an uncertainty that is small against the
tolerance that is a guard band of 1.65 u at each limit. Conformity counts both tails, so that it
stays right where the tolerance is hardly wider than the uncertainty; non-conformity counts one
limit at a time, as else a value in the middle of a narrow tolerance would be proven outside it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

from ocmm_core.errors import MeasuringError
from ocmm_core.measuring.uncertainty import COVERAGE_FACTOR
from ocmm_core.tolerances.characteristic import Characteristic
from ocmm_core.tolerances.result import CharacteristicResult, Verdict

Rule = Literal["iso14253-1", "simple"]

PROBABILITY = 0.95
"""Default conformance probability limit of ISO 14253-1:2017."""


def conformance_probability(
    value: float, standard_uncertainty: float, low: float, high: float
) -> float:
    """Return the probability that the true value lies between ``low`` and ``high``, mm."""
    return normal_probability((high - value) / standard_uncertainty) - normal_probability(
        (low - value) / standard_uncertainty
    )


def decide(
    value: float,
    standard_uncertainty: float,
    nominal: float,
    lower: float,
    upper: float,
    rule: Rule,
    *,
    one_sided: bool = False,
) -> Verdict:
    """Return the verdict on a value.

    Parameters
    ----------
    value
        mm.
    standard_uncertainty
        mm, greater than zero: under no rule is there a verdict without it.
    nominal, lower, upper
        Nominal value and the limits of the deviation from it, mm.
    rule
        ``"iso14253-1"``, or ``"simple"`` acceptance, which leaves the uncertainty out.
    one_sided
        The value cannot be below its lower limit (form): only the upper one counts.

    Raises
    ------
    MeasuringError
        The value or its uncertainty is not a finite number, or the uncertainty is not positive:
        there is nothing to decide about.
    """
    if not (math.isfinite(value) and math.isfinite(standard_uncertainty)):
        raise MeasuringError(
            "decision.not_finite",
            "The value or its uncertainty is not a finite number.",
            "Take the points of the feature again.",
        )
    if standard_uncertainty <= 0.0:
        raise MeasuringError(
            "decision.no_uncertainty",
            "The uncertainty is zero, which no measurement has.",
            "Take more points than the shape needs at least.",
        )
    low = -math.inf if one_sided else nominal + lower
    high = nominal + upper
    if rule == "simple":
        return Verdict.CONFORM if low <= value <= high else Verdict.NOT_CONFORM
    if conformance_probability(value, standard_uncertainty, low, high) >= PROBABILITY:
        return Verdict.CONFORM
    below = normal_probability((low - value) / standard_uncertainty)
    above = normal_probability((value - high) / standard_uncertainty)
    if max(below, above) >= PROBABILITY:
        return Verdict.NOT_CONFORM
    return Verdict.NOT_PROVEN


def make_result(
    characteristic: Characteristic,
    value: float,
    standard_uncertainty: float,
    rule: Rule,
    note: str = "",
) -> CharacteristicResult:
    """Return the result of a characteristic that was measured, with U = 2 u and its verdict.

    Raises
    ------
    MeasuringError
        As `decide`.
    """
    return replace(
        not_measured(characteristic, note),
        measured=value,
        deviation=value - characteristic.nominal,
        uncertainty=COVERAGE_FACTOR * standard_uncertainty,
        verdict=decide(
            value,
            standard_uncertainty,
            characteristic.nominal,
            characteristic.lower,
            characteristic.upper,
            rule,
            one_sided=characteristic.kind == "form",
        ),
    )


def not_measured(characteristic: Characteristic, note: str) -> CharacteristicResult:
    """Return the result of a characteristic without a trustworthy value, and why."""
    return CharacteristicResult(
        name=characteristic.name,
        kind=characteristic.kind,
        features=tuple(characteristic.features),
        nominal=characteristic.nominal,
        lower=characteristic.lower,
        upper=characteristic.upper,
        measured=None,
        deviation=None,
        uncertainty=None,
        verdict=Verdict.NOT_MEASURED,
        note=note,
    )


def not_proven(result: CharacteristicResult, why: str) -> CharacteristicResult:
    """Return a result whose value proves nothing, and why; one without a value stays as it is."""
    if result.verdict is Verdict.NOT_MEASURED:
        return result
    return replace(result, verdict=Verdict.NOT_PROVEN, note=f"{why} {result.note}".strip())


def normal_probability(x: float) -> float:
    """Return the probability that a standard normal variable lies below ``x``."""
    return 0.5 * (1.0 + math.erf(x / math.sqrt(2.0)))
