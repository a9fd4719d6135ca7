"""Spots of the virtual rig: pure functions of the frame number, and true to the world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.camera import Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.scene import (
    Part,
    RigScript,
    ScriptedOcclusion,
    VirtualRig,
    WorldOptions,
    decode_script,
)

MakeRig = Callable[..., VirtualRig]

EVERYTHING = WorldOptions(occlusion_rate_hz=2.0)


def spots_by_led(rig: VirtualRig, camera: int, uv: Float) -> Float:
    return uv[:, rig.truth.slots[camera]]


@pytest.mark.parametrize("cuts", [[1] * 5 + [0] + [75, 80, 81, 33, 226], [500], [7] * 71 + [3]])
def test_frames_do_not_depend_on_the_blocks_they_are_asked_in(
    make_rig: MakeRig, cuts: list[int]
) -> None:
    rig = make_rig(options=EVERYTHING)
    first = 7_973
    whole = make_rig(options=EVERYTHING).frames(first, 500)
    assert sum(cuts) == 500
    for count in cuts:
        piece = rig.frames(first, count)
        at = slice(first - 7_973, first - 7_973 + count)
        np.testing.assert_array_equal(piece.uv, whole.uv[at])
        np.testing.assert_array_equal(piece.valid, whole.valid[at])
        np.testing.assert_array_equal(piece.flags, whole.flags[at])
        np.testing.assert_array_equal(piece.counter, whole.counter[at])
        np.testing.assert_array_equal(piece.time_ns, piece.counter * 125_000)
        first += count


def test_one_camera_sees_what_it_sees_in_the_joined_frames(make_rig: MakeRig) -> None:
    rig = make_rig(options=EVERYTHING)
    joined = rig.frames(17_000, 1000)
    for camera in range(2):
        valid, flags, uv = rig.camera_frames(camera, 17_000, 1000)
        assert valid.dtype == flags.dtype == np.dtype(np.uint16)
        assert uv.shape == (1000, 8, 2)
        np.testing.assert_array_equal(valid, joined.valid[:, camera])
        np.testing.assert_array_equal(uv, joined.uv[:, camera])
        np.testing.assert_array_equal(flags, joined.flags)


def test_a_rig_built_from_its_script_in_words_sees_the_same(make_rig: MakeRig) -> None:
    options = WorldOptions(occlusions=(ScriptedOcclusion(1, (0, 3), 5, 9),))
    script = RigScript(
        rig=str(resource("rigs", "recommended.toml")),
        probe=str(resource("probes", "standard.toml")),
        part=str(resource("parts", "demo.toml")),
        touches=(("BED", 2), ("SPHERE", 2)),
        seed=1,
        options=options,
    )
    built = decode_script(script.to_json(), RigScript).build()
    here = make_rig(options=options)
    assert built.n_frames == here.n_frames
    np.testing.assert_array_equal(
        built.camera_frames(1, 0, 20_000)[2], here.camera_frames(1, 0, 20_000)[2]
    )


@pytest.mark.parametrize("text", ["", "{}", '{"rig": 1}', "not json"])
def test_a_script_that_cannot_be_read_says_so(text: str) -> None:
    with pytest.raises(InputError, match="script of the virtual rig cannot be read"):
        decode_script(text, RigScript)


def test_spots_are_the_projections_of_the_true_leds(make_rig: MakeRig) -> None:
    rig = make_rig(options=WorldOptions(white_noise=False, pattern_noise=False))
    truth = rig.truth
    motion = rig.motion(0, 40_000)
    leds_world = (
        np.einsum("nij,lj->nli", motion.rotation_world_from_probe, truth.leds_probe)
        + motion.origin_world(truth.tip_probe)[:, None]
    )
    block = rig.frames(0, 40_000)
    for camera, model in enumerate(truth.cameras):
        uv = spots_by_led(rig, camera, block.uv[:, camera])
        # Two ways to the same pixel differ by rounding only.
        np.testing.assert_allclose(uv, project(model, leds_world), rtol=0, atol=1e-9)


def test_the_true_tip_is_where_the_ball_is(make_rig: MakeRig) -> None:
    rig = make_rig()
    motion = rig.motion(0, 1000)
    tip = motion.origin_world(rig.truth.tip_probe) + (
        motion.rotation_world_from_probe @ rig.truth.tip_probe
    )
    np.testing.assert_allclose(tip, motion.tip_world, atol=1e-10)


def test_attitudes_are_rotations(make_rig: MakeRig) -> None:
    rotation = make_rig().motion(0, 50_000).rotation_world_from_probe
    identity = np.broadcast_to(np.eye(3), rotation.shape)
    np.testing.assert_allclose(rotation @ rotation.transpose(0, 2, 1), identity, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-12)


def test_valid_bits_and_numbers_agree(make_rig: MakeRig) -> None:
    block = make_rig(options=EVERYTHING).frames(0, 20_000)
    bits = (block.valid[..., None] >> np.arange(8, dtype=np.uint64)) & np.uint64(1)
    np.testing.assert_array_equal(bits == 1, np.isfinite(block.uv).all(axis=3))
    assert 0 < bits.sum() < block.valid.size * 6


def test_slots_are_shuffled_between_cameras_and_seeds(make_rig: MakeRig) -> None:
    slots = {make_rig(seed=seed).truth.slots.tobytes() for seed in range(10)}
    assert len(slots) == 10
    assert not np.array_equal(*make_rig(seed=0).truth.slots)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"seed": -1}, "seed is -1"),
        ({"seed": 2**63}, "seed is 9223372036854775808"),
        ({"frame_rate_hz": -5}, "frame rate of the virtual rig is -5 Hz"),
        ({"frame_rate_hz": 0}, "frame rate of the virtual rig is 0 Hz"),
        ({"touches": [("BED", 0)]}, "Feature 'BED' is set to be touched 0 times"),
        ({"touches": [("BORE_X", 3)]}, "has no feature 'BORE_X'"),
    ],
)
def test_what_cannot_be_simulated_is_refused(
    make_rig: MakeRig, arguments: dict[str, object], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        make_rig(**arguments)


def test_a_ball_that_does_not_enter_the_bore_is_refused(
    recommended: Rig, standard: ProbeBody, demo_part: Part
) -> None:
    body = replace(standard, tip_radius=11.0)
    with pytest.raises(InputError, match=r"'BORE_A' of 20\.009 mm is too narrow"):
        VirtualRig(recommended, body, demo_part, [("BORE_A", 3)], 1)


def test_every_led_is_seen_wherever_the_part_is_touched(
    recommended: Rig, standard: ProbeBody, demo_part: Part, every_surface: tuple[tuple[str, int]]
) -> None:
    for rig in (recommended, load_rig(resource("rigs", "thesis.toml"))):
        for body in (standard, load_probe(resource("probes", "thesis.toml"))):
            for seed in range(3):
                virtual = VirtualRig(rig, body, demo_part, every_surface, seed, None, 100)
                block = virtual.frames(0, virtual.n_frames)
                assert np.all(np.bitwise_count(block.valid) == body.n_leds)
                low, high = rig.volume_world
                for touch in virtual.truth.touches:
                    assert np.all((touch.tip_world > low) & (touch.tip_world < high))


def test_an_led_outside_its_emission_cone_is_not_seen(
    recommended: Rig, standard: ProbeBody, demo_part: Part
) -> None:
    # All LEDs but one turned away by an angle just below and just above the limit.
    rig = VirtualRig(recommended, standard, demo_part, [("BED", 1)], 1, WorldOptions.ideal())
    leds = standard.leds_probe + rig.motion(0, 1).origin_world(standard.tip_probe)
    rays = recommended.cameras[0].centre_world - leds
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    side = np.cross(rays, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    for angle, seen in ((59.0, 6), (61.0, 0)):
        turned = np.stack(
            [
                rotation_from_vector(np.radians(angle) * axis) @ ray
                for axis, ray in zip(side, rays, strict=True)
            ]
        )
        body = replace(standard, led_directions_probe=turned)
        virtual = VirtualRig(recommended, body, demo_part, [("BED", 1)], 1, WorldOptions.ideal())
        assert np.bitwise_count(virtual.camera_frames(0, 0, 1)[0])[0] == seen


def test_an_led_beside_the_sensor_is_not_seen(
    recommended: Rig, standard: ProbeBody, demo_part: Part
) -> None:
    small = replace(recommended, cameras=tuple(replace(c, height=800) for c in recommended.cameras))
    virtual = VirtualRig(small, standard, demo_part, [("BED", 3)], 1, WorldOptions.ideal())
    whole = VirtualRig(recommended, standard, demo_part, [("BED", 3)], 1, WorldOptions.ideal())
    cut, full = virtual.frames(0, 20_000), whole.frames(0, 20_000)
    inside = full.uv[..., 1] <= 799
    np.testing.assert_array_equal(np.isfinite(cut.uv[..., 1]), inside)
    assert 0 < inside.sum() < inside.size * 6 / 8


def test_a_scripted_occlusion_hides_these_leds_from_this_camera_in_these_frames(
    make_rig: MakeRig,
) -> None:
    options = WorldOptions(occlusions=(ScriptedOcclusion(1, (0, 4), 100, 149),))
    rig, free = make_rig(options=options), make_rig()
    block, all_seen = rig.frames(0, 300), free.frames(0, 300)
    np.testing.assert_array_equal(block.uv[:, 0], all_seen.uv[:, 0])
    uv = spots_by_led(rig, 1, block.uv[:, 1])[..., 0]
    expected = np.ones((300, 6), dtype=bool)
    expected[100:150, [0, 4]] = False
    np.testing.assert_array_equal(np.isfinite(uv), expected)


def test_random_occlusions_come_at_their_rate_and_last_as_long_as_they_should(
    make_rig: MakeRig,
) -> None:
    touches = [("BED", 9), ("PLATE_TOP", 9), ("CYLINDER", 12)] * 3
    rig = make_rig(touches, options=WorldOptions(occlusion_rate_hz=0.5), frame_rate_hz=1000)
    hidden = ~np.isfinite(
        np.concatenate(
            [
                spots_by_led(rig, camera, rig.camera_frames(camera, 0, rig.n_frames)[2])[..., 0]
                for camera in range(2)
            ],
            axis=1,
        )
    )
    begins = (~hidden[:-1] & hidden[1:]).sum(axis=0)
    hours = hidden.size / 1000.0
    # Events overlap in 0.5 x 0.175 = 8 % of cases; the count scatters by its square root.
    expected = 0.5 * hours
    assert 0.85 * expected - 4 * np.sqrt(expected) < begins.sum() < expected + 4 * expected**0.5
    # P(hidden) = 1 - exp(-rate x mean duration).
    assert hidden.mean() == pytest.approx(1.0 - np.exp(-0.5 * 0.175), rel=0.15)


def test_more_touches_leave_the_past_as_it_was(make_rig: MakeRig) -> None:
    rig = make_rig()
    end = rig.n_frames
    before = rig.frames(0, end)
    rig.extend([("SPHERE", 3), ("CORNER", 1)], after_frame=end + 4000)
    np.testing.assert_array_equal(rig.frames(0, end).uv, before.uv)
    touches = rig.truth.touches
    assert [touch.feature for touch in touches[4:]] == ["SPHERE"] * 3 + ["CORNER"]
    assert touches[4].first_frame > end + 4000
    assert rig.n_frames > touches[-1].last_frame + 4000
    places = np.array([touch.tip_world for touch in touches if touch.feature == "SPHERE"])
    gaps = np.linalg.norm(places[:, None] - places[None], axis=2)[np.triu_indices(5, 1)]
    assert gaps.min() > 0.01, "a repeated touch goes to a new place"


def test_a_lower_frame_rate_sees_the_same_motion(make_rig: MakeRig) -> None:
    slow, fast = make_rig(frame_rate_hz=500), make_rig()
    assert slow.frame_period_ns == 2_000_000
    a, b = slow.motion(0, 4000), fast.motion(0, 64_000)
    np.testing.assert_allclose(a.tip_world, b.tip_world[::16], atol=1e-9)
    ours, theirs = slow.truth.touches[-1], fast.truth.touches[-1]
    assert ours.contact_s == theirs.contact_s
    assert 16 * ours.first_frame == pytest.approx(theirs.first_frame, abs=16)


def test_the_button_is_down_once_in_every_touch(make_rig: MakeRig) -> None:
    rig = make_rig([("BED", 5), ("BORE_A", 4)])
    flags = rig.frames(0, rig.n_frames).flags
    pressed = np.flatnonzero(np.diff(flags & FrameFlag.BUTTON) == 1) + 1
    touches = rig.truth.touches
    assert len(pressed) == len(touches)
    for frame, touch in zip(pressed, touches, strict=True):
        assert touch.first_frame < frame < touch.last_frame
        assert frame / 8000.0 == pytest.approx(touch.contact_s + 0.10, abs=1.5 / 8000.0)


def test_a_drop_is_felt_for_a_second_by_every_camera(make_rig: MakeRig) -> None:
    rig = make_rig([("BED", 1)], options=WorldOptions(drops=(1200,)))
    felt = rig.frames(0, 10_000).flags & FrameFlag.DROPPED
    assert np.flatnonzero(felt).tolist() == list(range(1200, 9200))
    _, flags, _ = rig.camera_frames(1, 1199, 2)
    assert (flags & FrameFlag.DROPPED).tolist() == [0, FrameFlag.DROPPED]
