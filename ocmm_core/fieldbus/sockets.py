"""Raw Ethernet sockets beside the master's own: find it, listen with it, empty it."""

from __future__ import annotations

import os
import socket
import stat
from pathlib import Path

_ETHERTYPE = 0x88A4


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


def drain(channel: socket.socket | None) -> int:
    """Throw away what waits on a socket; return how many answers it was."""
    count = 0
    while channel is not None:
        try:
            channel.recv(16, socket.MSG_DONTWAIT)
        except OSError:
            # Nothing more, or the link is down.
            break
        count += 1
    return count


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
