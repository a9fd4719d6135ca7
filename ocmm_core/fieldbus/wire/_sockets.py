"""Raw Ethernet sockets next to the master's, and a passive tap with a file for Wireshark.

The kernel copies every EtherCAT frame with its time. Blocks of the file (IETF
draft-ietf-opsawg-pcapng): section header, interface description with times in nanoseconds, one
enhanced packet block per frame with its direction, and interface statistics with the drop count.
"""

from __future__ import annotations

import os
import select
import socket
import stat
import struct
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from ocmm_core.fieldbus.wire._datagrams import ETHERTYPE

_ETHERTYPE = 0x88A4
_SIOCGIFFLAGS = 0x8913
_UP, _RUNNING = 0x1, 0x40
_FRAME_BYTES = 2048
_SO_ATTACH_FILTER = 26
INDICES = range(256)
"""Of EtherCAT frames."""


def listen(interface: str, indices: range = INDICES) -> socket.socket:
    """Return a socket that receives the EtherCAT frames of `interface` with these indices."""
    # Without a protocol nothing comes before the filter.
    channel = socket.socket(socket.AF_PACKET, socket.SOCK_RAW | socket.SOCK_NONBLOCK, 0)
    try:
        receive_only(channel, indices)
        channel.bind((interface, _ETHERTYPE))
    except OSError:
        channel.close()
        raise
    return channel


def receive_only(channel: socket.socket, indices: range) -> None:
    """Have the kernel drop frames with other indices for a socket, before they wake a process."""
    # struct sock_filter: load byte 17; drop if below the first or above the last; else accept.
    lines = (
        (0x30, 0, 0, 17), (0x35, 0, 2, indices[0]), (0x25, 1, 0, indices[-1]),
        (0x06, 0, 0, _FRAME_BYTES), (0x06, 0, 0, 0),
    )  # fmt: skip
    program = array("B", b"".join(struct.pack("=HBBI", *line) for line in lines))
    address, _size = program.buffer_info()
    channel.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, struct.pack("HP", len(lines), address))


def receive(channel: socket.socket) -> bytes | None:
    """Return the next waiting frame of a socket, or None."""
    try:
        return channel.recv(_FRAME_BYTES, socket.MSG_DONTWAIT)
    except OSError:
        # Empty, or the link is down.
        return None


def waiting_on(channel: socket.socket) -> list[bytes]:
    """Return all waiting frames of a socket made by `listen`."""
    frames: list[bytes] = []
    take = channel.recv
    try:
        while True:
            frames.append(take(_FRAME_BYTES))
    except OSError:
        # Empty, or the link is down.
        return frames


def transmit(channel: socket.socket, frame: bytes) -> bool:
    """Send a frame; return whether the interface accepted it; never blocks."""
    try:
        channel.send(frame, socket.MSG_DONTWAIT)
    except OSError:
        return False
    return True


def drain(channel: socket.socket | None) -> None:
    """Discard all waiting frames of a socket."""
    try:
        while channel is not None:
            channel.recv(_FRAME_BYTES, socket.MSG_DONTWAIT)
    except OSError:
        return


def query_socket() -> socket.socket:
    """Return a socket for interface queries; it receives nothing.

    Same family as frame sockets: the service may create no others
    (``installer/linux/ocmm-acq@.service``).
    """
    return socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, 0)


class LinkWatch:
    """Link state of an interface, read with one cheap system call."""

    def __init__(self, interface: str) -> None:
        self._request = struct.pack("16s24x", interface.encode("ascii"))
        self._query = query_socket()

    def trouble(self) -> str:
        """Return why no frame can pass; empty if one can."""
        import fcntl

        try:
            answer = fcntl.ioctl(self._query, _SIOCGIFFLAGS, self._request)
        except OSError:
            return "is gone"
        (flags,) = struct.unpack_from("<H", answer, 16)
        if not flags & _UP:
            return "is switched off"
        return "" if flags & _RUNNING else "has no link"

    def close(self) -> None:
        """Close the socket; idempotent."""
        self._query.close()


