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
"""struct timex has 208 bytes; the rest is reserve."""


def _clock_is_synchronised() -> bool | None:
    """Return whether the kernel clock is synchronised (adjtimex(2)); None if unknown.

    Needs neither ``timedatectl`` nor ``chronyc``, which report the same.
    """
    if sys.platform != "linux":
        return None
    state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    return None if state < 0 else bool(state != _TIME_ERROR)


@dataclass(frozen=True, slots=True)
class HostCalls:
    now: Callable[[], datetime] = lambda: datetime.now(UTC)
    # Resolved when called: not every system has it, and this module is imported on all.
    statvfs: Callable[[Path], os.statvfs_result] = lambda path: os.statvfs(path)
    fsync: Callable[[int], None] = os.fsync
    owner: Callable[[Path], int] = lambda path: path.stat().st_uid
    """User id of a file's owner."""
    granted: Callable[[Path], frozenset[int]] = granted_by
    """Capabilities by number that a program file grants."""
    synchronised: Callable[[], bool | None] = _clock_is_synchronised
