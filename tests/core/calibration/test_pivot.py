from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ocmm_core.calibration.pivot import (
    PivotCalibration,
    PivotLimits,
    PivotOptions,
    PivotSweep,
    adjust_pivot,
    calibrate_probe,
    common_centre,
    moments_of,
    preview_pivot,
    sphere_centres,
    start_pivot,
    thesis_pivot,
    validate_pivot,
)
from ocmm_core.calibration.pivot._bundle import PivotState, chi2_of_cameras, normals_at
from ocmm_core.calibration.pivot._covariance import geometry_in
from ocmm_core.calibration.pivot._pivot import tip_of_arms
from ocmm_core.camera import N_PARAMETERS, Rig, project
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, rotation_from_vector
from tests.core.calibration.swept_probe import (
    CONE_WORLD,
    SIGMA_PX,
    attitudes,
    disturbed,
    plain_adjust,
    probe,
    rig,
    spots,
    sweep,
    waved_attitudes,
)
from tests.core.calibration.waved_probe import four_cameras
from tests.host import looser


def _refused(
    frames: PivotSweep, options: PivotOptions | None = None, force: bool = False
) -> CalibrationError:
    with pytest.raises(CalibrationError) as caught:
        calibrate_probe(rig(), probe(), frames, options, force)
    return caught.value


def _with(frames: PivotSweep, first: int, others: PivotSweep) -> PivotSweep:
    uv = frames.uv.copy()
    uv[first : first + len(others.uv)] = others.uv
    return replace(frames, uv=uv)


def _moved(*by: float) -> Float:
    moved: Float = CONE_WORLD + np.array(by)
    return moved


def _without_camera_errors() -> Rig:
    known = rig()
    return replace(known, parameter_covariance=np.zeros_like(known.parameter_covariance))


def test_tip_three_times_better_than_the_thesis(record_property: Any) -> None:
    body, ours, thesis = probe(), [], []
    for seed in range(15):
        frames = sweep(1000, 20.0, seed)
        start = start_pivot(rig(), frames, seed=1)
        ours.append(tip_of_arms(adjust_pivot(rig(), frames, start.state).state.arms, body))
        thesis.append(tip_of_arms(thesis_pivot(start.targets).arms, body))
    rms, rms_thesis = (1e3 * np.sqrt(np.mean(np.sum(np.square(e), axis=1))) for e in (ours, thesis))
    shown = [round(float(value), 2) for value in (rms, rms_thesis)]
    record_property("tip RMS of adjustment and thesis, um", shown)

    # The claim for a thousand runs is 1.25 um; 45 numbers scatter by 11 %.
    assert rms < 1.25
    assert rms_thesis > 2.5 * rms


def test_one_centre_for_all_is_better_than_the_mean_of_four() -> None:
    common, four = [], []
    for seed in range(15):
        frames = sweep(1000, 20.0, seed)
        targets = start_pivot(rig(), frames, seed=1).targets
        reference = targets.mean(axis=0)
        moments = moments_of(targets, reference)
        common.append(common_centre(moments, reference) - CONE_WORLD)
        four.append(sphere_centres(moments, reference).mean(axis=0) - CONE_WORLD)

    assert np.sum(np.square(common)) < 0.5 * np.sum(np.square(four))


def test_spheres_are_exact_far_from_the_origin() -> None:
    rng = np.random.default_rng(1)
    arms = probe().leds_probe
    centre = np.array([300.0, 1061.0, -250.0])
    targets = np.einsum("nij,lj->nli", attitudes(200, 10.0, rng), arms) + centre
    reference = targets[0]

    moments = moments_of(targets, reference)

    assert np.abs(sphere_centres(moments, reference) - centre).max() < 1e-7
    assert np.abs(common_centre(moments, reference) - centre).max() < 1e-8


