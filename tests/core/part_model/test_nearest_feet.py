"""The nearest place of trimmed faces: correct, complete, and reported if not measurable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.part_model import (
    ModelFace,
    SearchedFace,
    face_fault,
    followed_feet,
    nearest_feet,
    nominal_face,
    normals_at,
    places_at,
    searched,
    searched_face,
)
from tests.core.part_model.model_faces import (
    FREE_FORMS,
    analytic_faces,
    cylinder,
    face_of,
    library_distances,
    plane,
    waves,
    whole_face,
)
from tests.host import needs_package

TENTH_OF_A_MICROMETRE = 1e-4


def points_near(face: SearchedFace, count: int, far: float, seed: int) -> Float:
    """Return points (count, 3) up to ``far`` mm off a surface, on both its sides."""
    rng = np.random.default_rng(seed)
    surface = face.surface
    at = surface.low + (surface.high - surface.low) * rng.uniform(0.0, 1.0, (count, 2))
    normals = normals_at(surface, at)
    return np.asarray(places_at(surface, at) + normals * rng.uniform(-far, far, (count, 1)))


@pytest.mark.slow
@pytest.mark.parametrize("name", FREE_FORMS)
def test_free_forms_are_as_far_as_the_library_says(name: str) -> None:
    needs_package("OCP", "the extra 'step'")
    spline = FREE_FORMS[name]()
    face = searched_face(face_of(spline))
    points = points_near(face, 1000, 3.0, seed=18)
    found = nearest_feet(points, [face])
    distances = library_distances(points, whole_face(spline))
    # On edges too: they are followed to 2 micrometres, and a foot there gives no number.
    assert np.abs(np.abs(found.distances) - distances).max() < 2e-3
    good = np.array([doubt == "" for doubt in found.doubts])
    assert np.count_nonzero(good) > 950
    assert np.abs(np.abs(found.distances) - distances)[good].max() < TENTH_OF_A_MICROMETRE


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plane", "cylinder", "cone", "sphere", "torus"])
def test_other_kinds_of_faces_are_as_far_as_the_library_says(name: str) -> None:
    needs_package("OCP", "the extra 'step'")
    spline, face = analytic_faces()[name]
    made = searched_face(face_of(spline))
    points = points_near(made, 1000, 3.0, seed=19)
    found = nearest_feet(points, [made])
    good = np.array([doubt == "" for doubt in found.doubts])
    assert np.count_nonzero(good) > 950
    errors = np.abs(np.abs(found.distances) - library_distances(points, face))
    assert errors[good].max() < TENTH_OF_A_MICROMETRE


@pytest.mark.parametrize("name", FREE_FORMS)
def test_nothing_of_a_dense_sample_is_nearer(name: str) -> None:
    """Against 40,000 places of the surface, up to where feet jump from one fold to the next."""
    face = searched_face(face_of(FREE_FORMS[name]()))
    points = points_near(face, 150, 12.0, seed=20)
    found = nearest_feet(points, [face])
    steps = np.linspace(0.0, 1.0, 200)
    u, v = np.meshgrid(steps, steps)
    grid = places_at(face.surface, np.stack([u.ravel(), v.ravel()], axis=1))
    nearest = np.array([np.linalg.norm(grid - point, axis=1).min() for point in points])
    assert np.all(np.abs(found.distances) <= nearest + 1e-9)


def test_side_normal_and_curvature_of_a_shaft_and_a_bore() -> None:
    points = np.array([[13.0, 0.0, 10.0], [0.0, 9.0, 20.0], [-8.0, 8.0, 15.0]])
    shaft = nearest_feet(points, [searched_face(face_of(cylinder(10.0)))])
    radial = np.hypot(points[:, 0], points[:, 1])
    assert shaft.distances == pytest.approx(radial - 10.0, abs=1e-12)
    assert shaft.curvatures == pytest.approx(np.tile([0.0, 0.1], (3, 1)), abs=1e-12)
    assert np.all(shaft.normals[:, :2] * points[:, :2] >= -1e-12)
    bore = nearest_feet(points, [searched_face(face_of(cylinder(10.0), outward=False))])
    assert bore.distances == pytest.approx(10.0 - radial, abs=1e-12)
    assert bore.curvatures == pytest.approx(np.tile([-0.1, 0.0], (3, 1)), abs=1e-12)
    assert bore.normals == pytest.approx(-shaft.normals)
    assert shaft.doubts == bore.doubts == ("", "", "")


def test_the_seam_of_a_closed_surface_is_no_edge() -> None:
    face = searched_face(face_of(cylinder(10.0)))
    turn = np.array([-1e-7, 0.0, 1e-7])
    points = np.stack([12.0 * np.cos(turn), 12.0 * np.sin(turn), [3.0, 10.0, 27.0]], axis=1)
    found = nearest_feet(points, [face])
    assert found.doubts == ("", "", "")
    assert found.distances == pytest.approx(2.0, abs=1e-12)
    assert found.edge_gaps == pytest.approx([3.0, 10.0, 3.0], abs=1e-3)


def test_a_hole_has_an_edge_and_nothing_inside() -> None:
    hole = 0.5 + 0.1 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1.0]])
    outline = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    face = searched_face(
        ModelFace(3, "Plane", spline=plane(50.0, 30.0), loops=(outline, hole))
    )  # fmt: skip
    over_hole = [25.0, 15.0, 1.5]
    found = nearest_feet(
        np.array([over_hole, [10.0, 15.0, 1.5], [-1.0, 15.0, 1.5], [20.0 - 0.01, 15.0, 1.5]]),
        [face],
    )
    assert found.on_edge.tolist() == [True, False, True, True]
    # 3 mm from the middle of the hole to its long sides.
    assert found.distances[0] == pytest.approx(np.hypot(1.5, 3.0), abs=1e-9)
    assert found.distances[1] == pytest.approx(1.5, abs=1e-12)
    assert found.distances[2] == pytest.approx(np.hypot(1.5, 1.0), abs=1e-9)
    assert found.doubts[1] == ""
    assert all("on an edge" in found.doubts[i] for i in (0, 2, 3))


def test_a_point_before_two_faces_is_told() -> None:
    """Between the walls of a slit, in a corner, and on the axis of a bore."""
    low = searched_face(face_of(plane(50.0, 30.0)))
    other = plane(50.0, 30.0)
    high = searched_face(
        face_of(replace(other, poles=other.poles + np.array([0.0, 0.0, 4.0])), number=2)
    )
    found = nearest_feet(np.array([[25.0, 15.0, 2.04], [25.0, 15.0, 1.0]]), [low, high])
    assert found.rivals[0] == pytest.approx(0.08, abs=1e-9)
    assert "two places" in found.doubts[0]
    assert found.doubts[1] == ""
    bore = searched_face(face_of(cylinder(10.0), outward=False))
    found = nearest_feet(np.array([[0.0, 0.02, 15.0], [0.0, 0.6, 15.0], [0, 5.0, 15.0]]), [bore])
    assert "two places" in found.doubts[0]
    assert "centre of curvature" in found.doubts[1]
    assert found.doubts[2] == ""


def test_feet_that_are_followed_are_those_that_are_found() -> None:
    face = searched_face(face_of(waves()))
    points = points_near(face, 40, 2.0, seed=3)
    first = nearest_feet(points, [face])
    moved = points + np.random.default_rng(4).normal(0.0, 0.05, points.shape)
    found, again = followed_feet(moved, [face], first), nearest_feet(moved, [face])
    inside = again.faces >= 0
    assert found.distances[inside] == pytest.approx(again.distances[inside], abs=1e-10)
    assert found.normals[inside] == pytest.approx(again.normals[inside], abs=1e-8)


def test_a_distance_moves_along_the_normal() -> None:
    face = searched_face(face_of(waves()))
    points = points_near(face, 60, 2.0, seed=5)
    found = nearest_feet(points, [face])
    good = np.array([doubt == "" for doubt in found.doubts])
    step = 1e-5
    for k in range(3):
        shift = np.zeros(3)
        shift[k] = step
        ahead, behind = (nearest_feet(points + s * shift, [face]) for s in (1.0, -1.0))
        slope = (ahead.distances - behind.distances) / (2.0 * step)
        # Second order: curvature times the square of the step.
        assert slope[good] == pytest.approx(found.normals[good, k], abs=1e-6)


def test_a_plan_holds_a_face_exactly() -> None:
    for make in FREE_FORMS.values():
        face = face_of(make())
        held = nominal_face(face)
        assert face_fault(held) is None
        points = points_near(searched_face(face), 20, 2.0, seed=6)
        first = nearest_feet(points, [searched_face(face)])
        second = nearest_feet(points, [searched(held)])
        assert np.array_equal(first.distances, second.distances)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"degree_u": 0}, "degree"),
        ({"knots_u": (0.0, 1.0)}, "do not belong together"),
        ({"knots_u": (1.0,) * 18}, "do not rise"),
        ({"poles": (float("nan"),) * 784}, "not finite"),
        ({"poles": (0.0,) * 784}, "not positive"),
        ({"poles": (1.0,) * 200_001}, "numbers"),
        ({"loops": ((0.0, 0.0, 1.0),)}, "three corners"),
        ({"loops": ((0.9, 0.9, 0.9, 0.9, 0.9, 0.9),)}, "inside its outline"),
        ({"loops": ((5.0, 5.0, 6.0, 5.0, 6.0, 6.0),)}, "inside its outline"),
        ({"loops": ((0.0, 0.0, 1.0, 0.0, float("inf"), 1.0),)}, "not finite"),
    ],
)
def test_a_face_that_cannot_be_is_refused(change: dict[str, object], words: str) -> None:
    held = nominal_face(face_of(waves()))
    fault = face_fault(type(held)(**{**_fields(held), **change}))  # type: ignore[arg-type]
    assert fault is not None
    assert words in fault


def _fields(held: object) -> dict[str, object]:
    return {name: getattr(held, name) for name in held.__struct_fields__}  # type: ignore[attr-defined]


def test_what_cannot_be_searched_is_refused() -> None:
    face = searched_face(face_of(plane()))
    for points, faces in ((np.full((1, 3), np.nan), [face]), (np.zeros((1, 3)), [])):
        with pytest.raises(InputError, match="without a face, or of a point that is not finite"):
            nearest_feet(points, faces)
    with pytest.raises(InputError, match="no surface of face 7"):
        searched_face(ModelFace(7, "Plane"))
    with pytest.raises(InputError, match="no surface of face 7"):
        nominal_face(ModelFace(7, "Plane"))
