"""Rights of processes and program files, and dropping those not needed.

Linux divides root's rights into capabilities (capabilities(7)). The bus process needs three: raw
Ethernet frames, promiscuous mode for the EtherCAT library, and a real-time priority, which it takes
as far as permitted. It first drops everything else, also if started by root.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from ocmm_core.host import HOST


class Capability(IntEnum):
    """Capabilities by their number in the kernel (linux/capability.h)."""

    NET_ADMIN = 12
    NET_RAW = 13
    SYS_NICE = 23


NEEDED: frozenset[int] = frozenset(Capability)
"""Rights of the bus process beyond an ordinary process."""

_HEADER_VERSION_3 = 0x20080522
_PR_CAPBSET_DROP = 24
_PR_SET_NO_NEW_PRIVS = 38
_PR_CAP_AMBIENT = 47
_PR_CAP_AMBIENT_CLEAR_ALL = 4
_FILE_REVISIONS = (0x02000000, 0x03000000)
_FILE_REVISION_MASK = 0xFF000000
_FILE_EFFECTIVE = 1
_FILE_STRUCT = struct.Struct("<5I")


@dataclass(frozen=True, slots=True)
class ProcessRights:
    """Capabilities of a process by number, from ``/proc/PID/status``."""

    effective: frozenset[int]
    permitted: frozenset[int]
    inheritable: frozenset[int]
    bounding: frozenset[int]
    ambient: frozenset[int]
    no_new_privileges: bool
    """Its children cannot gain rights."""


def rights_of(pid: int | None = None) -> ProcessRights:
    """Return the rights of a process, default this one; raise OSError if it is gone."""
    status = Path("/proc", "self" if pid is None else str(pid), "status")
    lines = status.read_text(encoding="ascii", errors="replace").splitlines()
    fields = dict(line.split(":", 1) for line in lines)

    def held(name: str) -> frozenset[int]:
        return _numbers(int(fields[f"Cap{name}"], 16))

    return ProcessRights(
        effective=held("Eff"),
        permitted=held("Prm"),
        inheritable=held("Inh"),
        bounding=held("Bnd"),
        ambient=held("Amb"),
        no_new_privileges=fields["NoNewPrivs"].strip() == "1",
    )


def granted_by(program: Path) -> frozenset[int]:
    """Return the capabilities of a program file (``vfs_ns_cap_data``, linux/capability.h)."""
    try:
        content = os.getxattr(program, "security.capability")
    except OSError:
        return frozenset()
    if len(content) < _FILE_STRUCT.size:
        return frozenset()
    magic, low, _inheritable_low, high, _inheritable_high = _FILE_STRUCT.unpack_from(content)
    if magic & _FILE_REVISION_MASK not in _FILE_REVISIONS or not magic & _FILE_EFFECTIVE:
        return frozenset()
    return _numbers(high << 32 | low)


def allow_locked_memory() -> None:
    """Raise the memory lock limit, if permitted: the other means, a capability, is dropped."""
    if HOST.is_linux_like:
        import resource

        everything = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
        # Ordinary users may not raise it; systemd or limits.conf may have.
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_MEMLOCK, everything)


def give_up_all_but(kept: Iterable[int]) -> None:
    """Drop all capabilities but `kept`, permanently, for this and later threads: call it first."""
    if not HOST.is_linux_like:
        return
    kept = frozenset(kept)
    libc = ctypes.CDLL(None)
    own = rights_of()
    # Limits the rights of child processes; not always permitted, and then the last line has the
    # same effect.
    for number in own.bounding - kept:
        libc.prctl(_PR_CAPBSET_DROP, number, 0, 0, 0)
    _hold(libc, own.permitted & kept)
    libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)


def hold_nothing() -> None:
    """Drop all capabilities inherited by an ordinary user's process.

    For the window and the commands: they need none, and their children inherit none. A program file
    with its own rights, that of the bus process, still gets them. Applies to the calling thread and
    its later threads. Root keeps its capabilities, because its children would regain them anyway.
    """
    if HOST.is_linux_like and os.geteuid() != 0:
        _hold(ctypes.CDLL(None), frozenset())


def _hold(libc: ctypes.CDLL, kept: frozenset[int]) -> None:
    """Hold only these capabilities, all currently held, and make none inheritable."""
    libc.prctl(_PR_CAP_AMBIENT, _PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0)
    mask = sum(1 << number for number in kept)
    header = struct.pack("<Ii", _HEADER_VERSION_3, 0)
    low, high = mask & 0xFFFFFFFF, mask >> 32
    libc.capset(header, struct.pack("<6I", low, low, 0, high, high, 0))


def _numbers(mask: int) -> frozenset[int]:
    return frozenset(number for number in range(mask.bit_length()) if mask >> number & 1)


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