def test_group_average_never_reflects_a_flat_probe() -> None:
    rng = np.random.default_rng(2)
    arms = probe().leds_probe - probe().tip_probe
    targets = np.einsum("nij,lj->nli", attitudes(300, 45.0, rng), arms) + CONE_WORLD
    targets += 0.02 * rng.standard_normal(targets.shape)

    average = thesis_pivot(targets).arms

    # A mean over reflections of a plane body is the body too; the spread of distances is not.
    assert np.allclose(
        np.linalg.norm(average[:, None] - average, axis=2),
        np.linalg.norm(arms[:, None] - arms, axis=2),
        atol=0.005,
    )
    assert np.linalg.norm(tip_of_arms(average, probe())) < 0.02


def test_same_minimum_as_plain_numpy() -> None:
    frames = sweep(300, 25.0, 4)
    start = start_pivot(rig(), frames, seed=1).state

    ours = adjust_pivot(rig(), frames, start)
    plain = plain_adjust(rig(), frames.uv, start.centre, start.arms, start.rotations, 8)

    assert ours.converged
    # The last plain step moves by less than this.
    assert np.abs(ours.state.centre - plain.centre).max() < 1e-6
    tips = [tip_of_arms(arms, probe()) for arms in (ours.state.arms, plain.arms)]
    assert np.abs(tips[0] - tips[1]).max() < 1e-6
    # The peer measures its misses on the undistorted image.
    assert ours.cost == pytest.approx(plain.cost, rel=1e-7)


@pytest.mark.parametrize("slack", [0.0, 0.005])
def test_normal_equations_against_differences(slack: float) -> None:
    """Dense derivatives by differences, eliminated the long way."""
    rng = np.random.default_rng(3)
    known, body = rig(), probe()
    n, arms = 6, body.leds_probe
    state = PivotState(
        CONE_WORLD, arms, attitudes(n, 25.0, rng), slack * rng.standard_normal((n, 3))
    )
    frames = PivotSweep.even(spots(known, body, state.rotations, CONE_WORLD, rng), SIGMA_PX)
    frames.uv[2, 1, 3] = np.nan
    own = 6 if slack else 3
    count = state.columns + 14 * len(known.cameras) + own * n

    def residuals(step: Float) -> Float:
        k = state.columns
        cameras = [
            camera.perturbed(step[k + N_PARAMETERS * c : k + N_PARAMETERS * (c + 1)])
            for c, camera in enumerate(known.cameras)
        ]
        poses = step[k + 14 * len(cameras) :].reshape(n, own)
        turned = np.stack([rotation_from_vector(p[:3]) for p in poses]) @ state.rotations
        slacks = state.slacks + (poses[:, 3:] if slack else 0.0)
        led = arms + step[3:k].reshape(-1, 3)
        points = np.einsum("nij,lj->nli", turned, led)
        points += (CONE_WORLD + step[:3] + slacks)[:, None]
        uv = np.stack([project(camera, points) for camera in cameras], axis=1)
        off = ((uv - frames.uv) / SIGMA_PX).ravel()
        held = (slacks / slack).ravel() if slack else np.empty(0)
        return np.concatenate([off[np.isfinite(off)], held])

    h = 1e-6
    steps = h * np.eye(count)
    # Distortion terms k2 are so small that they need a separate step.
    j = np.stack([(residuals(s) - residuals(-s)) / (2.0 * h) for s in steps], axis=1)
    r = residuals(np.zeros(count))
    dense, gradient = j.T @ j, j.T @ r
    first = count - own * n
    inverse = np.linalg.inv(dense[first:, first:])
    reduced = dense[:first, :first] - dense[:first, first:] @ inverse @ dense[first:, :first]
    reduced_gradient = gradient[:first] - dense[:first, first:] @ inverse @ gradient[first:]

    found = normals_at(known, frames, state, slack, with_cameras=True)

    k = state.columns
    size = np.sqrt(np.diag(reduced))
    scale = size[:k, None] * size[None]
    assert found.cost == pytest.approx(float(r @ r), rel=1e-9)
    assert np.abs((found.normals[0] - reduced[:k, :k]) / scale[:, :k]).max() < 1e-5
    lens_of_little_effect = size[k:] < 1e-6 * size[k:].max()
    off = np.abs((found.crossed[0] - reduced[:k, k:]) / scale[:, k:])
    assert off[:, ~lens_of_little_effect].max() < 1e-4
    assert np.abs((found.gradients[0] - reduced_gradient[:k]) / size[:k]).max() < 1e-4
    assert np.allclose(found.scores.sum(axis=0), found.gradients[0])


