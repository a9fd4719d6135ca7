from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_shop.studies import compare_stated, gauge_study, linearity_study, suitability, type1_study

_AIAG = """
0.29 -0.56 1.34 0.47 -0.80 0.02 0.59 -0.31 2.26 -1.36
0.41 -0.68 1.17 0.50 -0.92 -0.11 0.75 -0.20 1.99 -1.25
0.64 -0.58 1.27 0.64 -0.84 -0.21 0.66 -0.17 2.01 -1.31
0.08 -0.47 1.19 0.01 -0.56 -0.20 0.47 -0.63 1.80 -1.68
0.25 -1.22 0.94 1.03 -1.20 0.22 0.55 0.08 2.12 -1.62
0.07 -0.68 1.34 0.20 -1.28 0.06 0.83 -0.34 2.19 -1.50
0.04 -1.38 0.88 0.14 -1.46 -0.29 0.02 -0.46 1.77 -1.49
-0.11 -1.13 1.09 0.20 -1.07 -0.67 0.01 -0.56 1.45 -1.77
-0.15 -0.96 0.67 0.11 -1.45 -0.49 0.21 -0.49 1.87 -2.16
"""
_TYPE1 = """
11.9963 12.0008 11.998 12.0023 12.0019 12.001 11.9945 12 12.0014 12.0018 11.9972 12.0002 11.9988
11.9992 12.0045 11.9992 12.0014 12.004 11.9999 12.0012 12.0018 12.0017 11.9981 12.0017 12.0053
"""


def _aiag() -> Float:
    rows = np.array(_AIAG.split(), dtype=np.float64).reshape(3, 3, 10)  # operator, trial, part
    return np.transpose(rows, (2, 0, 1))


def test_the_set_of_the_manual_comes_out_to_all_printed_digits() -> None:
    study = gauge_study(_aiag())
    ss = {row.name: row.ss for row in study.table}
    assert study.pooled
    assert round(ss["Parts"], 4) == 88.3619
    assert round(ss["Operators"], 4) == 3.1673
    full = gauge_study(_aiag(), level=0.99)
    ss = {row.name: row.ss for row in full.table}
    assert round(ss["Parts x operators"], 4) == 0.3590
    assert round(ss["Repeatability"], 4) == 2.7589
    assert round(study.interaction_f, 4) == 0.4337
    assert round(study.interaction_p, 3) == 0.974
    assert round(study.var_repeat, 6) == 0.039973
    assert round(study.var_operator, 6) == 0.051455
    assert round(study.var_part, 6) == 1.086447
    assert round(study.contribution_percent, 2) == 7.76
    assert round(study.study_percent, 2) == 27.86
    assert round(100 * study.ev / study.tv, 2) == 18.42
    assert round(100 * study.av / study.tv, 2) == 20.90
    assert round(100 * study.pv / study.tv, 2) == 96.04
    assert study.ndc == 4
    assert round(1.41 * study.pv / study.grr, 2) == 4.86
    assert study.grr_low < study.grr < study.grr_high
    assert study.word == "conditional"


def test_the_sums_of_squares_add_up() -> None:
    table = gauge_study(_aiag(), level=0.99).table
    assert sum(row.ss for row in table[:-1]) == pytest.approx(table[-1].ss, rel=1e-12)
    assert sum(row.df for row in table[:-1]) == table[-1].df


def test_a_negative_component_is_zero() -> None:
    rng = np.random.default_rng(5)
    values = rng.standard_normal((10, 3, 3)) + 10.0 * rng.standard_normal((10, 1, 1))
    values -= values.mean(axis=(0, 2), keepdims=True)  # operators alike to the last digit
    study = gauge_study(values)
    assert study.var_operator == 0.0
    assert study.av == pytest.approx(np.sqrt(study.var_interaction))


def test_the_percentage_of_a_tolerance_is_six_sigma_or_three_of_one_side() -> None:
    study = gauge_study(_aiag(), tolerance=8.0)
    assert study.tolerance_percent == pytest.approx(600 * study.grr / 8.0)
    one = gauge_study(_aiag(), one_sided=5.0)
    mean = float(_aiag().mean())
    assert one.tolerance_percent == pytest.approx(300 * study.grr / (5.0 - mean))


