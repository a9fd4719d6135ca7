"""The tip relative to a reference body: right after any nudge, honest, and never without it."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from benchmarks.reference import FRAMES, PLACE, Bench, measure, resting, share_inside
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import N_PARAMETERS, Rig
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.tracking import (
    ARRAYS,
    FrameStatus,
    TrackBlock,
    TrackingPipeline,
    home_of,
    in_rig,
    join,
    load_reference,
    ordered_spots,
    pick,
    relative_sensitivity,
    simultaneous,
)
from ocmm_core.tracking._reference import HOME_NS
from ocmm_sim.scene import ScriptedNudge, ScriptedOcclusion, VirtualRig, WorldOptions

NUDGE = ScriptedNudge(4000, 0, (0.6e-3, -0.6e-3, 0.6e-3), (0.6, -0.6, 0.6))
HOME = round(HOME_NS * 8000 / 1e9) + 1
"""Frames until the first place is determined, at 8 kHz."""


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench.of("standard4")


def world_of(bench: Bench, options: WorldOptions, seed: int = 3) -> VirtualRig:
    return VirtualRig(
        bench.rig, bench.body, bench.part, [], seed, options, reference=bench.reference
    )


def frames_of(world: VirtualRig, count: int) -> FrameBlock:
    pieces = [
        world.frames_of(resting(world, PLACE, np.zeros(3), first), first)
        for first in range(0, count, FRAMES)
    ]
    return FrameBlock(
        *(
            np.concatenate([getattr(piece, name) for piece in pieces])
            for name in FrameBlock.__dataclass_fields__
        )
    )


def part_of(block: FrameBlock, start: int, stop: int) -> FrameBlock:
    return FrameBlock(
        *(getattr(block, name)[start:stop] for name in FrameBlock.__dataclass_fields__)
    )


def track(bench: Bench, block: FrameBlock, cuts: list[int] | None = None) -> TrackBlock:
    pipeline = TrackingPipeline(bench.rig, bench.body, reference=bench.reference)
    edges = [0, *(cuts or []), len(block)]
    return join([pipeline.process(part_of(block, a, b)) for a, b in pairwise(edges) if b > a])


def test_a_nudge_does_not_move_the_tip(bench: Bench) -> None:
    ideal = replace(WorldOptions.ideal(), nudges=(NUDGE,))
    tracked = track(bench, frames_of(world_of(bench, ideal), 8000))
    assert (tracked.status[:HOME] == FrameStatus.REFERENCE_LOST).all()
    assert np.isnan(tracked.tip_world[:HOME]).all()
    after = slice(HOME, None)
    assert (tracked.status[after] == FrameStatus.OK).all()
    # The rest is the Gauss-Newton step and the filter on noise-free numbers.
    assert np.abs(tracked.tip_world[after] - PLACE).max() < 2e-4
    assert np.abs(simultaneous(tracked).tip_world[after] - PLACE).max() < 2e-4
    # Attitude and origin of the probe are in the same world.
    tips = (
        np.einsum("nij,j->ni", tracked.rotation_world_from_probe[after], bench.body.tip_probe)
        + tracked.origin_world[after]
    )
    assert np.allclose(tips, tracked.tip_world[after], atol=1e-9)
    # The cameras saw a movement of a millimetre, and determine the measuring volume.
    moved = in_rig(tracked).tip_world[-1] - PLACE
    assert 0.8 < np.linalg.norm(moved) < 1.4


def test_the_stated_covariance_is_that_of_the_frames(bench: Bench) -> None:
    world = world_of(bench, replace(WorldOptions.ideal(), white_noise=True))
    quiet = replace(bench.rig, noise=msgspec.structs.replace(bench.rig.noise, pattern_px=0.0))
    tracked = pick(track(replace(bench, rig=quiet), frames_of(world, 12_000)), slice(4000, None))
    assert (tracked.status == FrameStatus.OK).all()
    for block in (tracked, simultaneous(tracked)):
        error = block.tip_world - block.tip_world.mean(axis=0)
        squares = np.einsum("ni,nij,nj->n", error, np.linalg.inv(block.tip_covariance), error)
        # Mean of 8,000 values of chi-square with three degrees: 3 +- 0.027; 5 % is seven sigma.
        assert np.mean(squares) == pytest.approx(3.0, rel=0.05)
    one = np.trace(simultaneous(tracked).tip_covariance.mean(axis=0))
    averaged = np.trace(tracked.tip_covariance.mean(axis=0))
    alone = np.trace(in_rig(tracked).tip_covariance.mean(axis=0))
    assert alone < averaged < 1.02 * alone < one


def test_points_after_a_nudge_are_as_uncertain_as_stated(bench: Bench) -> None:
    found = [measure(bench, seed, replace(NUDGE, first_frame=FRAMES)) for seed in range(8)]
    error = np.concatenate([item.error for item in found])
    # 8 worlds of 6 points: the largest of 144 correlated numbers stays below 4.5 sigma.
    z = np.concatenate([item.error / np.sqrt(np.diag(item.covariance)) for item in found])
    assert np.abs(z).max() < 4.5
    assert share_inside(found) > 0.85
    assert np.sqrt(np.mean(error**2)) < 0.015
    plain = np.concatenate([item.plain for item in found])
    assert np.sqrt(np.mean(plain**2)) > 0.4


def test_derivatives_agree_with_finite_differences(bench: Bench) -> None:
    # Spots without noise: the derivatives leave out what residuals do to them.
    far = replace(NUDGE, turn=(0.03, -0.02, 0.03), shift=(30.0, -10.0, 20.0))
    world = world_of(bench, replace(WorldOptions.ideal(), nudges=(far,)))
    truth = world.truth
    first = world.frames_of(resting(world, PLACE, np.zeros(3), 0), 0).uv[:1]
    later = world.frames_of(resting(world, PLACE, np.full(3, 0.1), 6000), 6000).uv[:1]
    spots = ordered_spots(later, truth.slots)[0]
    beside = ordered_spots(later, truth.reference_slots)[0]
    at_home = ordered_spots(first, truth.reference_slots)[0]

    def tip(rig: Rig, leds: Float, probe: Float, now: Float, then: Float) -> Float:
        body = replace(bench.reference, leds=replace(bench.reference.leds, leds_body=leds))
        home = home_of(then, 1, rig, body)
        return relative_sensitivity(probe, now, home, rig, bench.body, body).tip_world

    leds = bench.reference.leds.leds_body
    home = home_of(at_home, FRAMES, bench.rig, bench.reference)
    found = relative_sensitivity(spots, beside, home, bench.rig, bench.body, bench.reference)
    place = tip(bench.rig, leds, spots, beside, at_home)
    assert np.allclose(found.tip_world, place, atol=1e-9)

    # Cameras: all three poses answer to the same change.
    for index in (0, 4, 8, N_PARAMETERS + 1, N_PARAMETERS + 6):
        sigma = np.sqrt(bench.rig.parameter_covariance[index, index])
        change = np.zeros((2, N_PARAMETERS))
        change.ravel()[index] = sigma
        cameras = tuple(
            camera.perturbed(row) for camera, row in zip(bench.rig.cameras, change, strict=True)
        )
        moved = tip(replace(bench.rig, cameras=cameras), leds, spots, beside, at_home) - place
        # Derivatives are of truth minus belief: a changed belief moves the estimate back.
        close = 0.01 * np.abs(moved).max()
        assert np.allclose(moved, -found.by_cameras[:, index] * sigma, rtol=0.0, atol=close)

    # Spots: of the probe, of the reference body now, and at home.
    n_probe, n_beside = (int(np.isfinite(uv[..., 0]).sum()) for uv in (spots, beside))
    for which, row in ((0, 0), (1, n_probe), (2, n_probe + n_beside)):
        scenes = [spots.copy(), beside.copy(), at_home.copy()]
        camera, led = np.argwhere(np.isfinite(scenes[which][..., 0]))[0]
        scenes[which][camera, led, 0] += 1e-3
        moved = tip(bench.rig, leds, *scenes) - place
        assert np.allclose(moved, 1e-3 * found.by_spots[:, row, 0], rtol=0.02, atol=1e-7)

    # LEDs of the reference body: only what does not cancel between now and home.
    step = 1e-2
    numeric = np.empty((3, leds.size))
    for index in range(leds.size):
        changed = leds.copy()
        changed.ravel()[index] += step
        numeric[:, index] = (tip(bench.rig, changed, spots, beside, at_home) - place) / step
    sigma = np.sqrt(bench.reference.geometry_covariance[0, 0])
    # Each column is a standard deviation, of either sign, and only their covariance counts.
    common = found.by_common[:, : leds.size]
    expected = sigma**2 * numeric @ numeric.T
    assert np.allclose(common @ common.T, expected, rtol=0.02, atol=0.01 * np.abs(expected).max())


def test_at_rest_what_is_wrong_with_the_cameras_cancels(bench: Bench) -> None:
    world = world_of(bench, WorldOptions())
    frames = world.frames_of(resting(world, PLACE, np.zeros(3), 0), 0).uv
    spots = ordered_spots(frames, world.truth.slots).mean(axis=0)
    beside = ordered_spots(frames, world.truth.reference_slots).mean(axis=0)
    home = home_of(beside, FRAMES, bench.rig, bench.reference)
    relative = relative_sensitivity(spots, beside, home, bench.rig, bench.body, bench.reference)
    n_probe = int(np.isfinite(spots[..., 0]).sum())
    n = (relative.by_spots.shape[1] - n_probe) // 2
    now, then = relative.by_spots[:, n_probe : n_probe + n], relative.by_spots[:, n_probe + n :]
    assert np.allclose(now, -then, atol=1e-9)
    assert np.abs(relative.by_common[:, :12]).max() < 1e-9


def test_a_jump_is_followed_in_its_own_frame(bench: Bench) -> None:
    world = world_of(bench, replace(WorldOptions(), nudges=(NUDGE,)))
    tracked = track(bench, frames_of(world, 6000))
    seen = tracked.reference
    assert seen is not None
    step = NUDGE.first_frame
    # The mean over 2,000 frames has hardly any noise; from the jump on it is that of one frame.
    ratio = np.trace(tracked.tip_covariance, axis1=1, axis2=2) / np.trace(
        in_rig(tracked).tip_covariance, axis1=1, axis2=2
    )
    assert ratio[step - 1] < 1.01
    assert ratio[step] > 1.2
    assert ratio[step + 200] < 1.02
    z = np.einsum(
        "ni,nij,nj->n",
        tracked.tip_world[step - 50 : step + 50] - PLACE,
        np.linalg.inv(tracked.tip_covariance[step - 50 : step + 50]),
        tracked.tip_world[step - 50 : step + 50] - PLACE,
    )
    assert z.max() < 45.0


@pytest.mark.parametrize("speed_mm_s", [0.05, 0.5, 5.0])
def test_a_drifting_table_is_followed_without_lag_in_points(
    bench: Bench, speed_mm_s: float
) -> None:
    # Two seconds of minimum jerk.
    drift = ScriptedNudge(4000, 16_000, (0.0, 0.0, 0.0), (2.0 * speed_mm_s / 1.875, 0.0, 0.0))
    world = world_of(bench, replace(WorldOptions.ideal(), white_noise=True, nudges=(drift,)))
    tracked = pick(track(bench, frames_of(world, 20_000)), slice(6000, 18_000))
    means = simultaneous(tracked).tip_world.reshape(6, 2000, 3).mean(axis=1)
    # The mean of 2,000 frames of 40 um has 1 um; nothing else moves it.
    assert np.abs(means - PLACE).max() < 0.005
    # The live position may lag by what no test sees yet: a third of the noise of one frame.
    live = tracked.tip_world.reshape(60, 200, 3).mean(axis=1)
    assert np.abs(live - PLACE).max() < 0.030


def test_the_result_does_not_depend_on_how_the_stream_is_cut(bench: Bench) -> None:
    hidden = ScriptedOcclusion(0, (4, 5), 5000, 5400)
    options = WorldOptions(nudges=(NUDGE,), occlusions=(hidden,))
    block = frames_of(world_of(bench, options), 8000)
    rng = np.random.default_rng(1)
    whole = track(bench, block)
    assert {FrameStatus.OK, FrameStatus.REFERENCE_LOST} <= {*map(FrameStatus, whole.status)}
    for cuts in ([1999, 2000, 2001, 4000], sorted(rng.choice(8000, 40, replace=False).tolist())):
        pieces = track(bench, block, cuts)
        for name in ARRAYS:
            assert getattr(whole, name).tobytes() == getattr(pieces, name).tobytes(), name


@pytest.mark.parametrize(
    ("camera", "leds", "lost"),
    [(0, (4,), False), (0, (4, 5), True), (1, (4, 5, 6, 7), True), (-1, (4, 5, 6, 7), True)],
)
def test_without_enough_of_the_reference_body_there_is_no_tip(
    bench: Bench, camera: int, leds: tuple[int, ...], lost: bool
) -> None:
    hidden = ScriptedOcclusion(camera, leds, 4000, 4999)
    world = world_of(bench, WorldOptions(occlusions=(hidden,)))
    tracked = track(bench, frames_of(world, 6000))
    during = tracked.status[4000:5000]
    assert (during == (FrameStatus.REFERENCE_LOST if lost else FrameStatus.OK)).all()
    assert np.isfinite(tracked.tip_world[4000:5000]).any() != lost
    # The probe itself is followed on.
    assert (in_rig(tracked).status[4000:5000] == FrameStatus.OK).all()
    assert (tracked.status[-500:] == FrameStatus.OK).all()
    assert np.abs(tracked.tip_world[-500:].mean(axis=0) - PLACE).max() < 0.05


def test_a_reference_body_that_is_bent_gives_no_tip(bench: Bench) -> None:
    block = frames_of(world_of(bench, WorldOptions()), 6000)
    slots = world_of(bench, WorldOptions()).truth.reference_slots
    for camera in range(2):
        block.uv[4000:, camera, slots[camera, 1], 0] += 1.0
        block.uv[4000:, camera, slots[camera, 2], 1] += 1.0
    tracked = track(bench, block)
    assert (tracked.status[4000:] == FrameStatus.REFERENCE_LOST).all()
    seen = tracked.reference
    assert seen is not None
    assert (seen.body.status[4000:4030] == FrameStatus.DOUBTFUL).all()


def test_the_first_place_is_not_taken_while_the_table_moves(bench: Bench) -> None:
    moving = ScriptedNudge(0, 6000, (0.0, 0.0, 0.0), (5.0, 0.0, 0.0))
    tracked = track(bench, frames_of(world_of(bench, WorldOptions(nudges=(moving,))), 12_000))
    ready = int(np.argmax(tracked.status == FrameStatus.OK))
    assert 5500 < ready < 8000 + HOME
    assert (tracked.status[ready:] == FrameStatus.OK).all()


def test_a_given_first_place_is_kept(bench: Bench) -> None:
    world = world_of(bench, WorldOptions())
    before = track(bench, frames_of(world, 4000))
    assert before.reference is not None
    home = before.reference.home
    nudged = world_of(bench, WorldOptions(nudges=(replace(NUDGE, first_frame=0),)))
    pipeline = TrackingPipeline(bench.rig, bench.body, reference=bench.reference, home=home)
    tracked = pipeline.process(frames_of(nudged, 2000))
    assert (tracked.status == FrameStatus.OK).all()
    assert pipeline.home is home
    assert np.abs(tracked.tip_world.mean(axis=0) - PLACE).max() < 0.05


@pytest.mark.parametrize("seed", [1, 2])
def test_random_occlusions_of_both_bodies_never_give_a_wrong_tip(bench: Bench, seed: int) -> None:
    slow = ScriptedNudge(6000, 2000, (1e-3, -1e-3, 0.5e-3), (1.0, -0.5, 0.5))
    options = WorldOptions(nudges=(slow,), occlusion_rate_hz=0.4)
    script = [("BED", 4), ("BLOCK_TOP", 4)]
    world = VirtualRig(
        bench.rig, bench.body, bench.part, script, seed, options, 1000, bench.reference
    )
    still = VirtualRig(
        bench.rig, bench.body, bench.part, script, seed, WorldOptions(), 1000, bench.reference
    )
    pipeline = TrackingPipeline(bench.rig, bench.body, reference=bench.reference)
    n = 10_000
    tracked = join([pipeline.process(world.frames(first, 100)) for first in range(0, n, 100)])
    good = tracked.status == FrameStatus.OK
    error = tracked.tip_world[good] - still.motion(0, n).tip_world[good]
    squares = np.einsum("ni,nij,nj->n", error, np.linalg.inv(tracked.tip_covariance[good]), error)
    # Errors of cameras and probe, 10 um, come on top of the noise of 40 um that is stated.
    assert np.sqrt(squares.max()) < 6.5
    assert np.mean(good) > 0.4
    assert np.mean(tracked.status == FrameStatus.REFERENCE_LOST) > 0.02


def test_a_reference_body_is_known_by_its_file() -> None:
    path = resource("references", "plate.toml")
    body = load_reference(path)
    assert body.identity == hashlib.sha256(path.read_bytes()).hexdigest()
    assert body.text.encode() == path.read_bytes()