def test_frame_of_the_document_is_kept() -> None:
    """Derivative of LEDs and tip by the arms, against differences, in any frame of the arms."""
    rng = np.random.default_rng(5)
    body = probe("standard")
    turn = rotation_from_vector(np.array([0.4, -1.1, 0.3]))
    arms = (body.leds_probe - body.tip_probe) @ turn.T + 0.01 * rng.standard_normal((6, 3))

    geometry = geometry_in(body.leds_probe, arms)

    for index in range(arms.size):
        change = np.zeros(arms.size)
        change[index] = 1e-4
        plus, minus = (
            geometry_in(body.leds_probe, arms + sign * change.reshape(-1, 3)) for sign in (1, -1)
        )
        slope = np.concatenate([plus.leds_probe.ravel(), plus.tip_probe])
        slope -= np.concatenate([minus.leds_probe.ravel(), minus.tip_probe])
        assert np.allclose(slope / 2e-4, geometry.by_arms[:, index], atol=1e-3)


def test_ghosts_and_hidden_spots_are_named() -> None:
    frames = sweep(1500, 30.0, 6)
    rng = np.random.default_rng(6)
    chosen = rng.choice(1500, 120, replace=False)
    ghosts, hidden = chosen[:60], chosen[60:]
    for frame in ghosts:
        frames.uv[frame, rng.integers(2), rng.integers(4)] += rng.choice([-1, 1], 2) * 5.0
    frames.uv[hidden, 0, :2] = np.nan

    found = calibrate_probe(rig(), probe(), frames)

    assert {one.frame for one in found.left_out if one.reason == "spots"} == set(ghosts)
    assert {one.frame for one in found.left_out if one.reason == "few"} == set(hidden)
    assert [one.code for one in found.warnings] == ["pivot.left_out"]
    assert np.linalg.norm(found.tip_probe) < 0.004
    assert np.isnan(found.residuals_px[ghosts]).all()


def test_ball_that_jumped_out_for_a_while_is_named() -> None:
    frames = _with(sweep(2000, 30.0, 7), 800, sweep(150, 30.0, 8, _moved(0.25, 0.0, 0.0)))

    found = calibrate_probe(rig(), probe(), frames)

    # Every single frame sees its tip to some 25 um.
    assert {one.frame for one in found.left_out} == set(range(800, 950))
    assert {one.reason for one in found.left_out} == {"tip"}
    assert np.median([one.size for one in found.left_out]) == pytest.approx(0.25, abs=0.02)
    assert np.linalg.norm(found.tip_probe) < 0.004


def test_moving_cone_is_refused_although_no_frame_shows_it() -> None:
    frames = _with(sweep(2000, 30.0, 9), 1000, sweep(1000, 30.0, 10, _moved(0.03, 0.02, 0.0)))

    error = _refused(frames)

    assert error.code == "pivot.moved"
    assert "36 um" in error.what or "35 um" in error.what or "37 um" in error.what


def test_drifting_cone_is_refused() -> None:
    rng = np.random.default_rng(11)
    rotations = attitudes(2000, 30.0, rng)
    cone = CONE_WORLD + np.linspace(0.0, 1.0, 2000)[:, None] * [0.08, 0.0, 0.0]

    error = _refused(PivotSweep.even(spots(rig(), probe(), rotations, cone, rng), SIGMA_PX))

    assert error.code == "pivot.moved"


def test_no_false_alarm_with_cameras_that_are_wrong_by_their_uncertainty(
    repeats: Callable[..., int],
) -> None:
    for seed in range(repeats(4, 8)):
        rng = np.random.default_rng(seed)
        true = disturbed(rig(), rng)
        rotations = waved_attitudes(1500, 30.0, rng)
        uv = spots(true, probe(), rotations, CONE_WORLD, rng)

        found = calibrate_probe(rig(), probe(), PivotSweep.even(uv, SIGMA_PX))

        assert not found.left_out
        assert not found.warnings


