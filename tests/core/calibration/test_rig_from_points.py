from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.cameras import (
    KnownPoints,
    LensCamera,
    SpotTable,
    calibrate_rig,
    fit_camera,
)
from ocmm_core.calibration.cameras._guards import judge_fit
from ocmm_core.calibration.cameras._lens import project_with_jacobian
from ocmm_core.calibration.cameras._network import RigCalibration, split
from ocmm_core.calibration.guided import length_sigma
from ocmm_core.calibration.records import Finding, let_pass
from ocmm_core.camera import N_PARAMETERS, project
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float
from ocmm_core.tracking import triangulate
from tests.core.calibration.difficult_lenses import parameter_errors
from tests.core.calibration.known_points import SIGMA_PX, distorted, observe, rig
from tests.core.calibration.predicted_errors import error_map
from tests.core.calibration.thesis_volumes import TABLE_1_UM, cost_of, table_1
from tests.host import looser

DEPTH = 1


def shifted(points: KnownPoints, factor: Float | float) -> KnownPoints:
    return replace(points, positions_world=points.positions_world * factor)


CAMERAS = rig().cameras


def refusal(points: KnownPoints, spots: SpotTable, force: bool = False) -> CalibrationError:
    with pytest.raises(CalibrationError) as caught:
        calibrate_rig(rig(), points, spots, force)
    return caught.value


def codes(calibration: RigCalibration) -> set[str]:
    return {warning.code for warning in calibration.warnings}


@pytest.mark.statistics
@pytest.mark.slow
def test_table_1_of_the_thesis(repeats: Callable[..., int]) -> None:
    # 40 calibrations, 8000 points: they determine the RMS to one per cent.
    runs = repeats(10, 40)
    assert table_1(runs) == pytest.approx(TABLE_1_UM, rel=looser(0.05, runs, 40))


@pytest.mark.statistics
@pytest.mark.slow
def test_what_the_depth_of_the_calibrated_volume_is_worth(repeats: Callable[..., int]) -> None:
    runs = repeats(10, 60)
    flat, deep = (cost_of(depth, (100.0,), runs) for depth in (15.0, 200.0))
    # A focal length, a distance and little else are free in depth: 60 show it to 10 per cent.
    scatter = looser(0.2, runs, 60)
    assert flat.found_um[0, DEPTH] == pytest.approx(30.0, rel=scatter)
    assert deep.found_um[0, DEPTH] < 5.0
    for cost in (flat, deep):
        # The map predicts it without the truth.
        assert cost.predicted_um[0] == pytest.approx(cost.found_um[0], rel=scatter)
    assert flat.predicted_um[0, DEPTH] == pytest.approx(30.0, rel=0.15)
    assert flat.focal_sigma_um == pytest.approx(13.0, rel=0.1)


@pytest.mark.statistics
def test_error_map_is_what_calibrations_scatter_by() -> None:
    ends = np.array([[-150.0, 150.0], [-80.0, 80.0], [-150.0, 150.0]])
    flat = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3)
    exact = np.stack([project(camera, flat) for camera in CAMERAS])
    volume = np.stack([flat.min(axis=0), flat.max(axis=0)])
    squares = []
    for seed in range(60):
        points, spots = observe(rig(), 120, 150.0, seed, reference_sigma=0.003)
        calibrated = calibrate_rig(rig(), points, spots, force=True).applied_to(rig(), "record")
        chart = error_map(calibrated, volume, (2, 2, 2), SIGMA_PX)
        errors = triangulate(calibrated, exact) - flat
        squares.append((errors / chart.calibration_sigma.reshape(-1, 3)) ** 2)
    # 60 runs x 24 values, of which perhaps a quarter is independent: 1 +- 0.08 each axis.
    assert np.mean(squares, axis=(0, 1)) == pytest.approx(np.ones(3), abs=0.3)


def test_error_map_is_empty_where_only_one_camera_sees() -> None:
    chart = error_map(rig(), np.array([[-900.0, 0.0, 0.0], [0.0, 0.1, 0.1]]), (2, 1, 1), SIGMA_PX)
    assert np.isnan(chart.calibration_sigma[0]).all()
    assert np.isnan(chart.spot_sigma[0]).all()
    assert np.isfinite(chart.calibration_sigma[1]).all()
    # Table 1 at the centre of the field, where X and Z are best: spots alone.
    assert 1e3 * chart.spot_sigma[1, 0, 0, 1] == pytest.approx(22.7, rel=0.1)


