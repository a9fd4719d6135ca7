"""Passive tap of an interface: copies of every EtherCAT frame with its time, by the kernel."""

from __future__ import annotations

import select
import socket
import struct
from collections.abc import Iterator
from typing import NamedTuple

from ocmm_core.fieldbus.wire._datagrams import ETHERTYPE

_ALL = 0x0003
"""Linux: ETH_P_ALL. Only such sockets see outgoing frames; `refuse_other_programs` ignores them."""
_SOL_PACKET, _STATISTICS = 263, 6
_TIMESTAMP_NS, _OUTGOING = 35, 4
"""Linux: SO_TIMESTAMPNS; PACKET_OUTGOING."""
_BUFFER_BYTES = 8 << 20
_FRAME_BYTES = 2048
_TIME = struct.Struct("@qq")
_ETHERTYPE_BYTES = ETHERTYPE.to_bytes(2, "big")


class TappedFrame(NamedTuple):
    """A captured frame: bytes, time (ns since 1970), and direction."""

    content: bytes
    utc_ns: int
    outgoing: bool


class Tap:
    """Tap of an interface accepted by `check_interface`.

    ``received`` and ``dropped`` count the kernel's frames, delivered and lost for lack of room.
    """

    def __init__(self, interface: str) -> None:
        self.received = self.dropped = 0
        self._channel = socket.socket(
            socket.AF_PACKET, socket.SOCK_RAW | socket.SOCK_NONBLOCK, socket.htons(_ALL)
        )
        try:
            self._channel.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            self._channel.setsockopt(socket.SOL_SOCKET, _TIMESTAMP_NS, 1)
            self._channel.bind((interface, _ALL))
        except OSError:
            self._channel.close()
            raise

    def frames(self, wait_s: float) -> Iterator[TappedFrame]:
        """Yield waiting frames; wait up to `wait_s` for the first."""
        select.select([self._channel], [], [], wait_s)
        while True:
            try:
                content, beside, _flags, address = self._channel.recvmsg(_FRAME_BYTES, 64)
            except OSError:
                # Empty, or the interface is down.
                return
            if content[12:14] != _ETHERTYPE_BYTES:
                continue
            seconds, rest = _TIME.unpack_from(beside[0][2]) if beside else (0, 0)
            yield TappedFrame(content, seconds * 1_000_000_000 + rest, address[2] == _OUTGOING)

    def count(self) -> None:
        """Update `received` and `dropped`; the kernel resets its counts on reading."""
        content = self._channel.getsockopt(_SOL_PACKET, _STATISTICS, 8)
        received, dropped = struct.unpack("@II", content)
        self.received += received
        self.dropped += dropped

    def close(self) -> None:
        self._channel.close()
