from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import ARRAYS, FrameStatus, ProbeBody, TrackBlock, TrackingPipeline, join
from ocmm_sim.scene import Part, ScriptedOcclusion, VirtualRig, WorldOptions

WRONG_TIP_MM = 1.0
"""Noise and calibration errors of one frame move the tip by some 0.1 mm; a label by more than 1."""

ALL = (0, 1, 2, 3, 4, 5)

Draw = Callable[..., tuple[Float, Float]]
Look = Callable[..., Float]


def part_of(block: FrameBlock, rows: slice | Int) -> FrameBlock:
    return FrameBlock(*(getattr(block, name)[rows] for name in FrameBlock.__dataclass_fields__))


def track(rig: Rig, body: ProbeBody, block: FrameBlock, cuts: list[int]) -> TrackBlock:
    pipeline = TrackingPipeline(rig, body)
    edges = [0, *cuts, len(block)]
    return join(
        [pipeline.process(part_of(block, slice(a, b))) for a, b in pairwise(edges) if b > a]
    )


def assert_consistent(tracked: TrackBlock) -> None:
    good = tracked.status == FrameStatus.OK
    assert np.isfinite(tracked.tip_world[good]).all()
    assert np.isfinite(tracked.tip_covariance[good]).all()
    for name in ("tip_world", "tip_covariance", "rotation_world_from_probe", "origin_world"):
        assert np.isnan(getattr(tracked, name)[~good]).all()
    assert np.all(np.diff(tracked.counter) > 0)


def errors_mm(tracked: TrackBlock, virtual: VirtualRig) -> Float:
    """Return how wrong the tips of the frames that are OK are, (m,), mm."""
    good = tracked.status == FrameStatus.OK
    truth = virtual.motion(int(tracked.counter[0]), len(tracked)).tip_world
    error: Float = np.linalg.norm(tracked.tip_world[good] - truth[good], axis=1)
    return error


@pytest.fixture(scope="module")
def make(recommended: Rig, standard_probe: ProbeBody, demo_part: Part) -> Callable[..., VirtualRig]:
    def virtual(seed: int, options: WorldOptions | None = None) -> VirtualRig:
        touches = (("BED", 2), ("SPHERE", 2))
        return VirtualRig(recommended, standard_probe, demo_part, touches, seed, options, 1000)

    return virtual


Make = Callable[..., VirtualRig]


@pytest.mark.parametrize("rate", [0.0, 1.0, 4.0])
def test_occlusion_never_gives_a_wrong_tip(rate: float, make: Make) -> None:
    share = []
    for seed in range(4):
        virtual = make(seed, WorldOptions(occlusion_rate_hz=rate))
        block = virtual.frames(0, virtual.n_frames)
        tracked = track(virtual.rig, virtual.body, block, [])
        assert_consistent(tracked)
        errors = errors_mm(tracked, virtual)
        assert errors.max() < WRONG_TIP_MM
        share.append(len(errors) / len(block))
    # With free view every frame is good. One occlusion a second hides 17 % of the spots, which
    # leaves three LEDs in both cameras in 93 % of the frames; four hide half, which leaves 17 %.
    assert np.mean(share) > {0.0: 0.999, 1.0: 0.8, 4.0: 0.0}[rate]


@pytest.mark.parametrize("seed", [1, 2])
def test_the_result_does_not_depend_on_how_the_stream_is_cut(seed: int, make: Make) -> None:
    options = WorldOptions(
        occlusion_rate_hz=3.0,
        occlusions=(
            ScriptedOcclusion(camera=-1, leds=ALL, first_frame=700, last_frame=903),
            ScriptedOcclusion(camera=0, leds=(0, 1), first_frame=0, last_frame=1500),
        ),
    )
    virtual = make(seed, options)
    block = virtual.frames(0, 4000)
    # Slots of one camera change places for a while, and frames are missing.
    block.uv[2000:2600, 1] = block.uv[2000:2600, 1, ::-1]
    block = part_of(block, np.setdiff1d(np.arange(4000), np.arange(3000, 3111)))
    whole = track(virtual.rig, virtual.body, block, [])
    assert len({int(status) for status in whole.status}) >= 3
    rng = np.random.default_rng(seed)
    for cuts in (
        list(range(80, len(block), 80)),
        list(range(1, 1000)),
        sorted(rng.choice(len(block), 60, replace=False).tolist()),
    ):
        pieces = track(virtual.rig, virtual.body, block, cuts)
        for name in ARRAYS:
            one, other = getattr(whole, name), getattr(pieces, name)
            assert one.dtype == other.dtype
            assert one.tobytes() == other.tobytes(), name


