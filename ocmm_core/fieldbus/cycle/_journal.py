"""Bus events; similar events are merged, so they never flood."""

from __future__ import annotations

import time
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass

from ocmm_core.fieldbus.report import EDGES_US, MAX_EVENTS, BusEvent, Histogram, alarm_of_code

OPERATION = "bus.operation"
"""Event code: bus in operation (again)."""
ERROR_OVER = "bus.error_over"
"""Event code: a camera reports the end of an error."""
_GROUP_NS = 1_000_000_000
"""Similar events closer than this are merged."""


@dataclass(slots=True)
class _Entry:
    number: int
    utc_ns: int
    cycle: int
    code: str
    camera: str
    what: str
    remedy: str
    cycles: int
    last_ns: int


class Journal:
    """Ring of the newest events."""

    def __init__(self) -> None:
        self.dropped = 0
        self._entries: deque[_Entry] = deque()
        self._open: dict[tuple[str, str], _Entry] = {}
        self._number = 0

    def note(
        self,
        code: str,
        what: str,
        *,
        cycle: int,
        now_ns: int,
        camera: str = "",
        remedy: str = "",
        cycles: int = 1,
    ) -> bool:
        """Record an event, see `BusEvent`; return whether it is new.

        An alarm's remedy may be omitted; `now_ns` is monotonic host time.
        """
        entry = self._open.get((code, camera))
        if entry is not None and now_ns - entry.last_ns <= _GROUP_NS:
            entry.cycles += cycles
            entry.last_ns = now_ns
            return False
        alarm = alarm_of_code(code)
        if not remedy and alarm is not None:
            remedy = alarm.spec.remedy
        self._number += 1
        entry = _Entry(
            self._number, time.time_ns(), cycle, code, camera, what, remedy, cycles, now_ns
        )
        self._entries.append(entry)
        self._open[code, camera] = entry
        if len(self._entries) > MAX_EVENTS:
            self._entries.popleft()
            self.dropped += 1
        return True

    def events(self) -> tuple[BusEvent, ...]:
        """Return the newest events, newest last."""
        return tuple(
            BusEvent(
                number=entry.number,
                utc_ns=entry.utc_ns,
                cycle=entry.cycle,
                code=entry.code,
                camera=entry.camera,
                what=entry.what,
                remedy=entry.remedy,
                cycles=entry.cycles,
            )
            for entry in self._entries
        )


class Durations:
    """Counts durations in the bins of a report."""

    def __init__(self) -> None:
        self._edges_ns = [int(edge * 1000) for edge in EDGES_US]
        self._counts = [0] * (len(EDGES_US) + 1)
        self._worst_ns = 0

    def add(self, duration_ns: int) -> None:
        self._counts[bisect_left(self._edges_ns, duration_ns)] += 1
        self._worst_ns = max(self._worst_ns, duration_ns)

    def histogram(self) -> Histogram:
        """Return the counts so far."""
        return Histogram(
            edges_us=EDGES_US, counts=tuple(self._counts), worst_us=self._worst_ns / 1e3
        )
