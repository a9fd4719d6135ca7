"""What is asked of the system itself and lies in no file."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.acquisition.bus_process import granted_by

_TIME_ERROR = 5
_TIMEX_BYTES = 512
"""struct timex has 208 bytes; the rest is room."""


def _clock_is_synchronised() -> bool | None:
    """Return whether the kernel calls its clock synchronised (adjtimex(2)); None where it is mute.

    ``timedatectl`` and ``chronyc`` say the same; this needs neither of them.
    """
    if sys.platform != "linux":
        return None
    state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    return None if state < 0 else bool(state != _TIME_ERROR)


@dataclass(frozen=True, slots=True)
class HostCalls:
    """What is asked of the system itself and lies in no file."""

    now: Callable[[], datetime] = lambda: datetime.now(UTC)
    """The computer's clock."""
    # Looked up when it is called: not every system has it, and this is imported on all.
    statvfs: Callable[[Path], os.statvfs_result] = lambda path: os.statvfs(path)
    fsync: Callable[[int], None] = os.fsync
    """`statvfs`, `fsync`: Of `os`."""
    owner: Callable[[Path], int] = lambda path: path.stat().st_uid
    """User number that a file belongs to."""
    granted: Callable[[Path], frozenset[int]] = granted_by
    """Capabilities by number that a program file gives to whoever starts it."""
    synchronised: Callable[[], bool | None] = _clock_is_synchronised
    """Whether the clock is; None where nobody knows."""
