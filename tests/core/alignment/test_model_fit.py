"""Best fit of ball centres to faces of the model: its result, and its constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.alignment import ModelFit, fit_to_faces
from ocmm_core.errors import FitError
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.part_model import (
    SearchedFace,
    SplineSurface,
    nearest_feet,
    normals_at,
    places_at,
    searched_face,
)
from tests.core.part_model.model_faces import FREE_FORMS, cylinder, face_of, plane

RADIUS = 1.5


def sphere(radius: float = 12.0) -> SplineSurface:
    """Return a whole sphere, exactly: an arc turned about z."""
    half = np.sqrt(0.5)
    around = cylinder(1.0)
    arc = np.array([[0, -1], [1, -1], [1, 0], [1, 1], [0, 1.0]])
    shares = np.array([1, half, 1, half, 1])
    poles = np.empty((9, 5, 3))
    poles[..., :2] = around.poles[:, :1, :2] * arc[:, 0][None, :, None] * radius
    poles[..., 2] = arc[:, 1] * radius
    weights = around.weights[:, :1] * shares
    knots_v = np.array([0, 0, 0, 0.5, 0.5, 1, 1, 1])
    return SplineSurface(poles, weights, around.knots_u, knots_v, 2, 2)


def balls(face: SearchedFace, side: int, off: Float | float = 0.0) -> Float:
    """Return ball centres that touch a face at side by side places."""
    steps = np.linspace(0.15, 0.85, side)
    u, v = np.meshgrid(steps, steps)
    at = face.surface.low + np.stack([u.ravel(), v.ravel()], axis=1) * (
        face.surface.high - face.surface.low
    )
    normals = normals_at(face.surface, at)
    return np.asarray(places_at(face.surface, at) + (RADIUS + np.reshape(off, (-1, 1))) * normals)


def placed(turn: Sequence[float] | Float, shift: Sequence[float] | Float) -> RigidTransform:
    return RigidTransform(rotation_from_vector(np.array(turn)), np.array(shift))


def fitted(points: Float, faces: list[SearchedFace], start: RigidTransform) -> ModelFit:
    return fit_to_faces(points, RADIUS, faces, start)


@pytest.mark.parametrize("name", ["waves", "rational"])
def test_a_part_is_found_where_it_lies(name: str) -> None:
    face = searched_face(face_of(FREE_FORMS[name]()))
    place = placed([0.7, -0.4, 1.1], [200.0, -50.0, 800.0])
    start = placed([0.004, -0.003, 0.005], [0.4, -0.3, 0.2]).compose(place.inverse())
    found = fitted(place.apply(balls(face, 6)), [face], start)
    assert np.abs(found.residuals).max() < 1e-8
    back = found.T_part_from_world.compose(place)
    # The faces hold some motions a thousand times weaker than others.
    assert back.rotation == pytest.approx(np.eye(3), abs=1e-7)
    assert back.translation == pytest.approx(np.zeros(3), abs=1e-5)
    assert set(found.faces) == {1}


def test_it_is_where_the_sum_of_squares_is_least() -> None:
    face = searched_face(face_of(FREE_FORMS["waves"]()))
    rng = np.random.default_rng(2)
    points = balls(face, 6, rng.normal(0.0, 0.02, 36))
    found = fitted(points, [face], RigidTransform.identity())
    least = float(found.residuals @ found.residuals)
    for _ in range(12):
        moved = placed(rng.normal(0.0, 1e-5, 3), rng.normal(0.0, 1e-3, 3))
        at = moved.compose(found.T_part_from_world).apply(points)
        off = nearest_feet(at, [face]).distances - RADIUS
        assert float(off @ off) > least


def test_the_frame_answers_to_its_points() -> None:
    face = searched_face(face_of(FREE_FORMS["waves"]()))
    points = balls(face, 6)
    found = fitted(points, [face], RigidTransform.identity())
    way = np.random.default_rng(3).normal(size=points.shape)
    step = 1e-4
    ahead, behind = (
        fitted(points + s * step * way, [face], RigidTransform.identity()).T_part_from_world
        for s in (1.0, -1.0)
    )
    twist = found.by_tips @ way.ravel()
    shift = (ahead.translation - behind.translation) / (2.0 * step)
    turn = (ahead.rotation - behind.rotation) / (2.0 * step)
    assert shift == pytest.approx(twist[3:], rel=1e-3, abs=1e-3)
    assert [turn[2, 1], turn[0, 2], turn[1, 0]] == pytest.approx(twist[:3], rel=1e-3, abs=1e-5)


@pytest.mark.parametrize(
    ("make", "words"),
    [(plane, {"x", "y", "rz"}), (cylinder, {"rz", "z"}), (sphere, {"rx", "ry", "rz"})],
)
def test_open_motions_are_named(make: object, words: set[str]) -> None:
    spline = make()  # type: ignore[operator]
    face = searched_face(face_of(spline))
    points = balls(face, 5)
    if make is sphere:
        # Off the origin, turns about the centre are turns and shifts of the frame.
        away = np.array([100.0, 0.0, 0.0])
        moved = replace(spline, poles=spline.poles + away)
        face, points = searched_face(face_of(moved)), points + away
    with pytest.raises(FitError, match="leave open") as caught:
        fitted(points, [face], RigidTransform.identity())
    named = set(caught.value.what.split(": ")[1].rstrip(".").split(", "))
    assert named == words


def test_a_twisted_blade_slides_along_its_screw() -> None:
    face = searched_face(face_of(FREE_FORMS["blade"]()))
    with pytest.raises(FitError, match="leave open: z"):
        fitted(balls(face, 6), [face], RigidTransform.identity())


def test_points_that_do_not_count_are_named() -> None:
    face = searched_face(face_of(FREE_FORMS["waves"]()))
    points = balls(face, 5)
    points[3] = [-47.0, 0.0, 3.0]
    with pytest.raises(FitError, match=r"Point 4 of the best fit .* on an edge"):
        fitted(points, [face], RigidTransform.identity())
    with pytest.raises(FitError, match="6 points for 6 motions"):
        fitted(balls(face, 5)[:6], [face], RigidTransform.identity())
