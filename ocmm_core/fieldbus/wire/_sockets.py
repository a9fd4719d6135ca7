"""Raw Ethernet sockets beside the master's own: find it, listen with it, empty it."""

from __future__ import annotations

import os
import socket
import stat
import struct
from pathlib import Path

_ETHERTYPE = 0x88A4
_SIOCGIFFLAGS = 0x8913
_UP, _RUNNING = 0x1, 0x40
_FRAME_BYTES = 2048


def listen(interface: str) -> socket.socket:
    """Return a socket that sees every EtherCAT frame that comes in on ``interface``."""
    channel = socket.socket(
        socket.AF_PACKET, socket.SOCK_RAW | socket.SOCK_NONBLOCK, socket.htons(_ETHERTYPE)
    )
    try:
        channel.bind((interface, _ETHERTYPE))
    except OSError:
        channel.close()
        raise
    return channel


def receive(channel: socket.socket) -> bytes | None:
    """Return the next frame that waits on a socket, or None."""
    try:
        return channel.recv(_FRAME_BYTES, socket.MSG_DONTWAIT)
    except OSError:
        # Nothing there, or the link is down.
        return None


def waiting_on(channel: socket.socket) -> list[bytes]:
    """Return all frames that wait on a socket that `listen` made."""
    frames: list[bytes] = []
    take = channel.recv
    try:
        while True:
            frames.append(take(_FRAME_BYTES))
    except OSError:
        # Nothing there any more, or the link is down.
        return frames


def transmit(channel: socket.socket, frame: bytes) -> bool:
    """Send a frame and say whether the interface took it; never waits."""
    try:
        channel.send(frame, socket.MSG_DONTWAIT)
    except OSError:
        return False
    return True


def drain(channel: socket.socket | None) -> None:
    """Throw away what waits on a socket."""
    try:
        while channel is not None:
            channel.recv(_FRAME_BYTES, socket.MSG_DONTWAIT)
    except OSError:
        return


def query_socket() -> socket.socket:
    """Return a socket to ask the kernel about interfaces with; it receives nothing.

    Of the same family as those that carry frames: the service may make no others
    (``installer/linux/ocmm-acq@.service``).
    """
    return socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, 0)


class LinkWatch:
    """Is there a link on an interface? Asked with one system call, as often as one likes.

    Parameters
    ----------
    interface
        Its name; it need not exist (any more).
    """

    def __init__(self, interface: str) -> None:
        self._request = struct.pack("16s24x", interface.encode("ascii"))
        self._query = query_socket()

    def trouble(self) -> str:
        """Return why no frame can pass, or an empty text where one can."""
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
        """Give the socket back; may be called twice."""
        self._query.close()


def packet_sockets() -> set[int]:
    """Return the descriptors of this process that are raw Ethernet sockets."""
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