def packet_sockets() -> set[int]:
    """Return the raw Ethernet sockets of this process."""
    found = set()
    for entry in Path("/proc/self/fd").iterdir():
        descriptor = int(entry.name)
        try:
            if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                continue
            with socket.socket(fileno=os.dup(descriptor)) as duplicate:
                if duplicate.family == socket.AF_PACKET:
                    found.add(descriptor)
        except OSError:
            # The descriptor of the listing itself is closed by now.
            continue
    return found


_SECTION, _INTERFACE, _STATISTICS_BLOCK, _PACKET = 0x0A0D0D0A, 1, 5, 6
_BYTE_ORDER, _UNKNOWN_LENGTH = 0x1A2B3C4D, -1
_ETHERNET = 1
SNAP_BYTES = 2048
"""Longer than any Ethernet frame."""
_END, _HARDWARE_OS, _USER_APPLICATION = 0, 3, 4
_NAME, _RESOLUTION, _FLAGS = 2, 9, 2
_NANOSECONDS = b"\x09"
_RECEIVED, _DROPPED = 4, 5
_INBOUND, _OUTBOUND = 1, 2
_EPB = struct.Struct("<IIIII")
_FLAGS_OPTION = struct.Struct("<HHI")
_END_OF_OPTIONS = struct.pack("<HH", _END, 0)
_OPTIONS = {
    outgoing: _FLAGS_OPTION.pack(_FLAGS, 4, _OUTBOUND if outgoing else _INBOUND) + _END_OF_OPTIONS
    for outgoing in (False, True)
}


def pcapng_head(interface: str, program: str) -> bytes:
    """Return the file header: section and interface description."""
    section = struct.pack("<IHHq", _BYTE_ORDER, 1, 0, _UNKNOWN_LENGTH)
    section += _option(_HARDWARE_OS, b"Linux") + _option(_USER_APPLICATION, program.encode("utf-8"))
    description = struct.pack("<HHI", _ETHERNET, 0, SNAP_BYTES)
    description += _option(_NAME, interface.encode("utf-8")) + _option(_RESOLUTION, _NANOSECONDS)
    return _block(_SECTION, section + _END_OF_OPTIONS) + _block(
        _INTERFACE, description + _END_OF_OPTIONS
    )


def pcapng_frame(frame: bytes, utc_ns: int, *, outgoing: bool) -> bytes:
    """Return the block of one frame, from the destination address, without checksum.

    ``utc_ns``: time at the interface, ns since 1970; ``outgoing``: sent by this computer.
    """
    kept = frame[:SNAP_BYTES]
    head = _EPB.pack(0, utc_ns >> 32, utc_ns & 0xFFFFFFFF, len(kept), len(frame))
    return _block(_PACKET, head + _padded(kept) + _OPTIONS[outgoing])


def pcapng_end(utc_ns: int, received: int, dropped: int) -> bytes:
    """Return the last block: received and dropped frames."""
    content = struct.pack("<III", 0, utc_ns >> 32, utc_ns & 0xFFFFFFFF)
    content += _option(_RECEIVED, struct.pack("<Q", received))
    content += _option(_DROPPED, struct.pack("<Q", dropped))
    return _block(_STATISTICS_BLOCK, content + _END_OF_OPTIONS)


def _block(kind: int, content: bytes) -> bytes:
    size = struct.pack("<I", len(content) + 12)
    return struct.pack("<I", kind) + size + content + size


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + _padded(value)


def _padded(content: bytes) -> bytes:
    return content + bytes(-len(content) % 4)


_ALL = 0x0003
"""Linux: ETH_P_ALL. Only such sockets see outgoing frames; `refuse_other_programs` ignores them."""
_SOL_PACKET, _STATISTICS = 263, 6
_TIMESTAMP_NS, _OUTGOING = 35, 4
"""Linux: SO_TIMESTAMPNS; PACKET_OUTGOING."""
_BUFFER_BYTES = 8 << 20
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
