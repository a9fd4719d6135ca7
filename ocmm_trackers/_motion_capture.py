"""Streams of motion capture: OptiTrack Motive (NatNet 3.0 to 4.x), Qualisys Track Manager (1.25).

NatNet: labelled markers alone. Source: the public clients of NaturalPoint for direct
depacketization. Little endian; datagrams of an identifier, a size, and the content. From 4.1 on
each block states its size in bytes.

Qualisys, real-time protocol: labelled markers, analog devices. Source: the open-source client
qtm-rt of Qualisys; it is not used, because a packet of size 0 stops it in an endless loop and a
packet of an unknown kind ends it. Little endian (port 22223), mm.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from lxml import etree

from ocmm_core.errors import AcquisitionError
from ocmm_trackers._messages import (
    HIDDEN,
    Cursor,
    Decoder,
    DeviceStatus,
    MarkerPlace,
    Message,
    frame_of,
    printable,
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
        kind, size = cursor.read("HH")
        if size != cursor.left:
            raise ValueError("size")
        if kind == _SERVER:
            self._meet(cursor)
            return []
        return self._frame(cursor) if kind == _FRAME and self.ready else None

    def _meet(self, cursor: Cursor) -> None:
        # Name and version of the program.
        cursor.skip(256 + 4)
        major, minor, _, clock_hz = cursor.read("BBHQ")
        if (major, minor) < _OLDEST or major > _NEWEST:
            raise AcquisitionError(
                "natnet.version",
                f"The tracker sends NatNet {major}.{minor}; versions 3.0 to 4.x are read.",
                "Use Motive 2.0 or newer, and let it send NatNet 3.0 to 4.x.",
            )
        port, multicast, *address = cursor.read("H?4B") if cursor.left >= 7 else (0, False)
        # Multicast addresses are 224.0.0.0 to 239.255.255.255.
        if not clock_hz or (multicast and not (port and address[0] >> 4 == 14)):
            raise ValueError("clock or address")
        self.group = (".".join(map(str, address)), port) if multicast else None
        self._version, self._clock_hz, self.ready = (major, minor), clock_hz, True

    def _frame(self, cursor: Cursor) -> list[Message]:
        sized = self._version >= _WITH_SIZES
        cursor.read("I")
        _pass_over(cursor, sized, _pass_set)
        _pass_over(cursor, sized, lambda one: one.skip(12))
        tracked = any(row[_BODY - 2] & 1 for row in _rows(cursor, sized, _BODY))
        # Skeletons; assets from 4.1 on.
        for _ in range(1 + sized):
            _pass_over(cursor, sized, lambda one: one.skip(_BODY * one.read("II")[1]))
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
        *_, exposed = cursor.read("IIdQ")
        return sensors + frame_of(self.name, exposed * 10**9 // self._clock_hz, elements)


def _pass_over(cursor: Cursor, sized: bool, one: Callable[[Cursor], object]) -> None:
    """Pass over a block of rows that are not read."""
    (count,) = cursor.read("I")
    if sized:
        cursor.skip(*cursor.read("I"))
        return
    for _ in range(count):
        one(cursor)


def _rows(cursor: Cursor, sized: bool, least: int) -> list[bytes]:
    """Return the rows of a block, whose size newer versions may enlarge."""
    (count,) = cursor.read("I")
    whole = cursor.read("I")[0] if sized else count * least
    block = Cursor(cursor.skip(whole))
    if whole < count * least or whole % max(count, 1):
        raise ValueError("rows")
    return [block.skip(whole // count) for _ in range(count)]


def _pass_set(cursor: Cursor) -> None:
    cursor.text()
    cursor.skip(12 * cursor.read("I")[0])


def _sensors(cursor: Cursor, sized: bool) -> list[Message]:
    """Return the newest values of the channels of devices, which are named by their numbers."""
    (count,) = cursor.read("I")
    block = Cursor(cursor.skip(*cursor.read("I"))) if sized else cursor
    found = []
    for _ in range(count):
        number, channels = block.read("II")
        values = [block.read(f"{block.read('I')[0]}f")[-1:] for _ in range(channels)]
        found.append(sensor_of(str(number), tuple(one for (one,) in filter(None, values))))
    return found


def _marker(row: Cursor) -> MarkerPlace:
    """Return a marker; hidden unless the cameras measured it in this frame."""
    number, x, y, z, _, flags = row.read("I4fH")
    measured = flags & _MEASURED and not flags & (_OCCLUDED | _FROM_MODEL)
    return MarkerPlace(f"{number >> 16}:{number & 0xFFFF}", (x, y, z) if measured else HIDDEN)


_HEADER = struct.Struct("<II")
_ERROR, _COMMAND, _XML, _DATA, _END = range(5)
_MARKERS, _ANALOG = 9, 13
"""Components: markers with residuals, and the newest values of analog devices."""
_MOST_BYTES = 1 << 20
_VERSION, _PARAMETERS = b"Version 1.25", b"GetParameters 3d"
_STREAM = b"StreamFrames AllFrames 3DRes AnalogSingle"
_MOST_NAME = 64
_FIRST_NS = 1000
"""Added to all times, since the first one can be zero, which means: not stamped."""


class QtmDecoder(Decoder):
    """Markers are named by their labels, analog devices by their numbers."""

    name, port = "QTM", 22223
    ready = False
    _labels: tuple[str, ...] = ()
    _pending: tuple[bytes, ...] = (_VERSION, _PARAMETERS)

    def requests(self, _now_s: float) -> bytes:
        """Return the commands that lead to frames."""
        pending, self._pending = self._pending, ()
        return b"".join(_HEADER.pack(9 + len(one), _COMMAND) + one + b"\0" for one in pending)

    def _cut(self) -> bytes | None:
        if len(self._buffer) < _HEADER.size:
            return None
        size, _ = _HEADER.unpack_from(self._buffer)
        if not _HEADER.size <= size <= _MOST_BYTES:
            raise self._foreign()
        return self._taken(size)

    def _read(self, packet: bytes) -> list[Message] | None:
        _, kind = _HEADER.unpack_from(packet)
        content = packet[_HEADER.size :]
        if kind == _DATA and self.ready:
            return self._frame(Cursor(content))
        if kind == _XML:
            self._label(content)
            return []
        text = printable(content) if kind == _ERROR else "no measurement is running"
        if kind == _ERROR and not self.ready:
            raise AcquisitionError(
                "qtm.refused",
                f"Qualisys Track Manager refused the request: {text}.",
                "Open a project, and start a new measurement (or its preview).",
            )
        if kind in (_ERROR, _END):
            return [Message("status", self.name, 0, DeviceStatus(0, text))]
        return None

    def _label(self, content: bytes) -> None:
        """Take the labels of the markers, in the order of those in a frame."""
        parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)
        try:
            tree = etree.fromstring(content.rstrip(b"\0"), parser)
        except etree.XMLSyntaxError as error:
            raise ValueError("XML") from error
        names = tuple(one.text or "" for one in tree.iterfind("The_3D/Label/Name"))
        if not names or not all(0 < len(one) <= _MOST_NAME and one.isprintable() for one in names):
            raise ValueError("labels")
        self._pending = () if self.ready else (_STREAM,)
        self._labels, self.ready = names, True

    def _frame(self, cursor: Cursor) -> list[Message]:
        time_us, _, components = cursor.read("QII")
        found: list[Message] = []
        markers = None
        for _ in range(components):
            size, kind = cursor.read("II")
            part = Cursor(cursor.skip(size - _HEADER.size))
            if kind == _MARKERS:
                # NaN if not seen.
                markers = [MarkerPlace(one, part.read("4f")[:3]) for one in self._labelled(part)]
            elif kind == _ANALOG:
                for _ in range(*part.read("I")):
                    number, channels = part.read("II")
                    found.append(sensor_of(str(number), part.read(f"{channels}f")))
        if markers is None:
            raise ValueError("component")
        return found + frame_of(self.name, 1000 * time_us + _FIRST_NS, markers)

    def _labelled(self, part: Cursor) -> tuple[str, ...]:
        """Return the labels of a component; ValueError if there are new ones."""
        if part.read("IHH")[0] != len(self._labels):
            # Request them, once.
            self._pending, self._labels = (_PARAMETERS,) if self._labels else (), ()
            raise ValueError("labels")
        return self._labels
