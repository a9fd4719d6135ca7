"""Verdicts at and beside the limits of ISO 14253-1, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ocmm_core.errors import MeasuringError
from ocmm_core.tolerances.characteristic import Characteristic
from ocmm_core.tolerances.decision import (
    conformance_probability,
    decide,
    make_result,
    normal_probability,
    not_measured,
)
from ocmm_core.tolerances.result import Verdict

G = 1.6448536269514722
"""95 % point of the normal distribution: the guard band in units of u."""


@pytest.mark.parametrize(("z", "p"), [(0.0, 0.5), (G, 0.95), (1.959963984540054, 0.975)])
def test_normal_probability(z: float, p: float) -> None:
    assert normal_probability(z) == pytest.approx(p, abs=1e-14)
    assert normal_probability(-z) == pytest.approx(1.0 - p, abs=1e-14)


# Tolerance 20 mm +0.10 / -0.10 with u = 0.010: a guard band of 0.01645 at each limit.
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
    assert decide(20.0 + deviation, 0.01, 20.0, -0.1, 0.1, "iso14253-1") is verdict


def test_a_tolerance_as_narrow_as_the_uncertainty_is_never_proven_from_within() -> None:
    # Both tails: 4 u wide holds 95.4 % at its middle, 3.8 u only 94.3 %.
    assert decide(5.0, 0.01, 5.0, -0.02, 0.02, "iso14253-1") is Verdict.CONFORM
    assert decide(5.0, 0.01, 5.0, -0.019, 0.019, "iso14253-1") is Verdict.NOT_PROVEN
    # Hardly any probability lies inside, and yet nothing is proven against the part.
    assert conformance_probability(5.0, 1.0, 4.99, 5.01) < 0.05
    assert decide(5.0, 1.0, 5.0, -0.01, 0.01, "iso14253-1") is Verdict.NOT_PROVEN


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
    result = make_result(flatness, value, 0.01, "iso14253-1")
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
    assert decide(value, 5.0, 20.0, -0.1, 20.1 - 20.0, "simple") is verdict


def test_false_acceptance_at_the_limit_is_at_most_five_percent() -> None:
    rng = np.random.default_rng(1)
    values = 10.05 + 0.01 * rng.normal(size=20_000)
    verdicts = [decide(v, 0.01, 10.0, -0.05, 0.05, "iso14253-1") for v in values]
    accepted = sum(v is Verdict.CONFORM for v in verdicts) / len(values)
    # The standard deviation of the share is 0.15 %.
    assert accepted == pytest.approx(0.05, abs=0.007)


@pytest.mark.parametrize("rule", ["iso14253-1", "simple"])
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
def test_no_verdict_without_an_uncertainty(rule: str, value: float, u: float, code: str) -> None:
    with pytest.raises(MeasuringError) as caught:
        decide(value, u, 20.0, -0.1, 0.1, "simple" if rule == "simple" else "iso14253-1")
    assert caught.value.code == code


def test_a_result_states_the_expanded_uncertainty() -> None:
    size = Characteristic(
        name="d", kind="diameter", features=["ball"], nominal=20.0, lower=-0.1, upper=0.1
    )
    result = make_result(size, 20.02, 0.0125, "iso14253-1", "a note")
    assert result.measured == 20.02
    assert result.deviation == pytest.approx(0.02)
    assert result.uncertainty == pytest.approx(0.025)
    assert result.note == "a note"

    nothing = not_measured(size, "why")
    assert (nothing.measured, nothing.deviation, nothing.uncertainty) == (None, None, None)
    assert nothing.verdict is Verdict.NOT_MEASURED
