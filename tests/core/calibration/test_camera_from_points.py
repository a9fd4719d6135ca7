from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest

from ocmm_core.calibration.cameras import LensCamera, cloud_of, fit_camera
from ocmm_core.calibration.cameras._dlt import camera_of_dlt, dlt, pose_of_dlt, pose_of_plane
from ocmm_core.calibration.cameras._guards import judge_lens_terms, ratio_of
from ocmm_core.calibration.cameras._least_squares import covariance_of, minimise
from ocmm_core.calibration.cameras._lens import ALL_PARAMETERS, by_point, project_with_jacobian
from ocmm_core.calibration.cameras._model_fit import CameraProblem, free_parameters, whitening_of
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel, project, projection_jacobians
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from tests.core.calibration.difficult_lenses import anywhere, end_of, parameter_errors, trial_of
from tests.core.calibration.known_points import SIGMA_PX, distorted, rig, slab
from tests.core.calibration.published_cameras import fit_heikkila, fit_zhang

FOCAL = PARAMETERS.index("focal")
STEPS = np.array(
    [1e-6] * 3 + [1e-3] * 3 + [1e-4, 1e-6, 1e-3, 1e-3, 1e-8, 1e-10, 1e-8, 1e-8, 1e-12, 1e-8, 1e-8]
)
"""For central differences: each moves a pixel by about 1e-3 px."""


def camera() -> CameraModel:
    return replace(rig().cameras[0], aspect=1.0007)


def test_heikkilas_target_gives_the_published_camera(reference: Path) -> None:
    fit = fit_heikkila(reference)
    assert fit.rms_px == pytest.approx(0.05101, abs=5e-6)
    assert fit.camera.model.focal == pytest.approx(8.3502, abs=1e-4)
    # Three independent implementations agree on these digits.
    assert fit.camera.model.u0 == pytest.approx(367.314, abs=1e-3)
    assert fit.camera.model.k1 == pytest.approx(-3.1297e-3, abs=1e-7)
    assert fit.used.all()


def test_zhangs_views_give_his_published_lens(reference: Path) -> None:
    rms_px, deviation = fit_zhang(reference)
    assert rms_px == pytest.approx(0.33643, abs=5e-6)
    assert deviation < 1e-5


def test_lens_without_extra_terms_is_the_running_model() -> None:
    model, points = camera(), slab(80, 300.0, np.random.default_rng(1))
    seen = project_with_jacobian(LensCamera(model), points)
    d_point, d_parameters = projection_jacobians(model, points)
    # The same sums in another order: some ulp of 2000 px, and of derivatives up to 1e6.
    assert np.abs(seen.residuals.T - project(model, points)).max() < 1e-11
    assert np.abs(by_point(LensCamera(model), seen.rows).transpose(2, 0, 1) - d_point).max() < 1e-12
    ours = seen.rows[:N_PARAMETERS].transpose(2, 1, 0)
    size = np.abs(d_parameters).max((0, 1))
    assert (np.abs(ours - d_parameters).max((0, 1)) / size).max() < 1e-12


def test_derivatives_with_extra_terms_are_those_of_the_pixels() -> None:
    points = slab(60, 300.0, np.random.default_rng(2))
    lens = LensCamera(camera(), np.array([3e-10, 2e-5, -3e-5]))
    seen = project_with_jacobian(lens, points)
    for index, (name, step) in enumerate(zip(ALL_PARAMETERS, STEPS, strict=True)):
        change = np.zeros(len(ALL_PARAMETERS))
        change[index] = step
        ahead, behind = (
            project_with_jacobian(lens.moved(way * change), points).residuals for way in (1.0, -1.0)
        )
        numeric = (ahead - behind) / (2.0 * step)
        # Steps move pixels by some 1e-3 px, of which 1e-12 px is rounding: 1e-8 with room.
        miss = np.abs(seen.rows[index] - numeric).max()
        assert miss < 2e-8 * np.abs(numeric).max(), name


