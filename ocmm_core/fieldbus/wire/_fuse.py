"""A fuse for calls of the master library that would not end where the cable breaks meanwhile."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import time
import warnings
from collections.abc import Iterator, Sequence
from typing import Protocol

_FUSE_STRETCHED_S = 30.0
_FUSE_S = 0.1
_FUSE_RET_US, _FUSE_RET_RING_US = 50, 1000


class _Timeouts(Protocol):
    """The library's own, one set a process, us."""

    ret: int
    eeprom: int


@contextlib.contextmanager
def fuse(
    timeouts: _Timeouts, sockets: Sequence[socket.socket], *, stretched: bool, ring: bool
) -> Iterator[None]:
    """Keep pysoem from waiting where the cable breaks while it maps.

    It would then ask for thousands of words of the EEPROM, wait 8 ms for each and hold the
    GIL: 84 s without an end for this process (measured). After a moment a helper switches
    the socket, which it shares, to not waiting; then the rest takes half a second.

    Parameters
    ----------
    timeouts
        Of the library; restored at the end.
    stretched
        The time of the bus waits for this computer.
    ring
        There is a redundancy cable.
    """
    kept = timeouts.ret, timeouts.eeprom
    fuse_s = _FUSE_S
    if stretched:
        fuse_s = _FUSE_STRETCHED_S
    else:
        # Without effect while one socket waits, but not for two; the EEPROM is not needed.
        timeouts.ret = timeouts.eeprom = _FUSE_RET_RING_US if ring else _FUSE_RET_US
    helper = _fork_quietly()
    if helper == 0:
        try:
            time.sleep(fuse_s)
            set_blocking(sockets, blocking=False)
        finally:
            os._exit(0)
    try:
        yield
    finally:
        os.kill(helper, signal.SIGKILL)
        os.waitpid(helper, 0)
        set_blocking(sockets, blocking=True)
        timeouts.ret, timeouts.eeprom = kept


def set_blocking(sockets: Sequence[socket.socket], *, blocking: bool) -> None:
    """Let all who share these open sockets wait for them, or not."""
    for own in sockets:
        # Only the flag of the open file, which pysoem's own descriptor shares.
        os.set_blocking(own.fileno(), blocking)


def _fork_quietly() -> int:
    """Fork; the warning about other threads is for children that do more than one system call."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()
