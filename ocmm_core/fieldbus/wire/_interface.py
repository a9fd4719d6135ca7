"""Checks whether an interface may be the camera bus, and detection of a second master.

pysoem gives the same text for "no such interface" and "no permission", and an overlong name ends
the process. EtherCAT floods the interface, so one that the computer uses for its network is
refused.

A second master would corrupt the frames of the first. For programs on this computer the kernel
lists EtherCAT sockets per interface (``/proc/net/packet``); they end with their process, even a
killed one. Our own socket is opened before the check, so of two simultaneous starts at least one
sees the other. Masters elsewhere are seen by their frames: incoming frames that have not passed a
camera, or with an index that is not used here. Masters that bypass the kernel are not seen while
silent. `MasterWatch` looks for masters that start later.
"""

from __future__ import annotations

import ctypes
import errno
import importlib.util
import os
import re
import socket
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._datagrams import ETHERTYPE, OWN_SOURCE, frame_index, has_passed
from ocmm_core.fieldbus.wire._sockets import query_socket
from ocmm_core.plugins import install_line

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


_INTERFACES = Path("/sys/class/net")
_NETWORK = Path("/proc/self/net")
"""Target of /proc/net, which the service does not see."""
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,15}")
_SIOCGIFADDR = 0x8915
_SIOCGIFFLAGS = 0x8913
_SIOCGIFINDEX = 0x8933
_ASK_DRIVER, _GET_DRIVER, _DRIVER_BYTES = 0x8946, 0x3, 196
"""Linux: SIOCETHTOOL, ETHTOOL_GDRVINFO and the size of its answer, struct ethtool_drvinfo."""
_UP = 0x1
_LOOPBACK = 0x8
_CAP_NET_ADMIN = 12
_ETHERTYPE = 0x88A4
_RIGHTS = (
    "Grant the bus process its rights once: sudo installer/linux/grant-rights.sh; "
    "or, with the installed package: sudo usermod -aG ocmm NAME"
)


def require_pysoem() -> None:
    """Raise BusError if the EtherCAT master is not installed."""
    if importlib.util.find_spec("pysoem") is None:
        raise BusError(
            "bus.pysoem",
            "The package pysoem, the EtherCAT master, is not installed here.",
            f"Install it: {install_line('bus')}.",
        )


def is_virtual_interface(name: str) -> bool:
    """Return whether a network interface of this computer has no physical wire.

    A pair of virtual interfaces carries only software cameras. Such an interface has no device, nor
    a lower interface as a bridge or bond has. Unknown interfaces are not virtual.
    """
    place = _INTERFACES / name
    if not _NAME.fullmatch(name) or not place.is_dir():
        return False
    return not (place / "device").exists() and not any(place.glob("lower_*"))


def is_virtual_cable(name: str) -> bool:
    """Return whether an interface is one end of a virtual cable.

    Unlike `is_virtual_interface` it queries the driver, also inside a private network.
    """
    import fcntl

    if not _NAME.fullmatch(name):
        return False
    answer = bytearray(_DRIVER_BYTES)
    struct.pack_into("<I", answer, 0, _GET_DRIVER)
    place = (ctypes.c_char * len(answer)).from_buffer(answer)
    request = struct.pack("16sQ16x", name.encode("ascii"), ctypes.addressof(place))
    try:
        with query_socket() as channel:
            fcntl.ioctl(channel, _ASK_DRIVER, request)
    except OSError:
        return False
    return bytes(answer[4:36]).rstrip(b"\x00") == b"veth"


