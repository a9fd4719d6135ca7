"""Decision from a value and its uncertainty.

Three rules, selected by the plan:

- ISO 14253-1 in its general form (default): a characteristic conforms if the probability that the
  true value is inside the limits is at least `PROBABILITY`, does not if the probability that it is
  beyond one of them is, and is not proven otherwise. For an uncertainty small against the tolerance
  that is a guard band of U = 2 u at each limit. Conformity counts both tails, so it also holds for
  a tolerance hardly wider than the uncertainty.
- ILAC-G8 with the guard band w = U: values in a band are a conditional pass or fail, here NOT
  PROVEN, leaning in or out.
- Simple acceptance: the value alone, shared risk.

No rule gives a verdict without an uncertainty, and no value conforms with a tolerance smaller than
twice U.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from ocmm_core.errors import MeasuringError
from ocmm_core.tolerances.decisions._verdict import LOWEST_TUR, CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.uncertainty import ONE_SIDED, Spread, Spreads, expanded
from ocmm_core.tolerances.zones import Characteristic, Evaluation

Rule = Literal["iso14253-1", "ilac-g8", "simple"]

PROBABILITY = ONE_SIDED
"""Conformance probability limit, that of two standard deviations to one side.

The 2017 edition of ISO 14253-1 uses 95 % unless agreed otherwise; then 5 % of parts exactly at a
limit are accepted. With this stricter limit it is 2.3 %, and the guard band is U.
"""


@dataclass(frozen=True, slots=True)
class RuleStatement:
    """A decision rule as stored and printed: version of this implementation, and words."""

    version: int
    words: str


RULES: dict[Rule, RuleStatement] = {
    "iso14253-1": RuleStatement(
        2, "ISO 14253-1, conformance probability at least 97.7 % (guard band U at each limit)"
    ),
    "ilac-g8": RuleStatement(1, "ILAC-G8, guard band w = U at each limit"),
    "simple": RuleStatement(2, "simple acceptance: uncertainty not taken into account"),
}


@dataclass(frozen=True, slots=True)
class Decision:
    """Verdict, its ratio and leaning, and why it is not better."""

    verdict: Verdict
    tur: float
    """Tolerance, including a material bonus, divided by twice U."""
    leaning: Literal["", "in", "out"] = ""
    """Side of the limit of an unproven value."""
    why: str = ""
    """A sentence if the verdict is worse than by the rule alone."""


def rule_id(rule: Rule) -> str:
    """Return the identity of a rule stored in results: word and version, ``iso14253-1/2``."""
    return f"{rule}/{RULES[rule].version}"


def rule_words(identity: str) -> str:
    """Return the words of a `rule_id`; the identity itself if unknown."""
    for rule, statement in RULES.items():
        if identity == f"{rule}/{statement.version}":
            return f"{statement.words} ({identity})"
    return identity


def decide(
    spread: Spread,
    value: float,
    nominal: float,
    lower: float,
    upper: float,
    rule: Rule,
    uncertainty: float | None = None,
    bonus: float = 0.0,
) -> Decision:
    """Return the verdict on a value.

    Parameters
    ----------
    spread
        Distribution of the value about the true one; its standard uncertainty is positive.
    value, nominal, lower, upper
        Value, nominal value and the limits of the deviation from it, mm or degrees.
    uncertainty
        U (`interval.expanded`), if already computed.
    bonus
        Material bonus, mm. Already subtracted from ``value``, so that its uncertainty is in
        ``spread``; the ratio counts it in the tolerance.

    Raises
    ------
    MeasuringError
        The value or its uncertainty is not finite, or the uncertainty is not positive.
    """
    if not (math.isfinite(value) and math.isfinite(spread.sigma)):
        raise MeasuringError(
            "decision.not_finite",
            "The value or its uncertainty is not a finite number.",
            "Re-probe the feature.",
        )
    if spread.sigma <= 0.0:
        raise MeasuringError(
            "decision.no_uncertainty",
            "The uncertainty is zero, which is impossible.",
            "Take more than the minimum number of points.",
        )
    low = -math.inf if spread.one_sided else nominal + lower
    high = nominal + upper
    within = low <= value <= high
    u95 = expanded(spread, value) if uncertainty is None else uncertainty
    verdict = _verdict(spread, value, low, high, rule, u95)
    why = ""
    tur = tolerance_ratio(lower, upper + bonus, u95)
    if verdict is Verdict.CONFORM and tur < LOWEST_TUR:
        verdict = Verdict.NOT_PROVEN
        why = "The tolerance is smaller than twice the uncertainty."
    if verdict is not Verdict.NOT_PROVEN:
        return Decision(verdict, tur)
    return Decision(verdict, tur, "in" if within else "out", why)


def _verdict(
    spread: Spread, value: float, low: float, high: float, rule: Rule, guard: float
) -> Verdict:
    match rule:
        case "simple":
            return Verdict.CONFORM if low <= value <= high else Verdict.NOT_CONFORM
        case "ilac-g8":
            if low + guard <= value <= high - guard:
                return Verdict.CONFORM
            if value < low - guard or value > high + guard:
                return Verdict.NOT_CONFORM
            return Verdict.NOT_PROVEN
        case "iso14253-1":
            if spread.inside(low, high) >= PROBABILITY:
                return Verdict.CONFORM
            if spread.beyond(low, high) >= PROBABILITY:
                return Verdict.NOT_CONFORM
            return Verdict.NOT_PROVEN


def tolerance_ratio(lower: float, upper: float, expanded_uncertainty: float) -> float:
    """Return TUR: the tolerance divided by twice U."""
    return (upper - lower) / (2.0 * expanded_uncertainty)


def make_result(
    characteristic: Characteristic, evaluation: Evaluation, spreads: Spreads, rule: Rule
) -> CharacteristicResult:
    """Return the result of a characteristic with U (95 %) and verdict; errors as `decide`."""
    value, bonus = evaluation.value, evaluation.bonus
    lower, upper = characteristic.lower, characteristic.upper
    uncertainty = expanded(spreads.of_value, value)
    held = uncertainty
    if spreads.judged is not spreads.of_value:
        held = expanded(spreads.judged, value - bonus)
    decision = decide(
        spreads.judged, value - bonus, characteristic.nominal, lower, upper, rule, held, bonus
    )
    lowest = value - uncertainty
    one_sided = spreads.of_value.one_sided
    return replace(
        not_measured(characteristic, f"{decision.why} {evaluation.note}".strip()),
        measured=value,
        deviation=value - characteristic.nominal,
        uncertainty=uncertainty,
        verdict=decision.verdict,
        rule=rule_id(rule),
        tur=decision.tur,
        leaning=decision.leaning,
        interval=(max(lowest, 0.0) if one_sided else lowest, value + uncertainty),
        association=evaluation.association,
        frame=evaluation.frame,
        bonus=bonus,
    )


def not_measured(characteristic: Characteristic, note: str) -> CharacteristicResult:
    """Return the result of a characteristic without a trustworthy value, with the reason."""
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
        unit=spec_of(characteristic.kind).unit,
    )


def without_uncertainty(
    characteristic: Characteristic, evaluation: Evaluation, why: str
) -> CharacteristicResult:
    """Return a value without uncertainty, hence without proof, with the reason."""
    return replace(
        not_measured(characteristic, f"{why} {evaluation.note}".strip()),
        measured=evaluation.value,
        deviation=evaluation.value - characteristic.nominal,
        verdict=Verdict.NOT_PROVEN,
        association=evaluation.association,
        frame=evaluation.frame,
        bonus=evaluation.bonus,
    )


def provisional(result: CharacteristicResult, why: str) -> CharacteristicResult:
    """Return a preliminary result, with the reason."""
    return replace(result, verdict=Verdict.PROVISIONAL, leaning="", rule="", tur=None, note=why)


def not_proven(result: CharacteristicResult, why: str) -> CharacteristicResult:
    """Return a result as NOT PROVEN, with the reason; unmeasured or provisional ones unchanged."""
    if result.verdict in (Verdict.NOT_MEASURED, Verdict.PROVISIONAL):
        return result
    return replace(
        result, verdict=Verdict.NOT_PROVEN, leaning="", note=f"{why} {result.note}".strip()
    )
