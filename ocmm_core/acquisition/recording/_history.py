"""Last seconds of raw frames in memory, for support bundles."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import (
    FrameBlock,
    SourceDescription,
    frame_dtype,
    from_records,
    to_records,
)
from ocmm_core.acquisition.recording._recorder import FRAMES_PER_READ, FrameRecorder
from ocmm_core.camera import Rig

HISTORY_S = 30.0
MOST_BYTES = 96 << 20
"""30 s of two cameras at 8 kHz take 67 MB; more cameras shorten the history."""


class FrameHistory:
    """Keep the newest frames, bounded in time and memory.

    Frames are copied into one circular array. Keeping the incoming blocks would avoid the copy, but
    fragments the heap: a window grew by 18 MiB an hour. One thread appends; reading is thread-safe.
    """

    def __init__(
        self,
        description: SourceDescription,
        rig: Rig,
        seconds: float = HISTORY_S,
        most_bytes: int = MOST_BYTES,
    ) -> None:
        self.description = description
        self._rig = rig
        self._span_ns = round(seconds * 1e9)
        layout = frame_dtype(len(description.camera_serials), description.n_slots)
        frames = self._span_ns // max(1, description.frame_period_ns) + 1
        # Pages are only committed when frames are written to them.
        self._ring = np.zeros(max(1, min(frames, most_bytes // layout.itemsize)), layout)
        self._next = self._count = self._touched = 0
        self._lock = threading.Lock()

    def append(self, block: FrameBlock) -> None:
        """Append a block, and drop old frames."""
        records = to_records(block)
        with self._lock:
            capacity = len(self._ring)
            records = records[-capacity:]
            if not len(records) or not capacity:
                return
            newest = self._ring["time_ns"][self._next - 1]
            if self._count and records["time_ns"][-1] < newest:
                # The bus clock was reset: earlier frames are not comparable.
                self._count = 0
            first = min(len(records), capacity - self._next)
            self._ring[self._next : self._next + first] = records[:first]
            self._ring[: len(records) - first] = records[first:]
            self._next = (self._next + len(records)) % capacity
            self._count = min(capacity, self._count + len(records))
            self._touched = max(self._touched, self._count)

    def clear(self) -> None:
        """Drop all frames and stop keeping new ones."""
        with self._lock:
            self._ring = self._ring[:0].copy()
            self._next = self._count = self._touched = 0

    @property
    def seconds(self) -> float:
        """Return the current time span, s."""
        with self._lock:
            times = self._ring["time_ns"][self._places()[[0, -1]]] if self._count else np.zeros(2)
        return float(times[-1] - times[0]) * 1e-9

    @property
    def size_bytes(self) -> int:
        """Return the memory in use."""
        return self._touched * self._ring.itemsize

    def blocks(self) -> Sequence[FrameBlock]:
        """Return copies of the kept frames, oldest first."""
        with self._lock:
            records = self._ring[self._places()]
        return [
            from_records(records[first : first + FRAMES_PER_READ])
            for first in range(0, len(records), FRAMES_PER_READ)
        ]

    def _places(self) -> NDArray[np.int64]:
        """Return the indices of kept frames, oldest first; requires the lock."""
        places = np.arange(self._next - self._count, self._next) % max(1, len(self._ring))
        if not len(places):
            return places
        # Lost frames leave room for frames older than the span.
        times = self._ring["time_ns"][places]
        return places[np.searchsorted(times, times[-1] - self._span_ns) :]

    def write(self, path: Path, blocks: Sequence[FrameBlock] | None = None) -> int:
        """Write a recording; return its frame count; AcquisitionError if it cannot be."""
        kept = self.blocks() if blocks is None else blocks
        with FrameRecorder(path, self.description, self._rig) as recorder:
            for block in kept:
                recorder.append(block)
            return recorder.frames
