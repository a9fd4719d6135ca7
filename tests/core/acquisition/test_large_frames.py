"""Frames of sixteen cameras with 64 slots: virtual rig, ring, recording, replay, and tips."""

from __future__ import annotations

import json
import zlib
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock, FrameRing, SourceDescription
from ocmm_core.acquisition.recording import FrameRecorder, ReplaySource
from ocmm_core.acquisition.recording._recording import Recording
from ocmm_core.camera import MAX_CAMERAS, MAX_LEDS, Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import AcquisitionError
from ocmm_core.tracking import FrameStatus, TrackingPipeline, load_probe
from ocmm_sim.scene import SimulatedSource, VirtualRig, load_part
from tests.large_rig import write_probe, write_rig


@pytest.fixture
def virtual(tmp_path: Path) -> VirtualRig:
    rig = load_rig(write_rig(tmp_path, MAX_CAMERAS))
    probe = load_probe(write_probe(tmp_path, MAX_LEDS))
    part = load_part(resource("parts", "demo.toml"))
    return VirtualRig(rig, probe, part, (("BED", 1),), 1)


def same(one: FrameBlock, other: FrameBlock) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=name == "uv")
        for name in ("counter", "time_ns", "flags", "valid", "uv")
    )


def test_full_frames_pass_ring_and_recording_and_give_tips(
    virtual: VirtualRig, tmp_path: Path
) -> None:
    source = SimulatedSource(virtual)
    description = source.description
    assert description.n_slots == MAX_LEDS
    block = virtual.frames(0, 160)
    assert block.uv.shape == (160, MAX_CAMERAS, MAX_LEDS, 2)
    bits = (block.valid[..., None] >> np.arange(MAX_LEDS, dtype=np.uint64)) & np.uint64(1)
    np.testing.assert_array_equal(bits == 1, np.isfinite(block.uv).all(axis=3))
    # Each slot holds a spot in some camera, the last one as well: the highest bit is in use.
    assert bits.any(axis=(0, 1)).all()
    ring = FrameRing.create(MAX_CAMERAS, 200, MAX_LEDS)
    with FrameRecorder(tmp_path / "full.ocmr", description, virtual.rig) as recorder:
        for first in (0, 80):
            ring.write(virtual.frames(first, 80))
        passed = ring.read(200)
        assert passed is not None
        recorder.append(passed)
    ring.close()
    assert same(passed, block)
    replay = ReplaySource(tmp_path / "full.ocmr")
    assert replay.description.n_slots == MAX_LEDS
    replay.open()
    played = replay.read().frames
    replay.close()
    assert played is not None
    assert same(played, block)
    track = TrackingPipeline(virtual.rig, virtual.body).process(played)
    good = track.status == FrameStatus.OK
    assert good.mean() > 0.95
    error = track.tip_world[good] - virtual.motion(0, 160).tip_world[good]
    # Calibration (0.0017 mm a point), probe (0.002 mm a LED and at the tip) and the pattern of the
    # optics move all tips of a world alike, by some hundredths at the most; a wrong name, by
    # millimetres.
    assert np.linalg.norm(error, axis=1).max() < 0.1


def test_recordings_of_eight_slots_stay_as_they_were(
    tmp_path: Path, description: SourceDescription, rig: Rig
) -> None:
    FrameRecorder(tmp_path / "usual.ocmr", description, rig).close()
    line = json.loads((tmp_path / "usual.ocmr").read_text(encoding="utf-8"))
    assert line["head"]["schema"] == "ocmm.recording/1"
    assert "n_slots" not in line["head"]
    with Recording(tmp_path / "usual.ocmr") as recording:
        assert recording.head.n_slots == 8


@pytest.mark.parametrize(("old", "new"), [(b"recording/2", b"recording/1"), (b":64", b":65")])
def test_a_head_that_contradicts_its_frames_is_refused(
    virtual: VirtualRig, tmp_path: Path, old: bytes, new: bytes
) -> None:
    path = tmp_path / "full.ocmr"
    FrameRecorder(path, SimulatedSource(virtual).description, virtual.rig).close()
    line = path.read_bytes()
    start, end = line.index(b'{"head":') + 8, line.index(b',"crc32"')
    head = line[start:end].replace(old, new)
    path.write_bytes(b'{"head":' + head + b',"crc32":' + str(zlib.crc32(head)).encode() + b"}\n")
    with pytest.raises(AcquisitionError, match="slots") as caught:
        Recording(path)
    assert caught.value.code == "recording.foreign"


def test_a_ring_of_large_frames_does_not_take_all_memory() -> None:
    usual, large = FrameRing.create(2), FrameRing.create(MAX_CAMERAS, n_slots=MAX_LEDS)
    try:
        assert usual.capacity == 65536
        assert 8000 < large.capacity < 65536
        assert large.path.stat().st_size < 300e6
    finally:
        usual.close()
        large.close()
