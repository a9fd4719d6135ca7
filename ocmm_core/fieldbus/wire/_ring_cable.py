"""A redundancy cable closes the wire to a ring; this follows a frame of ours through it.

On a whole ring a frame comes out at the other end, worked on by all cameras. Where a cable is
broken it comes back at the end where it went in, worked on by the cameras before the break, and is
sent in once more at the other end for the rest: so every camera works on it once, in the order of
the wire (ETG.1000.4: the processing unit of a slave follows its port 0). The master library does
the same with the process data.
"""

from __future__ import annotations

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._datagrams import Command, decode_frame

_OPEN_FRAMES = 3
"""So many frames in a row must say that the ring is open."""
_KEPT = 64


class RingCable:
    """Where frames came out, and whether the ring is whole.

    Attributes
    ----------
    is_open
        The redundancy cable, or another cable of the ring, is broken.
    reached
        Where the ring is in two parts: how many cameras are reached from the first end.
    """

    def __init__(self) -> None:
        self.is_open = False
        self.reached: int | None = None
        self._entered: dict[int, int] = {}
        self._row = 0

    def sent(self, index: int, end: int) -> None:
        """Note that a frame went in at an end (0 or 1)."""
        self._entered.pop(index, None)
        self._entered[index] = end
        while len(self._entered) > _KEPT:
            self._entered.pop(next(iter(self._entered)))

    def is_whole(self, index: int, end: int, frame: bytes, *, other_has_link: bool) -> bool:
        """Say whether a frame that came out at an end is the answer, or must go in at the other."""
        came_back = self._entered.get(index) == end
        if came_back and other_has_link:
            # What it brings next time is the answer.
            del self._entered[index]
            self._note(broken=True, reached=_count(frame))
            return False
        if index in self._entered:
            self._note(broken=came_back, reached=None)
        return True

    def _note(self, *, broken: bool, reached: int | None) -> None:
        self._row = self._row + 1 if broken else 0
        self.is_open = self._row >= _OPEN_FRAMES
        if not broken:
            self.reached = None
        elif reached is not None:
            self.reached = reached


def _count(frame: bytes) -> int | None:
    """Return how many cameras answered a broadcast in a frame; None where there is none."""
    try:
        _, datagrams = decode_frame(frame)
    except BusError:
        return None
    for datagram in datagrams:
        if datagram.command == Command.BRD:
            return datagram.working_counter
    return None
