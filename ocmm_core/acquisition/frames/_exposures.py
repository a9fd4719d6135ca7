"""Continuous exposure count of an acquisition, across bring-ups.

Each bring-up restarts the exposures and may set the bus clock. Readers see one increasing counter
with matching time; exposures missed between bring-ups are a gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames._frames import FrameBlock
from ocmm_core.acquisition.frames._join import FrameJoiner
from ocmm_core.fieldbus.cycle import Schedule
from ocmm_core.geometry import Float

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