@pytest.mark.parametrize("seed", [5, 12])
def test_wide_sweep_of_wrong_cameras_is_no_moving_cone(seed: int) -> None:
    # With a linear slope for camera errors: "shifted by 30 um" and "by 33 um".
    rng = np.random.default_rng(seed)
    true, wide = disturbed(rig(), rng), rng.uniform(30.0, 60.0)
    uv = spots(true, probe(), waved_attitudes(1000, wide, rng), CONE_WORLD, rng)

    found = calibrate_probe(
        rig(), probe(), PivotSweep.even(uv, SIGMA_PX), PivotOptions(resamples=60)
    )

    assert "pivot.moved" not in [one.code for one in found.warnings]


@pytest.mark.parametrize(
    ("frames", "code"),
    [
        (lambda: sweep(20, 30.0, 1), "pivot.few_frames"),
        (lambda: sweep(40, 30.0, 1), "pivot.few_poses"),
        (lambda: sweep(500, 2.0, 1), "pivot.weak_motion"),
        (lambda: sweep(500, 7.0, 1), "pivot.small_range"),
        (lambda: sweep(500, 30.0, 1, body=probe("standard")), "pivot.leds"),
    ],
)
def test_sweeps_that_show_too_little_are_refused(frames: Any, code: str) -> None:
    error = _refused(frames())

    assert error.code == code
    assert error.remedy


def test_weak_motion_cannot_be_forced_and_a_small_range_can() -> None:
    assert _refused(sweep(500, 2.0, 1), force=True).code == "pivot.weak_motion"

    found = calibrate_probe(rig(), probe(), sweep(500, 7.0, 1), force=True)

    assert found.forced
    assert "pivot.small_range" in [one.code for one in found.warnings]


def test_wrong_probe_and_another_tip_are_refused() -> None:
    body = probe()
    other = body.leds_probe.copy()
    other[2] += [3.0, 0.0, 1.0]
    wrong = sweep(500, 30.0, 1, body=replace(body, leds_probe=other))
    assert _refused(wrong).code == "pivot.wrong_probe"

    longer = replace(body, tip_probe=body.tip_probe - [0.0, 0.0, 1.0])
    error = _refused(sweep(500, 30.0, 1, body=longer))
    assert error.code == "pivot.tip_changed"
    assert "1.00" in error.what
    assert _refused(sweep(500, 30.0, 1, body=longer), force=True).code == "pivot.tip_changed"
    anywhere = PivotOptions(limits=PivotLimits(tip_change_mm=np.inf))
    forced = calibrate_probe(rig(), body, sweep(500, 30.0, 1, body=longer), anywhere)
    assert forced.tip_probe == pytest.approx([0.0, 0.0, -1.0], abs=0.01)


def test_noise_ten_times_what_was_stated_is_refused() -> None:
    frames = sweep(500, 30.0, 1)
    frames.uv[:] += 0.1 * np.random.default_rng(1).standard_normal(frames.uv.shape)

    assert _refused(frames).code == "calibration.chi2"


@pytest.mark.slow
@pytest.mark.statistics
def test_stated_uncertainty_holds_with_wrong_cameras(
    repeats: Callable[..., int], record_property: Any
) -> None:
    squares, inside = [], []
    for seed in range(n := repeats(12, 60)):
        rng = np.random.default_rng(seed)
        true = disturbed(rig(), rng)
        rotations = attitudes(400, 30.0, rng)
        uv = spots(true, probe(), rotations, CONE_WORLD, rng)
        found = calibrate_probe(rig(), probe(), PivotSweep.even(uv, SIGMA_PX), force=True)
        covariance = found.tip_covariance
        squares.append(found.tip_probe @ np.linalg.solve(covariance, found.tip_probe) / 3.0)
        inside.append(np.abs(found.tip_probe) <= 2.0 * np.sqrt(np.diag(covariance)))
    shown = [round(float(value), 3) for value in (np.mean(squares), np.mean(inside))]
    record_property("normalised square, inside k=2", shown)

    # 60 runs of three numbers: the mean square scatters by 11 %, the share by 1.6 %.
    assert np.mean(squares) == pytest.approx(1.0, abs=looser(0.3, n, 60))
    assert np.mean(inside) == pytest.approx(0.954, abs=looser(0.05, n, 60))


