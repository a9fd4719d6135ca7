from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import Rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Int
from ocmm_core.tracking import (
    FrameStatus,
    ProbeBody,
    TrackBlock,
    TrackingPipeline,
    join,
    load_probe,
)
from ocmm_core.tracking._strobe import NOT_NAMED, StrobeCode, StrobeReader, decode, is_lit
from ocmm_sim.scene import Part, ScriptedOcclusion, VirtualRig, WorldOptions

CODE = StrobeCode(16, np.array([0, 4, 8, 12]))
STROBE = "\n[strobe]\nperiod = 16\ndark = [0, 4, 8, 12]\n"
WRONG_TIP_MM = 1.0
"""Noise of one frame moves the tip by 0.1 mm; exchanged corners of the rectangle by over 100."""


def rectangle(tmp_path: Path, strobe: str = STROBE, leds: int = 4) -> Path:
    """Write the probe of the thesis without its rules, the document of a symmetric body."""
    text = resource("probes", "thesis.toml").read_text(encoding="utf-8")
    head, *entries = text.split("[[orientation_rules]]")[0].split("[[leds]]")
    path = tmp_path / "strobe.toml"
    path.write_text("[[leds]]".join([head, *entries[:leds]]) + strobe, encoding="utf-8")
    return path


@pytest.fixture
def coded(tmp_path: Path) -> ProbeBody:
    return load_probe(rectangle(tmp_path))


def virtual_rig(
    rig: Rig, body: ProbeBody, part: Part, options: WorldOptions | None = None
) -> VirtualRig:
    return VirtualRig(rig, body, part, (("BED", 2),), 5, options, 8000)


def track(body: ProbeBody, rig: Rig, block: FrameBlock, cuts: list[int]) -> TrackBlock:
    pipeline = TrackingPipeline(rig, body)
    rows = FrameBlock.__dataclass_fields__
    return join(
        [
            pipeline.process(FrameBlock(*(getattr(block, name)[a:b] for name in rows)))
            for a, b in pairwise([0, *cuts, len(block)])
        ]
    )


