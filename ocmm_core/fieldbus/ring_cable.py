"""A redundancy cable closes the wire to a ring: each frame of ours goes out at both ends.

Where the ring is whole, the frame from the first end comes out at the second, worked on by all
cameras, and the one from the second comes out at the first, untouched. Where a cable is broken,
each comes back where it went out, worked on by the cameras on its side of the break (ETG.1000.4:
the processing unit of a slave follows its port 0). Either way both copies together are the answer.
"""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.datagrams import Command, Datagram, decode_frame, encode_frame

_OPEN_COPIES = 3
"""So many answers in a row must say that the ring is open: one copy alone may be lost."""
_SUMS = {Command.BRD, Command.BRW}
"""Answers to which every camera adds its own bits."""


class RingCable:
    """Puts the two copies of an answer together and tells whether the ring is whole.

    Attributes
    ----------
    is_open
        The redundancy cable, or another cable of the ring, is broken.
    """

    def __init__(self) -> None:
        self.is_open = False
        self._halves: dict[int, tuple[int, bytes]] = {}
        self._row = 0

    def take(self, end: int, frame: bytes, index: int) -> bytes | None:
        """Take the copy that came in at an end (0 or 1); return the answer once it is whole."""
        before = self._halves.pop(index, None)
        if before is None or before[0] == end:
            self._halves[index] = (end, frame)
            return None
        first, second = (frame, before[1]) if end == 0 else (before[1], frame)
        try:
            _, near = decode_frame(first)
            _, far = decode_frame(second)
            answer = encode_frame(index, merge(near, far))
        except BusError:
            # One of them is damaged: the channel counts it as such.
            return frame
        self._note(broken=any(datagram.working_counter for datagram in near))
        return answer

    def settle(self) -> list[bytes]:
        """Return the copies whose counterpart did not come, as the answers they must be."""
        alone = [frame for _, frame in self._halves.values()]
        self._halves.clear()
        if alone:
            self._note(broken=True)
        return alone

    def _note(self, *, broken: bool) -> None:
        self._row = self._row + 1 if broken else 0
        self.is_open = self._row >= _OPEN_COPIES


def merge(near: Sequence[Datagram], far: Sequence[Datagram]) -> list[Datagram]:
    """Return the datagrams of an answer from both copies of it.

    Raises
    ------
    BusError
        They are not copies of one frame.
    """
    if [_kind(one) for one in near] != [_kind(other) for other in far]:
        raise BusError(
            "bus.malformed",
            "Two copies of a frame on the bus differ.",
            "Check cables and adapters; let nothing but cameras be on this network.",
        )
    merged = []
    for one, other in zip(near, far, strict=True):
        counter = one.working_counter + other.working_counter
        worked = one if one.working_counter else other
        data = worked.data
        if one.working_counter and other.working_counter and one.command in _SUMS:
            data = bytes(a | b for a, b in zip(one.data, other.data, strict=True))
        merged.append(Datagram(worked.command, worked.target, worked.register, data, counter))
    return merged


def _kind(datagram: Datagram) -> tuple[int, int, int]:
    """Return what is the same in both; a broadcast counts the slaves in its target."""
    return datagram.command, datagram.register, len(datagram.data)
