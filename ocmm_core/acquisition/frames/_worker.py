"""Acquisition worker: owns a source, fills the ring and counts every cycle."""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass
from enum import IntEnum

from ocmm_core.acquisition.frames._frames import Cycle, CycleVerdict, FrameSource
from ocmm_core.acquisition.frames._ring import FrameRing, RingHeaderField
from ocmm_core.errors import AcquisitionError, InternalError, OcmmError
from ocmm_core.failure import CODE, EXIT_FAILED, EXIT_INTERNAL, REOPEN, contained, described
from ocmm_core.fieldbus.report import pace_words

_WAIT_S = 0.002
_BEHIND_SHARE = 16
"""A virtual bus waits for a reader behind by this part of the ring: half a second."""
_READER_S = 10.0
"""A reader silent for this long is gone; the time allows it to compile."""


class AcquisitionState(IntEnum):
    """State of the worker: IDLE -> OPENING -> RUNNING -> STOPPED."""

    IDLE = 0
    OPENING = 1
    RUNNING = 2
    STOPPED = 3


class StopReason(IntEnum):
    NONE = 0
    REQUESTED = 1
    FINISHED = 2
    FAILED = 3


@dataclass(frozen=True, slots=True)
class AcquisitionStatus:
    """Snapshot of a worker, in this process or another one."""

    state: AcquisitionState
    stop_reason: StopReason
    message: str
    elapsed: int
    good: int
    late: int
    lost: int
    bad: int
    """`elapsed`, `good`, `late`, `lost`, `bad`: cycles; ``good + late + lost + bad == elapsed``."""
    frames: int
    frames_lost: int
    overrun: int
    """`frames`, `frames_lost`, `overrun`: delivered, never arrived, overwritten before reading."""
    internal: bool = False
    """Stopped by an unexpected error, named in ``message``."""
    pace: float | None = None
    mean_pace: float | None = None
    """`pace`, `mean_pace`: bus time over real time of a virtual bus that waits for a busy computer:
    last second, and since the start. None otherwise, and while unknown."""

    @property
    def pace_words(self) -> str:
        """Return a warning about a slow virtual bus; empty if it keeps real time."""
        return pace_words(self.pace)

    def error(self, code: str, remedy: str) -> OcmmError:
        """Return the message of a failed worker as an error with remedy."""
        if self.internal:
            return InternalError(CODE, self.message, remedy)
        return AcquisitionError(code, self.message, remedy)


def read_status(ring: FrameRing) -> AcquisitionStatus:
    """Return the status of the ring's writer."""
    books = ring.books
    return AcquisitionStatus(
        state=AcquisitionState(ring.word(RingHeaderField.STATE)),
        stop_reason=StopReason(ring.word(RingHeaderField.STOP_REASON)),
        message=ring.text(),
        elapsed=books.elapsed,
        good=books.good,
        late=books.late,
        lost=books.lost,
        bad=books.bad,
        frames=books.frames,
        frames_lost=books.frames_lost,
        overrun=ring.word(RingHeaderField.OVERRUN),
        internal=ring.word(RingHeaderField.INTERNAL) != 0,
        pace=_pace(ring, RingHeaderField.PACE_PPM),
        mean_pace=_pace(ring, RingHeaderField.MEAN_PACE_PPM),
    )


def _pace(ring: FrameRing, which: RingHeaderField) -> float | None:
    return ring.word(which) * 1e-6 or None


def leave_error(ring: FrameRing, error: Exception) -> None:
    """Store in a ring why its writer ends."""
    # Status before the log: disks can be slow.
    told = described(error, "The acquisition", remedy=REOPEN)
    ring.set_text(str(told))
    ring.set_word(RingHeaderField.INTERNAL, int(isinstance(told, InternalError)))
    ring.set_text(str(contained(error, "The acquisition", remedy=REOPEN)))


