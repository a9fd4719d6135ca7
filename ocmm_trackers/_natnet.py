"""Frames of OptiTrack Motive by NatNet, versions 3.0 to 4.x: labelled markers alone.

Source: the public clients of NaturalPoint for direct depacketization. Little endian; datagrams of
an identifier, a size, and the content. From 4.1 on each block states its size in bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from ocmm_core.errors import AcquisitionError
from ocmm_trackers._messages import (
    HIDDEN,
    Cursor,
    Decoder,
    MarkerPlace,
    Message,
    frame_of,
    sensor_of,
)

_CONNECT, _SERVER, _FRAME, _KEEP_ALIVE = 0, 1, 7, 10
_OLDEST, _WITH_SIZES, _NEWEST = (3, 0), (4, 1), 4
_EACH_S = 1.0
"""Between two signs of life, or two requests for a connection."""
_BODY, _MARKER, _SUFFIX = 38, 26, 46
"""Bytes of a rigid body, of a labelled marker, and of the end of a frame in version 3.0."""
_OCCLUDED, _MEASURED, _FROM_MODEL = 1, 2, 4


class NatNetDecoder(Decoder):
    """Markers are named MODEL:MARKER by their numbers in Motive, such as 1:3."""

    name, port = "NatNet", 1510
    datagrams = True
    ready = False
    _version = (0, 0)
    _clock_hz = 1
    _next_s = 0.0

    def requests(self, now_s: float) -> bytes:
        """Return the request for a connection, then the signs of life that unicast needs."""
        if now_s < self._next_s:
            return b""
        self._next_s = now_s + _EACH_S
        kind, content = (_KEEP_ALIVE, b"\0") if self.ready else (_CONNECT, b"Ping\0")
        return struct.pack("<HH", kind, len(content)) + content

    def _cut(self) -> bytes | None:
        packet = bytes(self._buffer)
        self._buffer.clear()
        return packet or None

    def _read(self, packet: bytes) -> list[Message] | None:
        cursor = Cursor(packet)
        kind, size = cursor.take("HH")
        if size != cursor.left:
            raise ValueError("size")
        if kind == _SERVER:
            self._meet(cursor)
            return []
        return self._frame(cursor) if kind == _FRAME and self.ready else None

    def _meet(self, cursor: Cursor) -> None:
        # Name and version of the program.
        cursor.skip(256 + 4)
        major, minor, _, clock_hz = cursor.take("BBHQ")
        if (major, minor) < _OLDEST or major > _NEWEST:
            raise AcquisitionError(
                "natnet.version",
                f"The tracker sends NatNet {major}.{minor}; versions 3.0 to 4.x are read.",
                "Use Motive 2.0 or newer, and let it send NatNet 3.0 to 4.x.",
            )
        port, multicast, *address = cursor.take("H?4B") if cursor.left >= 7 else (0, False)
        # Multicast addresses are 224.0.0.0 to 239.255.255.255.
        if not clock_hz or (multicast and not (port and address[0] >> 4 == 14)):
            raise ValueError("clock or address")
        self.group = (".".join(map(str, address)), port) if multicast else None
        self._version, self._clock_hz, self.ready = (major, minor), clock_hz, True

    def _frame(self, cursor: Cursor) -> list[Message]:
        sized = self._version >= _WITH_SIZES
        cursor.take("I")
        _pass_over(cursor, sized, _pass_set)
        _pass_over(cursor, sized, lambda one: one.skip(12))
        tracked = any(row[_BODY - 2] & 1 for row in _rows(cursor, sized, _BODY))
        # Skeletons; assets from 4.1 on.
        for _ in range(1 + sized):
            _pass_over(cursor, sized, lambda one: one.skip(_BODY * one.take("II")[1]))
        elements = [_marker(Cursor(row)) for row in _rows(cursor, sized, _MARKER)]
        if tracked and not elements:
            raise AcquisitionError(
                "natnet.markers",
                "The tracker sends rigid bodies without their markers, so that the uncertainty of "
                "a tip is unknown.",
                "Switch on the labelled markers in the streaming settings of Motive.",
            )
        # Force plates, then other devices.
        _, sensors = (_sensors(cursor, sized) for _ in range(2))
        if cursor.left < _SUFFIX:
            raise ValueError("end of frame")
        # Time code, time since the start, and the clock at the middle of the exposure.
        *_, exposed = cursor.take("IIdQ")
        return sensors + frame_of(self.name, exposed * 10**9 // self._clock_hz, elements)


def _pass_over(cursor: Cursor, sized: bool, one: Callable[[Cursor], object]) -> None:
    """Pass over a block of rows that are not read."""
    (count,) = cursor.take("I")
    if sized:
        cursor.skip(*cursor.take("I"))
        return
    for _ in range(count):
        one(cursor)


def _rows(cursor: Cursor, sized: bool, least: int) -> list[bytes]:
    """Return the rows of a block, whose size newer versions may enlarge."""
    (count,) = cursor.take("I")
    whole = cursor.take("I")[0] if sized else count * least
    block = Cursor(cursor.skip(whole))
    if whole < count * least or whole % max(count, 1):
        raise ValueError("rows")
    return [block.skip(whole // count) for _ in range(count)]


def _pass_set(cursor: Cursor) -> None:
    cursor.text()
    cursor.skip(12 * cursor.take("I")[0])


def _sensors(cursor: Cursor, sized: bool) -> list[Message]:
    """Return the newest values of the channels of devices, which are named by their numbers."""
    (count,) = cursor.take("I")
    block = Cursor(cursor.skip(*cursor.take("I"))) if sized else cursor
    found = []
    for _ in range(count):
        number, channels = block.take("II")
        values = [block.take(f"{block.take('I')[0]}f")[-1:] for _ in range(channels)]
        found.append(sensor_of(str(number), tuple(one for (one,) in filter(None, values))))
    return found


def _marker(row: Cursor) -> MarkerPlace:
    """Return a marker; hidden unless the cameras measured it in this frame."""
    number, x, y, z, _, flags = row.take("I4fH")
    measured = flags & _MEASURED and not flags & (_OCCLUDED | _FROM_MODEL)
    return MarkerPlace(f"{number >> 16}:{number & 0xFFFF}", (x, y, z) if measured else HIDDEN)
