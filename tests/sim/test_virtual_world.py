"""The truth that a world draws, and the noise of its spots, have the statistics they state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.camera import PARAMETERS, CameraModel, Rig, SpotNoise
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody
from ocmm_sim.scene import VirtualRig, World, WorldOptions, draw_pattern, draw_world, white_noise

MakeRig = Callable[..., VirtualRig]

RUNS = 400
NO_PATTERN = WorldOptions(pattern_noise=False)


@pytest.fixture(scope="module")
def worlds(recommended: Rig, standard: ProbeBody) -> list[World]:
    return [draw_world(recommended, standard, seed, NO_PATTERN) for seed in range(RUNS)]


def change(true: CameraModel, nominal: CameraModel) -> Float:
    """Return the parameters that differ, in the order of `PARAMETERS`."""
    before, after = nominal.T_camera_from_world, true.T_camera_from_world
    turn = after.rotation @ before.rotation.T
    antisymmetric = 0.5 * (turn - turn.T)
    rotation = np.array([antisymmetric[2, 1], antisymmetric[0, 2], antisymmetric[1, 0]])
    lens = [getattr(true, name) - getattr(nominal, name) for name in PARAMETERS[6:]]
    return np.concatenate([rotation, after.translation - before.translation, lens])


@pytest.mark.statistics
def test_camera_errors_have_the_covariance_of_the_rig(
    recommended: Rig, worlds: list[World]
) -> None:
    drawn = np.array(
        [
            np.concatenate(
                [change(t, n) for t, n in zip(w.cameras, recommended.cameras, strict=True)]
            )
            for w in worlds
        ]
    )
    size = drawn.shape[1]
    distance = np.einsum(
        "ni,ij,nj->n", drawn, np.linalg.inv(recommended.parameter_covariance), drawn
    )
    # Chi-square with 28 degrees of freedom; 4 standard errors of its mean and its variance.
    assert distance.mean() == pytest.approx(size, abs=4.0 * np.sqrt(2.0 * size / RUNS))
    assert distance.var() == pytest.approx(2.0 * size, rel=0.4)
    sigma = np.sqrt(np.diag(recommended.parameter_covariance))
    np.testing.assert_allclose(drawn.std(axis=0) / sigma, 1.0, atol=4.0 / np.sqrt(2.0 * RUNS))


@pytest.mark.statistics
def test_probe_errors_have_the_sigmas_of_the_probe(
    standard: ProbeBody, worlds: list[World]
) -> None:
    limit = 4.0 / np.sqrt(2.0 * RUNS)
    leds = np.array([w.leds_probe - standard.leds_probe for w in worlds])
    tips = np.array([w.tip_probe - standard.tip_probe for w in worlds])
    radii = np.array([w.tip_radius - standard.tip_radius for w in worlds])
    np.testing.assert_allclose(leds.std(axis=0), 0.002, rtol=limit)
    np.testing.assert_allclose(tips.std(axis=0), 0.002, rtol=limit)
    assert radii.std() == pytest.approx(standard.tip_radius_sigma, rel=limit)
    assert abs(radii.mean()) < 4.0 * standard.tip_radius_sigma / np.sqrt(RUNS)


def test_an_ideal_world_is_as_the_documents_say(recommended: Rig, standard: ProbeBody) -> None:
    world = draw_world(recommended, standard, 7, WorldOptions.ideal())
    assert world.cameras == recommended.cameras
    np.testing.assert_array_equal(world.leds_probe, standard.leds_probe)
    np.testing.assert_array_equal(world.tip_probe, standard.tip_probe)
    assert world.tip_radius == standard.tip_radius
    assert all(not pattern.nodes.any() for pattern in world.patterns)


@pytest.mark.parametrize(
    ("error", "options"),
    [
        ("camera_error", replace(NO_PATTERN, camera_error=False)),
        ("probe_error", replace(NO_PATTERN, probe_error=False)),
        ("tip_error", replace(NO_PATTERN, tip_error=False)),
    ],
)
def test_each_error_can_be_switched_off_by_itself(
    recommended: Rig, standard: ProbeBody, error: str, options: WorldOptions
) -> None:
    world = draw_world(recommended, standard, 7, options)
    same = {
        "camera_error": world.cameras == recommended.cameras,
        "probe_error": np.array_equal(world.leds_probe, standard.leds_probe),
        "tip_error": world.tip_radius == standard.tip_radius,
    }
    assert same == {name: name == error for name in same}


@pytest.mark.statistics
def test_white_noise_is_white(make_rig: MakeRig) -> None:
    quiet = WorldOptions(white_noise=False, pattern_noise=False)
    noisy = make_rig(options=WorldOptions(pattern_noise=False)).frames(0, 4000)
    still = make_rig(options=quiet).frames(0, 4000)
    slots = np.isfinite(still.uv).all(axis=(0, 3))
    noise = (noisy.uv - still.uv)[:, slots].reshape(4000, -1)
    n = noise.size
    # Four standard errors each: of the mean, of the deviation, of the correlations.
    assert abs(noise.mean()) < 4.0 * 0.03 / np.sqrt(n)
    assert noise.std() == pytest.approx(0.03, rel=4.0 / np.sqrt(2.0 * n))
    for lag in (1, 2, 80):
        product = np.mean(noise[lag:] * noise[:-lag]) / 0.03**2
        assert abs(product) < 4.0 / np.sqrt(n)
    between = np.corrcoef(noise.T) - np.eye(noise.shape[1])
    assert np.abs(between).max() < 5.0 / np.sqrt(4000)


def test_white_noise_is_what_the_key_of_its_chunk_gives() -> None:
    """Recordings and seeds of others depend on it: stream 4, camera 2, chunk 3."""
    key = np.array([9, (4 << 56) | (2 << 40) | 3], dtype=np.uint64)
    wanted = np.random.Generator(np.random.Philox(key=key)).standard_normal((80, 6, 2))
    assert np.array_equal(white_noise(9, 2, 6, 240, 80), wanted)


def test_white_noise_differs_between_cameras_and_seeds() -> None:
    drawn = [white_noise(seed, camera, 6, 0, 80) for seed in (1, 2) for camera in (0, 1)]
    for first in range(4):
        for second in range(first):
            assert np.abs(drawn[first] - drawn[second]).min() > 0.0


@pytest.mark.statistics
def test_the_fixed_pattern_has_its_deviation_and_its_correlation() -> None:
    noise = SpotNoise(white_px=0.03, pattern_px=0.01, pattern_length_px=20.0)
    rng = np.random.default_rng(11)
    fields = np.concatenate(
        [draw_pattern(noise, 2048, 2048, rng).nodes for _ in range(4)], dtype=np.float64
    )
    step = 4
    # About (2048 / 50)^2 independent places in each of eight fields: 1 % of deviation, and each
    # field is 256 waves, which lets its correlation scatter by 1 / sqrt(2 x 256 x 8) = 0.016.
    assert fields.std() == pytest.approx(0.01, rel=0.02)
    assert np.abs(fields.mean()) < 4.0 * 0.01 / np.sqrt(8 * 1600)
    for length in (20, 40):
        shift = length // step
        for moved, here in (
            (fields[:, shift:], fields[:, :-shift]),
            (fields[:, :, shift:], fields[:, :, :-shift]),
        ):
            correlation = np.mean(moved * here) / np.mean(fields**2)
            expected = np.exp(-((length / 20.0) ** 2) / 2.0)
            assert correlation == pytest.approx(expected, abs=0.06)
    u_and_v = np.mean(fields[0::2] * fields[1::2]) / np.mean(fields**2)
    assert abs(u_and_v) < 0.06


@pytest.mark.statistics
def test_the_fixed_pattern_reaches_the_spots_and_stays_at_its_place(make_rig: MakeRig) -> None:
    with_pattern = make_rig(options=WorldOptions(white_noise=False), frame_rate_hz=100)
    without = make_rig(
        options=WorldOptions(white_noise=False, pattern_noise=False), frame_rate_hz=100
    )
    n = with_pattern.n_frames
    error = with_pattern.frames(0, n).uv - without.frames(0, n).uv
    error = error[np.isfinite(error)]
    assert error.std() == pytest.approx(0.01, rel=0.25)
    rest = with_pattern.frames(0, 40).uv - without.frames(0, 40).uv
    # The tremor moves spots by up to 4 px, and the pattern changes by 0.010 / 20 per px: 2.5 sigma
    # of that. A pattern that changed from frame to frame would spread over 0.04 px.
    assert np.ptp(rest[:, np.isfinite(rest[0])], axis=0).max() < 0.005
