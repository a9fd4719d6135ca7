"""Values on a part: near their points and between them, never more than they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.geometry import Float
from ocmm_gui.rendering import RenderMesh, ValueField, mesh_of, value_field
from tests.made_parts import PartMaker

TOP = 5
"""The face of a box that looks up."""


def block() -> RenderMesh:
    return mesh_of(PartMaker().box((-50.0, -40.0, 0.0), (50.0, 40.0, 20.0)).part())


def grid(step: float = 8.0, height: float = 20.0) -> Float:
    x, y = np.meshgrid(np.arange(-2, 3) * step, np.arange(-2, 3) * step)
    return np.stack([x.ravel(), y.ravel(), np.full(25, height)], axis=1)


def field_of(points: Float, values: Float, good: bool = True) -> ValueField:
    found = value_field(block(), points, values, [good] * len(points), [""] * 6)
    assert found is not None
    return found


def test_a_field_is_between_its_points_and_no_more_than_they_are() -> None:
    rng = np.random.default_rng(3)
    points, values = grid(), rng.uniform(-2.0, 1.5, 25)
    found = field_of(points, values)
    has = np.isfinite(found.values)
    places = found.mesh.vertices[has]
    assert values.min() - 1e-9 <= found.values[has].min()
    assert found.values[has].max() <= values.max() + 1e-9
    # On the face that was touched, and outside the points by less than half their step.
    assert np.allclose(places[:, 2], 20.0)
    assert np.abs(places[:, :2]).max() < 16.0 + 8.0 / 2.0
    near = np.linalg.norm(found.mesh.vertices[:, None] - points, axis=2).min(axis=1)
    assert near[has].max() <= found.reach_mm <= 10.0
    # All of what lies between is coloured, and at a point it is the point's.
    inside = np.abs(found.mesh.vertices[:, :2]).max(axis=1) < 15.9
    inside &= np.isclose(found.mesh.vertices[:, 2], 20.0)
    assert has[inside].all()
    assert inside.sum() > 250
    for point, value in zip(points, values, strict=True):
        at = int(np.argmin(np.linalg.norm(found.mesh.vertices - point, axis=1)))
        away = float(np.linalg.norm(found.mesh.vertices[at] - point))
        # Its neighbour vertex: the field is smooth, with a slope of at most its range per step.
        assert abs(found.values[at] - value) < 3.5 * away / 2.0 + 0.02


def test_a_point_alone_colours_two_millimetres_and_one_beside_the_part_nothing() -> None:
    alone = field_of(np.array([[10.0, 5.0, 20.0]]), np.array([0.4]))
    has = np.isfinite(alone.values)
    away = np.linalg.norm(alone.mesh.vertices[has] - [10.0, 5.0, 20.0], axis=1)
    assert 0.5 < away.max() <= 2.0 + 1e-9
    assert np.allclose(alone.values[has], 0.4)
    off = np.array([[10.0, 5.0, 25.0]])
    assert value_field(block(), off, np.array([0.4]), [True], [""] * 6) is None


def test_far_points_do_not_colour_what_lies_between_them() -> None:
    points = np.array([[-40.0, 0.0, 20.0], [40.0, 0.0, 20.0]])
    found = field_of(points, np.array([0.1, -0.1]))
    has = np.isfinite(found.values)
    assert np.linalg.norm(found.mesh.vertices[has][:, None] - points, axis=2).min(1).max() <= 2.0


def test_the_part_looks_the_same_with_smaller_triangles() -> None:
    before, found = block(), field_of(grid(), np.zeros(25))
    after = found.mesh

    def area(mesh: RenderMesh, face: int) -> float:
        a, b, c = (
            mesh.vertices[mesh.triangles[mesh.triangle_faces == face][:, k]] for k in (0, 1, 2)
        )
        return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    for face in range(6):
        assert area(after, face) == pytest.approx(area(before, face), rel=1e-9)
    assert 1000 < len(after.triangles) < 130_000
    np.testing.assert_allclose(after.normals, before.normals[found.parents], atol=1e-9)
    # Both sides of an edge are halved: new triangles leave no gap, so that every edge
    # inside the face occurs twice, in opposite directions.
    places, place_of = np.unique(after.vertices, axis=0, return_inverse=True)
    rows = place_of.ravel()[after.triangles[after.triangle_faces == TOP]]
    edges = np.sort(np.concatenate([rows[:, [0, 1]], rows[:, [1, 2]], rows[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    ends = np.abs(places[unique[count == 1]])
    on_rim = np.isclose(ends[..., 0], 50.0).all(axis=1) | np.isclose(ends[..., 1], 40.0).all(axis=1)
    assert on_rim.all()


def test_what_is_good_comes_from_good_points_alone() -> None:
    good = [True] * 25
    good[12] = False
    found = value_field(block(), grid(), np.zeros(25), good, [""] * 6)
    assert found is not None
    has = np.isfinite(found.values)
    away = np.linalg.norm(found.mesh.vertices - [0.0, 0.0, 20.0], axis=1)
    assert not found.good[has & (away < 5.9)].any()
    assert found.good[has & (away > 6.1)].all()
    assert not found.good[~has].any()


def test_faces_of_one_feature_share_their_points() -> None:
    points = np.array([[48.0, 0.0, 20.0], [50.0, 0.0, 18.0], [48.0, 4.0, 20.0], [50.0, 4.0, 18.0]])
    values = np.array([1.0, -1.0, 1.0, -1.0])
    owners = [""] * 6
    apart = value_field(block(), points, values, [True] * 4, owners)
    assert apart is not None
    top = apart.mesh.triangles[apart.mesh.triangle_faces == TOP]
    own = apart.values[np.unique(top)]
    assert np.allclose(own[np.isfinite(own)], 1.0)
    owners[TOP] = owners[1] = "EDGE"
    joined = value_field(block(), points, values, [True] * 4, owners)
    assert joined is not None
    # The nearest other point is round the corner now.
    assert apart.reach_mm == pytest.approx(0.75 * 4.0)
    assert joined.reach_mm == pytest.approx(0.75 * np.hypot(2.0, 2.0))


def test_hostile_numbers_colour_nothing_or_what_they_are() -> None:
    points = grid()
    points[3] = np.nan
    values = np.zeros(25)
    values[4], values[5], values[6] = np.nan, np.inf, 1e9
    found = field_of(points, values)
    has = np.isfinite(found.values)
    assert has.any()
    assert found.values[has].max() == pytest.approx(1e9, rel=1e-9)
    # The very same place twice, with two values: neither is preferred.
    twice = field_of(np.array([[0.0, 0.0, 20.0]] * 2), np.array([-1.0, 1.0]))
    assert np.allclose(twice.values[np.isfinite(twice.values)], 0.0)
    wide = mesh_of(PartMaker().box((-5000.0, -4000.0, 0.0), (5000.0, 4000.0, 20.0)).part())
    large = value_field(wide, grid(), np.zeros(25), [True] * 25, [""] * 6)
    assert large is not None
    assert len(large.mesh.triangles) < 250_000
    lost = replace(block(), vertices=np.where(block().vertices > 45.0, np.nan, block().vertices))
    assert value_field(lost, grid(), np.zeros(25), [True] * 25, [""] * 6) is None
