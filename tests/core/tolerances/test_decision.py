"""Verdicts at and near the limits of ISO 14253-1, and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ocmm_core.errors import MeasuringError
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.decisions import (
    LOWEST_TUR,
    CharacteristicResult,
    Rule,
    Verdict,
    decide,
    make_result,
    not_measured,
    not_proven,
    rule_id,
    rule_words,
)
from ocmm_core.tolerances.decisions._decision import PROBABILITY, Decision
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.uncertainty import Normal, Spreads
from ocmm_core.tolerances.uncertainty._interval import normal_probability
from ocmm_core.tolerances.zones import Characteristic, Evaluation

pytestmark = pytest.mark.numerics

G = 2.0
"""Guard band in units of u: U itself."""


RULES: tuple[Rule, ...] = ("iso14253-1", "ilac-g8", "simple")


def decided(
    value: float, u: float, nominal: float, lower: float, upper: float, rule: Rule
) -> Decision:
    return decide(Normal(value, u), value, nominal, lower, upper, rule)


def result_of(
    characteristic: Characteristic, value: float, u: float, rule: Rule, note: str = ""
) -> CharacteristicResult:
    spread = Normal(value, u, one_sided=spec_of(characteristic.kind).one_sided)
    evaluation = Evaluation(value, Rows.nothing(), note=note)
    return make_result(characteristic, evaluation, Spreads(spread, spread), rule)


@pytest.mark.parametrize(("z", "p"), [(0.0, 0.5), (G, PROBABILITY), (1.959963984540054, 0.975)])
def test_normal_probability(z: float, p: float) -> None:
    assert normal_probability(z) == pytest.approx(p, abs=1e-14)
    assert normal_probability(-z) == pytest.approx(1.0 - p, abs=1e-14)


# Tolerance 20 mm +0.10 / -0.10 with u = 0.010: a guard band of 0.020 at each limit.
@pytest.mark.parametrize(
    ("deviation", "verdict"),
    [
        (0.0, Verdict.CONFORM),
        (0.10 - G * 0.01 - 1e-6, Verdict.CONFORM),
        (0.10 - G * 0.01 + 1e-6, Verdict.NOT_PROVEN),
        (0.10, Verdict.NOT_PROVEN),
        (0.10 + G * 0.01 - 1e-6, Verdict.NOT_PROVEN),
        (0.10 + G * 0.01 + 1e-6, Verdict.NOT_CONFORM),
        (-0.10 + G * 0.01 + 1e-6, Verdict.CONFORM),
        (-0.10 + G * 0.01 - 1e-6, Verdict.NOT_PROVEN),
        (-0.10 - G * 0.01 + 1e-6, Verdict.NOT_PROVEN),
        (-0.10 - G * 0.01 - 1e-6, Verdict.NOT_CONFORM),
    ],
)
def test_guard_band(deviation: float, verdict: Verdict) -> None:
    assert decided(20.0 + deviation, 0.01, 20.0, -0.1, 0.1, "iso14253-1").verdict is verdict
    assert decided(20.0 + deviation, 0.01, 20.0, -0.1, 0.1, "ilac-g8").verdict is verdict


def test_a_tolerance_as_narrow_as_the_uncertainty_is_never_proven_from_within() -> None:
    # Both tails: 4.6 u wide holds 97.9 % at its middle, 4.5 u only 97.6 %.
    assert decided(5.0, 0.01, 5.0, -0.023, 0.023, "iso14253-1").verdict is Verdict.CONFORM
    assert decided(5.0, 0.01, 5.0, -0.0225, 0.0225, "iso14253-1").verdict is Verdict.NOT_PROVEN
    # Hardly any probability lies inside, and yet nothing is proven against the part.
    assert Normal(5.0, 1.0).inside(4.99, 5.01) < 0.05
    assert decided(5.0, 1.0, 5.0, -0.01, 0.01, "iso14253-1").verdict is Verdict.NOT_PROVEN


@pytest.mark.parametrize("rule", RULES)
def test_nothing_conforms_whose_tolerance_is_smaller_than_twice_its_uncertainty(rule: Rule) -> None:
    found = decided(5.0, 0.01, 5.0, -0.0199, 0.0199, rule)
    assert found.verdict is Verdict.NOT_PROVEN
    assert decided(5.0, 0.01, 5.0, -0.05, 0.05, rule).verdict is Verdict.CONFORM


def test_a_result_warns_of_a_tolerance_that_is_hardly_wider_than_its_uncertainty() -> None:
    size = Characteristic(name="d", kind="diameter", features=["b"], lower=-0.1, upper=0.1)
    assert result_of(size, 0.0, 0.0125, "iso14253-1").tur == pytest.approx(4.0)
    assert result_of(size, 0.0, 0.0125, "iso14253-1").caution == ""
    assert "3.9 times" in result_of(size, 0.0, 0.0128, "iso14253-1").caution
    assert "smaller than twice" in result_of(size, 0.0, 0.06, "simple").note


@pytest.mark.parametrize("rule", ["iso14253-1", "ilac-g8"])
@pytest.mark.parametrize(
    ("deviation", "leaning"), [(0.05, ""), (0.09, "in"), (0.1, "in"), (0.11, "out"), (0.13, "")]
)
def test_what_is_not_proven_leans_in_or_out(rule: Rule, deviation: float, leaning: str) -> None:
    assert decided(deviation, 0.01, 0.0, -0.1, 0.1, rule).leaning == leaning


def test_the_rule_and_its_version_are_stored() -> None:
    size = Characteristic(name="d", kind="diameter", features=["b"], lower=-0.1, upper=0.1)
    for rule in RULES:
        result = result_of(size, 0.0, 0.01, rule)
        assert result.rule == rule_id(rule)
        assert result.rule.startswith(f"{rule}/")
        assert result.rule in rule_words(result.rule)
    assert rule_words("of-old/1") == "of-old/1"
    doubted = not_proven(result_of(size, 0.095, 0.01, "iso14253-1"), "why")
    assert (doubted.verdict, doubted.leaning) == (Verdict.NOT_PROVEN, "")


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (0.0, Verdict.CONFORM),
        (0.05 - G * 0.01 - 1e-6, Verdict.CONFORM),
        (0.05 - G * 0.01 + 1e-6, Verdict.NOT_PROVEN),
        (0.05 + G * 0.01 + 1e-6, Verdict.NOT_CONFORM),
    ],
)
def test_a_form_has_an_upper_limit_only(value: float, verdict: Verdict) -> None:
    flatness = Characteristic(
        name="flat", kind="form", features=["top"], nominal=0.0, lower=0.0, upper=0.05
    )
    result = result_of(flatness, value, 0.01, "iso14253-1")
    assert result.verdict is verdict
    assert result.lower == 0.0


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (20.1, Verdict.CONFORM),
        (20.1 + 1e-9, Verdict.NOT_CONFORM),
        (19.9 - 1e-9, Verdict.NOT_CONFORM),
    ],
)
def test_simple_acceptance_looks_at_the_value_alone(value: float, verdict: Verdict) -> None:
    assert decided(value, 0.01, 20.0, -0.1, 20.1 - 20.0, "simple").verdict is verdict


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(
    ("value", "u", "code"),
    [
        (math.nan, 0.01, "decision.not_finite"),
        (math.inf, 0.01, "decision.not_finite"),
        (20.0, math.nan, "decision.not_finite"),
        (20.0, math.inf, "decision.not_finite"),
        (20.0, 0.0, "decision.no_uncertainty"),
        (20.0, -0.01, "decision.no_uncertainty"),
    ],
)
def test_no_verdict_without_an_uncertainty(rule: Rule, value: float, u: float, code: str) -> None:
    with pytest.raises(MeasuringError) as caught:
        decided(value, u, 20.0, -0.1, 0.1, rule)
    assert caught.value.code == code


def test_a_result_states_the_expanded_uncertainty() -> None:
    size = Characteristic(
        name="d", kind="diameter", features=["ball"], nominal=20.0, lower=-0.1, upper=0.1
    )
    result = result_of(size, 20.02, 0.0125, "iso14253-1", "a note")
    assert result.measured == 20.02
    assert result.deviation == pytest.approx(0.02)
    assert result.uncertainty == pytest.approx(0.025)
    assert result.interval == pytest.approx((19.995, 20.045))
    assert result.note == "a note"

    nothing = not_measured(size, "why")
    assert (nothing.measured, nothing.deviation, nothing.uncertainty) == (None, None, None)
    assert nothing.verdict is Verdict.NOT_MEASURED


def test_the_ratio_counts_the_bonus_like_the_verdict() -> None:
    # t 0.02 with a bonus of 0.20: the value 0.03 lies far inside 0.22, and U is 0.03.
    spread = Normal(0.03 - 0.20, 0.015, one_sided=True)
    found = decide(spread, 0.03 - 0.20, 0.0, 0.0, 0.02, "iso14253-1", 0.03, 0.20)
    assert (found.verdict, found.why) == (Verdict.CONFORM, "")
    assert found.tur == pytest.approx(0.22 / 0.06)
    spread = Normal(0.01, 0.015, one_sided=True)
    without = decide(spread, 0.01, 0.0, 0.0, 0.02, "simple", 0.03)
    assert (without.verdict, bool(without.why)) == (Verdict.NOT_PROVEN, True)
    assert without.tur == pytest.approx(0.02 / 0.06)


@pytest.mark.parametrize("rule", RULES)
def test_verdict_reason_and_ratio_agree(rule: Rule) -> None:
    rng = np.random.default_rng(12)
    for _ in range(2000):
        sigma, upper = 10.0 ** rng.uniform(-4.0, -1.0), 10.0 ** rng.uniform(-3.0, -0.5)
        bonus = float(rng.integers(2)) * 10.0 ** rng.uniform(-3.0, 0.0)
        value = rng.uniform(0.0, 2.0) * (upper + bonus) - bonus
        spread = Normal(value, sigma, one_sided=True)
        found = decide(spread, value, 0.0, 0.0, upper, rule, 2.0 * sigma, bonus)
        assert found.verdict is not Verdict.CONFORM or found.tur >= LOWEST_TUR
        assert not found.why or found.tur < LOWEST_TUR
