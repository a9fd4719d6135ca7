"""A recording of two cameras as bytes, and all of one read."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.acquisition.recording._recording import (
    Recording,
    RecordingHead,
    encode_chunk,
    encode_head,
)


def sample_recording() -> bytes:
    """Return a recording of four frames in two chunks."""
    head = RecordingHead(
        schema="ocmm.recording/1", source="test", rig_name="rig", rig_identity="0", started_utc="",
        camera_serials=(1, 2), frame_period_ns=125_000, cycle_period_ns=1_000_000,
    )  # fmt: skip
    frame = 20 + 2 * (2 + 8 * 2 * 8)
    return encode_head(head) + encode_chunk(0, bytes(3 * frame)) + encode_chunk(1, bytes(frame))


def read_recording(path: Path) -> list[FrameBlock]:
    """Return all frames of a recording."""
    with Recording(path) as found:
        return [found.read(start, 64) for start in range(0, len(found), 64)]
