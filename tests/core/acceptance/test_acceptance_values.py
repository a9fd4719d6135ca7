from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.optimize import minimize

from ocmm_core.acceptance import (
    PartTask,
    block_length,
    dissimilar,
    location_value,
    nest_lengths,
    part_uncertainty,
    repeat_ranges,
    smallest_ball,
    spat_values,
    sphere_values,
    thickness,
    volumetric_values,
)
from ocmm_core.calibration.tip import QUALIFICATION_RINGS
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Points3
from tests.host import amount, looser

_ALL = 10_000
_N = amount(2_500, _ALL)
_SHARE = looser(0.02, _N, _ALL)
"""Two per cent of the facts' figures, which were simulated with 20,000 tests themselves, for all;
twice as much for a quarter of them."""
_PART = """
25.004 25.0058 25.0024 24.9987 25.0013 24.9981 25.0044 25.012 25.001 25.0003
25.0069 25.0061 25.0046 24.9984 25.0038 25.0082 24.9959 25.0013 24.9926 24.9963
"""


def _layout() -> Points3:
    found = []
    for polar, count, turn in QUALIFICATION_RINGS:
        for azimuth in np.radians(turn + 360.0 * np.arange(count) / count):
            p = np.radians(polar)
            found.append([np.sin(p) * np.cos(azimuth), np.sin(p) * np.sin(azimuth), np.cos(p)])
    return np.array(found)


def _five() -> Points3:
    return np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=np.float64)


def test_the_calibrated_part_comes_out_to_the_printed_digits() -> None:
    found = part_uncertainty(
        np.array(_PART.split(), dtype=np.float64).tolist(), 25.0, 0.0016,
        u_workpiece=0.0005, temperature_c=22.5, u_expansion=1e-6,
    )  # fmt: skip
    assert round(found.bias, 6) == 0.002105
    assert round(found.scatter, 6) == 0.004676
    assert round(found.expanded, 6) == 0.009541
    assert round(found.expanded_uncorrected, 6) == 0.011646


def test_e_n_compares_the_bias_with_both_uncertainties() -> None:
    found = part_uncertainty([10.003, 10.005], 10.0, 0.003, expanded_model=0.004)
    assert found.normalized == pytest.approx(0.004 / 0.005)


@pytest.mark.parametrize(
    ("field", "value", "word"),
    [
        ("dimension", 140.0, "dimension"),
        ("angle_deg", 7.0, "angle"),
        ("points", 6, "6 points"),
        ("stylus", "ruby 3", "stylus"),
        ("material", "steel", "material"),
    ],
)
def test_a_part_that_is_not_similar_gets_no_uncertainty(
    field: str, value: object, word: str
) -> None:
    import msgspec

    task = PartTask(
        dimension=100.0, points=9, strategy="circle", stylus="ruby 6", material="aluminium",
        clamping="vice",
    )  # fmt: skip
    assert not dissimilar(task, msgspec.structs.replace(task, dimension=120.0, stylus=" RUBY 6"))
    assert word in dissimilar(task, msgspec.structs.replace(task, **{field: value}))


def test_one_result_is_no_study() -> None:
    with pytest.raises(InputError, match="1 usable"):
        part_uncertainty([25.0], 25.0, 0.001)


def test_the_smallest_ball_of_known_points() -> None:
    tetra = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
    centre, radius = smallest_ball(np.vstack([tetra, [[0.1, 0.2, 0.3]]]) + 5.0)
    assert centre == pytest.approx([5.0, 5.0, 5.0])
    assert radius == pytest.approx(np.sqrt(3.0))
    # On one line, twice the same point, and one point alone.
    assert location_value(np.outer([0.0, 1.0, 4.0, 4.0, 2.0], [0, 0, 1])) == pytest.approx(4.0)
    assert location_value(np.ones((5, 3))) == 0.0


def _farthest(points: Points3, centre: Float) -> float:
    return float(np.linalg.norm(points - centre, axis=1).max())


def test_the_smallest_ball_is_that_of_a_search() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        points = rng.standard_normal((5, 3))
        found = smallest_ball(points)[1]
        searched = minimize(
            partial(_farthest, points), points.mean(axis=0), method="Nelder-Mead", tol=1e-9
        )
        assert np.linalg.norm(points - smallest_ball(points)[0], axis=1).max() <= found + 1e-9
        # The search may stop above the least, never below it.
        assert found <= searched.fun + 1e-9


def test_a_block_is_compensated_along_its_certified_direction() -> None:
    first = np.array([[0.0, 0.0, -3.0]])
    second = np.array([[0.4, 0.0, 23.0]])
    assert block_length(first, second, np.array([0.0, 0.0, 1.0]), 3.0) == pytest.approx(20.0)


