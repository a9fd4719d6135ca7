"""The operator of the virtual rig repeats touches without a point, at the same place."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_sim.scene import Missing, load_part
from ocmm_sim.scene._operator import Operator
from ocmm_sim.scene._surfaces import SlotEntry
from ocmm_sim.scene._touches import sample

PART = load_part(resource("parts", "gauge.toml"))
RADIUS = 3.0
COUNT = 6
NONE = np.empty((0, 3))


@pytest.mark.parametrize("lost", [(0,), (1, 2), (0, 2, 5), (0, 1, 2, 3, 4, 5)])
@pytest.mark.parametrize("shift", [0.0, 0.5])
def test_a_touch_that_gave_no_point_is_made_again_at_its_place(
    lost: tuple[int, ...], shift: float
) -> None:
    operator = Operator(PART, RADIUS, [("SLOT", COUNT), ("BORE_A", 4)], seed=1)
    first = np.array([touch.tip_world for touch in operator.touches[:COUNT]])
    # The part may be pushed a little before missing points are requested.
    taken = (np.delete(first, lost, axis=0) + shift).tolist()
    operator.complete(Missing([("SLOT", len(lost))], {"SLOT": taken}), 0.0)
    again = operator.touches[COUNT + 4 :]
    assert [touch.feature for touch in again] == ["SLOT"] * len(lost)
    np.testing.assert_allclose([touch.tip_world for touch in again], first[list(lost)], atol=1e-9)


def test_what_is_lost_twice_is_made_a_third_time() -> None:
    operator = Operator(PART, RADIUS, [("SLOT", COUNT)], seed=1)
    first = np.array([touch.tip_world for touch in operator.touches])
    operator.complete(Missing([("SLOT", 2)], {"SLOT": first[2:].tolist()}), 0.0)
    operator.complete(Missing([("SLOT", 1)], {"SLOT": first[1:].tolist()}), 0.0)
    np.testing.assert_allclose(operator.touches[-1].tip_world, first[0], atol=1e-9)


def test_a_feature_that_needs_more_than_was_touched_is_spread_anew() -> None:
    operator = Operator(PART, RADIUS, [("SLOT", 2)], seed=1)
    operator.complete(Missing([("SLOT", COUNT), ("BORE_B", 4)], {"SLOT": NONE.tolist()}), 0.0)
    tips = np.array([touch.tip_world for touch in operator.touches[2 : 2 + COUNT]])
    gaps = np.linalg.norm(tips[:, None] - tips[None], axis=2) + 1e3 * np.eye(COUNT)
    assert len(operator.touches) == 2 + COUNT + 4
    assert gaps.min() > 1.0


@pytest.mark.parametrize("count", [4, 5, 6, 7])
@pytest.mark.parametrize("seed", range(20))
def test_few_touches_of_a_slot_reach_its_sides_and_an_end(count: int, seed: int) -> None:
    # Without a touch along the slot its length depends on noise.
    slot = load_part(resource("parts", "gauge.toml")).artefact("SLOT")
    assert isinstance(slot, SlotEntry)
    touched = sample(slot, count, np.random.default_rng(seed))
    along = touched.normals @ np.array(slot.along)
    assert np.abs(along).max() > 0.9
    if count % 2 == 0:
        assert along.max() > 0.9 > -0.9 > along.min()
    straight, radius = 0.5 * (slot.length - slot.width), 0.5 * slot.width
    flat = touched.points - np.array(slot.point)
    middle = np.clip(flat @ np.array(slot.along), -straight, straight)[:, None] * slot.along
    beside = flat - middle
    beside -= (beside @ np.array(slot.direction))[:, None] * slot.direction
    assert np.linalg.norm(beside, axis=1) == pytest.approx(np.full(count, radius))
