"""The joiner that owns each frame by its number, decoded at once: slow, and easy to check."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock, Given
from ocmm_core.camera import USUAL_SLOTS
from ocmm_core.geometry import Float, Int


class PlainJoiner:
    """Collects frames per camera and returns exposures complete in all.

    `start_ns`, `period_ns`: exposure k is at ``start_ns + k * period_ns``. `capacity`: maximum lead
    of a camera in exposures before these are given up.
    """

    def __init__(self, n_cameras: int, start_ns: int, period_ns: int, capacity: int) -> None:
        self._start_ns = start_ns
        self._period_ns = period_ns
        self._capacity = capacity
        self._next = 0
        self._upto = [0] * n_cameras
        self._owner = np.full((n_cameras, capacity), -1, dtype=np.int64)
        self._flags = np.zeros((n_cameras, capacity), dtype=np.uint32)
        self._valid = np.zeros((capacity, n_cameras), dtype=np.uint64)
        self._uv = np.full((capacity, n_cameras, USUAL_SLOTS, 2), np.nan)

    def push(
        self,
        camera: int,
        time_ns: Int,
        flags: NDArray[np.uint16],
        valid: NDArray[np.uint16],
        uv: Float,
    ) -> int:
        """Add the next frames of one camera; return the number of skipped frames.

        `time_ns`: (n,): exposure times on the bus clock, rising. `flags`, `valid`: (n,): bits of
        `FrameFlag`, and which slots hold a spot. `uv`: (n, 8, 2), px.
        """
        since = np.asarray(time_ns, dtype=np.int64) - self._start_ns
        counter = (since + self._period_ns // 2) // self._period_ns
        assert not np.any(since - counter * self._period_ns)
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

    def pull(self) -> Given:
        """Return completed frames, and count those that never will be."""
        given_up = max(0, max(self._upto) - self._capacity - self._next)
        self._next += given_up
        end = min(self._upto)
        if end <= self._next:
            return Given(None, given_up)
        counter = np.arange(self._next, end)
        place = counter % self._capacity
        complete = np.all(self._owner[:, place] == counter, axis=0)
        self._next = end
        lost = given_up + int(np.count_nonzero(~complete))
        counter, place = counter[complete], place[complete]
        if not len(counter):
            return Given(None, lost)
        return Given(
            FrameBlock(
                counter=counter,
                time_ns=self._start_ns + counter * self._period_ns,
                flags=np.bitwise_or.reduce(self._flags[:, place], axis=0),
                valid=self._valid[place],
                uv=self._uv[place],
            ),
            lost,
        )
