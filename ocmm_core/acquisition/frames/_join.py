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
from ocmm_core.geometry import Float, Int

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

    def start(self, schedule: Schedule, start_host_ns: int) -> int:
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


MOST_FRAMES = 8
"""Largest skew that can be aligned, in frame periods."""
_APART = 1.5
"""Frames further apart than this many periods are no neighbours."""
_NODES = np.array([-1.0, 0.0, 1.0, 2.0])


class FrameAligner:
    """Shift the spots of each camera by its skew; frames come out some periods later.

    Camera c exposes a frame at its time stamp plus ``skew_s[c]``. Spots are interpolated between
    consecutive frames of a slot: by a cubic, or a line at the ends; a spot without neighbour is
    left out. For one thread.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._held: FrameBlock | None = None
        self._sent_ns = -1

    def push(self, block: FrameBlock, skew_s: Float) -> FrameBlock | None:
        """Return the frames whose neighbours have arrived in all cameras; None if there are none.

        Frames before a pause, or before a step back of the clock, are dropped if not yet returned.
        """
        held = block if self._held is None else _joined(self._held, block)
        reach_ns = MOST_FRAMES * self._period_ns
        steps = np.diff(held.time_ns)
        breaks = np.flatnonzero((steps <= 0) | (steps > reach_ns))
        if len(breaks):
            held, self._sent_ns = held.part(slice(int(breaks[-1]) + 1, None)), -1
        skew_ns = np.round(skew_s * 1e9).astype(np.int64)
        latest = int(held.time_ns[-1]) + min(0, int(skew_ns.min())) - self._period_ns
        chosen = np.flatnonzero((held.time_ns > self._sent_ns) & (held.time_ns <= latest))
        keep_ns = latest - reach_ns - 2 * self._period_ns
        self._held = held.part(held.time_ns >= keep_ns)
        if not len(chosen):
            return None
        self._sent_ns = int(held.time_ns[chosen[-1]])
        uv = np.stack(
            [
                self._at(held, camera, held.time_ns[chosen] - shift)
                for camera, shift in enumerate(skew_ns)
            ],
            axis=1,
        )
        found = np.isfinite(uv[..., 0])
        bits = np.uint64(1) << np.arange(uv.shape[2], dtype=np.uint64)
        valid = np.where(found, bits, np.uint64(0)).sum(axis=2, dtype=np.uint64)
        return FrameBlock(held.counter[chosen], held.time_ns[chosen], held.flags[chosen], valid, uv)

    def _at(self, held: FrameBlock, camera: int, times_ns: Int) -> Float:
        """Return the spots (n, S, 2) of a camera at some of its time stamps (n,)."""
        stamps, spots = held.time_ns, held.uv[:, camera]
        if len(stamps) < 2:
            return np.full((len(times_ns), *spots.shape[1:]), np.nan)
        left = np.clip(np.searchsorted(stamps, times_ns, side="right") - 1, 0, len(stamps) - 2)
        step = stamps[left + 1] - stamps[left]
        share = (times_ns - stamps[left]) / step
        places = np.clip(left[:, None] + _NODES.astype(np.int64), 0, len(stamps) - 1)
        near = np.abs(stamps[places] - stamps[left][:, None] - _NODES * self._period_ns) < (
            (_APART - 1.0) * self._period_ns
        )
        taken = np.where(near[..., None, None], spots[places], np.nan)
        line = taken[:, 1] + share[:, None, None] * (taken[:, 2] - taken[:, 1])
        # A time on a frame needs no neighbour.
        line = np.where((share == 0.0)[:, None, None], taken[:, 1], line)
        line[(share < 0.0) | (share > 1.0)] = np.nan
        cubic = np.einsum("nk,nksa->nsa", _lagrange(share), taken)
        return np.where(np.isfinite(cubic) & np.isfinite(line), cubic, line)


def _lagrange(share: Float) -> Float:
    """Return the weights (n, 4) of the frames at -1, 0, 1 and 2 periods."""
    weights = np.ones((len(share), 4))
    for k, node in enumerate(_NODES):
        for other in _NODES[np.arange(4) != k]:
            weights[:, k] *= (share - other) / (node - other)
    return weights


def _joined(first: FrameBlock, then: FrameBlock) -> FrameBlock:
    return FrameBlock(
        *(
            np.concatenate([getattr(first, name), getattr(then, name)])
            for name in FrameBlock.__slots__
        )
    )
