"""The last seconds of raw frames, kept in memory while measuring; for a support bundle."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from pathlib import Path

from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.acquisition.recording._recorder import FrameRecorder
from ocmm_core.camera import Rig

HISTORY_S = 30.0
MOST_BYTES = 96 << 20
"""30 s of two cameras at 8 kHz take 71 MB; more cameras have a shorter past, never more memory."""


class FrameHistory:
    """Keep the newest frames, bounded in time and in memory.

    A block is kept as it is: nobody writes into one, so that a frame costs no copy. One thread
    appends; any thread may ask.

    Parameters
    ----------
    description, rig
        Of the source, and of the cameras.
    seconds, most_bytes
        Whichever is reached first.
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
        self._span_ns, self._most_bytes = round(seconds * 1e9), most_bytes
        self._blocks: deque[tuple[FrameBlock, int]] = deque()
        self._bytes = 0
        self._lock = threading.Lock()

    def append(self, block: FrameBlock) -> None:
        """Keep a block, and forget what is too old."""
        if not len(block):
            return
        size = sum(part.nbytes for part in (
            block.counter, block.time_ns, block.flags, block.valid, block.uv
        ))  # fmt: skip
        newest = int(block.time_ns[-1])
        with self._lock:
            if self._blocks and newest < int(self._blocks[-1][0].time_ns[-1]):
                # The bus clock was set anew: what was before belongs to another time.
                self._blocks.clear()
                self._bytes = 0
            self._blocks.append((block, size))
            self._bytes += size
            while len(self._blocks) > 1 and (
                self._bytes > self._most_bytes
                or newest - int(self._blocks[0][0].time_ns[-1]) > self._span_ns
            ):
                self._bytes -= self._blocks.popleft()[1]

    def clear(self) -> None:
        """Forget all: who keeps this object keeps no frames any more."""
        with self._lock:
            self._blocks.clear()
            self._bytes = 0

    @property
    def seconds(self) -> float:
        """Return how long a time is kept now, s."""
        blocks = self.blocks()
        if not blocks:
            return 0.0
        return float(int(blocks[-1].time_ns[-1]) - int(blocks[0].time_ns[0])) * 1e-9

    @property
    def size_bytes(self) -> int:
        """Return how much memory it takes now."""
        return self._bytes

    def blocks(self) -> Sequence[FrameBlock]:
        """Return what is kept, the oldest first."""
        with self._lock:
            return [block for block, _ in self._blocks]

    def write(self, path: Path, blocks: Sequence[FrameBlock] | None = None) -> int:
        """Write a recording that `ReplaySource` plays back, and return how many frames it has.

        Raises
        ------
        AcquisitionError
            The file is there already or cannot be written.
        """
        kept = self.blocks() if blocks is None else blocks
        with FrameRecorder(path, self.description, self._rig) as recorder:
            for block in kept:
                recorder.append(block)
            return recorder.frames
