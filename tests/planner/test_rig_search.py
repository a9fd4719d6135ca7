"""The search of placements, and changes of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import msgspec
import numpy as np
import pytest

from ocmm_planner import evaluate_plan, placement_cost, search_places
from ocmm_planner._plan import Box
from tests.planner.rig_scenes import changed, given_plan, random_plan, search_scene


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
def test_search_is_no_worse_than_a_grid(seed: int) -> None:
    plan = search_scene(seed)
    nodes = plan.nodes(plan.document.search_nodes)
    found, tried = search_places(plan, seed=seed, evaluations=300, step=lambda _: None)
    assert 200 < tried <= 300
    corners = [
        list(product(*(np.linspace(a, b, 3 if b > a else 1) for a, b in limits)))
        for limits in (
            zip(one.place.min, one.place.max, strict=True)
            for one in plan.document.cameras
            if one.place is not None
        )
    ]
    targets = plan.places[:, 3:]
    grid = min(
        placement_cost(plan, np.hstack([pair, targets]), nodes) for pair in product(*corners)
    )
    # 5 % as required of the benchmark, which has more scenes and a finer grid.
    assert placement_cost(plan, found, nodes) <= 1.05 * grid


def test_search_keeps_places_and_seed() -> None:
    plan = search_scene(3)
    found = [search_places(plan, seed=seed, evaluations=1, step=lambda _: None) for seed in (5, 5)]
    assert np.array_equal(found[0][0], found[1][0])
    for row, one in zip(found[0][0], plan.document.cameras, strict=True):
        assert one.place is not None
        assert (row[:3] >= one.place.min).all()
        assert (row[:3] <= one.place.max).all()
    fixed = tuple(msgspec.structs.replace(one, place=None) for one in plan.document.cameras)
    kept, tried = search_places(
        changed(plan, cameras=fixed), seed=1, evaluations=50, step=lambda _: None
    )
    assert tried == 0
    assert np.array_equal(kept, plan.places)


def test_placement_in_a_keep_out_box_costs_most() -> None:
    plan = given_plan()
    nodes = plan.nodes((2, 2, 2))
    x, y, z = plan.places[0, :3]
    box = Box(name="post", min=(x - 50, y - 50, z - 50), max=(x + 50, y + 50, z + 50))
    taken = replace(plan, boxes=np.array([[box.min, box.max]]))
    assert placement_cost(plan, plan.places, nodes) < 2e3
    assert placement_cost(taken, plan.places, nodes) == 1e4
    # A camera that does not see the points of its calibration is better than that, and no good.
    aside = np.add(plan.places, [0.0, 0.0, 0.0, 3000.0, 0.0, 0.0])
    assert placement_cost(plan, aside, nodes) == 5e3


def test_more_base_and_fewer_cameras() -> None:
    plan = changed(random_plan(4), nodes=(3, 2, 3))
    sheet = evaluate_plan(plan, seed=1, evaluations=0)
    assert len(plan.cameras) == 3 == len(sheet.one_less)
    assert not sheet.is_moved
    assert sheet.evaluations == 0
    assert sheet.given == sheet.best
    assert sheet.best.median_um is not None
    assert sheet.wider.median_um is not None
    # Depth is the worst direction of cameras next to each other: more base helps it.
    assert sheet.wider.median_um < sheet.best.median_um
    for left in sheet.one_less:
        assert left.median_um is None or left.median_um > sheet.best.median_um
    pair = evaluate_plan(changed(given_plan(), nodes=(2, 2, 2)), seed=1, evaluations=0)
    assert [one.measurable for one in pair.one_less] == [0, 0]
    assert "depth" in pair.one_less[0].why
