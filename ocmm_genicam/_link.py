"""Load of the network cards that cameras share, and the parts of their sensors that are sent."""

from __future__ import annotations

import contextlib
import ctypes
import math
import socket
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.camera import CameraModel, Window, project
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float
from ocmm_genicam._client import Camera
from ocmm_genicam._set_up import SetUp

_HEADERS, _FRAMING = 36, 38
"""Bytes of a packet: IP, UDP and GVSP inside the MTU; Ethernet outside it."""
_MOST_SHARE = 0.95
_MARGIN_PX = 16
_GRID = 9
_ROUTES = Path("/proc/net/route")
_ETHTOOL, _GET_MTU, _GET_SETTINGS = 0x8946, 0x8921, 1
"""Of Linux: SIOCETHTOOL, SIOCGIFMTU, ETHTOOL_GSET; sysfs has the cards of one namespace only."""
_SETTINGS_BYTES, _SPEED_AT, _UNKNOWN = 44, 12, 0xFFFF_FFFF


@dataclass(frozen=True, slots=True)
class AdapterLoad:
    """Load of a network card by its cameras, and its capacity."""

    adapter: str
    serials: tuple[str, ...]
    needed_mb_s: float
    carried_mb_s: float
    """NaN if unknown."""

    def __str__(self) -> str:
        carried = "–" if math.isnan(self.carried_mb_s) else f"{self.carried_mb_s:.0f}"
        return f"{self.needed_mb_s:.1f} / {carried} MB/s {self.adapter}".rstrip()


def loads_of(
    cameras: Sequence[Camera], set_ups: Sequence[SetUp], period_ns: int
) -> tuple[AdapterLoad, ...]:
    """Return the load of the network card of each camera; cameras of one card have the same."""
    rows = [
        (adapter_of(one.address()), one.serial, each.size)
        for one, each in zip(cameras, set_ups, strict=True)
    ]
    return tuple(
        AdapterLoad(
            name, tuple(serial for at, serial, _ in rows if at == name),
            sum(size for at, _, size in rows if at == name) * 1e3 / period_ns, _carried_mb_s(name),
        )
        for name, _, _ in rows
    )  # fmt: skip


def require_carried(loads: Sequence[AdapterLoad]) -> None:
    """Raise AcquisitionError if a network card cannot carry the images of its cameras."""
    for one in loads:
        if one.needed_mb_s > _MOST_SHARE * one.carried_mb_s:
            raise AcquisitionError(
                "genicam.adapter",
                f"The cameras {', '.join(one.serials)} send {one.needed_mb_s:.1f} MB/s, but "
                f"network card {one.adapter} carries {_MOST_SHARE * one.carried_mb_s:.1f} MB/s.",
                "Lower 'frame_rate_hz' of the rig, measure with regions (genicam:region,...), set "
                "MTU 9000, or connect each camera to a card of its own.",
            )


def adapter_of(address: str) -> str:
    """Return the network card that reaches an IPv4 address; empty if unknown."""
    found = (-1, "")
    with contextlib.suppress(OSError, ValueError):
        (target,) = struct.unpack("<I", socket.inet_aton(address))
        for line in _ROUTES.read_text(encoding="ascii").splitlines()[1:]:
            name, network, *rest = line.split()
            mask = int(rest[5], 16)
            # The last route of the same width is the one in force.
            if target & mask == int(network, 16) and mask.bit_count() > found[0]:
                found = mask.bit_count(), name
    return found[1]


def _carried_mb_s(adapter: str) -> float:
    """Return the bytes of images that a card carries; NaN if it states no speed."""
    if not adapter:
        return math.nan
    import fcntl

    name = adapter.encode()
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        asked = ctypes.create_string_buffer(struct.pack("<I", _GET_SETTINGS), _SETTINGS_BYTES)
        fcntl.ioctl(link, _ETHTOOL, struct.pack("16sP16x", name, ctypes.addressof(asked)))
        low, high = struct.unpack_from("=H14xH", asked, _SPEED_AT)
        mtu = struct.unpack_from("=16si", fcntl.ioctl(link, _GET_MTU, name.ljust(40, b"\0")))[1]
        if 0 < (speed := high << 16 | low) < _UNKNOWN:
            return float(speed / 8.0 * (mtu - _HEADERS) / (mtu + _FRAMING))
    return math.nan


def volume_window(camera: CameraModel, volume_world: Float, reach_mm: float) -> Window:
    """Return the part of a sensor that shows the LEDs of a probe with its ball in the volume.

    `volume_world`: (2, 3), mm. `reach_mm`: of the LEDs from the ball.
    """
    low, high = volume_world[0] - reach_mm, volume_world[1] + reach_mm
    # A box with edges that the lens bends.
    axes = np.linspace(low, high, _GRID).T
    uv = project(camera, np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3))
    if not np.isfinite(uv).all():
        return Window(0, 0, camera.width, camera.height)
    size = np.array([camera.width, camera.height])
    first = np.clip(np.floor(uv.min(axis=0)) - _MARGIN_PX, 0, size - 1).astype(int)
    last = np.clip(np.ceil(uv.max(axis=0)) + _MARGIN_PX, first, size - 1).astype(int)
    left, top, right, bottom = (int(one) for one in (*first, *last))
    return Window(left, top, right - left + 1, bottom - top + 1)
