"""Raw recording: file format and reader.

A recording is one line of JSON (header with checksum), then chunks, one per block of frames. A
chunk is a head of 20 bytes, `_CHUNK`, and its frames in `frame_dtype`. The file only grows, so a
crash leaves a torn chunk at the end, which is skipped with a warning. Files damaged before the end
are refused, because the missing frames would be unknown.
"""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from bisect import bisect_right
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.frames import FrameBlock, frame_dtype, from_records
from ocmm_core.camera import MAX_CAMERAS, MAX_SLOTS, USUAL_SLOTS, Rig
from ocmm_core.documents import shortened
from ocmm_core.errors import AcquisitionError, InputError
from ocmm_core.side_files import open_guarded

SCHEMA = "ocmm.recording/2"
_FIRST_SCHEMA = "ocmm.recording/1"
"""For `USUAL_SLOTS`; still written so that older programs can read it."""
_MAGIC = b"OCRF"
_CHUNK = struct.Struct("<4sIIII")
"""Magic, sequence number, payload bytes, CRC-32 of the payload, CRC-32 of the 16 bytes before."""
_LONGEST_HEAD = 65536
_SHORTEST_NS, _LONGEST_NS = 1_000, 10_000_000_000
"""Limits of frame and cycle periods, ns."""


_COMPUTED = ("simulated", "EtherCAT, virtual wire")
"""Prefixes of virtual sources in recordings without the field `simulated`."""


