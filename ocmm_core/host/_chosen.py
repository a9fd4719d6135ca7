"""Which side this computer is on: asked once, by what Python itself is built with."""

from __future__ import annotations

from ocmm_core.host._host import Host


def _chosen() -> Host:
    try:
        from ocmm_core.host._posix import PosixHost
    except ImportError:
        from ocmm_core.host._windows import WindowsHost

        return WindowsHost()
    return PosixHost()


HOST = _chosen()