@pytest.mark.statistics
def test_common_reference_points_couple_the_cameras() -> None:
    found = []
    for seed in range(120):
        points, spots = observe(rig(), 80, 200.0, seed, sigma_px=0.002, reference_sigma=0.01)
        calibration = calibrate_rig(rig(), points, spots, force=True)
        found.append([c.model.T_camera_from_world.translation for c in calibration.cameras])
    shifts = np.array(found).reshape(120, 6)
    rows = [3, 4, 5, N_PARAMETERS + 3, N_PARAMETERS + 4, N_PARAMETERS + 5]
    predicted = calibration.covariance[np.ix_(rows, rows)]
    assert np.allclose(calibration.covariance, calibration.covariance.T)
    assert np.linalg.eigvalsh(calibration.covariance).min() > -1e-12
    correlation = np.corrcoef(shifts.T)[:3, 3:]
    sigmas = np.sqrt(np.diag(predicted))
    expected = (predicted / np.outer(sigmas, sigmas))[:3, 3:]
    # 120 samples determine correlations to 0.09; two of these are above 0.3.
    assert np.abs(expected).max() > 0.3
    assert np.abs(correlation - expected).max() < 0.3


def test_uncertain_length_of_the_list_is_that_of_all_lengths() -> None:
    points, spots = observe(rig(), 120, 200.0, 1)
    off, certain = 1e-5, calibrate_rig(rig(), points, spots)
    middle = points.positions_world.mean(axis=0)
    longer = middle + (1.0 + off) * (points.positions_world - middle)
    moved = calibrate_rig(rig(), replace(points, positions_world=longer), spots)
    both = zip(moved.cameras, certain.cameras, strict=True)
    errors = np.concatenate([parameter_errors(a.model, b.model) for a, b in both])
    uncertain = calibrate_rig(rig(), replace(points, length_sigma=off), spots)
    grown = uncertain.covariance - certain.covariance
    # The effect of a list that is too long by one sigma; the rest is rounding.
    size = np.sqrt(np.diag(certain.covariance))
    assert np.abs((grown - np.outer(errors, errors)) / np.outer(size, size)).max() < 1e-5
    assert np.abs(grown / np.outer(size, size)).max() > 1e-3
    assert np.array_equal(uncertain.cameras[1].covariance, uncertain.covariance[14:, 14:])
    box = middle + np.array([[-200.0, -100.0, -200.0], [200.0, 100.0, 200.0]])
    lengths = [length_sigma(one.applied_to(rig(), "record"), box) for one in (certain, uncertain)]
    assert np.sqrt(lengths[1] ** 2 - lengths[0] ** 2) == pytest.approx(400.0 * off, rel=1e-3)


def test_a_good_calibration_says_what_it_is() -> None:
    points, spots = observe(rig(), 300, 250.0, 1, reference_sigma=0.0017)
    spots.uv[1, 7] = np.nan
    spots.uv[0, 20] += [0.4, 0.0]
    calibration = calibrate_rig(rig(), points, spots)
    left, right = calibration.cameras
    assert [outlier.name for outlier in left.outliers] == ["P020"]
    assert left.outliers[0].miss_px == pytest.approx([0.4, 0.0], abs=6 * SIGMA_PX)
    assert codes(calibration) == {"calibration.outliers"}
    assert "P020" in calibration.warnings[0].what
    assert "'left'" in calibration.warnings[0].what
    assert len(right.indices) == 299
    assert 7 not in right.indices
    assert not calibration.forced
    assert left.rms_px == pytest.approx(SIGMA_PX, rel=0.15)
    low, high = calibration.volume_world
    assert np.all(low > [-200.1, -125.1, -200.1])
    assert np.all(high < [200.1, 125.1, 200.1])
    applied = calibration.applied_to(rig(), "the record")
    assert applied.identity == "the record"
    assert applied.cameras[0].serial == CAMERAS[0].serial
    assert applied.parameter_covariance.shape == (2 * N_PARAMETERS,) * 2


def test_split_shares_all_points_and_is_seeded() -> None:
    points, _ = observe(rig(), 50, 100.0, 1)
    used, kept = split(points, 20, np.random.default_rng(1))
    assert sorted([*used, *kept]) == list(range(50))
    assert len(used) == 20
    assert np.array_equal(used, split(points, 20, np.random.default_rng(1))[0])
    with pytest.raises(CalibrationError, match="leave none for evaluation"):
        split(points, 50, np.random.default_rng(1))


