"""Faces with many holes: containment and distance to edges, against trying every edge."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_cad.step import _place_kernel as kernel
from ocmm_cad.step.brep._surface_kernel import inside as are_inside
from ocmm_core.geometry import Float

SEED = 6
FAR_MM = 4.0


def holed() -> tuple[Float, Float]:
    """Return places of a grid on a plate of 100 by 60 with uneven holes, and its edges."""
    rng = np.random.default_rng(SEED)
    u, v = np.linspace(0.01, 99.0, 60), np.linspace(0.013, 59.0, 40)
    grid = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    box = np.array([[0, 0], [100, 0], [100, 60], [0, 60.0]])
    outlines = [box]
    for _ in range(40):
        turn = np.sort(rng.uniform(0.0, 2.0 * np.pi, int(rng.integers(3, 40))))
        ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        outlines.append(rng.uniform([5, 5], [95, 55]) + rng.uniform(1.0, 9.0) * ring)
    loops = np.concatenate([np.stack([one, np.roll(one, -1, axis=0)], axis=1) for one in outlines])
    return grid, loops


def test_inside_is_where_a_ray_crosses_an_odd_number_of_edges() -> None:
    grid, loops = holed()
    crossed = np.zeros(len(grid), dtype=np.int64)
    for (u0, v0), (u1, v1) in loops:
        if v0 == v1:
            continue
        spans = (grid[:, 1] >= min(v0, v1)) & (grid[:, 1] < max(v0, v1))
        crossed += spans & (u0 + (u1 - u0) * (grid[:, 1] - v0) / (v1 - v0) > grid[:, 0])
    inside = crossed % 2 == 1
    assert 0.2 < inside.mean() < 0.9
    us, vs = np.unique(grid[:, 0]), np.unique(grid[:, 1])
    found = np.zeros((len(us), len(vs)), dtype=np.bool_)
    are_inside(us, vs, loops, found)
    np.testing.assert_array_equal(found.ravel(), inside)


def test_distances_are_those_from_every_edge_up_to_what_counts() -> None:
    grid, loops = holed()
    places = np.column_stack([grid, np.zeros(len(grid))])
    edges = np.concatenate([loops, np.zeros((len(loops), 2, 1))], axis=2)
    # Also an edge of zero length.
    edges = np.concatenate([edges, np.repeat(edges[:1, :1], 2, axis=1)])
    nearest = np.full(len(places), np.inf)
    for start, end in edges:
        along = end - start
        length = float(along @ along)
        arms = places - start
        share = np.clip(arms @ along / length, 0.0, 1.0) if length else np.zeros(len(places))
        off = np.linalg.norm(arms - share[:, None] * along, axis=1)
        nearest = np.minimum(nearest, off)
    found = kernel.distances(places, edges, FAR_MM)
    near = nearest <= FAR_MM
    assert found[near] == pytest.approx(nearest[near], abs=1e-12)
    assert np.isinf(found[~near]).all()
    assert 0.1 < near.mean() < 0.9


def test_without_edges_everything_is_far() -> None:
    assert np.isinf(kernel.distances(np.zeros((3, 3)), np.empty((0, 2, 3)), FAR_MM)).all()


@pytest.mark.parametrize("jitter", [-1e-14, 0.0, 1e-14])
def test_the_side_of_an_edge_is_not_told_by_a_place_along_it(jitter: float) -> None:
    # A shoulder round a shaft of 15 mm: the shaft's wall rises from it.
    middle, up = np.array([-15.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    along, wall = np.array([jitter, -3.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    places = np.array([[-15.0 + jitter, 1.0, 0.0], [-15.0 - jitter, -1.0, 0.0], [-17.0, 1.0, 0.0]])
    assert kernel.leans_inward(middle, along, up, places, wall) == pytest.approx(1.0)
    assert kernel.leans_inward(middle, along, up, places, -wall) == pytest.approx(-1.0)
    # Without a neighbour at the edge a wall is assumed: the ball keeps away.
    assert kernel.leans_inward(middle, along, up, places[:2], -wall) == 1.0
