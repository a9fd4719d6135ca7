from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.camera import N_PARAMETERS, PARAMETERS, Rig, projection_jacobians
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float, rigid_fit, rotation_from_vector, skew
from ocmm_core.tracking import (
    ProbeBody,
    TipSensitivity,
    reprojection,
    solve,
    tip_sensitivities,
    tip_sensitivity,
    triangulate,
)
from ocmm_core.tracking.kernels import N_LENS

STEPS = np.array([1e-6] * 3 + [1e-3] * 3 + [1e-4, 1e-6, 1e-3, 1e-3, 1e-8, 1e-10, 1e-8, 1e-8])
"""Each moves a pixel by about 1e-3 px; in the order of the camera's parameters."""

TOLERANCE = 1e-6
"""Relative, of the greatest entry: central differences of tips that move by some 1e-5 mm and are
rounded to 1e-12 mm."""

PLAIN = 1e-8
"""Relative, of the greatest entry: both solve the normal equations of a pose, whose condition in mm
and rad is 1e6 at most, once by LU and once by Cholesky: 1e6 roundings of 2e-16, some tenfold."""

Draw = Callable[..., tuple[Float, Float]]
Look = Callable[..., Float]


@pytest.fixture
def scene(
    recommended: Rig, standard_probe: ProbeBody, draw_poses: Draw, look: Look
) -> Callable[..., Float]:
    """Return a maker of exact spots (C, L, 2) of one pose, for a rig and a probe as they are."""
    rotations, tips = draw_poses(np.random.default_rng(1), 1, (30.0, 30.0, 10.0))

    def see(rig: Rig = recommended, body: ProbeBody = standard_probe) -> Float:
        # The pose of the body stays; only its composition changes.
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


def plain(spots: Float, rig: Rig, body: ProbeBody) -> TipSensitivity:
    """Return the result of the kernel, in plain numpy and camera by camera."""
    positions = triangulate(rig, spots)
    located = np.isfinite(positions).all(axis=1)
    rotation, origin = rigid_fit(body.leds_probe[located], positions[located])
    for _ in range(10):
        residuals, rows = reprojection(rig, body.leds_probe, spots, rotation, origin)
        step: Float = np.linalg.lstsq(rows, residuals)[0].astype(np.float64)
        rotation = rotation_from_vector(step[:3]) @ rotation
        origin = origin + step[3:]
    _, rows = reprojection(rig, body.leds_probe, spots, rotation, origin)
    gain = np.linalg.solve(rows.T @ rows, rows.T)
    camera_of, led_of = np.nonzero(np.isfinite(spots).all(axis=2))
    by_cameras = np.zeros((6, N_PARAMETERS * len(rig.cameras)))
    by_leds = np.zeros((6, body.leds_probe.size))
    leds_world = body.leds_probe @ rotation.T + origin
    for row, (c, led) in enumerate(zip(camera_of, led_of, strict=True)):
        d_point, d_camera = projection_jacobians(rig.cameras[c], leds_world[led : led + 1])
        own = gain[:, 2 * row : 2 * row + 2]
        by_cameras[:, c * N_PARAMETERS : (c + 1) * N_PARAMETERS] += own @ d_camera[0]
        by_leds[:, 3 * led : 3 * led + 3] += own @ d_point[0] @ rotation
    arm = rotation @ body.tip_probe
    to_tip = np.hstack([-skew(arm), np.eye(3)])
    return TipSensitivity(
        tip_world=arm + origin,
        camera=camera_of,
        uv=spots[camera_of, led_of],
        by_spots=(to_tip @ gain).reshape(3, -1, 2),
        by_cameras=to_tip @ by_cameras,
        by_geometry=np.hstack([to_tip @ by_leds, -rotation]),
    )


def test_many_points_at_once_are_those_of_plain_numpy(
    recommended: Rig, standard_probe: ProbeBody, draw_poses: Draw, look: Look
) -> None:
    """Every point has other LEDs that are hidden, so that their lists are of unlike lengths."""
    rng = np.random.default_rng()
    # A tip away from the origin of the probe, which that of the document is not.
    body = replace(standard_probe, tip_probe=np.array([3.0, -5.0, 11.0]))
    rotations, tips = draw_poses(rng, 40, (30.0, 30.0, 10.0))
    spots = look(recommended, body, rotations, tips, 0.01, rng)
    hidden = rng.uniform(size=(40, 2, 6)) < 0.1
    hidden[:, :, :4] = False
    spots[hidden] = np.nan
    spots = spots[[np.isfinite(triangulate(recommended, one)).all(1).sum() >= 4 for one in spots]]
    assert len(spots) > 20
    found = tip_sensitivities(spots, recommended, body)
    assert len({len(one.camera) for one in found}) > 1
    for one, seen in zip(found, spots, strict=True):
        told = plain(seen, recommended, body)
        assert np.array_equal(one.camera, told.camera)
        assert np.array_equal(one.uv, told.uv)
        assert np.abs(one.tip_world - told.tip_world).max() < 1e-8
        for name in ("by_spots", "by_geometry"):
            a, b = getattr(one, name), getattr(told, name)
            assert np.abs(a - b).max() < PLAIN * np.abs(b).max(), name
        # The parameters have different units: each has its own greatest entry.
        apart = np.abs(one.by_cameras - told.by_cameras).max(axis=0)
        assert np.all(apart < 100.0 * PLAIN * np.abs(told.by_cameras).max(axis=0))
        alone = tip_sensitivity(seen, recommended, body)
        assert np.array_equal(alone.by_cameras, one.by_cameras)
        assert np.array_equal(alone.by_spots, one.by_spots)


def test_the_kernel_knows_how_many_parameters_a_camera_has() -> None:
    assert len(PARAMETERS) == N_LENS


def test_a_point_without_a_pose_refuses_them_all_and_other_shapes_are_refused(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    many = np.stack([scene(), scene(), scene()])
    many[1, 0, 1:] = np.nan
    with pytest.raises(TrackingError) as caught:
        tip_sensitivities(many, recommended, standard_probe)
    assert caught.value.code == "tracking.targets"
    for spots in (many[:, :1], many[:, :, :5], many[..., :1], many[0]):
        with pytest.raises(TrackingError) as caught:
            tip_sensitivities(spots, recommended, standard_probe)
        assert caught.value.code == "tracking.shape"
    assert tip_sensitivities(many[:0], recommended, standard_probe) == ()


def test_leds_at_one_place_leave_the_pose_open(
    recommended: Rig, standard_probe: ProbeBody, scene: Callable[..., Float]
) -> None:
    """All LEDs at the origin of the probe: no turn moves a spot, and J'J has zeros."""
    body = replace(standard_probe, leds_probe=np.zeros_like(standard_probe.leds_probe))
    with pytest.raises(TrackingError) as caught:
        tip_sensitivity(scene(), recommended, body)
    assert caught.value.code == "tracking.open"