def test_flat_volume_warns_refuses_and_can_be_forced() -> None:
    # With such precise spots the focal length alone would be determined well enough.
    shallow = observe(rig(), 400, 80.0, 1, sigma_px=0.002)
    assert codes(calibrate_rig(rig(), *shallow)) == {"calibration.flat_volume"}
    flat = observe(rig(), 400, 15.0, 1)
    error = refusal(*flat)
    assert error.code == "calibration.flat_volume"
    assert "0.03 times as deep as wide" in error.what
    assert "override it with a reason" in error.remedy
    forced = calibrate_rig(rig(), *flat, force=True)
    assert forced.forced
    assert {"calibration.flat_volume", "calibration.focal_sigma"} <= codes(forced)


def test_small_volume_is_refused() -> None:
    points, spots = observe(rig(), 200, 400.0, 1)
    for size, refused in ((20.0, True), (80.0, False)):
        rng = np.random.default_rng(2)
        truth = rng.uniform(-0.5, 0.5, (200, 3)) * size
        uv = np.stack([project(camera, truth) for camera in CAMERAS])
        uv += 1e-5 * rng.standard_normal(uv.shape)
        small = replace(points, positions_world=truth), replace(spots, uv=uv, sigma_px=1e-5)
        if refused:
            error = refusal(*small)
            assert error.code == "calibration.small_volume"
            assert "only 2.0 % of their distance" in error.what
        # So small a field does not show the extra lens terms; nor do they matter in it.
        assert codes(calibrate_rig(rig(), *small, force=refused)) == {"calibration.small_volume"}


def test_uncertain_focal_length_is_refused() -> None:
    coarse = observe(rig(), 200, 200.0, 1, sigma_px=5.0 * SIGMA_PX)
    error = refusal(*coarse)
    assert error.code == "calibration.focal_sigma"
    assert "2." in error.what
    assert codes(calibrate_rig(rig(), *coarse, force=True)) == {"calibration.focal_sigma"}
    assert not calibrate_rig(rig(), *observe(rig(), 200, 200.0, 1, sigma_px=SIGMA_PX)).forced


def test_few_points_are_named() -> None:
    few = observe(rig(), 40, 300.0, 1, sigma_px=0.002)
    assert codes(calibrate_rig(rig(), *few)) == {"calibration.few_points"}


def test_a_fit_that_did_not_end_is_refused_even_when_forced() -> None:
    points, spots = observe(rig(), 200, 200.0, 1)
    fit = fit_camera(CAMERAS[0], points.positions_world, spots.uv[0], SIGMA_PX)
    assert judge_fit(fit, points.names) == []
    with pytest.raises(CalibrationError) as caught:
        let_pass(judge_fit(replace(fit, converged=False), points.names), force=True)
    assert caught.value.code == "calibration.not_converged"


def test_too_few_points_are_refused_by_number() -> None:
    points, spots = observe(rig(), 200, 200.0, 1)
    spots.uv[1, 15:] = np.nan
    error = refusal(points, spots)
    assert error.code == "calibration.too_few_points"
    assert "'right' saw 15" in error.what


def test_residuals_that_their_sigma_does_not_explain() -> None:
    # The stated noise is too small by factors of three and one and a half, and too large by two.
    points, spots = observe(rig(), 400, 400.0, 1, sigma_px=3.0 * SIGMA_PX)
    assert refusal(points, replace(spots, sigma_px=SIGMA_PX)).code == "calibration.chi2"
    forced = calibrate_rig(rig(), points, replace(spots, sigma_px=SIGMA_PX), force=True)
    honest = calibrate_rig(rig(), points, spots)
    # The covariance follows the observed scatter.
    assert np.trace(forced.covariance) == pytest.approx(np.trace(honest.covariance), rel=0.15)
    modest = calibrate_rig(rig(), points, replace(spots, sigma_px=2.0 * SIGMA_PX))
    assert "calibration.chi2" in codes(modest)
    generous = calibrate_rig(rig(), points, replace(spots, sigma_px=6.0 * SIGMA_PX))
    assert "calibration.chi2_low" in codes(generous)
    hopeless = refusal(points, replace(spots, sigma_px=0.2 * SIGMA_PX), force=True)
    assert hopeless.code == "calibration.rms"


