from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.geometry import Float
from ocmm_core.measuring import PointOptions, Touch, TouchCollector, approach_direction
from ocmm_core.measuring._trigger import MIN_FRAMES
from ocmm_core.tracking import ARRAYS, FrameStatus, TrackBlock, cut, join, pick

PERIOD_S = 125e-6
WINDOW = 2000
"""Frames of the 0.25 s of a window."""

Tracked = Callable[..., TrackBlock]


def touches_of(block: TrackBlock, cuts: list[int]) -> list[Touch]:
    collector = TouchCollector(PERIOD_S, PointOptions())
    edges = [0, *cuts, len(block)]
    return [
        touch for a, b in pairwise(edges) if b > a for touch in collector.push(cut(block, a, b))
    ]


def press(block: TrackBlock, first: int, last: int) -> None:
    block.flags[first : last + 1] |= np.uint32(FrameFlag.BUTTON)


def approaching(contact: int, dwell: int, speed_mm_s: float = 20.0) -> Float:
    """Return tips (n, 3), mm, that come down along z and rest at the origin."""
    before = np.arange(contact, 0, -1) * speed_mm_s * PERIOD_S
    z = np.concatenate([before, np.zeros(dwell)])
    return np.stack([0.0 * z, 0.0 * z, z], axis=1)


def test_a_press_gives_the_frames_from_it_on(tracked: Tracked) -> None:
    block = tracked(np.zeros((5000, 3)), first=700)
    press(block, 1000, 1300)
    (touch,) = touches_of(block, [])
    assert touch.first_frame == 1700
    assert touch.expected == WINDOW
    assert np.array_equal(touch.window.counter, np.arange(1700, 1700 + WINDOW))


def test_windows_do_not_depend_on_how_the_stream_is_cut(tracked: Tracked) -> None:
    rng = np.random.default_rng(1)
    tips = np.cumsum(0.05 * rng.standard_normal((20_000, 3)), axis=0)
    block = tracked(tips)
    for first in (1000, 4000, 4500, 9000, 14_000):
        press(block, first, first + 50)
    block.status[rng.random(20_000) < 0.1] = FrameStatus.LOST
    kept = np.setdiff1d(np.arange(20_000), np.arange(9500, 9700))
    block = pick(block, kept)
    whole = touches_of(block, [])
    # The third press falls into the window of the second.
    assert [touch.first_frame for touch in whole] == [1000, 4000, 9000, 14_000]
    assert len(whole[2].window) == WINDOW - 200
    for cuts in (
        list(range(80, 19_800, 80)),
        list(range(990, 3100)),
        sorted(rng.choice(19_800, 100, replace=False).tolist()),
    ):
        parts = touches_of(block, cuts)
        assert len(parts) == len(whole)
        for one, other in zip(whole, parts, strict=True):
            assert one.first_frame == other.first_frame
            assert one.trail_world.tobytes() == other.trail_world.tobytes()
            for name in ARRAYS:
                a, b = getattr(one.window, name), getattr(other.window, name)
                assert a.tobytes() == b.tobytes(), name


def test_a_button_that_is_down_at_the_start_is_no_press(tracked: Tracked) -> None:
    block = tracked(np.zeros((6000, 3)))
    press(block, 0, 500)
    assert not touches_of(block, [100])
    press(block, 1000, 1000)
    assert [touch.first_frame for touch in touches_of(block, [100])] == [1000]


def test_a_button_held_down_gives_one_touch(tracked: Tracked) -> None:
    block = tracked(np.zeros((9000, 3)))
    press(block, 1000, 8999)
    assert len(touches_of(block, [])) == 1


@pytest.mark.parametrize("released", [True, False])
def test_a_press_during_a_window_is_ignored(released: bool, tracked: Tracked) -> None:
    block = tracked(np.zeros((9000, 3)))
    press(block, 1000, 1100)
    press(block, 2000, 2100 if released else 3500)
    press(block, 5000, 5100)
    assert [touch.first_frame for touch in touches_of(block, [])] == [1000, 5000]


