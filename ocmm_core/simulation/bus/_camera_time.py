"""The cameras' side of the time of a virtual bus, and their count of the frames on the way."""

from __future__ import annotations

import time

from ocmm_core.acquisition.frames import FrameRing, RingHeaderField


class CameraTime:
    """The clock of this computer: cameras on a wire that nobody stretches."""

    stretched = False

    def now_ns(self) -> int:
        """Return the time now."""
        return time.monotonic_ns()

    def taken(self, *, answered: bool) -> None:
        """Note that a frame was taken from the wire, and whether an answer left."""

    def close(self) -> None:
        """Give back what belongs to it; may be called twice."""


class SteppedCameraTime(CameraTime):
    """The time that the bus process sets, see `SteppedTime`.

    Parameters
    ----------
    path
        File of the ring whose words hold it.
    """

    stretched = True

    def __init__(self, path: str) -> None:
        self._ring = FrameRing.attach(path)
        self._counts = [
            self._ring.word(RingHeaderField.FRAMES_TAKEN),
            self._ring.word(RingHeaderField.FRAMES_ANSWERED),
        ]

    def now_ns(self) -> int:
        """Return the bus's time now."""
        if self._ring.word(RingHeaderField.BUS_STEPS):
            return self._ring.word(RingHeaderField.BUS_NOW_NS)
        return time.monotonic_ns() + self._ring.word(RingHeaderField.BUS_OFFSET_NS)

    def taken(self, *, answered: bool) -> None:
        """Note that a frame was taken from the wire, and whether an answer left."""
        counts = self._counts
        if answered:
            counts[1] += 1
            self._ring.set_word(RingHeaderField.FRAMES_ANSWERED, counts[1])
        # Last: who reads that a frame was taken finds its answer counted.
        counts[0] += 1
        self._ring.set_word(RingHeaderField.FRAMES_TAKEN, counts[0])

    def close(self) -> None:
        """Unmap the ring; may be called twice."""
        self._ring.close()