def test_a_study_too_small_or_with_a_hole_is_refused() -> None:
    with pytest.raises(InputError, match="4 parts"):
        gauge_study(_aiag()[:4])
    broken = _aiag()
    broken[3, 1, 1] = np.nan
    with pytest.raises(InputError, match="finite"):
        gauge_study(broken)


@pytest.mark.statistics
def test_the_interval_covers_ninety_percent_of_studies() -> None:
    rng = np.random.default_rng(20)
    sigma_p, sigma_o, sigma_po, sigma_e = 1.0, 0.15, 0.05, 0.20
    true = np.sqrt(sigma_o**2 + sigma_po**2 + sigma_e**2)
    n, hits = 1000, 0
    for _ in range(n):
        values = (
            sigma_p * rng.standard_normal((10, 1, 1))
            + sigma_o * rng.standard_normal((1, 3, 1))
            + sigma_po * rng.standard_normal((10, 3, 1))
            + sigma_e * rng.standard_normal((10, 3, 3))
        )
        study = gauge_study(values)
        hits += study.grr_low <= true <= study.grr_high
    # 1.4 % is two standard deviations of 1,000 studies at 90 %.
    assert 0.88 <= hits / n <= 0.92


def test_type_one_comes_out_to_the_printed_digits() -> None:
    study = type1_study(np.array(_TYPE1.split(), dtype=np.float64), 12.0, 0.120)
    assert round(study.mean, 6) == 12.000488
    assert round(study.scatter, 6) == 0.002489
    assert round(study.cg, 4) == 1.6069
    assert round(study.cgk, 4) == 1.5416
    assert round(study.t, 4) == 0.9802
    assert not study.biased
    assert study.capable
    assert study.least_tolerance / study.scatter == pytest.approx(39.9, abs=0.01)
    # n = 25 determines s to -22 / +39 %.
    assert study.cg_low / study.cg == pytest.approx(1 / 1.391, abs=2e-3)
    assert study.cg_high / study.cg == pytest.approx(1 / 0.781, abs=2e-3)


def test_a_type_one_study_needs_scatter_tolerance_and_enough_results() -> None:
    with pytest.raises(InputError, match="24 results"):
        type1_study(np.arange(24.0), 12.0, 1.0)
    with pytest.raises(InputError, match="too coarse"):
        type1_study(np.full(30, 12.0), 12.0, 1.0)


def test_a_bias_that_grows_over_the_range_is_found() -> None:
    rng = np.random.default_rng(2)
    references = [10.0, 50.0, 100.0, 150.0, 200.0]
    good = [r + 0.002 * rng.standard_normal(12) for r in references]
    steep = [values + 5e-5 * r for r, values in zip(references, good, strict=True)]
    assert linearity_study(references, good).linear
    found = linearity_study(references, steep)
    assert not found.linear
    assert found.slope == pytest.approx(5e-5, abs=2e-5)
    assert found.p_slope < 1e-3
    with pytest.raises(InputError, match="4 references"):
        linearity_study(references[:4], good[:4])


def test_suitability_is_two_expanded_uncertainties_over_the_tolerance() -> None:
    u_ms = float(np.hypot(0.001, 0.003))
    found = suitability(u_ms, 2 * u_ms, 0.1)
    assert found.q_ms == pytest.approx(400 * np.hypot(0.001, 0.003) / 0.1)
    assert found.suitable
    at_least = suitability(u_ms, 2 * u_ms, found.least_tolerance)
    assert max(at_least.q_ms - 15.0, at_least.q_mp - 30.0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("factor", "word"), [(1.0, ""), (2.0, "too small"), (0.4, "larger")])
def test_a_stated_uncertainty_that_does_not_fit_is_told(factor: float, word: str) -> None:
    rng = np.random.default_rng(4)
    values = factor * 0.003 * rng.standard_normal((30, 3))
    found = compare_stated(values, np.full(30, 0.003))
    assert (word in found.message) if word else found.message == ""


@pytest.mark.statistics
def test_a_right_uncertainty_is_called_wrong_in_few_studies() -> None:
    rng = np.random.default_rng(6)
    told = sum(
        bool(compare_stated(rng.standard_normal((30, 3)), np.ones(30)).message) for _ in range(1000)
    )
    # 1 % for the cells and 1 % for all of them; 8 more are two standard deviations.
    assert told <= 28
