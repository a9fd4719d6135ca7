"""Detection of a second master, which would corrupt the frames of the first.

For programs on this computer the kernel lists EtherCAT sockets per interface
(``/proc/net/packet``); they end with their process, even a killed one. Our own socket is opened
before the check, so of two simultaneous starts at least one sees the other. Masters elsewhere are
seen by their frames: incoming frames that have not passed a camera, or with an index that is not
used here. Masters that bypass the kernel are not seen while silent. `MasterWatch` looks for masters
that start later.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._datagrams import ETHERTYPE, OWN_SOURCE, frame_index, has_passed
from ocmm_core.fieldbus.wire._interface import interface_index

_SOCKETS = Path("/proc/self/net/packet")
_PROTOCOL, _INTERFACE, _INODE = 3, 4, 8
"""Columns of its lines."""
LISTEN_S = 0.03
"""A master with a cycle of up to 10 ms sends three frames in it."""
_WATCH_NS, _QUICK_NS = 200_000_000, 20_000_000
_REMEDY = (
    "Close that program (another OCMM window or command, a configuration tool), then try again."
)
FEW = 2
"""A single damaged frame may look foreign this many times."""


def is_foreign(frame: bytes) -> bool:
    """Return whether an incoming frame of another master has passed no camera."""
    if frame_index(frame) is None or has_passed(frame):
        return False
    return frame[6:12] != OWN_SOURCE


def refuse_other_programs(interfaces: Sequence[str]) -> None:
    """Raise BusError if another program has an EtherCAT socket on an interface.

    ``bus.second_master`` names the program if this user may read it.
    """
    found = MasterWatch(interfaces).trouble(0, disturbed=True)
    if found:
        raise BusError("bus.second_master", found, _REMEDY)


class MasterWatch:
    """Watch of interfaces for programs that open them as EtherCAT master."""

    def __init__(self, interfaces: Sequence[str]) -> None:
        self._interfaces = tuple(filter(None, interfaces))
        self._known: set[int] = set()
        self._suspect = -1
        self._words = ""
        self._next_ns: int | None = None

    def trouble(self, now_ns: int, *, disturbed: bool) -> str:
        """Return who else is master of an interface, in a sentence; empty if no other program.

        The kernel is queried about five times a second, more often on a disturbed bus. On an
        undisturbed one a socket must be seen twice: checks of an interface open one briefly.
        """
        pause_ns = _QUICK_NS if disturbed or self._suspect >= 0 else _WATCH_NS
        if (
            self._next_ns is not None
            and now_ns < self._next_ns
            and self._next_ns - now_ns <= pause_ns
        ):
            return self._words
        self._next_ns = now_ns + pause_ns
        found = next(self._others(), None)
        if found is None:
            self._suspect, self._words = -1, ""
            return ""
        interface, inode = found
        seen_before = inode == self._suspect
        # The search through all processes is slow: once per socket.
        if (seen_before or disturbed) and not (seen_before and self._words):
            told = _who(inode)
            self._words = f"{told} uses interface '{interface}' as an EtherCAT master."
        self._suspect = inode
        return self._words

    def _others(self) -> Iterator[tuple[str, int]]:
        for interface in self._interfaces:
            for inode in _sockets_on(interface):
                if inode not in self._known:
                    self._known = set(_inodes_of(Path("/proc/self")))
                if inode not in self._known:
                    yield interface, inode


def foreign_frames(interface: str, count: int) -> BusError:
    """Return the error for another master on the bus."""
    return BusError(
        "bus.second_master",
        f"Another master sends on the bus of interface '{interface}' ({count} frames that did "
        "not come from this computer).",
        "Disconnect the other computer or controller from the camera bus, or stop its master.",
    )


def _sockets_on(interface: str) -> list[int]:
    number = interface_index(interface)
    try:
        lines = _SOCKETS.read_text(encoding="ascii").splitlines()[1:]
    except OSError:
        return []
    found = []
    for fields in map(str.split, lines):
        of_ethercat = len(fields) > _INODE and int(fields[_PROTOCOL], 16) == ETHERTYPE
        if of_ethercat and int(fields[_INTERFACE]) == number:
            found.append(int(fields[_INODE]))
    return found


def _inodes_of(process: Path) -> list[int]:
    found = []
    try:
        entries = list((process / "fd").iterdir())
    except OSError:
        return []
    for entry in entries:
        try:
            target = os.readlink(entry)  # noqa: PTH115 - it leads to no path
        except OSError:
            continue
        if target.startswith("socket:["):
            found.append(int(target[8:-1]))
    return found


def _who(inode: int) -> str:
    """Return the program that owns a socket, if this user may read it."""
    for process in Path("/proc").iterdir():
        if process.name.isdigit() and inode in _inodes_of(process):
            try:
                name = (process / "comm").read_text(encoding="utf-8", errors="replace").strip()
            except OSError:
                break
            return f"The program '{name}' (process {process.name})"
    return "Another program on this computer"
