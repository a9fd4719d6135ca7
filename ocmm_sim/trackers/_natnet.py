"""Markers as frames of OptiTrack Motive, by NatNet 3.0 to 4.1."""

from __future__ import annotations

import struct

import numpy as np

from ocmm_core.camera import TrackerDocument
from ocmm_sim.trackers._encoder import MarkerEncoder, NamedPlaces

_CONNECT, _SERVER, _FRAME, _UNKNOWN = 0, 1, 7, 100
_KEEP_ALIVE = 10
_CLOCK_HZ = 10_000_000
_MEASURED, _HIDDEN = 0x0A, 0x0D
"""Parameters of a marker: of a model, and measured or occluded and filled in from the model."""
_LATENCY = 50_000


class NatNetEncoder(MarkerEncoder):
    """Frames of markers as NatNet: one rigid body, its marker set and its labelled markers."""

    datagrams = True

    def __init__(
        self, document: TrackerDocument, version: tuple[int, int] = (4, 1), seed: int = 0
    ) -> None:
        super().__init__(document, seed)
        self._version, self._number = version, 0

    def answer(self, data: bytes) -> bytes:
        if len(data) < 4 or data[0] == _KEEP_ALIVE:
            return b""
        if data[0] != _CONNECT:
            return _datagram(_UNKNOWN, b"")
        program, protocol = bytes((3, 1, 0, 0)), bytes((*self._version, 0, 0))
        multicast = struct.pack("<H?4B", 1511, False, 239, 255, 42, 99)
        return _datagram(
            _SERVER,
            b"Motive".ljust(256, b"\0") + program + protocol + struct.pack("<Q", _CLOCK_HZ)
            + multicast,
        )  # fmt: skip

    def _packets(self, named: NamedPlaces, time_ns: int, pressed: bool) -> bytes:
        self._number += 1
        seen = np.array([place for place in named.values() if place is not None]).reshape(-1, 3)
        middle = seen.mean(axis=0) if len(seen) else np.zeros(3)
        quaternion = (0.0, 0.0, 0.0, 1.0)
        rows = []
        for name, place in () if self.faults.poses else named.items():
            model, marker = map(int, name.split(":"))
            flags = _HIDDEN if place is None else _MEASURED
            x, y, z = place or middle
            rows.append(struct.pack("<I4fHf", model << 16 | marker, x, y, z, 0.012, flags, 0.0002))
        point = struct.pack("<3f", *middle)
        blocks = [
            [b"all\0" + struct.pack("<I", len(seen)) + seen.astype("<f4").tobytes()],
            [point] * 2,
            [struct.pack("<I8fH", 1, *middle, *quaternion, 0.0002, int(len(seen) >= 3))],
            [],
            *([[]] if self._version >= (4, 1) else []),
            rows,
            [],
            [struct.pack("<IIIf", 1, 1, 1, float(pressed))],
        ]
        content = struct.pack("<I", self._number)
        for block in blocks:
            data = b"".join(block)
            content += struct.pack("<I", len(block))
            content += struct.pack("<I", len(data)) if self._version >= (4, 1) else b""
            content += data
        ticks = time_ns * _CLOCK_HZ // 10**9
        times = ticks, ticks + _LATENCY, ticks + 2 * _LATENCY
        content += struct.pack("<IId3Q", 0, 0, self._number * 0.01, *times)
        content += struct.pack("<II", 0, 0) if self._version >= (4, 1) else b""
        return _datagram(_FRAME, content + struct.pack("<HI", 0, 0))


def _datagram(kind: int, content: bytes) -> bytes:
    return struct.pack("<HH", kind, len(content)) + content