def test_dlt_of_exact_pinhole_points_is_the_camera() -> None:
    model = replace(camera(), k1=0.0, k2=0.0, p1=0.0, p2=0.0)
    points = slab(40, 200.0, np.random.default_rng(3))
    matrix = dlt(cloud_of(points), project(model, points))
    assert matrix is not None
    found = camera_of_dlt(model, matrix)
    assert found is not None
    # Rounding of pixels, 1e-13 relative, times the condition of the squared normal matrix.
    assert found.focal == pytest.approx(model.focal, rel=1e-7)
    assert found.aspect == pytest.approx(model.aspect, rel=1e-7)
    assert np.allclose(found.centre_world, model.centre_world, atol=1e-4)


def test_dlt_does_not_mind_a_world_origin_in_the_principal_plane() -> None:
    # With L12 = 1 this is singular (errata): the world is the camera's own frame.
    model = replace(
        camera(), k1=0.0, k2=0.0, p1=0.0, p2=0.0, T_camera_from_world=RigidTransform.identity()
    )
    points = slab(40, 200.0, np.random.default_rng(4)) + np.array([0.0, 0.0, 1000.0])
    matrix = dlt(cloud_of(points), project(model, points))
    assert matrix is not None
    found = camera_of_dlt(model, matrix)
    assert found is not None
    assert np.abs(found.centre_world).max() < 1e-4


def test_poses_for_a_known_lens() -> None:
    model = replace(camera(), k1=0.0, k2=0.0, p1=0.0, p2=0.0)
    rng = np.random.default_rng(5)
    flat, deep = slab(40, 0.0, rng), slab(40, 300.0, rng)
    for method, points in ((pose_of_plane, flat), (pose_of_dlt, deep)):
        pose = method(model, cloud_of(points), project(model, points))
        assert pose is not None
        assert np.allclose(pose.rotation, model.T_camera_from_world.rotation, atol=1e-8)
        assert np.allclose(pose.translation, model.T_camera_from_world.translation, atol=1e-4)
    # A plane has no DLT, and a mirror image no pose.
    assert dlt(cloud_of(flat), project(model, flat)) is None
    assert pose_of_dlt(model, cloud_of(deep * [1.0, 1.0, -1.0]), project(model, deep)) is None


def test_flatness_does_not_depend_on_the_axes() -> None:
    points = slab(4000, 40.0, np.random.default_rng(6))
    turned = points @ rotation_from_vector(np.array([0.3, -0.8, 0.5])).T
    # The spread of 4000 points is determined to one per cent.
    assert cloud_of(points).flatness == pytest.approx(0.1, rel=0.04)
    assert cloud_of(turned).flatness == pytest.approx(cloud_of(points).flatness, rel=1e-9)


@pytest.mark.parametrize("reference_sigma", [0.0, 0.004])
def test_covariance_is_honest(reference_sigma: float) -> None:
    truth, rng = distorted(camera(), -1.5), np.random.default_rng(7)
    squares, chi2 = [], []
    for _ in range(60):
        points = slab(150, 200.0, rng)
        uv = project(truth, points) + SIGMA_PX * rng.standard_normal((len(points), 2))
        listed = points + reference_sigma * rng.standard_normal(points.shape)
        fit = fit_camera(truth, listed, uv, SIGMA_PX, reference_sigma)
        errors = parameter_errors(fit.camera.model, truth)
        squares.append(errors @ np.linalg.solve(fit.covariance, errors))
        chi2.append(fit.chi2 / fit.dof)
    # Means of 60 chi-squares of 14 and of 286 degrees: 14 +- 0.68, 1 +- 0.011; four sigma.
    assert np.mean(squares) == pytest.approx(14.0, abs=2.8)
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.045)