def test_errors_of_the_cameras_count_once(
    repeats: Callable[..., int], record_property: Any
) -> None:
    """They scatter the blocks too, which the bootstrap alone would take for noise."""
    noise, formal = 0.0, 0.0
    for seed in range(repeats(6, 16)):
        rng = np.random.default_rng(seed)
        uv = spots(disturbed(rig(), rng), probe(), attitudes(600, 30.0, rng), CONE_WORLD, rng)
        found = calibrate_probe(rig(), probe(), PivotSweep.even(uv, SIGMA_PX))
        noise += float(np.trace(found.noise_covariance[-3:, -3:]))
        formal += float(np.trace(found.formal_covariance[-3:, -3:]))
    record_property("noise over formal", round(noise / formal, 2))

    # 3.7 without the share of the cameras taken off.
    assert 1.0 <= noise / formal < 3.0


def test_chi2_that_wrong_cameras_leave() -> None:
    known, body = rig(), probe()
    rng = np.random.default_rng(7)
    rotations = attitudes(1200, 30.0, rng)
    state = PivotState(CONE_WORLD, body.leds_probe, rotations, np.zeros((1200, 3)))
    points = state.points()
    costs = []
    for _ in range(40):
        true = disturbed(known, rng)
        uv = np.stack([project(camera, points) for camera in true.cameras], axis=1)
        costs.append(adjust_pivot(known, PivotSweep.even(uv, SIGMA_PX), state).cost)

    stated = chi2_of_cameras(known, PivotSweep.even(uv, SIGMA_PX), state, 0.0, 400, seed=1)

    # Forty draws of a skewed distribution know its mean to 15 %.
    assert np.mean(stated) == pytest.approx(float(np.mean(costs)), rel=0.4)


def test_correlated_frames_are_not_taken_as_independent(record_property: Any) -> None:
    """A pattern of the sensors that a slow hand moves over: what recordings are like."""
    known, body = _without_camera_errors(), probe()
    found: list[PivotCalibration] = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        uv = spots(known, body, waved_attitudes(3000, 30.0, rng), CONE_WORLD, rng)
        waves = rng.normal(0.0, 1.0, (2, 4, 2, 2)) / 12.0
        phase = np.einsum("nclk,clko->nclo", uv, waves) + rng.uniform(0.0, 6.28, (2, 4, 2))
        found.append(
            calibrate_probe(known, body, PivotSweep.even(uv + 0.01 * np.sin(phase), SIGMA_PX))
        )
    true = np.sqrt(np.mean([np.sum(one.tip_probe**2) for one in found]))
    stated = np.sqrt(np.mean([np.trace(one.noise_covariance[-3:, -3:]) for one in found]))
    formal = np.sqrt(np.mean([np.trace(one.formal_covariance[-3:, -3:]) for one in found]))
    shown = [round(1e3 * float(value), 2) for value in (true, stated, formal)]
    record_property("true, bootstrap, formal, um", shown)

    assert formal < 0.6 * true
    # Eight runs know the true error to 15 %, and a bootstrap misses correlations beyond a block.
    assert 0.6 * true < stated < 1.8 * true


def test_ball_with_slack() -> None:
    """A ball that moves by 5 um in its cone: reported, and modelled by the adjustment."""
    rng = np.random.default_rng(13)
    rotations = attitudes(1500, 30.0, rng)
    balls = CONE_WORLD + 0.02 * rng.standard_normal((1500, 3))
    frames = PivotSweep.even(spots(rig(), probe(), rotations, balls, rng), SIGMA_PX)

    without = calibrate_probe(rig(), probe(), frames, force=True)
    with_slack = calibrate_probe(rig(), probe(), frames, PivotOptions(slack_mm=0.02))

    assert without.chi2 / without.dof > 1.5
    assert with_slack.chi2 / with_slack.dof == pytest.approx(1.0, abs=0.05)
    assert with_slack.formal_covariance[-1, -1] > without.formal_covariance[-1, -1]
    assert np.linalg.norm(with_slack.tip_probe) < 0.005


