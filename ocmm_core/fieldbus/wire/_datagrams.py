"""Encoding and decoding of EtherCAT frames and datagrams (ETG.1000.4).

The master library carries the process data. Everything that must not delay it (states, clocks,
mailboxes) travels in separate frames with indices that the library does not use and ignores.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from ocmm_core.errors import BusError

ETHERTYPE = 0x88A4
FRAME_BYTES = 1514
"""Longest Ethernet frame, without its check sequence."""
DATAGRAM_OVERHEAD = 12
"""Header and working counter of a datagram."""

_BROADCAST = b"\xff" * 6
OWN_SOURCE = bytes((0x00, 0x4F, 0x43, 0x4D, 0x4D, 0x01))
"""Slaves set bit 1 of the first byte, which distinguishes returned from sent frames."""
_PASSED = 0x02
_ETHERNET_HEAD = struct.Struct(">6s6sH")
_ETHERCAT_HEAD = struct.Struct("<H")
_DATAGRAM_HEAD = struct.Struct("<BBHHHH")
_COUNTER = struct.Struct("<H")
_LENGTH_MASK = 0x07FF
_MORE = 0x8000
_KIND_DATAGRAMS = 1
_SHORTEST_FRAME = 60
_DATAGRAMS_AT = _ETHERNET_HEAD.size + _ETHERCAT_HEAD.size
_SHORTEST_ANSWER = _DATAGRAMS_AT + _DATAGRAM_HEAD.size
_ETHERTYPE_BYTES = ETHERTYPE.to_bytes(2, "big")


class Command(IntEnum):
    """EtherCAT commands."""

    NOP = 0
    APRD = 1
    APWR = 2
    APRW = 3
    FPRD = 4
    FPWR = 5
    FPRW = 6
    BRD = 7
    BWR = 8
    BRW = 9
    LRD = 10
    LWR = 11
    LRW = 12
    ARMW = 13
    FRMW = 14


class Datagram(NamedTuple):
    command: int
    """EtherCAT command; may be unknown if received."""
    target: int
    """Position, station address, or low half of the logical address."""
    register: int
    """Memory address in the slave, or high half of the logical address."""
    data: bytes
    working_counter: int = 0
    """Number of slaves that took part; zero when sent."""


def encode_frame(index: int, datagrams: Sequence[Datagram]) -> bytes:
    """Return an Ethernet frame with datagrams; raise BusError if they exceed `FRAME_BYTES`.

    ``index``, 0 to 255, in every datagram (at least one), identifies the frame of an answer.
    """
    size = sum(len(datagram.data) + DATAGRAM_OVERHEAD for datagram in datagrams)
    total = _ETHERNET_HEAD.size + _ETHERCAT_HEAD.size + size
    if not datagrams or total > FRAME_BYTES:
        raise BusError(
            "bus.frame",
            f"{len(datagrams)} datagrams of {size} bytes do not make an EtherCAT frame.",
            "Report this as a program error.",
        )
    parts = [
        _ETHERNET_HEAD.pack(_BROADCAST, OWN_SOURCE, ETHERTYPE),
        _ETHERCAT_HEAD.pack(size | _KIND_DATAGRAMS << 12),
    ]
    for number, datagram in enumerate(datagrams, start=1):
        more = _MORE if number < len(datagrams) else 0
        parts.append(
            _DATAGRAM_HEAD.pack(
                datagram.command, index, datagram.target, datagram.register,
                len(datagram.data) | more, 0,
            )
        )  # fmt: skip
        parts += (datagram.data, _COUNTER.pack(datagram.working_counter))
    return b"".join(parts).ljust(_SHORTEST_FRAME, b"\x00")


class FrameForm:
    """Frame with constant datagrams: built once, sent and parsed many times."""

    def __init__(self, datagrams: Sequence[Datagram]) -> None:
        self._blank = bytearray(encode_frame(0, datagrams))
        self._index_at: list[int] = []
        layout = "<"
        at = _DATAGRAMS_AT
        for datagram in datagrams:
            self._index_at.append(at + 1)
            layout += f"BBHHHH{len(datagram.data)}sH"
            at += len(datagram.data) + DATAGRAM_OVERHEAD
        self._head = bytes(self._blank[_ETHERNET_HEAD.size : _DATAGRAMS_AT])
        self._end = at
        self._values = struct.Struct(layout)
        asked = self._values.unpack_from(self._blank, _DATAGRAMS_AT)
        # Fields that no slave changes; a broadcast counts the slaves in its target.
        self._commands, self._registers, self._lengths = asked[0::8], asked[3::8], asked[4::8]

    def encode(self, index: int) -> bytes:
        """Return the frame with an index, as `encode_frame` does."""
        blank = self._blank
        for at in self._index_at:
            blank[at] = index
        return bytes(blank)

    def answers(self, frame: bytes) -> list[Datagram] | None:
        """Return the datagrams of an answer; None unless it matches exactly."""
        if (
            len(frame) < self._end
            or frame[_ETHERNET_HEAD.size : _DATAGRAMS_AT] != self._head
            or frame[12:14] != _ETHERTYPE_BYTES
        ):
            return None
        values = self._values.unpack_from(frame, _DATAGRAMS_AT)
        if (
            values[0::8] != self._commands
            or values[3::8] != self._registers
            or values[4::8] != self._lengths
        ):
            return None
        columns = values[0::8], values[2::8], values[3::8], values[6::8], values[7::8]
        return list(map(Datagram, *columns))


def frame_index(frame: bytes) -> int | None:
    """Return the index of an EtherCAT frame, or None; checks nothing else."""
    if len(frame) < _SHORTEST_ANSWER or frame[12:14] != _ETHERTYPE_BYTES:
        return None
    return frame[_DATAGRAMS_AT + 1]


def has_passed(frame: bytes) -> bool:
    """Return whether an EtherCAT frame has passed a slave."""
    return bool(frame[6] & _PASSED)


def decode_frame(frame: bytes) -> tuple[int, tuple[Datagram, ...]]:
    """Return index and datagrams of an Ethernet frame; raise BusError if incomplete."""
    index = frame_index(frame)
    if index is None:
        raise _malformed("not an EtherCAT frame")
    (head,) = _ETHERCAT_HEAD.unpack_from(frame, _ETHERNET_HEAD.size)
    at = _ETHERNET_HEAD.size + _ETHERCAT_HEAD.size
    end = at + (head & _LENGTH_MASK)
    if head >> 12 != _KIND_DATAGRAMS or end > len(frame):
        raise _malformed("its header does not match its length")
    datagrams = []
    more = True
    while more:
        if at + DATAGRAM_OVERHEAD > end:
            raise _malformed("a datagram is missing")
        command, _index, target, register, flags, _event = _DATAGRAM_HEAD.unpack_from(frame, at)
        start = at + _DATAGRAM_HEAD.size
        length = flags & _LENGTH_MASK
        at = start + length + _COUNTER.size
        if at > end:
            raise _malformed("a datagram ends outside it")
        (counter,) = _COUNTER.unpack_from(frame, start + length)
        datagrams.append(
            Datagram(command, target, register, bytes(frame[start : start + length]), counter)
        )
        more = bool(flags & _MORE)
    return index, tuple(datagrams)


def answers_like(frame: bytes, asked: Sequence[Datagram]) -> tuple[Datagram, ...] | None:
    """Return the datagrams of a frame that answers `asked` (more flags allowed), else None."""
    try:
        _index, datagrams = decode_frame(frame)
    except BusError:
        return None
    return datagrams if [*map(_shape, asked)] == [*map(_shape, datagrams)] else None


def _shape(datagram: Datagram) -> tuple[int, int, int]:
    """Return fields that no slave changes; a broadcast counts slaves in its target."""
    return datagram.command, datagram.register, len(datagram.data)


def _malformed(why: str) -> BusError:
    return BusError(
        "bus.malformed",
        f"A frame on the bus cannot be read: {why}.",
        "Check cables and adapter; connect only cameras to this network.",
    )