def check_interface(name: str, *, force: bool = False) -> None:
    """Refuse an interface that cannot or must not carry the camera bus.

    ``force`` accepts one with an IP address or the default route. BusError if the name is invalid,
    the interface is absent, down or in use, or this process lacks the rights for raw Ethernet.
    """
    if not hasattr(socket, "AF_PACKET"):
        raise BusError(
            "bus.platform",
            "The camera bus needs Linux; this system has no raw Ethernet sockets.",
            "Use the simulated rig or a recording on this computer.",
        )
    if not _NAME.fullmatch(name) or name in (".", ".."):
        raise BusError(
            "bus.interface_name",
            f"'{name}' is not the name of a network interface "
            "(1 to 15 letters, digits, '_', '.' or '-').",
            "Use a name listed by 'ip link'.",
        )
    if name not in (known := _known()):
        raise BusError(
            "bus.no_interface",
            f"No network interface '{name}'; available: {', '.join(known)}.",
            "Give one of these, or plug in the camera adapter.",
        )
    _check_rights(name)
    flags = _flags(name)
    if flags & _LOOPBACK:
        raise BusError(
            "bus.loopback",
            (
                f"Interface '{name}' is the loopback of this computer; no camera can be "
                "connected to it."
            ),
            "Give the interface the cameras are connected to.",
        )
    if not flags & _UP:
        raise BusError(
            "bus.down",
            f"Interface '{name}' is switched off.",
            f"Switch it on: ip link set {name} up",
        )
    use = None if force else _use(name)
    if use:
        raise BusError(
            "bus.in_use",
            f"Interface '{name}' {use}; the camera bus would cut this computer off.",
            "Give the cameras their own network adapter (or force it if you are sure).",
        )


def _known() -> list[str]:
    # `if_nameindex` uses a socket family that the service may not create.
    lines = (_NETWORK / "dev").read_text(encoding="ascii").splitlines()
    return [line.partition(":")[0].strip() for line in lines if ":" in line]


def _check_rights(name: str) -> None:
    try:
        with socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ETHERTYPE)) as probe:
            probe.bind((name, _ETHERTYPE))
    except OSError as error:
        if error.errno in (errno.EPERM, errno.EACCES):
            raise _no_rights(name) from error
        raise BusError(
            "bus.unusable",
            f"Interface '{name}' cannot be opened ({error.strerror}).",
            "Check the adapter and its driver.",
        ) from error
    status = Path("/proc/self/status").read_text(encoding="ascii")
    effective = re.search(r"^CapEff:\s*([0-9a-fA-F]+)$", status, re.MULTILINE)
    if effective is not None and not int(effective[1], 16) >> _CAP_NET_ADMIN & 1:
        raise _no_rights(name)


def _no_rights(name: str) -> BusError:
    return BusError(
        "bus.rights", f"This user may not send raw Ethernet frames on '{name}'.", _RIGHTS
    )


def interface_index(name: str) -> int | None:
    """Return the kernel index of an interface, or None if absent.

    ``socket.if_nametoindex`` uses a socket family that the service may not create.
    """
    answer = _request(name, _SIOCGIFINDEX)
    return None if answer is None else int(struct.unpack_from("=i", answer, 16)[0])


def _request(name: str, code: int) -> bytes | None:
    import fcntl

    with query_socket() as query:
        try:
            return fcntl.ioctl(query, code, struct.pack("16s24x", name.encode("ascii")))
        except OSError:
            return None


def _flags(name: str) -> int:
    answer = _request(name, _SIOCGIFFLAGS)
    return 0 if answer is None else int(struct.unpack_from("<H", answer, 16)[0])


def _use(name: str) -> str | None:
    """Return what the computer uses the interface for, or None."""
    answer = _request(name, _SIOCGIFADDR)
    if answer is not None:
        return f"has the address {socket.inet_ntoa(answer[20:24])}"
    for fields in _table("if_inet6"):
        # Every interface that is up has an fe80: address; it does not indicate use.
        if fields[5] == name and not fields[0].startswith("fe80"):
            address = socket.inet_ntop(socket.AF_INET6, bytes.fromhex(fields[0]))
            return f"has the IPv6 address {address}"
    for fields in _table("route"):
        if fields[0] == name and fields[1] == "00000000" and fields[7] == "00000000":
            return "carries the default route"
    return None


def _table(name: str) -> list[list[str]]:
    try:
        lines = (_NETWORK / name).read_text(encoding="ascii").splitlines()
    except OSError:
        return []
    return [fields for line in lines if len(fields := line.split()) >= 6]