def test_second_sweep_confirms_or_contradicts() -> None:
    body, elsewhere = probe(), _moved(80.0, 30.0, 40.0)
    first = calibrate_probe(rig(), body, sweep(1500, 30.0, 20))
    frames = sweep(1500, 30.0, 21, elsewhere)
    loose = sweep(1500, 30.0, 22, elsewhere, replace(body, tip_probe=np.array([0.03, 0.0, 0.0])))
    again = sweep(1500, 30.0, 23)

    good = validate_pivot(rig(), first, calibrate_probe(rig(), body, frames), frames)
    bad = validate_pivot(rig(), first, calibrate_probe(rig(), body, loose), loose)
    same = validate_pivot(rig(), first, calibrate_probe(rig(), body, again), again)

    assert good.passed
    assert good.place_distance == pytest.approx(np.linalg.norm([80, 30, 40]), abs=0.1)
    assert good.articulation_2s < 0.03
    assert [one.code for one in bad.findings] == ["pivot.contradiction"]
    assert np.linalg.norm(bad.tip_difference) == pytest.approx(0.03, abs=0.01)
    assert not bad.passed
    assert [one.code for one in same.findings] == ["pivot.same_place"]


def test_preview_promises_what_the_calibration_then_states() -> None:
    frames = sweep(1000, 30.0, 30)

    preview = preview_pivot(rig(), probe(), frames)
    found = calibrate_probe(rig(), probe(), frames)

    assert preview.coverage is not None
    assert np.allclose(preview.coverage.ranges, found.coverage.ranges, atol=0.01)
    assert preview.tip_sigma == pytest.approx(found.tip_sigma, rel=0.1)
    few = preview_pivot(rig(), probe(), frames.only(np.arange(1000) < 5))
    assert few.coverage is None
    assert few.tip_sigma == np.inf


def test_three_leds_before_four_cameras_that_do_not_see_everything() -> None:
    """Spots seen by a single camera count as well; the number of spots does not matter."""
    body = probe("standard")
    body = replace(
        body,
        leds_probe=body.leds_probe[:3],
        led_directions_probe=body.led_directions_probe[:3],
        geometry_covariance=np.eye(12),
    )
    rng = np.random.default_rng(41)
    known = four_cameras()
    frames = PivotSweep.even(
        spots(known, body, attitudes(800, 30.0, rng), CONE_WORLD, rng), SIGMA_PX
    )
    frames.uv[rng.random(frames.uv.shape[:3]) < 0.1] = np.nan

    found = calibrate_probe(replace(known, parameter_covariance=np.zeros((56, 56))), body, frames)

    assert found.chi2 / found.dof == pytest.approx(1.0, abs=0.05)
    assert len(found.left_out) < 30
    sigma = np.sqrt(np.diag(found.tip_covariance))
    assert np.abs(found.tip_probe / sigma).max() < 4.0
    assert found.tip_sigma < 0.002


def test_result_is_a_probe_that_measures() -> None:
    body = probe("standard")
    moved = replace(body, tip_probe=np.array([0.05, -0.1, 0.2]))
    frames = sweep(600, 30.0, 40, body=moved)

    found = calibrate_probe(rig(), body, frames)
    calibrated = found.applied_to(body, "hash")

    assert found.thesis.centres_world.shape == (6, 3)
    assert np.allclose(found.thesis.deviations.sum(axis=0), 0.0, atol=1e-9)
    # Table 4 of the thesis: 5.2 um; noise alone explains 3 with ten thousand poses.
    assert 0.0005 < found.thesis.spread < 0.03
    assert np.linalg.norm(found.thesis_tip_probe - found.tip_probe) < 0.02
    assert calibrated.identity == "hash"
    assert np.abs(calibrated.tip_probe - moved.tip_probe).max() < 0.005
    assert np.abs(calibrated.leds_probe - body.leds_probe).max() < 0.005
    covariance = calibrated.geometry_covariance
    assert np.allclose(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > -1e-12
