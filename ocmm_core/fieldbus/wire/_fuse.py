"""Time limit for master library calls that would not end if the cable breaks."""

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
    ret: int
    eeprom: int


@contextlib.contextmanager
def fuse(
    timeouts: _Timeouts, sockets: Sequence[socket.socket], *, stretched: bool, ring: bool
) -> Iterator[None]:
    """Limit how long pysoem waits if the cable breaks during mapping.

    It would read thousands of EEPROM words, wait 8 ms for each and hold the GIL: 84 s for this
    process (measured). After a moment a helper process makes the shared socket non-blocking; the
    rest then takes half a second.
    """
    kept = timeouts.ret, timeouts.eeprom
    fuse_s = _FUSE_S
    if stretched:
        fuse_s = _FUSE_STRETCHED_S
    else:
        # No effect with one blocking socket, but with two; the EEPROM is not needed.
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
    """Make these open sockets blocking or not, for all processes that share them."""
    for own in sockets:
        # Only the flag of the open file, which pysoem's own descriptor shares.
        os.set_blocking(own.fileno(), blocking)


def _fork_quietly() -> int:
    """Fork; the threads warning concerns children with more than one system call."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()