def watched(counter: Int) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return two cameras with LED 2, 0, 3, 1 in slots 1, 2, 5, 7 and a lamp in slot 4."""
    there = np.zeros((len(counter), 2, 8), dtype=bool)
    there[:, :, [1, 2, 5, 7]] = is_lit(CODE, counter)[:, None, [2, 0, 3, 1]]
    there[:, :, 4] = True
    return there


def test_every_slot_names_its_led_and_a_lamp_none() -> None:
    for start in range(1000, 1016):
        counter = np.arange(start, start + 40)
        found = decode(CODE, counter, watched(counter))
        assert found is not None
        expected = np.full(8, NOT_NAMED)
        expected[[1, 2, 5, 7]] = [2, 0, 3, 1]
        assert np.array_equal(found, [expected, expected])


def test_what_is_not_seen_for_two_periods_is_not_named() -> None:
    counter = np.arange(200, 240)
    there = watched(counter)
    assert decode(CODE, counter[:31], there[:31]) is None
    # A frame is missing.
    kept = np.arange(40) != 20
    assert decode(CODE, counter[kept], there[kept]) is None
    # Hidden for one frame more: two numbers at once are none.
    there[25, 0, 1] = False
    found = decode(CODE, counter, there)
    assert found is not None
    assert found[0, 1] == NOT_NAMED
    assert found[1, 1] == 2


@pytest.mark.parametrize("size", [1, 7, 16, 50])
def test_the_reader_sees_the_same_in_pieces(size: int) -> None:
    reader = StrobeReader(CODE)
    counter = np.arange(77, 200)
    there = watched(counter)
    for a in range(0, len(counter), size):
        part = slice(a, a + size)
        assert reader.gaps(counter[part]) == []
        found = reader.decode(counter[part], there[part])
        last = min(a + size, len(counter))
        wanted = decode(CODE, counter[:last], there[:last])
        # A label is best sought in a frame in which no LED is dark.
        if wanted is None or not is_lit(CODE, counter[last - 1 : last]).all():
            assert found is None
        else:
            assert found is not None
            assert np.array_equal(found, wanted)
        reader.remember(counter[part], there[part])
    assert reader.gaps(counter[-1:] + np.array([1, 2, 5])) == [2]
    assert reader.gaps(counter[-1:] + 2) == [0]


def test_a_symmetric_probe_with_a_code_needs_no_rule(tmp_path: Path) -> None:
    body = load_probe(rectangle(tmp_path))
    assert body.code is not None
    assert not body.rules
    with pytest.raises(InputError) as caught:
        load_probe(rectangle(tmp_path, ""))
    assert caught.value.code == "probe.ambiguous"
    three = load_probe(rectangle(tmp_path, STROBE.replace(", 12", ""), leds=3))
    assert three.n_leds == 3


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (("period = 16", "period = 3"), "strobe.period"),
        (("period = 16", "period = 65"), "strobe.period"),
        (("[0, 4, 8, 12]", "[0, 4, 8]"), "3 numbers"),
        (("[0, 4, 8, 12]", "[0, 4, 8, 8]"), "strobe.dark"),
        (("[0, 4, 8, 12]", "[0, 4, 8, 16]"), "strobe.dark"),
        (("[0, 4, 8, 12]", "[0, 4, 8, -1]"), "strobe.dark"),
    ],
)
def test_codes_that_name_nothing_are_refused(
    tmp_path: Path, change: tuple[str, str], named: str
) -> None:
    with pytest.raises(InputError) as caught:
        load_probe(rectangle(tmp_path, STROBE.replace(*change)))
    assert caught.value.code == "body.strobe"
    assert named in caught.value.what


@pytest.mark.parametrize("cuts", [[], list(range(8, 2000, 8))])
def test_the_rectangle_is_named_by_its_code_and_measured_in_every_frame(
    cuts: list[int], coded: ProbeBody, recommended: Rig, demo_part: Part
) -> None:
    virtual = virtual_rig(recommended, coded, demo_part)
    tracked = track(coded, recommended, virtual.frames(0, 2000), cuts)
    good = tracked.status == FrameStatus.OK
    named = int(np.argmax(good))
    # Two periods are 32 frames, 4 ms; no LED is dark in the last of them.
    assert named == 31
    assert good[named:].all()
    truth = virtual.motion(0, 2000).tip_world
    assert np.linalg.norm(tracked.tip_world[good] - truth[good], axis=1).max() < WRONG_TIP_MM
    # A quarter of the frames has one LED dark, in both cameras, and its number is the code's.
    assert coded.code is not None
    lit = is_lit(coded.code, tracked.counter[named:])
    bits = (lit * (1 << np.arange(4))).sum(axis=1)
    assert np.array_equal(tracked.seen[named + 500 :, 0], bits[500:])
    assert 0.2 < np.mean(~lit.all(axis=1)) < 0.3


def test_an_exchange_is_seen_by_the_code(
    coded: ProbeBody, recommended: Rig, demo_part: Part
) -> None:
    """Half a turn of the rectangle fits as well: only frames with dark LEDs distinguish them."""
    virtual = virtual_rig(recommended, coded, demo_part)
    block = virtual.frames(0, 1600)
    slots = virtual.truth.slots
    exchanged = block.uv.copy()
    for camera in range(2):
        exchanged[800:, camera, slots[camera]] = block.uv[800:, camera, slots[camera, [3, 2, 1, 0]]]
    # The slots change places while a few frames are missing.
    kept = np.r_[0:800, 810:1600]
    block = replace(block, uv=exchanged)
    block = FrameBlock(*(getattr(block, name)[kept] for name in FrameBlock.__dataclass_fields__))
    tracked = track(coded, recommended, block, [300])
    good = tracked.status == FrameStatus.OK
    truth = virtual.motion(0, 1600).tip_world[kept]
    assert np.linalg.norm(tracked.tip_world[good] - truth[good], axis=1).max() < WRONG_TIP_MM
    assert not good[800:831].any()
    assert good[-500:].all()


def test_lights_that_are_out_of_step_give_no_tip(
    coded: ProbeBody, recommended: Rig, demo_part: Part
) -> None:
    virtual = virtual_rig(recommended, coded, demo_part)
    block = virtual.frames(0, 1600)
    late = replace(block, counter=block.counter + 3)
    assert not (track(coded, recommended, late, []).status == FrameStatus.OK).any()


def test_three_leds_with_a_code_are_named(
    tmp_path: Path, recommended: Rig, demo_part: Part
) -> None:
    body = load_probe(rectangle(tmp_path, STROBE.replace(", 12", ""), leds=3))
    hidden = ScriptedOcclusion(camera=-1, leds=(0, 1, 2), first_frame=900, last_frame=1000)
    virtual = virtual_rig(recommended, body, demo_part, WorldOptions(occlusions=(hidden,)))
    tracked = track(body, recommended, virtual.frames(0, 2000), [1000])
    good = tracked.status == FrameStatus.OK
    truth = virtual.motion(0, 2000).tip_world
    assert np.linalg.norm(tracked.tip_world[good] - truth[good], axis=1).max() < WRONG_TIP_MM
    lit = is_lit(StrobeCode(16, CODE.dark[:3]), tracked.counter).all(axis=1)
    # With one of three dark nothing can be measured.
    assert not good[~lit].any()
    assert good[lit][-300:].all()


def test_labels_that_went_wrong_unseen_are_thrown_away_within_a_period(
    coded: ProbeBody, recommended: Rig, demo_part: Part
) -> None:
    """All four slots of both cameras exchanged at once, and no frame missing: nothing does that."""
    virtual = virtual_rig(recommended, coded, demo_part)
    block = virtual.frames(0, 1600)
    slots = virtual.truth.slots
    exchanged = block.uv.copy()
    for camera in range(2):
        exchanged[800:, camera, slots[camera]] = block.uv[800:, camera, slots[camera, [3, 2, 1, 0]]]
    tracked = track(coded, recommended, replace(block, uv=exchanged), [])
    good = tracked.status == FrameStatus.OK
    truth = virtual.motion(0, 1600).tip_world
    wrong = np.linalg.norm(tracked.tip_world - truth, axis=1) > WRONG_TIP_MM
    assert not wrong[:800].any()
    assert not wrong[816:].any()
    assert good[1000:].all()
