"""Virtual Ethernet links and private network namespaces, made with the system's own tools."""

from __future__ import annotations

import os
import shutil
import socket
import struct
import subprocess
from collections.abc import Sequence

from ocmm_core.errors import BusError
from ocmm_core.host import require_linux

HOST_INTERFACE, CAMERA_INTERFACE = "ocmm-host", "ocmm-cameras"
"""Ends of the cable in a private network namespace."""
_SYSTEM_FOLDERS = "/usr/sbin:/sbin:/usr/bin:/bin"
_TIMEOUT_S = 10.0
_GET_FLAGS, _SET_FLAGS, _UP = 0x8913, 0x8914, 1
"""Linux: SIOCGIFFLAGS, SIOCSIFFLAGS, IFF_UP."""
_ALTERNATIVE = (
    "Allow them (Debian, Ubuntu: sysctl kernel.unprivileged_userns_clone=1 and "
    "kernel.apparmor_restrict_unprivileged_userns=0), or run 'ocmm rig up' as root and use "
    "the source ethercat:ocmm0, or the source simulated."
)
_PACKAGES = {"ip": "iproute2", "unshare": "util-linux"}


def tool(name: str) -> str:
    """Return the path of a system tool; raise BusError with its package if missing."""
    # An ordinary user's path lacks the folders of Debian's network tools.
    found = shutil.which(name, path=f"{os.environ.get('PATH', '')}:{_SYSTEM_FOLDERS}")
    if found is None:
        raise BusError(
            "bus.tool",
            f"The system tool '{name}' is missing.",
            f"Install the package '{_PACKAGES[name]}', or use the source simulated.",
        )
    return found


def run(command: Sequence[str]) -> str | None:
    """Run a command; return its error output, or None on success."""
    try:
        done = subprocess.run(  # noqa: S603 - fixed tools, checked names, no shell
            list(command), capture_output=True, timeout=_TIMEOUT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if done.returncode == 0:
        return None
    text = done.stderr.decode("utf-8", errors="replace").strip()
    return text.splitlines()[-1] if text else f"exit code {done.returncode}"


def make_link(near: str, far: str) -> None:
    """Create a virtual cable with both ends up; raise BusError, undoing everything."""
    ip = tool("ip")
    complaint = run([ip, "link", "add", near, "type", "veth", "peer", "name", far])
    if complaint is None:
        for name in (near, far):
            complaint = complaint or run([ip, "link", "set", name, "up"])
        if complaint is not None:
            remove_link(near)
    if complaint is not None:
        raise BusError(
            "bus.virtual_link",
            f"The virtual cable '{near}' - '{far}' cannot be created: {complaint}.",
            "Check that these names are free and that the kernel has virtual Ethernet (veth); "
            "or use the source simulated.",
        )


def set_link(name: str, *, up: bool) -> None:
    """Set an interface up or down; raise BusError if absent or not permitted."""
    import fcntl

    request = struct.Struct("16sh14x")
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
            asked = request.pack(name.encode(), 0)
            flags = request.unpack(fcntl.ioctl(channel, _GET_FLAGS, asked))[1]
            flags = flags | _UP if up else flags & ~_UP
            fcntl.ioctl(channel, _SET_FLAGS, request.pack(name.encode(), flags))
    except OSError as error:
        raise BusError(
            "bus.virtual_link",
            f"Interface '{name}' cannot be switched ({error.strerror}).",
            "Check its name and the rights of this user.",
        ) from error


def remove_link(near: str) -> None:
    """Remove both ends of a virtual cable, if present."""
    run([tool("ip"), "link", "delete", near])


def namespace_command() -> list[str]:
    """Return the prefix for a private network namespace; BusError if forbidden."""
    require_linux("The virtual cable")
    unshare = tool("unshare")
    # Root keeps its right to a real-time priority outside of a user namespace.
    ways = [["-n"]] if os.geteuid() == 0 else []
    ways.append(["-r", "-n"])
    complaint: str | None = None
    for way in ways:
        complaint = run([unshare, *way, "true"])
        if complaint is None:
            return [unshare, *way]
    raise BusError(
        "bus.namespace",
        f"This system does not allow private network namespaces ({complaint}).",
        _ALTERNATIVE,
    )
