"""Join the frames of the cameras by exposure time, and count exposures across bring-ups.

Each camera sends its frames in order, but the arrival time is unrelated to the exposure: one camera
may be many frames behind another. Frames are joined by exposure number, which was checked against
their times on the bus clock. Each exposure is counted exactly once, as delivered or lost.

Each bring-up restarts the exposures and may set the bus clock. Readers see one increasing counter
with matching time; exposures missed between bring-ups are a gap.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames._frames import FrameBlock
from ocmm_core.fieldbus.cycle import Schedule
from ocmm_core.fieldbus.device import FRAME_DTYPE, decode_spots

DEFAULT_CAPACITY = 4096
"""Maximum lead of the fastest camera in exposures; half a second at 8 kHz."""
_FRAME_BYTES = FRAME_DTYPE.itemsize


@dataclass(frozen=True, slots=True)
class Joined:
    """Completed frames."""

    frames: FrameBlock | None
    lost: int
    """Exposures missing in a camera, given up."""


class FrameJoiner:
    """Collects raw frames per camera and returns exposures complete in all.

    `start_ns`, `period_ns`: exposure k is at ``start_ns + k * period_ns``. `capacity`: maximum lead
    of a camera in exposures before these are given up.
    """

    def __init__(
        self, n_cameras: int, start_ns: int, period_ns: int, capacity: int = DEFAULT_CAPACITY
    ) -> None:
        self._start_ns = start_ns
        self._period_ns = period_ns
        self._capacity = capacity
        self._next = 0
        self._upto = [0] * n_cameras
        self._gaps: list[tuple[int, int]] = []
        # Parts of the inputs with the number of their first exposure: nothing is copied.
        self._held: list[deque[tuple[int, memoryview]]] = [deque() for _ in range(n_cameras)]

    @property
    def next_exposure(self) -> int:
        """Return the first exposure neither delivered nor lost."""
        return self._next

    def push(self, camera: int, first: int, frames: memoryview) -> int:
        """Add the next frames of one camera; return the number skipped as known or lost.

        `first`: exposure number of the first frame. `frames`: consecutive, bytes of `FRAME_DTYPE`.
        """
        known, end = self._upto[camera], first + len(frames) // _FRAME_BYTES
        # A push longer than the capacity is the maximum lead itself: its beginning is given up.
        begin = max(first, known, self._next, end - self._capacity)
        if begin >= end:
            return end - first
        if begin > known:
            self._gaps.append((known, begin))
        self._upto[camera] = end
        self._held[camera].append((begin, frames[(begin - first) * _FRAME_BYTES :]))
        return begin - first

    def pull(self) -> Joined:
        """Return completed frames, and count those that never will be."""
        given_up = max(0, max(self._upto) - self._capacity - self._next)
        begin, end = self._next + given_up, min(self._upto)
        self._next = max(begin, end)
        if given_up:
            self._gaps = [gap for gap in self._gaps if gap[1] > begin]
            for held in self._held:
                _ = [*_cut(held, begin)]
        if end <= begin:
            return Joined(None, given_up)
        counter = np.arange(begin, end)
        parts = [part for held in self._held for part in _cut(held, end)]
        frames = np.frombuffer(b"".join([part for _, part in parts]), FRAME_DTYPE)
        if self._gaps:
            complete = self._complete(begin, end)
            numbers = [first + np.arange(len(part) // _FRAME_BYTES) for first, part in parts]
            frames = frames[complete[np.concatenate(numbers) - begin]]
            counter = counter[complete]
        lost = given_up + end - begin - len(counter)
        if not len(counter):
            return Joined(None, lost)
        frames = frames.reshape(len(self._held), -1)
        flags = np.zeros(len(counter), np.uint32)
        if any(frames["flags"].tobytes()):
            np.bitwise_or.reduce(frames["flags"], axis=0, out=flags)
        valid = frames["valid"].T.astype(np.uint64)
        time_ns = self._start_ns + counter * self._period_ns
        uv = decode_spots(frames).swapaxes(0, 1)
        return Joined(FrameBlock(counter, time_ns, flags, valid, uv), lost)

    def _complete(self, begin: int, end: int) -> NDArray[np.bool_]:
        """Return which of these exposures no camera left out."""
        complete = np.ones(end - begin, np.bool_)
        for first, last in self._gaps:
            complete[max(0, first - begin) : max(0, last - begin)] = False
        self._gaps = [gap for gap in self._gaps if gap[1] > end]
        return complete


def _cut(held: deque[tuple[int, memoryview]], end: int) -> Iterator[tuple[int, memoryview]]:
    """Remove and yield the frames before `end`."""
    while held and held[0][0] < end:
        first, frames = held.popleft()
        size = (end - first) * _FRAME_BYTES
        if size < len(frames):
            held.appendleft((end, frames[size:]))
        yield first, frames[:size]


_SAME_CLOCK_NS = 5_000_000
_SAME_CLOCK_RATE = 1e-3


@dataclass(frozen=True, slots=True)
class Given:
    """Completed frames in the continuous count, and the loss before them."""

    frames: FrameBlock | None
    lost: int


class ExposureCount:
    """Joins the frames of all cameras across bring-ups."""

    def __init__(self, n_cameras: int) -> None:
        self._n_cameras = n_cameras
        self._joiner: FrameJoiner | None = None
        self._origin: tuple[int, int] | None = None
        self._offset = 0
        self._start_ns = self._period_ns = 0
        self._owed = 0

    def begin(self, schedule: Schedule, start_host_ns: int) -> int:
        """Start a bring-up's exposures, the first near a host time; return the lost ones."""
        gap = 0
        if self._origin is None or self._joiner is None:
            self._origin = (schedule.start_ns, start_host_ns)
            self._start_ns = schedule.start_ns
        else:
            origin_ns, origin_host_ns = self._origin
            passed_ns = start_host_ns - origin_host_ns
            exact_ns = schedule.start_ns - origin_ns
            # A reset bus clock has a new origin; this computer's has not.
            unsure = _SAME_CLOCK_NS + abs(passed_ns) * _SAME_CLOCK_RATE
            chosen = exact_ns if abs(exact_ns - passed_ns) < unsure else passed_ns
            given = self._offset + self._joiner.next_exposure
            self._offset = max(given, -(-chosen // schedule.period_ns))
            gap = self._offset - given
        self._period_ns = schedule.period_ns
        self._joiner = FrameJoiner(self._n_cameras, schedule.start_ns, schedule.period_ns)
        self._owed += gap
        return gap

    def push(self, camera: int, first: int, frames: memoryview) -> None:
        """Add frames of one camera, numbered since the last bring-up; see `FrameJoiner.push`."""
        if self._joiner is not None:
            self._joiner.push(camera, first, frames)

    def pull(self) -> Given:
        if self._joiner is None:
            return Given(None, 0)
        joined = self._joiner.pull()
        block, lost, self._owed = joined.frames, joined.lost + self._owed, 0
        if block is not None and self._offset:
            counter = block.counter + self._offset
            block = replace(
                block, counter=counter, time_ns=self._start_ns + counter * self._period_ns
            )
        return Given(block, lost)