def test_total_occlusion_and_return(make: Make) -> None:
    hidden = ScriptedOcclusion(camera=-1, leds=ALL, first_frame=500, last_frame=799)
    virtual = make(3, WorldOptions(occlusions=(hidden,)))
    tracked = track(virtual.rig, virtual.body, virtual.frames(0, 1500), [640, 1000])
    assert (tracked.status[:500] == FrameStatus.OK).all()
    assert (tracked.status[500:800] == FrameStatus.LOST).all()
    # A search every 40 frames while nothing is seen: back within one such pause.
    back = 800 + int(np.argmax(tracked.status[800:] == FrameStatus.OK))
    assert back <= 841
    assert (tracked.status[back:] == FrameStatus.OK).all()
    assert (tracked.status[800:back] == FrameStatus.UNIDENTIFIED).all()
    assert errors_mm(tracked, virtual).max() < WRONG_TIP_MM


def test_one_blind_camera_loses_the_probe_and_keeps_the_labels(make: Make) -> None:
    hidden = ScriptedOcclusion(camera=1, leds=ALL, first_frame=500, last_frame=799)
    virtual = make(4, WorldOptions(occlusions=(hidden,)))
    tracked = track(virtual.rig, virtual.body, virtual.frames(0, 1000), [])
    expected = np.full(1000, FrameStatus.OK)
    expected[500:800] = FrameStatus.LOST
    assert np.array_equal(tracked.status, expected)
    assert not tracked.seen[500:800, 1].any()
    assert (tracked.seen[500:800, 0] == 0b111111).all()


def test_swapped_slots_are_doubtful_and_then_named_anew(make: Make) -> None:
    virtual = make(5, None)
    block = virtual.frames(0, 1200)
    first, second = virtual.truth.slots[0, :2]
    block.uv[400:, 0, [first, second]] = block.uv[400:, 0, [second, first]]
    pipeline = TrackingPipeline(virtual.rig, virtual.body)
    tracked = pipeline.process(block)
    assert (tracked.status[:400] == FrameStatus.OK).all()
    assert (tracked.status[400:440] == FrameStatus.DOUBTFUL).all()
    assert (tracked.status[440:] == FrameStatus.OK).all()
    assert errors_mm(tracked, virtual).max() < WRONG_TIP_MM
    expected = virtual.truth.slots.copy()
    expected[0, :2] = second, first
    assert pipeline.slot_of_led is not None
    assert np.array_equal(pipeline.slot_of_led, expected)
    leds = pipeline.slot_leds()
    assert leds[0, first] == 1
    assert leds[0, second] == 0
    assert np.count_nonzero(leds < 0) == 4


@pytest.mark.parametrize("step_ns", [2_000_000_000, -3_600_000_000_000])
def test_after_an_interruption_the_labels_are_sought_anew(step_ns: int, make: Make) -> None:
    """A camera that was restarted gives its slots to the LEDs in another order."""
    virtual = make(5, None)
    block = virtual.frames(0, 1200)
    block.uv[400:, 0] = block.uv[400:, 0, ::-1]
    # The bus clock may begin at another time as well.
    block.time_ns[:] += 7_200_000_000_000
    block.time_ns[400:] += step_ns
    for cuts in ([], [400], list(range(10, 1190, 10))):
        tracked = track(virtual.rig, virtual.body, block, cuts)
        assert (tracked.status == FrameStatus.OK).all()
        assert errors_mm(tracked, virtual).max() < WRONG_TIP_MM


@pytest.mark.parametrize("cameras", [(0,), (0, 1)])
def test_any_exchange_of_two_leds_is_noticed(cameras: tuple[int, ...], make: Make) -> None:
    virtual = make(6, None)
    for a in range(6):
        for b in range(a):
            block = virtual.frames(300, 60)
            for camera in cameras:
                one, other = virtual.truth.slots[camera, [a, b]]
                block.uv[10:, camera, [one, other]] = block.uv[10:, camera, [other, one]]
            tracked = track(virtual.rig, virtual.body, block, [])
            assert (tracked.status[10:50] == FrameStatus.DOUBTFUL).all(), (a, b)
            assert errors_mm(tracked, virtual).max() < WRONG_TIP_MM


