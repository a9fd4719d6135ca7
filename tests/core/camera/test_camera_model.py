from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.camera import (
    N_PARAMETERS,
    PARAMETERS,
    CameraModel,
    distort,
    distortion_jacobian,
    ideal_from_pixels,
    load_rig,
    on_sensor,
    project,
    projection_jacobians,
)
from ocmm_core.camera._model import PACKED_SIZE, from_pixels, to_pixels, undistort
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, Points3

pytestmark = pytest.mark.numerics

EDGE_MM = 12.288
"""Half a sensor side, at which the distortion in per cent is stated (errata of the thesis, 1f)."""

STEPS = np.array([1e-6] * 3 + [1e-3] * 3 + [1e-4, 1e-6, 1e-3, 1e-3, 1e-8, 1e-10, 1e-8, 1e-8])
"""For central differences: each moves a pixel by about 1e-3 px."""


def camera(per_cent: float = -1.5, k2: float = 2e-8) -> CameraModel:
    """Return the thesis camera with this distortion at the edge, tangential terms included."""
    model = load_rig(resource("rigs", "thesis.toml")).cameras[0]
    k1 = 0.01 * per_cent / EDGE_MM**2 - k2 * EDGE_MM**2
    return replace(model, k1=k1, k2=k2, p1=1.1e-5, p2=-0.9e-5, aspect=1.0003)


def points(n: int, seed: int) -> Points3:
    """Return points (n, 3), mm, that lie on the sensor."""
    low, high = [-350.0, -200.0, -350.0], [350.0, 200.0, 350.0]
    cloud = np.random.default_rng(seed).uniform(low, high, (2 * n, 3))
    return cloud[on_sensor(camera(), project(camera(), cloud))][:n]


@pytest.mark.parametrize("per_cent", [-3.0, -1.5, -0.1, 0.0, 0.1, 1.5, 3.0])
def test_undistort_inverts_distort_over_the_full_sensor(per_cent: float) -> None:
    model = camera(per_cent)
    side = np.linspace(0.0, 2047.0, 257)
    uv = np.stack(np.meshgrid(side, side), axis=-1)
    # From the sensor and back: every place that a spot can have, corners included.
    back = to_pixels(model, distort(model, ideal_from_pixels(model, uv)))
    # 1e-9 px is the limit; three Newton steps measured 5e-12 px at 3 %.
    assert np.abs(back - uv).max() < 1e-9
    # And from the ideal image: the inverse is the right branch, not only a root.
    ideal = 0.95 * from_pixels(model, uv)
    there = undistort(model, distort(model, ideal))
    assert np.abs(there - ideal).max() / model.pitch_mm < 1e-9


def test_the_stated_edge_distortion_is_there() -> None:
    model = replace(camera(-3.0), p1=0.0, p2=0.0)
    moved = distort(model, np.array([EDGE_MM, 0.0]))[0]
    assert (moved - EDGE_MM) / EDGE_MM == pytest.approx(-0.03, abs=1e-12)


def test_distortion_jacobian_is_the_derivative_of_distort() -> None:
    model = camera(3.0)
    ideal = np.random.default_rng(1).uniform(-EDGE_MM, EDGE_MM, (200, 2))
    h = 1e-4
    numeric = np.stack(
        [(distort(model, ideal + d) - distort(model, ideal - d)) / (2 * h) for d in h * np.eye(2)],
        axis=-1,
    )
    # Third derivatives of about 1e-3 mm^-2 times h^2, and rounding of 1e-15 / h.
    assert np.abs(distortion_jacobian(model, ideal) - numeric).max() < 1e-10


def test_projection_of_a_hand_computed_point() -> None:
    model = replace(camera(0.0, k2=0.0), p1=0.0, p2=0.0, aspect=1.0)
    pose = model.T_camera_from_world
    # 40 mm right of and 20 mm below the axis, one metre in front: f/z = 0.025.
    world = pose.inverse().apply(np.array([40.0, 20.0, 1000.0]))
    expected = [1023.5 + 1.0 / 0.012, 1023.5 + 0.5 / 0.012]
    assert project(model, world) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("per_cent", [-3.0, 0.0, 3.0])
def test_jacobians_are_the_derivatives_of_project(per_cent: float) -> None:
    model = camera(per_cent)
    cloud = points(60, 2)
    d_point, d_parameters = projection_jacobians(model, cloud)
    h = 1e-3
    numeric = np.stack(
        [(project(model, cloud + d) - project(model, cloud - d)) / (2 * h) for d in h * np.eye(3)],
        axis=-1,
    )
    # Rounding of a pixel, 1e-13, over h; curvature of 1e-6 px/mm^3 times h^2 is less.
    assert np.abs(d_point - numeric).max() < 1e-8
    for index, (name, step) in enumerate(zip(PARAMETERS, STEPS, strict=True)):
        change = np.zeros(N_PARAMETERS)
        change[index] = step
        numeric_one = (
            project(model.perturbed(change), cloud) - project(model.perturbed(-change), cloud)
        ) / (2 * step)
        scale = np.abs(numeric_one).max()
        # Steps move pixels by some 1e-3 px, of which 1e-12 px is rounding: 1e-8 with room.
        assert np.abs(d_parameters[:, :, index] - numeric_one).max() < 1e-8 * scale, name


def test_a_point_behind_or_beside_the_camera_has_no_pixel() -> None:
    model = camera()
    in_camera = np.array([[10.0, 5.0, -1000.0], [10.0, 5.0, 0.0], [0.0, 0.0, -1e-9]])
    uv = project(model, model.T_camera_from_world.inverse().apply(in_camera[[0]]))
    assert np.isnan(uv).all()
    # Exactly in the plane of the centre, at which the inverse motion would round.
    at_origin = replace(model, T_camera_from_world=model.T_camera_from_world.identity())
    uv = project(at_origin, in_camera)
    assert np.isnan(uv).all()
    assert not on_sensor(model, uv).any()


def test_on_sensor_counts_the_border_pixels() -> None:
    uv = np.array([[0.0, 0.0], [2047.0, 2047.0], [-0.01, 5.0], [5.0, 2047.01], [np.nan, 5.0]])
    assert on_sensor(camera(), uv).tolist() == [True, True, False, False, False]


def test_perturbed_adds_every_parameter_in_the_stated_order() -> None:
    model = camera()
    change: Float = np.arange(1.0, 15.0) * STEPS
    moved = model.perturbed(change)
    for index, name in enumerate(PARAMETERS[6:], start=6):
        assert getattr(moved, name) == getattr(model, name) + change[index], name
    before, after = model.T_camera_from_world, moved.T_camera_from_world
    assert np.array_equal(after.translation, before.translation + change[3:6])
    turn = after.rotation @ before.rotation.T
    found = [turn[2, 1], turn[0, 2], turn[1, 0]]
    # Second order in angles of 3e-6 rad.
    assert found == pytest.approx(change[:3], abs=1e-11)
    assert np.array_equal(model.perturbed(np.zeros(14)).packed(), model.packed())
    assert model.packed().shape == (PACKED_SIZE,)


def test_the_centre_projects_nowhere_and_lies_where_the_document_says() -> None:
    assert camera().centre_world == pytest.approx([-165.0, -1000.0, 0.0], abs=1e-9)