def test_arm_takes_the_next_frame_once(tracked: Tracked) -> None:
    collector = TouchCollector(PERIOD_S, PointOptions())
    assert not collector.push(tracked(np.zeros((10, 3))))
    collector.arm()
    assert not collector.collecting
    assert not collector.push(tracked(np.zeros((10, 3)), first=10))
    assert collector.collecting
    # One touch gives one answer: a repeated key press during it is ignored.
    collector.arm()
    touches = collector.push(tracked(np.zeros((9000, 3)), first=20))
    assert [touch.first_frame for touch in touches] == [10]
    assert not collector.collecting
    collector.arm()
    touches = collector.push(tracked(np.zeros((3000, 3)), first=9020))
    assert [touch.first_frame for touch in touches] == [9020]


def test_a_window_whose_frames_are_all_lost_is_still_answered(tracked: Tracked) -> None:
    collector = TouchCollector(PERIOD_S, PointOptions())
    before = tracked(np.zeros((100, 3)))
    press(before, 99, 99)
    assert not collector.push(before)
    (touch,) = collector.push(tracked(np.zeros((10, 3)), first=50_000))
    assert touch.first_frame == 99
    assert len(touch.window) == 1


def joined(*blocks: TrackBlock) -> TrackBlock:
    return join(list(blocks))


def test_an_interruption_ends_the_open_window(tracked: Tracked) -> None:
    before = tracked(np.zeros((1900, 3)))
    press(before, 99, 99)
    block = joined(before, tracked(np.zeros((6000, 3)), first=1900 + 401))
    for cuts in ([], [1900], [1950], list(range(80, 7800, 80))):
        (touch,) = touches_of(block, cuts)
        assert touch.interrupted
        assert (touch.first_frame, len(touch.window)) == (99, 1801)
    # 90 % of the frames are there, and would do if the stream had gone on.
    short = joined(before, tracked(np.zeros((6000, 3)), first=1900 + 199))
    (touch,) = touches_of(short, [])
    assert not touch.interrupted


def test_a_window_that_was_full_before_the_interruption_counts(tracked: Tracked) -> None:
    before = tracked(np.zeros((WINDOW + 100, 3)))
    press(before, 100, 100)
    (touch,) = touches_of(joined(before, tracked(np.zeros((100, 3)), first=90_000)), [])
    assert not touch.interrupted
    assert len(touch.window) == WINDOW


def test_a_clock_that_was_set_back_is_an_interruption(tracked: Tracked) -> None:
    block = tracked(np.zeros((1000, 3)))
    press(block, 99, 99)
    block.time_ns[500:] -= 50_000_000
    assert [touch.interrupted for touch in touches_of(block, [])] == [True]


def test_nothing_of_before_an_interruption_is_used(tracked: Tracked) -> None:
    before = tracked(approaching(3000, 100))
    after = tracked(np.zeros((3000, 3)), first=20_000)
    press(after, 0, 500)
    press(after, 700, 800)
    (touch,) = touches_of(joined(before, after), [])
    # The button was pressed unseen: no trigger. The ball's path is undetermined.
    assert touch.first_frame == 20_700
    assert len(touch.trail_world) == 1
    assert approach_direction(touch.trail_world, np.zeros(3), 2.0) is None


def test_a_key_during_an_interruption_is_answered_and_takes_nothing(tracked: Tracked) -> None:
    collector = TouchCollector(PERIOD_S, PointOptions())
    collector.push(tracked(np.zeros((100, 3))))
    collector.arm()
    (touch,) = collector.push(tracked(np.zeros((5000, 3)), first=20_000))
    assert touch.interrupted
    assert len(touch.window) == 0
    assert not collector.push(tracked(np.zeros((5000, 3)), first=25_000))


