"""Raw Ethernet sockets next to the master's: find, listen, drain."""

from __future__ import annotations

import os
import socket
import stat
import struct
from array import array
from pathlib import Path

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
