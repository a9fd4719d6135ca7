"""Line between the conformance test and a camera: datagrams and a clock.

The rules use nothing else: they also run on a camera in this process, in the line's time.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Protocol

from ocmm_core.fieldbus.wire import Datagram, RawLine

_PAUSE_NS = 10_000_000
"""Longer pauses of the computer distort timings and trip camera watchdogs."""


class ConformLine(Protocol):
    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        """Send datagrams in one frame; return the answers; raise BusError if lost."""
        ...

    def now_ns(self) -> int: ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def paused_ns(self) -> int:
        """Return the longest pause of this computer since the last call; 0 if none."""
        ...


class WireLine:
    """Network interface with this computer's clock; implements `ConformLine`."""

    def __init__(self, line: RawLine) -> None:
        self._line = line
        self._paused_ns = 0

    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        begin = time.monotonic_ns()
        answers = self._line.exchange_all(datagrams)
        # The controller answers in hardware: delays come from this computer or a lost frame.
        self._note(time.monotonic_ns() - begin)
        return answers

    def now_ns(self) -> int:
        """Return the time of this computer since its start, ns."""
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        begin = time.monotonic_ns()
        time.sleep(seconds)
        self._note(time.monotonic_ns() - begin - round(seconds * 1e9))

    def paused_ns(self) -> int:
        longest, self._paused_ns = self._paused_ns, 0
        return longest

    def _note(self, late_ns: int) -> None:
        if late_ns > _PAUSE_NS:
            self._paused_ns = max(self._paused_ns, late_ns)
