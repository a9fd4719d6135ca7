"""The 3-D view's geometry: projection, fit of the view, wire shapes."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.features.elements import nominal_distances
from ocmm_core.features.shapes import Fit, Shape, element, make_fit
from ocmm_core.geometry import Float
from ocmm_gui.scene import Orbit
from ocmm_gui.scene._scene_painter import merge_short
from ocmm_gui.views import _shapes as shapes
from ocmm_gui.views import upright

UP = np.array([0.0, 0.0, 1.0])
EXACT = 1e-9  # mm and px: rounding of a few products of numbers below 1e4


def _fit(shape: Shape, point: Float, direction: Float, radius: float) -> Fit:
    geometry = element(point, direction, radius)
    return make_fit(shape, geometry, np.zeros((12, 3)), np.zeros(1))


def test_axes_are_orthonormal_and_right_handed() -> None:
    for azimuth in np.linspace(0.0, 6.0, 7):
        axes = Orbit(np.zeros(3), azimuth, 0.4, 100.0, UP).axes()
        assert np.allclose(axes @ axes.T, np.eye(3), atol=EXACT)
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_the_target_is_in_the_middle_and_up_is_up() -> None:
    orbit = Orbit(np.array([10.0, -20.0, 30.0]), 0.7, 0.3, 50.0, UP)
    assert np.allclose(orbit.project(orbit.target, 400, 300)[:2], [200.0, 150.0], atol=EXACT)
    above = orbit.project(orbit.target + UP, 400, 300)
    assert above[0] == pytest.approx(200.0)
    assert above[1] < 150.0


def test_a_point_at_the_radius_touches_the_shorter_side() -> None:
    orbit = Orbit(np.zeros(3), 0.2, 0.0, 50.0, UP)
    assert orbit.project(50.0 * UP, 400, 300)[1] == pytest.approx(0.0, abs=EXACT)


def test_fitted_shows_every_point_and_fills_the_picture() -> None:
    points = np.random.default_rng(3).uniform(-80.0, 120.0, (60, 3))
    orbit = Orbit(np.zeros(3), 0.9, 0.5, 10.0, UP).fitted(points, 800, 300, margin=1.1)
    seen = orbit.project(points, 800, 300)[:, :2]
    assert (seen >= 0.0).all()
    assert (seen <= [800.0, 300.0]).all()
    share = np.ptp(seen, axis=0) / [800.0, 300.0]
    assert share.max() == pytest.approx(1.0 / 1.1)


def test_elevation_stops_short_of_the_pole() -> None:
    orbit = Orbit(np.zeros(3), 0.0, 0.0, 50.0, UP).turned(0.0, 10.0)
    assert np.isfinite(orbit.axes()).all()
    assert orbit.elevation < np.pi / 2


def test_shapes_lie_on_their_features() -> None:
    centre, axis = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.6, 0.8])
    surface = centre + np.array([[0.0, 0.0, 0.0], [0.0, 6.0, 8.0], [0.0, -3.0, -4.0]])
    circle, _ = shapes.fitted_shape(_fit(Shape.CIRCLE, centre, axis, 5.0), surface)
    offsets = circle.reshape(-1, 3) - centre
    assert np.allclose(np.linalg.norm(offsets, axis=1), 5.0, atol=EXACT)
    assert np.allclose(offsets @ axis, 0.0, atol=EXACT)
    ball, _ = shapes.fitted_shape(_fit(Shape.SPHERE, centre, np.zeros(3), 5.0), surface)
    assert np.allclose(np.linalg.norm(ball.reshape(-1, 3) - centre, axis=1), 5.0, atol=EXACT)
    tube, _ = shapes.fitted_shape(_fit(Shape.CYLINDER, centre, axis, 5.0), surface)
    along = (tube.reshape(-1, 3) - centre) @ axis
    assert along.max() > 10.0  # beyond the outermost point
    assert along.min() < -5.0


def test_a_plane_covers_its_points() -> None:
    rng = np.random.default_rng(5)
    surface = np.column_stack([rng.uniform(-40, 40, (20, 2)), np.zeros(20)])
    lines, corners = shapes.fitted_shape(_fit(Shape.PLANE, surface.mean(axis=0), UP, 0.0), surface)
    assert len(lines) == 4
    assert np.allclose(corners[:, 2], 0.0, atol=EXACT)
    first, second = corners[1] - corners[0], corners[3] - corners[0]
    shares = (surface - corners[0]) @ np.linalg.pinv(np.stack([first, second]))
    assert ((shares > 0.0) & (shares < 1.0)).all()


@pytest.mark.parametrize("shape", [*Shape])
def test_every_shape_is_drawn_on_its_element(shape: Shape) -> None:
    spec = shape.spec
    geometry = element(
        [5.0, -7.0, 3.0], UP if spec.has_direction else np.zeros(3),
        across=[1.0, 0.0, 0.0] if spec.has_across else np.zeros(3),
    )  # fmt: skip
    for size in spec.sizes:
        geometry[size.place] = 0.3 if size.is_angle else {6: 12.5, 7: 5.0}[size.place]
    fit = make_fit(shape, geometry, np.zeros((12, 3)), np.zeros(1))
    lines, _ = shapes.fitted_shape(fit, np.array([[5.0, -7.0, -8.0], [9.0, 2.0, 10.0]]))
    ends = lines.reshape(-1, 3)
    assert len(ends) > 0 or shape is Shape.POINT
    if not spec.has_normals:
        # Distances from a point or line are those from a face, which is not drawn.
        geometry[3:6] = [1.0, 0.0, 0.0]
    distances, _ = nominal_distances(shape, geometry, ends)
    # The axis of a long feature is drawn as well.
    on_axis = np.linalg.norm(ends[:, :2] - geometry[:2], axis=1) < EXACT
    assert np.abs(distances[~(on_axis & spec.is_long)]).max(initial=0.0) < EXACT


def test_camera_pyramids_open_towards_the_volume() -> None:
    rig = load_rig(resource("rigs", "recommended.toml"))
    centre = rig.volume_world.mean(axis=0)
    for camera in rig.cameras:
        base = shapes.camera_pyramid(camera, 100.0)[:4, 1].mean(axis=0)
        apex = camera.centre_world
        assert np.linalg.norm(base - centre) < np.linalg.norm(apex - centre)
    assert np.allclose(upright(rig), UP)


def test_short_segments_of_a_ring_are_merged_and_others_stay() -> None:
    ring = shapes.ring(np.zeros(3), UP, 3.0)[:, :2]
    apart = np.array([[[50.0, 0.0], [50.5, 0.0]], [[60.0, 0.0], [60.5, 0.0]]])
    long = shapes.polyline(20.0 * ring, closed=True)
    merged = merge_short(np.concatenate([shapes.polyline(ring, closed=True), apart, long]))
    small = merged[: -len(apart) - len(long)]
    # The circumference of 18.8 px in pieces of 2 px.
    assert 9 <= len(small) <= 11
    assert np.allclose(small[1:, 0], small[:-1, 1], atol=EXACT)
    assert np.allclose(small[0, 0], small[-1, 1], atol=EXACT)
    # A chord of 3 px leaves a circle of 3 px by 0.4 px.
    assert np.abs(np.linalg.norm(small.mean(axis=1), axis=1) - 3.0).max() < 0.4
    assert np.array_equal(merged[len(small) :], np.concatenate([apart, long]))
