"""Which side this computer is on: asked once, by what Python itself is built with."""

from __future__ import annotations

import ipaddress

from ocmm_core.errors import InputError
from ocmm_core.host._host import Host


def _chosen() -> Host:
    try:
        from ocmm_core.host._posix import PosixHost
    except ImportError:
        from ocmm_core.host._windows import WindowsHost

        return WindowsHost()
    return PosixHost()


HOST = _chosen()


def is_loopback(host: str) -> bool:
    """Return whether a name or an address is that of this computer for itself."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def require_linux(what: str) -> None:
    """Raise InputError unless on Linux; ``what`` is the subject, e.g. "The camera bus"."""
    if not HOST.is_linux_like:
        raise InputError(
            "host.linux",
            f"{what} needs Linux; this computer runs another system.",
            "Use the station for that. Here plans, jobs, recordings, reports and the virtual rig "
            "can be used.",
        )
