"""From which side the ball touched: each way on its own, and what contradicts it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.measuring import (
    METHODS,
    PointOptions,
    Refusal,
    RefusalCode,
    Side,
    Touch,
    TouchCollector,
    side_of,
)
from ocmm_core.measuring._trigger import shank_axis
from ocmm_core.tracking import ProbeBody, TrackBlock, cut

pytestmark = pytest.mark.numerics

PERIOD_S = 125e-6
UP = np.array([0.0, 0.0, 1.0])


def way(direction: Float, length: float = 12.0) -> Float:
    """Return a straight way (m, 3), mm, that ends at the origin."""
    return np.arange(length, 0.0, -0.5)[:, None] * direction


@pytest.fixture
def touch(tracked: Callable[..., TrackBlock]) -> Touch:
    return Touch(0, tracked(np.zeros((2000, 3))), 2000, way(UP))


def side(
    method: str, touch: Touch, body: ProbeBody, rotation: Float, normal: Float | None = None
) -> Side | Refusal:
    return side_of(method, touch, np.zeros(3), rotation, body, 2.0, normal, 0.0)


def test_the_way_the_ball_came_gives_the_side(touch: Touch, standard_probe: ProbeBody) -> None:
    found = side("approach", touch, standard_probe, np.eye(3))
    assert isinstance(found, Side)
    np.testing.assert_allclose(found.direction, UP, atol=1e-12)
    assert found.word == "trail"


def test_the_pull_gives_the_side_whatever_way_the_ball_came(
    touch: Touch, standard_probe: ProbeBody
) -> None:
    beside = np.array([1.0, 0.0, 0.0])
    pulled = replace(touch, trail_world=way(beside), pull_world=way(UP)[::-1])
    found = side("pulled", pulled, standard_probe, np.eye(3))
    assert isinstance(found, Side)
    np.testing.assert_allclose(found.direction, UP, atol=1e-12)
    assert found.word == "pulled"
    refused = side("pulled", touch, standard_probe, np.eye(3))
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.NO_APPROACH
    assert "8 mm" in refused.remedy


def test_the_axis_of_the_probe_gives_the_side(touch: Touch, standard_probe: ProbeBody) -> None:
    axis = shank_axis(standard_probe)
    assert np.linalg.norm(axis) == pytest.approx(1.0)
    across = np.cross(axis, UP + np.array([1e-9, 0.0, 0.0]))
    angle = np.arccos(np.clip(axis @ UP, -1.0, 1.0))
    turned = rotation_from_vector(angle * across / np.linalg.norm(across))
    found = side("shank", touch, standard_probe, turned)
    assert isinstance(found, Side)
    np.testing.assert_allclose(found.direction, UP, atol=1e-6)
    # Without a way that it came there is nothing to contradict it.
    alone = side("shank", replace(touch, trail_world=np.empty((0, 3))), standard_probe, turned)
    assert isinstance(alone, Side)


def test_the_nominal_normal_gives_the_side_once_it_is_known(
    touch: Touch, standard_probe: ProbeBody
) -> None:
    normal = np.array([0.0, 0.6, 0.8])
    found = side("nominal", touch, standard_probe, np.eye(3), normal)
    assert isinstance(found, Side)
    np.testing.assert_array_equal(found.direction, normal)
    for unknown in (None, np.zeros(3)):
        refused = side("nominal", touch, standard_probe, np.eye(3), unknown)
        assert isinstance(refused, Refusal)
        assert "datum" in refused.remedy


@pytest.mark.parametrize("method", ["shank", "nominal"])
def test_a_ball_that_came_from_behind_is_refused_not_guessed(
    touch: Touch, standard_probe: ProbeBody, method: str
) -> None:
    axis = shank_axis(standard_probe)
    came = replace(touch, trail_world=way(-axis))
    refused = side(method, came, standard_probe, np.eye(3), axis)
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.NO_APPROACH
    assert "one of the two is wrong" in refused.what


def test_every_way_has_a_word() -> None:
    assert len(set(METHODS)) == 4


def touches(block: TrackBlock, pulled: bool, step: int) -> list[Touch]:
    collector = TouchCollector(PERIOD_S, PointOptions())
    collector.pulled = pulled
    found: list[Touch] = []
    for start in range(0, len(block), step):
        found += collector.push(cut(block, start, min(start + step, len(block))))
    return found


@pytest.mark.parametrize("step", [80, 777, 20_000])
def test_a_pulled_touch_is_complete_when_the_ball_is_away(
    tracked: Callable[..., TrackBlock], step: int
) -> None:
    rest, out = np.zeros((4000, 3)), np.zeros((10_000, 3))
    out[:, 1] = 0.004 * np.arange(1, 10_001)
    block = tracked(np.concatenate([way(UP, 10.0).repeat(100, axis=0), rest, out]))
    pressed = 2100
    block.flags[pressed : pressed + 400] |= np.uint32(FrameFlag.BUTTON)
    (touch,) = touches(block, True, step)
    assert len(touch.window) == 2000
    away = np.linalg.norm(touch.pull_world, axis=1)
    # Followed for four times the way of an approach, and no further.
    assert 8.0 <= away.max() < 8.6
    assert np.all(np.diff(away) > 0.0)
    np.testing.assert_allclose(touch.pull_world[:, [0, 2]], 0.0, atol=1e-12)
    (unfollowed,) = touches(block, False, step)
    assert unfollowed.first_frame == touch.first_frame
    assert len(unfollowed.pull_world) == 0


def test_a_ball_that_stays_ends_the_wait(tracked: Callable[..., TrackBlock]) -> None:
    block = tracked(np.zeros((20_000, 3)))
    block.flags[1000:1200] |= np.uint32(FrameFlag.BUTTON)
    collector = TouchCollector(PERIOD_S, PointOptions())
    collector.pulled = True
    assert collector.push(cut(block, 0, 14_000)) == []
    (touch,) = collector.push(cut(block, 14_000, 20_000))
    assert len(touch.pull_world) == 0
    assert not collector.collecting
