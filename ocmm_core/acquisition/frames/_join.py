"""Join the frames of the cameras by exposure time, and count exposures across bring-ups.

Each camera sends its frames in order, but the arrival time is unrelated to the exposure: one camera
may be many frames behind another. Frames are joined if their exposure times on the bus clock,
rounded to the frame period, are equal. Each exposure is counted exactly once, as delivered or lost.

Each bring-up restarts the exposures and may set the bus clock. Readers see one increasing counter
with matching time; exposures missed between bring-ups are a gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames._frames import FrameBlock
from ocmm_core.camera import USUAL_SLOTS
from ocmm_core.errors import AcquisitionError
from ocmm_core.fieldbus.cycle import Schedule
from ocmm_core.geometry import Float, Int

DEFAULT_CAPACITY = 4096
"""Maximum lead of the fastest camera in exposures; half a second at 8 kHz."""


@dataclass(frozen=True, slots=True)
class Joined:
    """Completed frames."""

    frames: FrameBlock | None
    lost: int
    """Exposures missing in a camera, given up."""


class FrameJoiner:
    """Collects frames per camera and returns exposures complete in all.

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
        self._owner = np.full((n_cameras, capacity), -1, dtype=np.int64)
        self._flags = np.zeros((n_cameras, capacity), dtype=np.uint32)
        self._valid = np.zeros((capacity, n_cameras), dtype=np.uint64)
        self._uv = np.full((capacity, n_cameras, USUAL_SLOTS, 2), np.nan)

    @property
    def next_exposure(self) -> int:
        """Return the first exposure neither delivered nor lost."""
        return self._next

    def push(
        self,
        camera: int,
        time_ns: Int,
        flags: NDArray[np.uint16],
        valid: NDArray[np.uint16],
        uv: Float,
    ) -> int:
        """Add the next frames of one camera; return the number skipped as known or lost.

        `time_ns`: (n,): exposure times on the bus clock, rising. `flags`, `valid`: (n,): bits of
        `FrameFlag`, and which slots hold a spot. `uv`: (n, 8, 2), px. AcquisitionError: a frame is
        off the common schedule by more than a quarter period.
        """
        since = np.asarray(time_ns, dtype=np.int64) - self._start_ns
        counter = (since + self._period_ns // 2) // self._period_ns
        if np.any(np.abs(since - counter * self._period_ns) > self._period_ns // 4):
            raise AcquisitionError(
                "join.schedule",
                f"Camera {camera + 1} exposed off the common schedule.",
                "Open the job again; if it happens again, check the bus clocks.",
            )
        fresh = counter >= max(self._upto[camera], self._next)
        counter = counter[fresh]
        # A push must not overwrite itself; excess exposures are given up.
        counter, kept = counter[-self._capacity :], np.flatnonzero(fresh)[-self._capacity :]
        if not len(counter):
            return len(fresh)
        place = counter % self._capacity
        self._owner[camera, place] = counter
        self._flags[camera, place] = flags[kept]
        self._valid[place, camera] = valid[kept]
        self._uv[place, camera] = uv[kept]
        self._upto[camera] = int(counter[-1]) + 1
        return len(fresh) - len(counter)

    def takes_at_once(self, first: int) -> bool:
        """Return whether exposure `first` is the next of every camera and none waits."""
        return self._next == first and self._upto.count(first) == len(self._upto)

    def pass_on(
        self, flags: NDArray[np.uint16], valid: NDArray[np.uint16], uv: Float
    ) -> FrameBlock:
        """Return complete frames directly; shortcut of `push` and `pull`.

        `flags`, `valid`: (C, n): of the next exposures, if `takes_at_once`. `uv`: (C, n, 8, 2), px.
        """
        counter = np.arange(self._next, self._next + flags.shape[1])
        self._next += flags.shape[1]
        self._upto = [self._next] * len(self._upto)
        return FrameBlock(
            counter=counter,
            time_ns=self._start_ns + counter * self._period_ns,
            flags=np.bitwise_or.reduce(flags, axis=0).astype(np.uint32),
            valid=valid.T.astype(np.uint64),
            uv=uv.swapaxes(0, 1),
        )

    def pull(self) -> Joined:
        """Return completed frames, and count those that never will be."""
        given_up = max(0, max(self._upto) - self._capacity - self._next)
        self._next += given_up
        end = min(self._upto)
        if end <= self._next:
            return Joined(None, given_up)
        counter = np.arange(self._next, end)
        place = counter % self._capacity
        complete = np.all(self._owner[:, place] == counter, axis=0)
        self._next = end
        lost = given_up + int(np.count_nonzero(~complete))
        counter, place = counter[complete], place[complete]
        if not len(counter):
            return Joined(None, lost)
        return Joined(
            FrameBlock(
                counter=counter,
                time_ns=self._start_ns + counter * self._period_ns,
                flags=np.bitwise_or.reduce(self._flags[:, place], axis=0),
                valid=self._valid[place],
                uv=self._uv[place],
            ),
            lost,
        )


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

    @property
    def joiner(self) -> FrameJoiner | None:
        """Return the joiner of the last bring-up."""
        return self._joiner

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

    def pull(self) -> Given:
        if self._joiner is None:
            return Given(None, 0)
        joined = self._joiner.pull()
        return self._given(joined.frames, joined.lost)

    def pass_on(
        self, first: int, flags: NDArray[np.uint16], valid: NDArray[np.uint16], uv: Float
    ) -> Given | None:
        """Return complete frames directly, or None if others are waiting.

        `first`: number of the first exposure since the last bring-up. `flags`, `valid`, `uv`: (C,
        n), (C, n) and (C, n, 8, 2) px: of all cameras.
        """
        if self._joiner is None or not self._joiner.takes_at_once(first):
            return None
        return self._given(self._joiner.pass_on(flags, valid, uv), 0)

    def _given(self, block: FrameBlock | None, given_up: int) -> Given:
        lost, self._owed = given_up + self._owed, 0
        if block is not None and self._offset:
            counter = block.counter + self._offset
            block = replace(
                block, counter=counter, time_ns=self._start_ns + counter * self._period_ns
            )
        return Given(block, lost)