def test_many_wrong_points_are_refused_even_when_forced() -> None:
    points, spots = observe(rig(), 200, 200.0, 1)
    wrong = np.random.default_rng(3).choice(200, 30, replace=False)
    spots.uv[0, wrong] += 5.0
    error = refusal(points, spots, force=True)
    assert error.code == "calibration.outliers"
    assert "30 of 200" in error.what


@pytest.mark.parametrize("depth", [40.0, 300.0])
def test_a_mixed_up_list_is_named(depth: float) -> None:
    points, spots = observe(rig(), 120, depth, 1)
    at = points.positions_world
    cases = [
        (at[::-1], "calibration.wrong_order", "reverse order"),
        (np.roll(at, 1, axis=0), "calibration.wrong_order", "next point"),
        (np.roll(at, -1, axis=0), "calibration.wrong_order", "previous point"),
        (at[:, [1, 0, 2]], "calibration.wrong_axes", "swapped"),
        (at * [1.0, -1.0, 1.0], "calibration.wrong_axes", "wrong sign"),
    ]
    for positions, code, words in cases:
        error = refusal(replace(points, positions_world=positions), spots, force=True)
        assert error.code == code
        assert words in error.what
    swapped = replace(spots, uv=spots.uv[:, :, ::-1])
    assert refusal(points, swapped, force=True).code == "calibration.wrong_axes"
    shuffled = at[np.random.default_rng(1).permutation(120)]
    error = refusal(replace(points, positions_world=shuffled), spots, force=True)
    assert error.code in {"calibration.rms", "calibration.outliers", "calibration.no_start"}


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1.0 / 25.4, "in inches, but declares mm"),
        (25.4, "in mm, but declares inches"),
        (1e-3, "in metres, but declares mm"),
        (10.0, "in mm, but declares centimetres"),
    ],
)
def test_a_wrong_unit_is_named(factor: float, words: str) -> None:
    points, spots = observe(rig(), 120, 300.0, 1)
    error = refusal(shifted(points, factor), spots, force=True)
    assert error.code == "calibration.wrong_unit"
    assert words in error.what


def test_a_rig_of_another_size_can_be_forced() -> None:
    points, spots = observe(rig(), 120, 300.0, 1)
    doubled = shifted(points, 2.0)
    assert refusal(doubled, spots).code == "calibration.baseline"
    assert "calibration.baseline" in codes(calibrate_rig(rig(), doubled, spots, force=True))


def test_another_camera_is_refused_by_serial() -> None:
    points, spots = observe(rig(), 120, 300.0, 1)
    other = replace(spots, serials=(spots.serials[0], 99))
    error = refusal(points, other, force=True)
    assert error.code == "calibration.serial_mismatch"
    assert "99" in error.what
    assert "'right'" in error.what
    # The order of the cameras in the file does not matter.
    turned = replace(spots, serials=spots.serials[::-1], uv=spots.uv[::-1])
    assert np.allclose(
        calibrate_rig(rig(), points, turned).covariance,
        calibrate_rig(rig(), points, spots).covariance,
    )


def test_a_lens_that_needs_more_terms_is_refused() -> None:
    points, spots = observe(rig(), 300, 250.0, 1)
    lens = LensCamera(distorted(CAMERAS[0], -1.5), np.array([2e-8, 0.0, 5e-4]))
    noise = SIGMA_PX * np.random.default_rng(1).standard_normal((300, 2))
    spots.uv[0] = project_with_jacobian(lens, points.positions_world).residuals.T + noise
    error = refusal(points, spots, force=True)
    assert error.code == "calibration.lens_model"
    lens = LensCamera(lens.model, 0.25 * lens.extra)
    spots.uv[0] = project_with_jacobian(lens, points.positions_world).residuals.T + noise
    assert "calibration.lens_model" in codes(calibrate_rig(rig(), points, spots))


def test_cameras_without_a_common_volume_are_refused() -> None:
    points, spots = observe(rig(), 200, 300.0, 1)
    spots.uv[0, :100] = np.nan
    spots.uv[1, 100:] = np.nan
    assert refusal(points, spots).code == "calibration.no_common_volume"


def test_what_cannot_be_forced_is_said_first() -> None:
    soft = Finding("a.soft", "Soft.", "Do.", refuses=True, forcible=True)
    hard = Finding("a.hard", "Hard.", "Do.", refuses=True)
    with pytest.raises(CalibrationError) as caught:
        let_pass([soft, hard], force=False)
    assert caught.value.code == "a.hard"
    assert [one.refuses for one in let_pass([soft], force=True)] == [False]
