"""Check of every frame from a bus process: shown by the cameras, and complete."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.clock_pattern import CLOCK_MODULUS_US, read_clock
from ocmm_core.acquisition.frames import FrameBlock, FrameRing, RingHeaderField
from ocmm_core.fieldbus.report import BusEvent, BusPhase, BusReport, decode_report

SAME_TIME_US = 50
"""Tolerance of simultaneous exposures: clock differences and rounding."""
MAX_AGE_US = 700_000
"""Maximum age. Cameras buffer 128 ms; a stalled computer may add its delay."""
_READ_FRAMES = 8192


@dataclass(slots=True)
class Watched:
    """Observations over a period."""

    frames: int = 0
    lost: int = 0
    stale: int = 0
    mixed: int = 0
    garbled: int = 0
    disordered: int = 0
    """`stale`, `mixed`, `garbled`, `disordered`: frames delivered wrongly: too old; with different
    exposure times; shown by no camera; not later than the previous one."""
    exposed_us: list[NDArray[np.int64]] = field(default_factory=list)
    """Host times of all exposures, modulo `CLOCK_MODULUS_US`."""
    events: list[BusEvent] = field(default_factory=list)
    grown: list[BusEvent] = field(default_factory=list)
    phases: list[BusPhase] = field(default_factory=list)
    """Bus phases in order, without repetitions."""
    alarms: list[str] = field(default_factory=list)
    """Reported alarms in order, without repetitions."""

    @property
    def wrong(self) -> int:
        """Return the number of wrongly delivered frames."""
        return self.stale + self.mixed + self.garbled + self.disordered

    def exposed_between(self, begin_ns: int, end_ns: int) -> int:
        """Return the number of frames exposed between two host times."""
        begin_us = begin_ns // 1000
        length_us = (end_ns - begin_ns) // 1000
        return sum(
            int(np.count_nonzero((us - begin_us) % CLOCK_MODULUS_US < length_us))
            for us in self.exposed_us
        )


class FrameWatch:
    """Reads the ring of a bus process whose cameras show a `ClockPattern`."""

    def __init__(self, ring: FrameRing) -> None:
        self._ring = ring
        self._counter = -1
        self._host_us = -1
        self._sequence = -1
        self._looked_us = time.monotonic_ns() // 1000
        self._cycles: dict[int, int] = {}
        self._lost = ring.books.frames_lost
        self.last_sign_ns: dict[str, int] = {}
        """Time of the last new or continued event per code."""
        self.report: BusReport | None = None

    def look(self, seen: Watched) -> int:
        """Process new frames; return their number."""
        count = 0
        looked_us = time.monotonic_ns() // 1000
        while (block := self._ring.read(_READ_FRAMES)) is not None:
            count += len(block)
            self._judge(block, seen)
        self._looked_us = looked_us
        lost = self._ring.books.frames_lost
        seen.lost += lost - self._lost
        self._lost = lost
        sequence = self._ring.word(RingHeaderField.REPORT_SEQUENCE)
        if sequence != self._sequence:
            report = decode_report(self._ring.report())
            if report is not None:
                self._sequence = sequence
                self._take_report(report, seen)
        return count

    def _take_report(self, report: BusReport, seen: Watched) -> None:
        self.report = report
        for event in report.events:
            known = self._cycles.get(event.number)
            if known is None:
                seen.events.append(event)
            elif event.cycles > known:
                seen.grown.append(event)
            if known != event.cycles:
                self._cycles[event.number] = event.cycles
                self.last_sign_ns[event.code] = time.monotonic_ns()
        if seen.phases[-1:] != [report.phase]:
            seen.phases.append(report.phase)
        if report.alarm and seen.alarms[-1:] != [report.alarm]:
            seen.alarms.append(report.alarm)

    def _judge(self, block: FrameBlock, seen: Watched) -> None:
        now_us = time.monotonic_ns() // 1000
        # Waiting in the ring for this process does not count as age.
        patience_us = now_us - self._looked_us
        seen.frames += len(block)
        readings = [
            read_clock(block.valid[:, camera], block.uv[:, camera])
            for camera in range(block.valid.shape[1])
        ]
        first = readings[0]
        told_us = block.time_ns // 1000 % CLOCK_MODULUS_US
        garbled = np.zeros(len(block), np.bool_)
        mixed = np.zeros(len(block), np.bool_)
        for camera, reading in enumerate(readings):
            garbled |= ~reading.intact | (reading.camera != camera)
            apart = _signed_us(reading.host_us - first.host_us)
            mixed |= (reading.bus_us != told_us) | (np.abs(apart) > SAME_TIME_US)
        age = _signed_us(now_us - first.host_us)
        # A camera makes frames ahead of time, marked with their future exposure.
        stale = (age > MAX_AGE_US + patience_us) | (age < -SAME_TIME_US)
        host_us = np.concatenate([[self._host_us], first.host_us])
        forward = _signed_us(np.diff(host_us)) > 0
        forward[0] |= self._host_us < 0
        rising = np.diff(np.concatenate([[self._counter], block.counter])) > 0
        seen.garbled += int(np.count_nonzero(garbled))
        seen.mixed += int(np.count_nonzero(mixed & ~garbled))
        seen.stale += int(np.count_nonzero(stale & ~garbled & ~mixed))
        seen.disordered += int(np.count_nonzero(~(forward & rising) & ~garbled & ~mixed))
        seen.exposed_us.append(first.host_us)
        self._counter = int(block.counter[-1])
        self._host_us = int(first.host_us[-1])


def _signed_us(difference: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return differences of times modulo `CLOCK_MODULUS_US`, nearest to zero."""
    half = CLOCK_MODULUS_US // 2
    signed: NDArray[np.int64] = (difference + half) % CLOCK_MODULUS_US - half
    return signed