def test_a_symmetric_exchange_breaks_the_rules_of_the_rectangle(
    thesis_rig: Rig, thesis_probe: ProbeBody, draw_poses: Draw, look: Look
) -> None:
    """After lost frames every slot may follow another LED; chi-square cannot detect that."""
    rng = np.random.default_rng(7)
    body = replace(thesis_probe, tip_probe=np.array([0.0, 0.0, 0.0]))
    rotations, tips = draw_poses(rng, 1, (10.0, 10.0, 5.0))
    n = 200
    uv = np.full((n, 2, 8, 2), np.nan)
    seen = look(thesis_rig, body, np.repeat(rotations, n, 0), np.repeat(tips, n, 0), 0.0105, rng)
    uv[:100, :, :4] = seen[:100]
    # Half a turn about the normal: 0 and 3, 1 and 2 change places.
    uv[100:, :, :4] = seen[100:, :, [3, 2, 1, 0]]
    # 25 ms: short enough for the labels to be kept.
    counter = np.concatenate([np.arange(100), np.arange(300, 400)])
    valid = np.full((n, 2), 0b1111, dtype=np.uint64)
    block = FrameBlock(counter, counter * 125_000, np.zeros(n, np.uint32), valid, uv)
    tracked = track(thesis_rig, body, block, [])
    good = tracked.status == FrameStatus.OK
    assert np.linalg.norm(tracked.tip_world[good] - tips, axis=1).max() < WRONG_TIP_MM
    assert (tracked.status[100:140] == FrameStatus.DOUBTFUL).all()
    assert good[140:].all()


def test_an_led_that_comes_late_is_taken_in(make: Make) -> None:
    late = ScriptedOcclusion(camera=1, leds=(4,), first_frame=0, last_frame=449)
    virtual = make(8, WorldOptions(occlusions=(late,)))
    tracked = track(virtual.rig, virtual.body, virtual.frames(0, 1000), [])
    assert (tracked.status == FrameStatus.OK).all()
    # Free LEDs are offered spots every 50 ms, which is every 50th exposure here; the LED comes
    # with exposure 450.
    assert (tracked.dof[:450] == 2 * 11 - 6).all()
    assert (tracked.dof[500:] == 2 * 12 - 6).all()
    assert (tracked.seen[:450, 1] == 0b101111).all()
    assert (tracked.seen[500:, 1] == 0b111111).all()
    assert errors_mm(tracked, virtual).max() < WRONG_TIP_MM


def test_a_ghost_is_never_taken_for_a_late_led(make: Make) -> None:
    """A spot 1 px from the place of the hidden LED is a candidate, but does not fit."""
    virtual = make(9, WorldOptions.ideal())
    block = virtual.frames(0, 900)
    slot = virtual.truth.slots[0, 2]
    block.uv[:, 0, slot] += [1.0, 0.0]
    block.uv[:100, 0, slot] = np.nan
    tracked = track(virtual.rig, virtual.body, block, [])
    assert (tracked.status == FrameStatus.OK).all()
    assert (tracked.seen[:, 0] == 0b111011).all()


def test_a_foreign_probe_gives_no_tip(
    make: Make, recommended: Rig, thesis_probe: ProbeBody
) -> None:
    virtual = make(10, None)
    tracked = track(recommended, thesis_probe, virtual.frames(0, 400), [])
    assert (tracked.status == FrameStatus.UNIDENTIFIED).all()
    assert_consistent(tracked)


def test_a_moved_camera_is_doubted_not_believed(make: Make) -> None:
    virtual = make(11, None)
    block = virtual.frames(0, 900)
    # 2 px up: the rays of the two cameras no longer meet.
    block.uv[300:, 1, :, 1] += 2.0
    tracked = track(virtual.rig, virtual.body, block, [])
    assert (tracked.status[:300] == FrameStatus.OK).all()
    assert not (tracked.status[300:] == FrameStatus.OK).any()
