"""Camera side of the virtual bus time, and the count of frames in transit."""

from __future__ import annotations

import time

from ocmm_core.acquisition.frames import FrameRing, RingHeaderField


class CameraTime:
    """Clock of this computer, for a wire in real time."""

    stretched = False

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def taken(self, *, answered: bool) -> None:
        """Record that a frame was received, and whether an answer left."""

    def close(self) -> None:
        """Release resources; idempotent."""


class SteppedCameraTime(CameraTime):
    """Time set by the bus process in its ring file, see `SteppedTime`."""

    stretched = True

    def __init__(self, path: str) -> None:
        self._ring = FrameRing.attach(path)
        self._counts = [
            self._ring.word(RingHeaderField.FRAMES_TAKEN),
            self._ring.word(RingHeaderField.FRAMES_ANSWERED),
        ]

    def now_ns(self) -> int:
        if self._ring.word(RingHeaderField.BUS_STEPS):
            return self._ring.word(RingHeaderField.BUS_NOW_NS)
        return time.monotonic_ns() + self._ring.word(RingHeaderField.BUS_OFFSET_NS)

    def taken(self, *, answered: bool) -> None:
        """Record that a frame was received, and whether an answer left."""
        counts = self._counts
        if answered:
            counts[1] += 1
            self._ring.set_word(RingHeaderField.FRAMES_ANSWERED, counts[1])
        # Last: a reader that sees the frame received finds its answer counted.
        counts[0] += 1
        self._ring.set_word(RingHeaderField.FRAMES_TAKEN, counts[0])

    def close(self) -> None:
        """Unmap the ring; idempotent."""
        self._ring.close()
