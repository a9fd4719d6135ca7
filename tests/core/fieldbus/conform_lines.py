"""Lines for the conformance test without a network: cameras in this process, in their own time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire import Datagram, decode_frame, encode_frame
from ocmm_sim.bus import Chain, Unit

_WAY_NS = 30_000
"""From the computer to the camera and back."""
_STEP_NS = 2_000_000


class TimedLine:
    """A camera in this process, with a clock advanced by the test; a `ConformLine`.

    Parameters
    ----------
    process
        Works on an Ethernet frame in place, at a time; returns whether an answer leaves.
    idle
        Lets the camera work at a time, as between frames.
    """

    def __init__(
        self, process: Callable[[bytearray, int], bool], idle: Callable[[int], object]
    ) -> None:
        self._process = process
        self._idle = idle
        self._now_ns = 10**12
        self.pauses_ns: list[int] = []

    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        self._now_ns += _WAY_NS
        self._idle(self._now_ns)
        frame = bytearray(encode_frame(1, datagrams))
        if not self._process(frame, self._now_ns):
            raise BusError("bus.silent", "No camera answers.", "Switch it on.")
        self._now_ns += _WAY_NS
        return list(decode_frame(bytes(frame))[1])

    def now_ns(self) -> int:
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        end = self._now_ns + round(seconds * 1e9)
        while self._now_ns < end:
            self._now_ns = min(end, self._now_ns + _STEP_NS)
            self._idle(self._now_ns)
        # Work in a thread of the camera takes time of this computer.
        time.sleep(0)

    def paused_ns(self) -> int:
        return self.pauses_ns.pop() if self.pauses_ns else 0


def software_line(unit: Unit) -> TimedLine:
    """Return a line with one software camera."""
    chain = Chain([unit])

    def idle(now_ns: int) -> None:
        unit.camera.keep_up(now_ns)
        unit.camera.generate(now_ns)
        unit.camera.esc.poll(now_ns)

    return TimedLine(lambda frame, now: chain.ways[0].segment.process(frame, now), idle)
