"""The line between the conformance test and a camera: frames of datagrams, and a clock.

The rules know nothing else of the world, so that they run over a real wire and, in the time of
the wire instead of the computer's, on a camera in the same process.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Protocol

from ocmm_core.fieldbus.wire import Datagram, RawLine


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


class WireLine:
    """A network interface and the clock of this computer; implements `ConformLine`.

    Parameters
    ----------
    line
        Open; nobody else may use the wire.
    """

    def __init__(self, line: RawLine) -> None:
        self._line = line

    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        """Send datagrams in one frame; return them as they came back."""
        return self._line.exchange_all(datagrams)

    def now_ns(self) -> int:
        """Return the time of this computer since its start, ns."""
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        time.sleep(seconds)