class RecordingHead(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """Header of a recording."""

    schema: str
    source: str
    rig_name: str
    rig_identity: str
    """`rig_name`, `rig_identity`: name and SHA-256 of the rig document in use."""
    camera_serials: tuple[int, ...]
    frame_period_ns: int
    cycle_period_ns: int
    started_utc: str
    """ISO 8601 text."""
    simulated: bool = False
    """Frames of a virtual rig. Omitted if False, so that the checksum of older recordings holds."""
    n_slots: int = USUAL_SLOTS
    """Slots of every camera; omitted if `USUAL_SLOTS`, as above."""
    untimed: bool = False
    """Of cameras without proof of a common exposure time; omitted if False, as above."""

    @property
    def is_simulated(self) -> bool:
        """Return whether the frames are simulated, also in older recordings."""
        return self.simulated or self.source.startswith(_COMPUTED)


class _HeadLine(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    head: RecordingHead
    crc32: int


def schema_of(n_slots: int) -> str:
    """Return the schema of a recording with `n_slots` slots."""
    return _FIRST_SCHEMA if n_slots == USUAL_SLOTS else SCHEMA


def encode_head(head: RecordingHead) -> bytes:
    """Return the first line of a recording."""
    return msgspec.json.encode(_HeadLine(head, zlib.crc32(msgspec.json.encode(head)))) + b"\n"


def encode_chunk(sequence: int, payload: bytes) -> bytes:
    """Return chunk number `sequence` (0, 1, 2 ...) with the frames `payload`."""
    start = _CHUNK.pack(_MAGIC, sequence, len(payload), zlib.crc32(payload), 0)[:-4]
    return start + struct.pack("<I", zlib.crc32(start)) + payload


class Recording:
    """A recording, open for reading; close it or use it in ``with``; for one thread.

    Opening reads the heads of all chunks; frame checksums are verified on reading.
    AcquisitionError: the file is missing, unreadable, no recording, or damaged before its end.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.warning = ""
        """Why the end of the file was skipped; empty for a closed recording."""
        try:
            with os.fdopen(open_guarded(self.path), "rb") as stream:
                line = stream.readline(_LONGEST_HEAD)
                self.head = _decode_head(self.path, line)
                self._map = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError as error:
            raise AcquisitionError(
                "recording.unreadable",
                f"{self.path}: the recording cannot be read ({error.strerror}).",
                "Check the name and read permission.",
            ) from error
        self._dtype = frame_dtype(len(self.head.camera_serials), self.head.n_slots)
        self._offsets: list[int] = []
        self._starts = [0]
        try:
            self._scan(len(line))
        except BaseException:
            self._map.close()
            raise

    def __len__(self) -> int:
        return self._starts[-1]

    def read(self, start: int, limit: int) -> FrameBlock:
        """Return up to `limit` frames of one block; AcquisitionError: damaged; IndexError."""
        if not 0 <= start < len(self):
            msg = f"frame {start} of a recording with {len(self)} frames"
            raise IndexError(msg)
        chunk = bisect_right(self._starts, start) - 1
        payload = self._payload(chunk)
        if payload is None:
            raise self._damaged(self._offsets[chunk], f"the frames from {self._starts[chunk]} on")
        first = start - self._starts[chunk]
        return from_records(np.frombuffer(payload, self._dtype)[first : first + limit])

    def check_rig(self, rig: Rig) -> None:
        """Raise InputError unless the recorded cameras are those of `rig`, in order.

        A newer calibration of the same cameras is allowed: that is the purpose of recordings. The
        views of a tracker follow from its calibration, which must be the same.
        """
        if rig.markers is not None and rig.identity != self.head.rig_identity:
            raise InputError(
                "recording.tracker",
                f"{self.path}: the frames were read by another calibration or document of tracker "
                f"'{self.head.rig_name}' than the present one.",
                "Give the document and the records that it was recorded with, or record again.",
            )
        serials = self.head.camera_serials
        if len(serials) != len(rig.cameras):
            raise InputError(
                "recording.rig",
                f"{self.path}: the recording has {len(serials)} cameras, but rig '{rig.name}' has "
                f"{len(rig.cameras)}.",
                f"Give the recorded rig ('{self.head.rig_name}').",
            )
        for index, (serial, camera) in enumerate(zip(serials, rig.cameras, strict=True)):
            if serial != camera.serial:
                raise InputError(
                    "recording.rig",
                    f"{self.path}: camera {index + 1} of the recording has serial number {serial}, "
                    f"but camera '{camera.name}' of rig '{rig.name}' has {camera.serial}.",
                    f"Give the recorded rig ('{self.head.rig_name}').",
                )

    def close(self) -> None:
        """Close the file; idempotent."""
        self._map.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _scan(self, offset: int) -> None:
        while offset < len(self._map):
            head = self._chunk_head(offset)
            if head is None or offset + _CHUNK.size + head[1] > len(self._map):
                break
            sequence, length, _ = head
            if sequence != len(self._offsets) or length % self._dtype.itemsize:
                raise self._damaged(offset, f"block {len(self._offsets)}")
            self._offsets.append(offset)
            self._starts.append(self._starts[-1] + length // self._dtype.itemsize)
            offset += _CHUNK.size + length
        # The size of a file can reach the disk before its content.
        while self._offsets and self._payload(len(self._offsets) - 1) is None:
            self._starts.pop()
            offset = self._offsets.pop()
        if offset < len(self._map):
            self._cut(offset)

    def _cut(self, offset: int) -> None:
        follower = self._map.find(_MAGIC, offset + 1)
        while follower >= 0:
            head = self._chunk_head(follower)
            if head is not None and head[0] > len(self._offsets):
                raise self._damaged(offset, f"block {len(self._offsets)}")
            follower = self._map.find(_MAGIC, follower + 1)
        self.warning = (
            f"{self.path}: the recording was not finished; its last {len(self._map) - offset} "
            f"bytes are an incomplete block and were dropped after {len(self)} frames."
        )

    def _chunk_head(self, offset: int) -> tuple[int, int, int] | None:
        content = self._map[offset : offset + _CHUNK.size]
        if len(content) < _CHUNK.size:
            return None
        magic, sequence, length, payload_crc, head_crc = _CHUNK.unpack(content)
        if magic != _MAGIC or head_crc != zlib.crc32(content[:-4]):
            return None
        return sequence, length, payload_crc

    def _payload(self, chunk: int) -> bytes | None:
        offset = self._offsets[chunk]
        head = self._chunk_head(offset)
        if head is None:
            return None
        _, length, expected = head
        payload = self._map[offset + _CHUNK.size : offset + _CHUNK.size + length]
        return payload if zlib.crc32(payload) == expected else None

    def _damaged(self, offset: int, what: str) -> AcquisitionError:
        return AcquisitionError(
            "recording.damaged",
            f"{self.path}: {what} at byte {offset} cannot be read, although data follow.",
            "Restore the recording from a good copy.",
        )


def _periods_are_right(head: RecordingHead) -> bool:
    periods = (head.frame_period_ns, head.cycle_period_ns)
    return all(_SHORTEST_NS <= period <= _LONGEST_NS for period in periods)


def _decode_head(path: Path, line: bytes) -> RecordingHead:
    fault = ""
    try:
        found = msgspec.json.decode(line, type=_HeadLine)
    except msgspec.ValidationError:
        # Whole JSON of another kind: a later version or another file.
        fault = "is not a recording of this version"
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        fault = "is not a recording, or its first line is truncated"
    else:
        if not line.endswith(b"\n"):
            fault = "has a truncated first line"
        elif found.head.schema not in (_FIRST_SCHEMA, SCHEMA):
            fault = f"has the schema {shortened(found.head.schema)}, but {SCHEMA!r} is needed"
        elif found.crc32 != zlib.crc32(msgspec.json.encode(found.head)):
            fault = "has a damaged first line"
        elif not 1 <= len(found.head.camera_serials) <= MAX_CAMERAS:
            fault = f"has {len(found.head.camera_serials)} cameras"
        elif found.head.schema != schema_of(found.head.n_slots):
            fault = f"has {found.head.n_slots} slots, which {found.head.schema!r} has not"
        elif not _periods_are_right(found.head):
            fault = "has frames or cycles without a duration"
        elif not 1 <= found.head.n_slots <= MAX_SLOTS:
            fault = f"has {found.head.n_slots} slots, but this program follows {MAX_SLOTS}"
        else:
            return found.head
    raise AcquisitionError(
        "recording.foreign",
        f"{path}: the file {fault}.",
        "Choose a recording made by this program, or a good copy of it.",
    )
