"""Real-time priority for the processes on the wire, as far as permitted."""

from __future__ import annotations

import ctypes
import os

BUS_PRIORITY = 60
CAMERA_PRIORITY = 50
"""Software cameras answer in time as real ones, but never before the bus process."""

_LOCK_CURRENT_AND_FUTURE = 3
_SET_TIMER_SLACK = 29
_SPARE_PROCESSORS = 4
"""With fewer, other programs need all of them."""


def take_priority(priority: int) -> str | None:
    """Set a real-time priority; return what this user may not have."""
    ctypes.CDLL(None).prctl(_SET_TIMER_SLACK, 1, 0, 0, 0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return "no real-time priority for this user; cycles may be late on a busy computer"
    return None


def take_processor(wanted: int | None = None) -> str | None:
    """Pin to CPU `wanted`, or the last one of enough; return why not, or None."""
    allowed = sorted(os.sched_getaffinity(0))
    if wanted is not None:
        try:
            # Also an isolated one, which is not in the given set.
            os.sched_setaffinity(0, [wanted])
        except (OSError, OverflowError):
            given = ", ".join(map(str, allowed))
            return f"processor {wanted} cannot be used; the bus process runs on {given}"
        return None
    if len(allowed) == 1 and (os.cpu_count() or 1) >= _SPARE_PROCESSORS:
        # Pinned by its parent: `CPUAffinity` of the service, on an isolated processor.
        return None
    if len(allowed) < _SPARE_PROCESSORS:
        return f"no dedicated processor: this computer has only {len(allowed)}"
    try:
        os.sched_setaffinity(0, allowed[-1:])
    except OSError:
        return "no dedicated processor for this user"
    return None


def lock_memory() -> str | None:
    """Lock all memory of this process; return what this user may not have."""
    import resource

    soft, _hard = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    # With a limit, locking future memory would make later allocations fail.
    allowed = soft == resource.RLIM_INFINITY or os.geteuid() == 0
    if allowed and ctypes.CDLL(None).mlockall(_LOCK_CURRENT_AND_FUTURE) == 0:
        return None
    return "this user cannot lock memory"
