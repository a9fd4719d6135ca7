from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.camera import N_PARAMETERS, Rig
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.tracking import ProbeBody, reprojection, solve, tip_sensitivity

STEPS = np.array([1e-6] * 3 + [1e-3] * 3 + [1e-4, 1e-6, 1e-3, 1e-3, 1e-8, 1e-10, 1e-8, 1e-8])
"""Each moves a pixel by about 1e-3 px; in the order of the camera's parameters."""

TOLERANCE = 1e-6
"""Relative, of the greatest entry: central differences of tips that move by some 1e-5 mm and are
rounded to 1e-12 mm."""

Draw = Callable[..., tuple[Float, Float]]
Look = Callable[..., Float]


@pytest.fixture
def scene(
    recommended: Rig, standard_probe: ProbeBody, draw_poses: Draw, look: Look
) -> Callable[..., Float]:
    """Return a maker of exact spots (C, L, 2) of one pose, for a rig and a probe as they are."""
    rotations, tips = draw_poses(np.random.default_rng(1), 1, (30.0, 30.0, 10.0))

    def see(rig: Rig = recommended, body: ProbeBody = standard_probe) -> Float:
        # The pose of the body stays; only what it consists of changes.
        origin = tips - rotations @ standard_probe.tip_probe
        at_tip = origin + rotations @ body.tip_probe
        spots: Float = look(rig, body, rotations, at_tip, 0.0, np.random.default_rng(0))[0]
        spots[0, 2] = spots[1, 4] = np.nan
        return spots

    return see


def same(found: Float, numeric: Float) -> bool:
    return bool(np.abs(found - numeric).max() < TOLERANCE * np.abs(numeric).max())


def test_tip_is_that_of_the_kernel(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    spots = scene() + 0.01 * np.random.default_rng(2).standard_normal((2, 6, 2))
    found = tip_sensitivity(spots, recommended, standard_probe)
    kernel = solve(spots[None], recommended, standard_probe, 0.01)
    # One step against convergence: at most 0.22 um (facts 3).
    assert np.abs(found.tip_world - kernel.tip_world[0]).max() < 3e-4
    # The covariance of white noise follows from the derivatives; the kernel takes its own before
    # the step, at a pose that is 1e-3 rad away.
    gain = found.by_spots.reshape(3, -1)
    assert np.allclose(0.01**2 * gain @ gain.T, kernel.tip_covariance[0], rtol=1e-2, atol=1e-8)


def test_tip_is_the_minimum_of_the_residuals(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    """At ten times the noise one step would be 1e-5 mm short."""
    from scipy.optimize import least_squares

    spots = scene() + 0.3 * np.random.default_rng(3).standard_normal((2, 6, 2))
    found = tip_sensitivity(spots, recommended, standard_probe)
    start = solve(spots[None], recommended, standard_probe, 0.01)

    def residuals(pose: Float) -> Float:
        rotation = rotation_from_vector(pose[:3]) @ start.rotation_world_from_probe[0]
        return reprojection(recommended, standard_probe.leds_probe, spots, rotation, pose[3:])[0]

    pose = np.concatenate([np.zeros(3), start.origin_world[0]])
    best = least_squares(residuals, pose, x_scale=[1e-3] * 3 + [1.0] * 3, xtol=1e-14, ftol=1e-14)
    # The probe's tip is the origin of its frame. Finite differences of scipy: 1e-8 of some mm.
    assert np.abs(found.tip_world - best.x[3:]).max() < 1e-6


def test_derivatives_by_the_spots(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    spots, h = scene(), 1e-3
    found = tip_sensitivity(spots, recommended, standard_probe)
    places = np.argwhere(np.isfinite(spots).all(axis=2))
    assert np.array_equal(found.camera, places[:, 0])
    assert np.array_equal(found.uv, spots[places[:, 0], places[:, 1]])
    numeric = np.empty_like(found.by_spots)
    for index, (camera, led) in enumerate(places):
        for axis in range(2):
            moved = []
            for step in (h, -h):
                changed = spots.copy()
                changed[camera, led, axis] += step
                moved.append(tip_sensitivity(changed, recommended, standard_probe).tip_world)
            numeric[:, index, axis] = (moved[0] - moved[1]) / (2 * h)
    # Residuals of 1e-3 px bend the estimate by their own curvature.
    assert np.abs(found.by_spots - numeric).max() < 1e-5 * np.abs(numeric).max()


def test_derivatives_by_all_parameters_of_all_cameras(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    found = tip_sensitivity(scene(), recommended, standard_probe)
    for camera in range(2):
        for index, step in enumerate(STEPS):
            moved = []
            for sign in (1.0, -1.0):
                change = np.zeros(N_PARAMETERS)
                change[index] = sign * step
                cameras = list(recommended.cameras)
                cameras[camera] = cameras[camera].perturbed(change)
                true_rig = replace(recommended, cameras=tuple(cameras))
                spots = scene(rig=true_rig)
                moved.append(tip_sensitivity(spots, recommended, standard_probe).tip_world)
            numeric = (moved[0] - moved[1]) / (2 * step)
            assert same(found.by_cameras[:, camera * N_PARAMETERS + index], numeric), index


def test_derivatives_by_the_leds_and_the_tip(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    believed = tip_sensitivity(scene(), recommended, standard_probe)
    h = 1e-3
    for index in range(standard_probe.leds_probe.size):
        moved = []
        for step in (h, -h):
            leds = standard_probe.leds_probe.copy()
            leds.flat[index] += step
            spots = scene(body=replace(standard_probe, leds_probe=leds))
            moved.append(tip_sensitivity(spots, recommended, standard_probe).tip_world)
        assert same(believed.by_geometry[:, index], (moved[0] - moved[1]) / (2 * h)), index
    # The tip has no LED: the estimate stays and the truth moves, so the error is minus its motion.
    kernel = solve(scene()[None], recommended, standard_probe, 0.01)
    rotation = kernel.rotation_world_from_probe[0]
    assert np.abs(believed.by_geometry[:, -3:] + rotation).max() < 1e-9


def test_spots_that_determine_nothing_are_refused(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    spots = scene()
    spots[1, :3] = np.nan
    with pytest.raises(TrackingError) as caught:
        tip_sensitivity(spots, recommended, standard_probe)
    assert caught.value.code == "tracking.targets"
    assert "Only 2 LEDs" in caught.value.what
