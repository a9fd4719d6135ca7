"""The line between the conformance test and a camera: frames of datagrams, and a clock.

The rules know nothing else of the world, so that they run over a real wire and, in the time of
the wire instead of the computer's, on a camera in the same process.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Protocol

from ocmm_core.fieldbus.wire import Datagram, RawLine

_PAUSE_NS = 10_000_000
"""A computer that is late by more spoils what is timed, and what the watchdog of a camera sees."""


class ConformLine(Protocol):
    """A wire with the camera under test."""

    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        """Send datagrams in one frame; return them as they came back.

        Raises
        ------
        BusError
            They do not come back.
        """
        ...

    def now_ns(self) -> int:
        """Return the time of the line."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def paused_ns(self) -> int:
        """Return for how long this computer paused at most since the last call, 0: it did not."""
        ...


class WireLine:
    """A network interface and the clock of this computer; implements `ConformLine`.

    Parameters
    ----------
    line
        Open; nobody else may use the wire.
    """

    def __init__(self, line: RawLine) -> None:
        self._line = line
        self._paused_ns = 0

    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        """Send datagrams in one frame; return them as they came back."""
        begin = time.monotonic_ns()
        answers = self._line.exchange_all(datagrams)
        # The controller of a camera answers frames by itself, whatever its firmware does: what
        # takes long here is this computer, or a frame that was lost.
        self._note(time.monotonic_ns() - begin)
        return answers

    def now_ns(self) -> int:
        """Return the time of this computer since its start, ns."""
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        begin = time.monotonic_ns()
        time.sleep(seconds)
        self._note(time.monotonic_ns() - begin - round(seconds * 1e9))

    def paused_ns(self) -> int:
        """Return for how long this computer paused at most since the last call."""
        longest, self._paused_ns = self._paused_ns, 0
        return longest

    def _note(self, late_ns: int) -> None:
        if late_ns > _PAUSE_NS:
            self._paused_ns = max(self._paused_ns, late_ns)