class AcquisitionWorker:
    """Run a source until it ends, fails or is asked to stop.

    `run` may be called directly (as in the bus process) or in a thread by `start`. `stop`: external
    stop event; None creates one.
    """

    def __init__(
        self, source: FrameSource, ring: FrameRing, stop: threading.Event | None = None
    ) -> None:
        self._source = source
        self._ring = ring
        self._stop = threading.Event() if stop is None else stop
        self._thread: threading.Thread | None = None
        # No reads yet; a starting reader is waited for.
        self._gone_at = 0

    def start(self) -> None:
        """Run in a separate thread."""
        if self._thread is not None:
            raise AcquisitionError(
                "acquisition.started", "The acquisition is already started.", "Make a new worker."
            )
        self._thread = threading.Thread(target=self.run, name="ocmm-acquisition")
        self._thread.start()

    def request_stop(self) -> None:
        """Request the end at the next cycle; returns at once; idempotent."""
        self._stop.set()

    def join(self, timeout_s: float) -> bool:
        if self._thread is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def run(self) -> StopReason:
        """Open, read until the end, close; source errors are reported in the ring."""
        reason = StopReason.FAILED
        self._ring.set_word(RingHeaderField.STATE, AcquisitionState.OPENING)
        try:
            self._ring.set_word(
                RingHeaderField.FRAME_PERIOD_NS, self._source.description.frame_period_ns
            )
            self._source.open()
            self._ring.set_word(RingHeaderField.STATE, AcquisitionState.RUNNING)
            reason = self._read_until_end()
        except Exception as error:
            leave_error(self._ring, error)
        try:
            self._source.close()
        except Exception as error:
            if reason is not StopReason.FAILED:
                reason = StopReason.FAILED
                leave_error(self._ring, error)
        if self._ring.word(RingHeaderField.INTERNAL):
            # Stopped by another thread of this process.
            reason = StopReason.FAILED
        self._ring.set_word(RingHeaderField.STOP_REASON, reason)
        self._ring.set_word(RingHeaderField.STATE, AcquisitionState.STOPPED)
        return reason

    def run_program(self) -> int:
        """Run as a program of its own, with the failure as its last words; return the exit code."""
        if self.run() is not StopReason.FAILED:
            return 0
        sys.stderr.write(f"{self._ring.text()}\n")
        return EXIT_INTERNAL if self._ring.word(RingHeaderField.INTERNAL) else EXIT_FAILED

    def _read_until_end(self) -> StopReason:
        description = self._source.description
        while not self._stopping():
            cycle = self._source.read()
            self._account(cycle)
            if cycle.frames is not None:
                if description.stretched:
                    self._wait_for_reader()
                if not description.live:
                    # A block that can never fit is not waited for: the ring refuses it.
                    needed = min(len(cycle.frames), self._ring.capacity)
                    while self._ring.free() < needed:
                        if self._stopping():
                            return StopReason.REQUESTED
                        time.sleep(_WAIT_S)
                self._ring.write(cycle.frames)
                self._ring.set_word(RingHeaderField.LAST_FRAMES_NS, time.monotonic_ns())
            if cycle.finished:
                return StopReason.FINISHED
        return StopReason.REQUESTED

    def _wait_for_reader(self) -> None:
        """Pause a virtual bus while its reader is behind, but not for one that is gone."""
        ring, most = self._ring, self._ring.capacity // _BEHIND_SHARE
        begin, asked = time.monotonic(), ring.word(RingHeaderField.READS)
        if ring.capacity - ring.free() <= most or asked == self._gone_at:
            return
        while ring.capacity - ring.free() > most and not self._stopping():
            time.sleep(_WAIT_S)
            if ring.word(RingHeaderField.READS) != asked:
                begin, asked = time.monotonic(), ring.word(RingHeaderField.READS)
            elif time.monotonic() - begin > _READER_S:
                self._gone_at = asked
                return

    def _account(self, cycle: Cycle) -> None:
        amounts = {cycle.verdict.value: 1}
        if cycle.elapsed > 1:
            skipped = cycle.skipped.value
            amounts[skipped] = amounts.get(skipped, 0) + cycle.elapsed - 1
        # Atomically: readers find every cycle counted once.
        self._ring.enter(
            elapsed=cycle.elapsed,
            frames=0 if cycle.frames is None else len(cycle.frames),
            frames_lost=cycle.frames_lost,
            **amounts,
        )
        self._ring.set_word(
            RingHeaderField.HEARTBEAT, self._ring.word(RingHeaderField.HEARTBEAT) + 1
        )
        if cycle.verdict is not CycleVerdict.GOOD and cycle.reason:
            self._ring.set_text(cycle.reason)

    def _stopping(self) -> bool:
        return self._stop.is_set() or self._ring.word(RingHeaderField.STOP_REQUEST) != 0
