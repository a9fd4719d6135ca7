"""Detection of a second master, which would corrupt the frames of the first.

For programs on this computer the kernel lists EtherCAT sockets per interface
(``/proc/net/packet``); they end with their process, even a killed one. Our own socket is opened
before the check, so of two simultaneous starts at least one sees the other. Masters elsewhere are
seen by their frames: incoming frames that have not passed a camera. Masters that bypass the kernel
are not seen while silent.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._datagrams import ETHERTYPE, OWN_SOURCE, frame_index, has_passed
from ocmm_core.fieldbus.wire._interface import interface_index

_SOCKETS = Path("/proc/self/net/packet")
_PROTOCOL, _INTERFACE, _INODE = 3, 4, 8
"""Columns of its lines."""
LISTEN_S = 0.03
"""A master with a cycle of up to 10 ms sends three frames in it."""
FEW = 2
"""A single damaged frame may look foreign this many times."""


def is_foreign(frame: bytes) -> bool:
    """Return whether an incoming frame of another master has passed no camera."""
    if frame_index(frame) is None or has_passed(frame):
        return False
    return frame[6:12] != OWN_SOURCE


def refuse_other_programs(interfaces: Sequence[str]) -> None:
    """Raise BusError ``bus.second_master`` if another program, named if possible, has a socket."""
    own = _own_inodes()
    for interface in interfaces:
        others = [inode for inode in _sockets_on(interface) if inode not in own]
        if others:
            told = _who(others[0])
            raise BusError(
                "bus.second_master",
                f"{told} uses interface '{interface}' as an EtherCAT master.",
                "Close that program (another OCMM window or command, a configuration tool), "
                "then try again.",
            )


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


def _own_inodes() -> set[int]:
    return set(_inodes_of(Path("/proc/self")))


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