@pytest.mark.parametrize("per_cent", [-1.5, 3.0])
@pytest.mark.parametrize("depth", [20.0, 200.0])
def test_wrong_points_are_found_and_named(per_cent: float, depth: float) -> None:
    truth, rng = distorted(camera(), per_cent), np.random.default_rng(8)
    points = slab(200, depth, rng)
    uv = project(truth, points) + SIGMA_PX * rng.standard_normal((200, 2))
    wrong = np.sort(rng.choice(200, 12, replace=False))
    # From 15 sigma to half the picture.
    sizes = np.geomspace(0.16, 900.0, 12)
    angles = rng.uniform(0.0, 2.0 * np.pi, 12)
    uv[wrong] += sizes[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    fit = fit_camera(truth, points, uv, SIGMA_PX)
    assert np.array_equal(np.flatnonzero(~fit.used), wrong)
    clean = np.setdiff1d(np.arange(200), wrong)
    alone = fit_camera(truth, points[clean], uv[clean], SIGMA_PX)
    assert fit.camera.model.focal == pytest.approx(alone.camera.model.focal, rel=1e-8)
    assert np.allclose(fit.covariance, alone.covariance, rtol=1e-3)


def test_good_points_are_not_called_wrong() -> None:
    truth, rng = camera(), np.random.default_rng(9)
    wrong = 0
    for _ in range(100):
        points = slab(100, 100.0, rng)
        uv = project(truth, points) + SIGMA_PX * rng.standard_normal((100, 2))
        wrong += int((~fit_camera(truth, points, uv, SIGMA_PX).used).sum())
    # One run in a thousand calls one wrong; three of a hundred have a chance of 2e-4.
    assert wrong <= 2


def test_extra_terms_are_found_needed_only_where_they_are() -> None:
    rng = np.random.default_rng(10)
    points = slab(300, 200.0, rng)
    noise = SIGMA_PX * rng.standard_normal((300, 2))
    plain = fit_camera(camera(), points, project(camera(), points) + noise, SIGMA_PX)
    assert not judge_lens_terms(plain).significant
    lens = LensCamera(camera(), np.array([3e-8, 0.0, 8e-4]))
    fit = fit_camera(
        camera(), points, project_with_jacobian(lens, points).residuals.T + noise, SIGMA_PX
    )
    terms = judge_lens_terms(fit)
    assert terms.significant
    assert np.all(np.abs(terms.values - lens.extra) < 5.0 * terms.sigmas)
    assert terms.effect_rms_px > SIGMA_PX
    # Errors of the running model show in its residuals if it rejects no point.
    small = LensCamera(camera(), 0.1 * lens.extra)
    fit = fit_camera(
        camera(), points, project_with_jacobian(small, points).residuals.T + noise, SIGMA_PX
    )
    assert fit.used.all()
    systematic = np.sqrt(fit.rms_px**2 - plain.rms_px**2)
    # Noise and effect correlate by chance, 1 / sqrt(600), on both sides of the difference.
    assert judge_lens_terms(fit).effect_rms_px == pytest.approx(systematic, rel=0.15)


@pytest.mark.statistics
@pytest.mark.parametrize("depth", [15.0, 200.0])
def test_chance_alone_makes_extra_terms_look_needed_as_often_as_stated(depth: float) -> None:
    rng = np.random.default_rng(15)
    found = []
    for _ in range(200):
        points = slab(100, depth, rng)
        uv = project(camera(), points) + SIGMA_PX * rng.standard_normal((100, 2))
        found.append(judge_lens_terms(fit_camera(camera(), points, uv, SIGMA_PX)).p_value)
    # Probabilities of what chance does are evenly spread; this fails one correct seed in 1000.
    assert kstest(found, "uniform").pvalue > 1e-3


def test_extra_terms_can_be_selected() -> None:
    rng = np.random.default_rng(11)
    points = slab(300, 200.0, rng)
    lens = LensCamera(camera(), np.array([3e-8, 0.0, 0.0]))
    uv = project_with_jacobian(lens, points).residuals.T + SIGMA_PX * rng.standard_normal((300, 2))
    fit = fit_camera(camera(), points, uv, SIGMA_PX, extra_terms=("k3",))
    assert ratio_of(fit) == pytest.approx(1.0, abs=0.15)
    assert fit.covariance.shape == (15, 15)
    assert abs(fit.camera.extra[0] - 3e-8) < 5.0 * np.sqrt(fit.covariance[14, 14])
    assert not fit.camera.extra[1:].any()


def test_whitening_makes_the_variance_of_uncertain_points_one() -> None:
    model, rng = camera(), np.random.default_rng(12)
    point = np.array([[120.0, 60.0, -150.0]])
    whitening = whitening_of(LensCamera(model), point, SIGMA_PX, 0.02)
    moved = point + 0.02 * rng.standard_normal((20_000, 3))
    miss = project(model, moved) - project(model, point)
    miss += SIGMA_PX * rng.standard_normal(miss.shape)
    problem = CameraProblem(point, miss[:1], whitening, free_parameters())
    first, across, second = problem.whitening[:, 0]
    u, v = miss.T
    white = np.stack([first * u, across * u + second * v])
    # 20,000 samples determine a variance to one per cent.
    assert np.allclose(np.cov(white), np.eye(2), atol=0.04)


def test_too_few_points_and_points_on_a_plane_are_refused() -> None:
    model, rng = camera(), np.random.default_rng(13)
    few = slab(19, 200.0, rng)
    with pytest.raises(CalibrationError, match="saw 19") as refusal:
        fit_camera(model, few, project(model, few), SIGMA_PX)
    assert refusal.value.code == "calibration.too_few_points"
    line = np.outer(rng.uniform(-200.0, 200.0, 50), [1.0, 0.1, 0.5])
    with pytest.raises(CalibrationError, match="not on a line"):
        fit_camera(model, line, project(model, line), SIGMA_PX)
    # A plane at right angles to the axis of a lens without distortion: focal length is distance.
    facing = replace(
        model, k1=0.0, k2=0.0, p1=0.0, p2=0.0, T_camera_from_world=RigidTransform.identity()
    )
    plane = np.column_stack([rng.uniform(-200.0, 200.0, (200, 2)), np.full(200, 1000.0)])
    with pytest.raises(CalibrationError, match="do not determine"):
        fit_camera(facing, plane, project(facing, plane), SIGMA_PX)


def test_covariance_of_undetermined_parameters_is_none() -> None:
    columns = np.random.default_rng(14).standard_normal((20, 2))
    assert covariance_of(np.column_stack([columns, columns.sum(axis=1)])) is None
    assert covariance_of(np.column_stack([columns, np.zeros(20)])) is None


@pytest.mark.statistics
@pytest.mark.slow
def test_no_wrong_minimum_in_many_calibrations(
    repeats: Callable[..., int], record_property: Callable[[str, object], None]
) -> None:
    n = repeats(30, 1000)
    ends = [end_of(trial_of(seed)) for seed in range(n)]
    for end in ("right", "refused", "wrong"):
        record_property(end, ends.count(end))
    wrong = [seed for seed, end in enumerate(ends) if end == "wrong"]
    assert not wrong
    # What refuses everything is never wrong.
    assert ends.count("right") >= 0.99 * n


@pytest.mark.statistics
def test_no_wrong_minimum_wherever_the_world_is(
    repeats: Callable[..., int], record_property: Callable[[str, object], None]
) -> None:
    n = repeats(20, 300)
    ends = [end_of(anywhere(seed)) for seed in range(n)]
    record_property("refused", ends.count("refused"))
    assert "wrong" not in ends
    # A wrong point among twenty cannot always be identified.
    assert ends.count("right") >= n - n // 30


def test_other_starts_help_where_wrong_points_lead_the_first_one_astray() -> None:
    trial = anywhere(438)
    fit = fit_camera(trial.nominal, trial.points, trial.uv, SIGMA_PX)
    assert not fit.start.startswith("nominal focal length, DLT")
    assert end_of(trial) == "right"


class Valley:
    """Rosenbrock's: a full first step leads uphill."""

    def linearise(self, state: Float) -> tuple[Float, Float]:
        x, y = state
        jacobian = np.array([[-20.0 * x, 10.0], [-1.0, 0.0]])
        return np.array([10.0 * (y - x * x), 1.0 - x]), jacobian

    def moved(self, state: Float, step: Float) -> Float:
        return state + step


def test_steps_that_lead_uphill_are_shortened() -> None:
    minimum = minimise(Valley(), np.array([-1.2, 1.0]))
    assert minimum.converged
    assert minimum.state == pytest.approx(np.ones(2), abs=1e-6)