def test_thickness_is_taken_from_the_plane_below_whichever_way_it_points() -> None:
    grid = np.array([[x, y, 0.0] for x in (0.0, 50.0, 100.0) for y in (0.0, 40.0)])
    top = grid + np.array([0.0, 0.0, 31.0])
    assert thickness(grid, top, 3.0) == pytest.approx(np.full(6, 25.0))
    assert thickness(top, grid, 3.0) == pytest.approx(np.full(6, 25.0))


def test_volumetric_figures_of_known_deviations() -> None:
    found = volumetric_values(np.array([0.01, -0.03, 0.02, 0.0]))
    assert found.largest == pytest.approx(0.03)
    assert found.half_range == pytest.approx(0.025)
    assert found.two_rms == pytest.approx(2 * np.sqrt(0.0014 / 4))


# Statistics of many virtual tests with isotropic noise of one sigma for each axis of a point.


@pytest.mark.statistics
def test_the_largest_of_35_lengths_is_as_chance_has_it() -> None:
    nests = np.random.default_rng(1).standard_normal((_N, 7, 6))
    at = np.zeros((6, 3))
    at[:, 0] = 80.0 * np.arange(6)
    worst = np.empty(_N)
    for i in range(_N):
        errors = []
        for line in nests[i]:
            moved = at.copy()
            moved[:, 0] += 1e-3 * line
            errors.append(1e3 * (nest_lengths(moved) - nest_lengths(at)))
        worst[i] = np.abs(errors).max()
    assert worst.mean() == pytest.approx(3.27, rel=_SHARE)
    assert np.quantile(worst, 0.95) == pytest.approx(4.49, rel=_SHARE)


@pytest.mark.statistics
@pytest.mark.slow
def test_form_and_size_of_25_points_are_as_chance_has_it() -> None:
    rng = np.random.default_rng(2)
    forms, sizes, centres = np.empty(_N), np.empty(_N), np.empty((_N, 3))
    for i in range(_N):
        found = sphere_values(18.0 * _layout() + 1e-3 * rng.standard_normal((25, 3)))
        forms[i], sizes[i] = 1e3 * found.form, 1e3 * (found.diameter - 36.0)
        centres[i] = 1e3 * found.centre
    assert forms.mean() == pytest.approx(3.658, rel=_SHARE)
    assert forms.std() == pytest.approx(0.685, rel=_SHARE)
    assert np.quantile(forms, 0.95) == pytest.approx(4.860, rel=_SHARE)
    # Of 10,000 tests ten lie beyond it.
    assert np.quantile(forms, 0.999) == pytest.approx(6.188, rel=looser(0.03, _N, _ALL))
    assert sizes.std() == pytest.approx(0.651, rel=_SHARE)
    assert centres.std(axis=0) == pytest.approx([0.351, 0.353, 0.541], rel=_SHARE)


@pytest.mark.statistics
@pytest.mark.slow
def test_l_dia_of_five_attitudes_is_as_chance_has_it() -> None:
    rng = np.random.default_rng(3)
    found, centres = np.empty(_N), np.empty((_N, 5, 3))
    for i in range(_N):
        for k in range(5):
            points = 18.0 * _five() + 1e-3 * rng.standard_normal((5, 3))
            centres[i, k] = 1e3 * sphere_values(points).centre
        found[i] = location_value(centres[i])
    assert found.mean() == pytest.approx(3.20, rel=_SHARE)
    # 60,000 sets of five Gaussian centres of these deviations give 4.634; 4.72 was printed.
    assert np.quantile(found, 0.95) == pytest.approx(4.634, rel=_SHARE)
    assert centres.std(axis=(0, 1)) == pytest.approx([0.705, 0.704, 1.114], rel=_SHARE)


@pytest.mark.statistics
def test_e0_and_r0_of_105_lengths_are_as_chance_has_it() -> None:
    ends = np.random.default_rng(4).standard_normal((_N, 35, 3, 2))
    errors: Float = ends[..., 1] - ends[..., 0]
    worst, ranges = np.abs(errors).max(axis=(1, 2)), repeat_ranges(errors).max(axis=1)
    assert worst.mean() == pytest.approx(3.91, rel=_SHARE)
    assert np.quantile(worst, 0.95) == pytest.approx(4.95, rel=_SHARE)
    assert ranges.mean() == pytest.approx(5.47, rel=_SHARE)
    assert np.quantile(ranges, 0.95) == pytest.approx(6.96, rel=_SHARE)


@pytest.mark.statistics
def test_spat_of_ten_points_is_as_chance_has_it() -> None:
    points = np.random.default_rng(5).standard_normal((_N, 10, 3))
    found = [spat_values(one) for one in points]
    two = np.array([one.two_sigma for one in found])
    far = np.array([one.largest for one in found])
    assert two.mean() == pytest.approx(3.44, rel=_SHARE)
    assert np.quantile(two, 0.95) == pytest.approx(4.23, rel=_SHARE)
    assert far.mean() == pytest.approx(2.57, rel=_SHARE)
    assert np.quantile(far, 0.95) == pytest.approx(3.40, rel=_SHARE)