def test_a_slow_rig_still_gets_frames_enough() -> None:
    collector = TouchCollector(0.05, PointOptions())
    assert MIN_FRAMES == 25
    collector.arm()
    assert not collector.collecting


@pytest.mark.parametrize("dwell_s", [0.0, 0.5, 30.0])
def test_the_way_is_remembered_however_long_the_ball_rests(
    dwell_s: float, tracked: Tracked
) -> None:
    dwell = round(dwell_s / PERIOD_S)
    tips = approaching(8000, dwell + 3000)
    # While it rests it trembles by 0.05 mm.
    tips[8000:] += 0.05 * np.sin(np.arange(dwell + 3000) / 400.0)[:, None]
    block = tracked(tips)
    press(block, 8000 + dwell, 8010 + dwell)
    (touch,) = touches_of(block, list(range(80, len(block), 800)))
    direction = approach_direction(touch.trail_world, np.zeros(3), 2.0)
    # Noise of 0.05 mm at 2 mm is 0.025 rad, of which the cosine shows 3e-4.
    assert direction is not None
    assert direction @ [0.0, 0.0, 1.0] > 0.999


def test_direction_is_that_of_the_last_way() -> None:
    # Came along x from afar, then around and down along z.
    far = np.stack([np.linspace(50.0, 4.0, 90), np.zeros(90), np.full(90, 4.0)], axis=1)
    around = np.stack([np.linspace(4.0, 0.0, 9), np.zeros(9), np.full(9, 4.0)], axis=1)
    down = np.stack([np.zeros(9), np.zeros(9), np.linspace(4.0, 0.0, 9)], axis=1)
    direction = approach_direction(np.concatenate([far, around, down]), np.zeros(3), 2.0)
    assert direction is not None
    assert np.abs(direction - [0.0, 0.0, 1.0]).max() < 1e-12


def test_no_way_no_direction() -> None:
    assert approach_direction(np.empty((0, 3)), np.zeros(3), 2.0) is None
    near = np.array([[0.0, 0.0, 1.9], [0.0, 0.0, 1.0]])
    assert approach_direction(near, np.zeros(3), 2.0) is None
    # The probe was hidden at the end of its path: the approach from the side was not seen.
    hidden = np.array([[50.0, 0.0, 0.0], [0.0, 0.0, 1.5], [0.0, 0.0, 1.0]])
    assert approach_direction(hidden, np.zeros(3), 2.0) is None


def test_what_was_not_seen_just_before_the_contact_is_no_direction() -> None:
    # Down near a wall, then to it: hidden for the last 3.5 mm it seems to come from above.
    down = np.stack([np.full(13, 3.5), np.zeros(13), np.linspace(6.0, 0.0, 13)], axis=1)
    rest = np.array([[0.05, 0.0, 0.0]])
    assert approach_direction(np.concatenate([down[:6], rest]), np.zeros(3), 2.0) is None
    # Followed to its end, it is the way to the wall.
    last = np.stack([np.linspace(3.5, 0.5, 7), np.zeros(7), np.zeros(7)], axis=1)
    seen = approach_direction(np.concatenate([down, last, rest]), np.zeros(3), 2.0)
    assert seen is not None
    assert np.abs(seen - [1.0, 0.0, 0.0]).max() < 1e-12


def test_a_ball_that_slid_sideways_at_last_has_no_direction() -> None:
    # A millimetre along the surface is already another way than the one from above.
    slid = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0]])
    assert approach_direction(slid, np.zeros(3), 2.0) is None


def test_only_good_frames_leave_a_trail(tracked: Tracked) -> None:
    block = tracked(approaching(8000, 3000))
    block.status[:7000] = FrameStatus.LOST
    block.tip_world[:7000] = np.nan
    press(block, 8000, 8010)
    (touch,) = touches_of(block, [])
    assert np.isfinite(touch.trail_world).all()
    assert np.linalg.norm(touch.trail_world, axis=1).max() <= 2.5
