"""One count of exposures for as long as the acquisition lasts, across every new bring-up.

Each bring-up starts the exposures anew and may even set the bus clock. Whoever takes the frames
sees one counter that only grows and a time that goes with it; what was exposed, or would have
been, between two bring-ups is a gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ocmm_core.acquisition.frames._frames import FrameBlock
from ocmm_core.acquisition.frames._join import FrameJoiner
from ocmm_core.fieldbus.cycle import Schedule

_SAME_CLOCK_NS = 5_000_000
_SAME_CLOCK_RATE = 1e-3


@dataclass(frozen=True, slots=True)
class Given:
    """What became complete: frames in the one count, and how many are lost before them."""

    frames: FrameBlock | None
    lost: int


class ExposureCount:
    """Joins the frames of all cameras from bring-up to bring-up.

    Parameters
    ----------
    n_cameras
        How many cameras must have seen an exposure.
    """

    def __init__(self, n_cameras: int) -> None:
        self._n_cameras = n_cameras
        self._joiner: FrameJoiner | None = None
        self._origin: tuple[int, int] | None = None
        self._offset = 0
        self._start_ns = self._period_ns = 0
        self._owed = 0

    @property
    def joiner(self) -> FrameJoiner | None:
        """Return where the frames since the last bring-up go."""
        return self._joiner

    def begin(self, schedule: Schedule, start_host_ns: int) -> int:
        """Begin with the exposures of a new bring-up; return how many are lost for ever.

        Parameters
        ----------
        schedule
            Bus times of the new exposures.
        start_host_ns
            Host time of the first of them, roughly.
        """
        gap = 0
        if self._origin is None or self._joiner is None:
            self._origin = (schedule.start_ns, start_host_ns)
            self._start_ns = schedule.start_ns
        else:
            origin_ns, origin_host_ns = self._origin
            passed_ns = start_host_ns - origin_host_ns
            exact_ns = schedule.start_ns - origin_ns
            # A clock that was set anew counts from elsewhere; this computer's does not.
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
        """Give out what is complete."""
        if self._joiner is None:
            return Given(None, 0)
        joined = self._joiner.pull()
        lost, self._owed = joined.lost + self._owed, 0
        block = joined.frames
        if block is not None and self._offset:
            counter = block.counter + self._offset
            block = replace(
                block, counter=counter, time_ns=self._start_ns + counter * self._period_ns
            )
        return Given(block, lost)
