"""The finder: eight windows over a stream of pictures, with LEDs that move, meet and vanish."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ocmm_core.camera import SpotBlock, SpotFinder, SpotOptions, SpotStatus, Window
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from tests.core.camera.spot_pictures import LIGHT, picture, spot

# The first one compiles, which takes ten seconds of processor time.
SHAPE = (120, 160)
OPTIONS = SpotOptions(dark_spread=0.0, response_spread=0.0, hold=100, search_lines=10)
"""No fixed pattern; a search of the small sensor takes six frames."""

Place = tuple[float, float]


def look(
    finder: SpotFinder, places: Sequence[Place], rng: np.random.Generator, light: float = LIGHT
) -> SpotBlock:
    mean = np.zeros(SHAPE)
    for u, v in places:
        mean += spot(u, v, SHAPE, light)
    return finder.find(picture(mean, rng))


def settle(finder: SpotFinder, places: Sequence[Place], rng: np.random.Generator) -> SpotBlock:
    """Let the finder see resting LEDs until it has searched everywhere twice."""
    for _ in range(30):
        block = look(finder, places, rng)
    return block


def slots_of(block: SpotBlock, places: Sequence[Place]) -> list[int]:
    """Return the slot that reports each place, -1 for none."""
    found = []
    for place in places:
        near = [
            slot
            for slot in range(8)
            if block.valid[0] >> slot & 1 and np.abs(block.uv[0, slot] - place).max() < 0.5
        ]
        assert len(near) <= 1
        found.append(near[0] if near else -1)
    return found


def status_of(block: SpotBlock, slot: int) -> SpotStatus:
    return SpotStatus(int(block.status[0, slot]))


def make(start: tuple[Window, ...] = (), options: SpotOptions = OPTIONS) -> SpotFinder:
    return SpotFinder(SHAPE[1], SHAPE[0], options, start)


FOUR: tuple[Place, ...] = ((30.2, 40.7), (80.9, 20.3), (120.4, 90.6), (60.5, 100.1))


def test_sixty_four_leds_are_found_as_exactly_as_a_few() -> None:
    """A grid of 64 LEDs 20 px apart; the noise of a spot is 0.03 px along each axis."""
    rng = np.random.default_rng(2)
    places = [(15.3 + 20.0 * i, 14.6 + 20.0 * j) for i in range(8) for j in range(8)]
    shape = (170, 170)
    options = replace(OPTIONS, search_lines=40)
    finder = SpotFinder(shape[1], shape[0], options, n_slots=64)
    mean = np.sum([spot(u, v, shape, LIGHT) for u, v in places], axis=0)
    for _ in range(30):
        block = finder.find(picture(mean, rng))
    assert int(block.valid[0]) == 2**64 - 1
    apart = np.linalg.norm(block.uv[0][:, None] - np.array(places), axis=2)
    # Every LED is in one slot, and its place is right.
    assert sorted(apart.argmin(axis=1)) == list(range(64))
    assert np.sqrt(np.mean(apart.min(axis=1) ** 2)) < 0.06


def test_every_led_gets_a_slot_of_its_own_and_keeps_it() -> None:
    rng = np.random.default_rng(1)
    finder = make()
    slots = slots_of(settle(finder, FOUR, rng), FOUR)
    assert sorted(slots) == [0, 1, 2, 3]
    for _ in range(200):
        block = look(finder, FOUR, rng)
        assert slots_of(block, FOUR) == slots
        assert block.valid[0].bit_count() == 4
        assert [status_of(block, slot) for slot in range(4, 8)] == [SpotStatus.FREE] * 4


def test_a_new_spot_is_reported_from_its_third_frame_on() -> None:
    rng = np.random.default_rng(2)
    finder = make()
    seen = []
    for _ in range(20):
        block = look(finder, FOUR[:1], rng)
        seen.append([name for name in map(int, block.status[0]) if name != SpotStatus.FREE])
    first = next(index for index, found in enumerate(seen) if found)
    assert seen[first : first + 3] == [[SpotStatus.UNCONFIRMED]] * 2 + [[SpotStatus.GOOD]]


def test_an_empty_scene_gives_nothing() -> None:
    rng = np.random.default_rng(3)
    finder = make()
    assert not any(look(finder, [], rng).valid[0] for _ in range(500))


def test_eight_leds_fill_all_slots_and_a_ninth_finds_none() -> None:
    rng = np.random.default_rng(4)
    places = [(20.0 + 40.0 * (k % 3), 20.0 + 35.0 * (k // 3)) for k in range(9)]
    finder = make()
    block = settle(finder, places, rng)
    assert block.valid[0] == 0xFF
    assert slots_of(block, places).count(-1) == 1


@pytest.mark.parametrize(("speed", "frames"), [(0.26, 400), (2.08, 60)])
@pytest.mark.parametrize("angle", [0.1, 0.7, 1.4])
def test_a_window_follows_an_led_at_one_metre_a_second(
    speed: float, frames: int, angle: float
) -> None:
    """2.08 px/mm at one metre: 0.26 px a frame at 8 kHz, 2.08 px at 1 kHz; there and back again."""
    rng = np.random.default_rng(5)
    finder = make()
    span = 0.5 * speed * frames
    settle(finder, [(20.0, 20.0)], rng)
    errors = []
    for frame in range(frames):
        # Turning round within a few frames is more than a hand can do.
        way = speed * frame if frame < frames // 2 else 2.0 * span - speed * frame
        place = (20.0 + way * np.cos(angle), 20.0 + way * np.sin(angle))
        block = look(finder, [place], rng)
        assert block.valid[0] == 1, frame
        errors.append(block.uv[0, 0] - place)
    # 0.03 px for each.
    assert np.sqrt(np.mean(np.square(errors))) < 0.04


def test_an_led_that_is_already_moving_is_found() -> None:
    rng = np.random.default_rng(6)
    finder = make()
    found = 0
    for frame in range(60):
        place = (20.0 + 2.08 * frame, 60.0)
        block = look(finder, [place], rng)
        found += slots_of(block, [place]) != [-1]
    # The search needs six frames to come by, the confirmation two.
    assert found > 45


def test_a_hidden_led_is_lost_at_once_and_gets_its_slot_back() -> None:
    rng = np.random.default_rng(7)
    finder = make()
    slots = slots_of(settle(finder, FOUR, rng), FOUR)
    for _ in range(50):
        block = look(finder, FOUR[1:], rng)
        assert slots_of(block, FOUR) == [-1, *slots[1:]]
        assert status_of(block, slots[0]) is SpotStatus.DARK
        assert np.isnan(block.uv[0, slots[0]]).all()
        assert np.isnan(block.variance[0, slots[0]]).all()
    for _ in range(4):
        block = look(finder, FOUR, rng)
    assert slots_of(block, FOUR) == slots


def test_the_window_of_a_hidden_led_moves_with_the_others() -> None:
    rng = np.random.default_rng(8)
    finder = make()
    slots = slots_of(settle(finder, FOUR, rng), FOUR)
    for frame in range(60):
        moved = [(u + 0.3 * frame, v - 0.15 * frame) for u, v in FOUR]
        block = look(finder, moved[1:] if 10 <= frame < 55 else moved, rng)
    assert slots_of(block, moved) == slots


def test_a_slot_is_given_up_after_a_while_and_its_led_comes_back_to_it() -> None:
    rng = np.random.default_rng(9)
    finder = make()
    slots = slots_of(settle(finder, FOUR, rng), FOUR)
    lost = (slots[1], slots[3])
    for _ in range(OPTIONS.hold + 2):
        block = look(finder, [FOUR[0], FOUR[2]], rng)
    assert {status_of(block, slot) for slot in lost} == {SpotStatus.FREE}
    assert [window is None for window in finder.windows()].count(False) == 2
    # Both reappear somewhere else, each nearer to its own old place.
    elsewhere = [FOUR[0], (95.0, 35.0), FOUR[2], (45.0, 85.0)]
    assert slots_of(settle(finder, elsewhere, rng), elsewhere) == slots


def test_no_slot_is_taken_from_an_led_that_is_followed() -> None:
    rng = np.random.default_rng(10)
    finder = make()
    slots = slots_of(settle(finder, FOUR, rng), FOUR)
    more = [*FOUR, (140.0, 20.0), (20.0, 90.0)]
    assert slots_of(settle(finder, more, rng), more)[:4] == slots


def crossing(frames: int, speed: float) -> list[tuple[Place, Place]]:
    """Return two LEDs that pass through each other at right angles."""
    ways = [speed * (frame - frames // 2) for frame in range(frames)]
    return [((80.0 + way, 60.0 + 0.3 * way), (80.0 - 0.4 * way, 60.0 + way)) for way in ways]


@pytest.mark.parametrize("speed", [0.25, 0.6, 2.0])
def test_two_leds_that_cross_are_lost_while_they_meet_and_never_mixed_up(speed: float) -> None:
    rng = np.random.default_rng(11)
    finder = make()
    places = crossing(round(80 / speed), speed)
    slots = slots_of(settle(finder, places[0], rng), places[0])
    assert -1 not in slots
    worst, unseen = 0.0, 0
    for pair in places:
        block = look(finder, pair, rng)
        for slot, place in zip(slots, pair, strict=True):
            if block.valid[0] >> slot & 1:
                worst = max(worst, float(np.abs(block.uv[0, slot] - place).max()))
            else:
                unseen += 1
        assert block.valid[0].bit_count() <= 2
    assert unseen > 0
    # A spot that were taken for the other, or for both, would be off by a pixel or more.
    assert worst < 0.2
    assert slots_of(look(finder, places[-1], rng), places[-1]) == slots


def test_two_leds_that_merge_are_no_led_however_slowly() -> None:
    """They come as near as 0.3 px and stay, so that one round spot of twice the light is left."""
    rng = np.random.default_rng(12)
    finder = make()
    pair: list[Place] = [(70.0, 60.0), (90.0, 60.0)]
    settle(finder, pair, rng)
    seen = 0
    for frame in range(140):
        way = min(0.15 * frame, 9.85)
        pair = [(70.0 + way, 60.0), (90.0 - way, 60.0)]
        block = look(finder, pair, rng)
        if pair[1][0] - pair[0][0] < 6.0:
            seen += block.valid[0].bit_count()
    assert seen == 0


def test_two_windows_never_report_the_same_spot() -> None:
    """An LED vanishes just when another one reaches its predicted place."""
    rng = np.random.default_rng(13)
    finder = make()
    slots = slots_of(settle(finder, [(60.0, 60.0), (100.0, 60.0)], rng), [(60.0, 60.0)])
    for frame in range(80):
        place = (max(100.0 - 0.5 * frame, 60.0), 60.0)
        block = look(finder, [place], rng)
        assert block.valid[0].bit_count() <= 1
    # The window of the hidden LED moved with the one that is seen, and did not take it.
    assert slots_of(block, [(60.0, 60.0)]) == [1 - slots[0]]


def test_light_that_jumps_is_not_that_of_the_led() -> None:
    rng = np.random.default_rng(14)
    finder = make()
    settle(finder, FOUR[:1], rng)
    for light in (0.4 * LIGHT, 2.0 * LIGHT):
        block = look(finder, FOUR[:1], rng, light)
        assert status_of(block, 0) is SpotStatus.JUMPED
        assert block.valid[0] == 0
    for factor in 1.02 ** np.arange(60):
        block = look(finder, FOUR[:1], rng, LIGHT * factor)
        assert block.valid[0] == 1, "slowly it may change"


def test_an_overexposed_led_is_followed_but_not_reported() -> None:
    rng = np.random.default_rng(15)
    finder = make()
    for frame in range(150):
        place = (30.0 + 0.4 * frame, 60.0)
        block = look(finder, [place], rng, 30.0 * LIGHT)
        assert block.valid[0] == 0
        if frame > 15:
            assert block.saturated[0]
            assert SpotStatus.SATURATED in block.status[0]


def test_a_reflection_is_looked_at_and_left_alone() -> None:
    rng = np.random.default_rng(16)
    finder = make()
    streak = spot(40.0, 50.0, SHAPE, 3.0 * LIGHT, (3.0, 1.0))
    for _ in range(100):
        block = finder.find(picture(streak + spot(*FOUR[2], SHAPE), rng))
    assert slots_of(block, [FOUR[2]]) != [-1]
    assert block.valid[0].bit_count() == 1


def test_an_led_at_the_edge_of_the_sensor_is_not_reported() -> None:
    rng = np.random.default_rng(17)
    finder = make()
    seen = []
    for frame in range(120):
        place = (20.0 - 0.2 * frame, 60.0)
        seen.append((place[0], look(finder, [place], rng).valid[0] == 1))
    assert all(valid for u, valid in seen if 3.5 < u < 17.0)
    # Its light reaches the first column with more than the threshold.
    assert not any(valid for u, valid in seen if u < 1.0)


def test_slots_start_in_the_windows_that_they_are_given() -> None:
    rng = np.random.default_rng(18)
    start = tuple(Window(round(u) - 10, round(v) - 10, 20, 20) for u, v in (FOUR[2], FOUR[0]))
    finder = make(start)
    assert slots_of(settle(finder, FOUR, rng), FOUR) == [1, -1, 0, -1]


@pytest.mark.parametrize(
    "windows",
    [
        (Window(-1, 0, 20, 20),),
        (Window(150, 0, 20, 20),),
        (Window(0, 110, 20, 20),),
        (Window(0, 0, 0, 20),),
        (Window(0, 0, 20, 20),) * 9,
    ],
)
def test_start_windows_that_cannot_be_are_refused(windows: tuple[Window, ...]) -> None:
    with pytest.raises(InputError, match="window"):
        make(windows)


def test_the_past_can_be_taken_up_again() -> None:
    """The state is complete: a copy of it yields the same frames again."""
    rng = np.random.default_rng(19)
    finder = make()
    settle(finder, FOUR, rng)
    images: list[NDArray[np.uint16]] = [
        picture(sum_of([(u + 0.3 * k, v) for u, v in FOUR[: 4 - k // 20]]), rng) for k in range(60)
    ]
    before = finder.state.copy()
    first = [finder.find(image) for image in images]
    finder.state = before
    for image, block in zip(images, first, strict=True):
        again = finder.find(image)
        np.testing.assert_array_equal(again.uv, block.uv)
        np.testing.assert_array_equal(again.status, block.status)


def sum_of(places: Sequence[Place]) -> Float:
    total = np.zeros(SHAPE)
    for u, v in places:
        total += spot(u, v, SHAPE)
    return total


def test_times_follow_from_the_frame_period() -> None:
    fast = SpotOptions().at_period(125_000, 2048)
    slow = SpotOptions().at_period(1_000_000, 2048)
    assert (fast.hold, fast.search_lines) == (800, 2)
    assert (slow.hold, slow.search_lines) == (100, 16)
