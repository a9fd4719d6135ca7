"""Control charts and capabilities of values over several parts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.tolerances.decisions import capability, control_chart
from ocmm_core.tolerances.decisions._capability import FEWEST_VALUES, RUN, Signal

ROUNDING = 1e-12


def test_limits_stand_at_266_mean_moving_ranges() -> None:
    values = np.array([10.0, 12.0, 11.0, 13.0, 9.0])  # moving ranges 2, 1, 2, 4
    chart = control_chart(values)
    assert chart.centre == 11.0
    # 3 / 1.128 = 2.6587, the 2.66 of the tables.
    assert chart.high - chart.centre == pytest.approx(2.66 * 2.25, rel=1e-3)
    assert chart.centre - chart.low == pytest.approx(2.66 * 2.25, rel=1e-3)
    assert chart.signals == ()
    assert not chart.settled


def test_a_value_beyond_a_limit_and_a_run_are_told() -> None:
    rng = np.random.default_rng(5)
    values = rng.normal(0.0, 1.0, 40)
    values[20] = 9.0
    assert (20, Signal.BEYOND) in control_chart(values).signals
    shifted = np.concatenate([np.tile([-0.5, 0.5], 10) - 1.0, np.tile([0.2, 0.6], 10) + 1.0])
    runs = [index for index, why in control_chart(shifted).signals if why is Signal.RUN]
    assert runs[0] == RUN - 1
    assert len(runs) == 2 * (20 - RUN + 1)


def test_indices_of_known_values() -> None:
    values = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])  # moving ranges 2: sigma 2 / 1.128
    found = capability(values, -6.0, 9.0, 0.0)
    sigma = 2.0 / 1.128379167
    assert found.cp == pytest.approx(15.0 / (6.0 * sigma), rel=ROUNDING)
    assert found.cpk == pytest.approx(6.0 / (3.0 * sigma), rel=ROUNDING)
    assert found.sigma_overall == pytest.approx(math.sqrt(6.0 / 5.0), rel=ROUNDING)
    assert "from 6 parts" in found.summary
    assert "indicative only" in found.summary


def test_a_one_sided_limit_has_no_cp() -> None:
    values = np.array([0.010, 0.012, 0.011, 0.014, 0.009, 0.011])
    found = capability(values, -math.inf, 0.02, 0.001)
    assert found.cp is None
    assert found.pp is None
    assert found.cpk > 0.0


def test_the_interval_of_cpk_holds_the_truth_in_95_percent() -> None:
    # 400 processes show 95 % with a standard deviation of 1.1 %; the interval is an approximation.
    rng = np.random.default_rng(11)
    inside = 0
    for _ in range(400):
        found = capability(rng.normal(0.0, 1.0, 50), -4.0, 4.0, 0.0)
        inside += found.cpk_low <= 4.0 / 3.0 <= found.cpk_high
    assert 0.92 <= inside / 400 <= 0.98


def test_the_share_of_the_measurement_is_said() -> None:
    rng = np.random.default_rng(3)
    found = capability(rng.normal(0.0, 0.01, 60), -0.1, 0.1, 0.005)
    assert found.measurement_share == pytest.approx(0.25, abs=0.1)
    assert "of the variance" in found.summary


@pytest.mark.parametrize(
    ("values", "code"),
    [
        ([1.0] * (FEWEST_VALUES - 1), "capability.too_few"),
        ([1.0, 2.0, math.nan, 1.0, 2.0], "capability.not_finite"),
        ([1.0] * 6, "capability.no_scatter"),
    ],
)
def test_values_that_say_nothing_are_refused(values: list[float], code: str) -> None:
    with pytest.raises(InputError) as caught:
        capability(np.array(values), 0.0, 3.0, 0.1)
    assert caught.value.code == code


def test_no_limit_is_refused() -> None:
    with pytest.raises(InputError) as caught:
        capability(np.arange(6.0), -math.inf, math.inf, 0.1)
    assert caught.value.code == "capability.no_limits"
