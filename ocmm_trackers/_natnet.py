"""Frames of OptiTrack Motive by NatNet, versions 3.0 to 4.x: labelled markers alone.

Source: the public clients of NaturalPoint for direct depacketization. Little endian; datagrams of
an identifier, a size, and the content. From 4.1 on each block states its size in bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError
from ocmm_trackers._messages import Cursor, MarkerPlace, Message, MessageAccount, frame_of

_CONNECT, _SERVER, _FRAME, _KEEP_ALIVE = 0, 1, 7, 10
_OLDEST, _WITH_SIZES, _NEWEST = (3, 0), (4, 1), 4
_EACH_S = 1.0
"""Between two keep-alives, or two requests for a connection."""
_NAME = 256
_MULTICAST = 14
"""Upper half of the first byte of a multicast address."""
_BODY, _MARKER, _SUFFIX = 38, 26, 46
"""Bytes of a rigid body, of a labelled marker, and of the end of a frame in version 3.0."""
_OCCLUDED, _MEASURED, _FROM_MODEL = 1, 2, 4
_HIDDEN = (float("nan"),) * 3


class NatNetDecoder:
    """A `Decoder` of NatNet.

    Markers are named MODEL:MARKER by their numbers in Motive, such as 1:3.
    """

    wait_s = 0.1

    def __init__(self, _document: TrackerDocument) -> None:
        self.account = MessageAccount()
        self.ready = False
        self.group: tuple[str, int] | None = None
        self._version = (0, 0)
        self._clock_hz = 0
        self._next_s = 0.0

    def requests(self, now_s: float) -> bytes:
        """Return the request for a connection, then the signs of life that unicast needs."""
        if now_s < self._next_s:
            return b""
        self._next_s = now_s + _EACH_S
        return packet(_KEEP_ALIVE, b"\0") if self.ready else packet(_CONNECT, b"Ping\0")

    def feed(self, data: bytes) -> list[Message]:
        """Return the frame of a datagram; AcquisitionError for versions that are not read."""
        self.account.received += 1
        found: list[Message] = []
        try:
            cursor = Cursor(data)
            kind, size = cursor.take("HH")
            if size != cursor.left:
                raise ValueError("size")
            if kind == _SERVER:
                self._meet(cursor)
            elif kind == _FRAME and self.ready:
                found.append(self._frame(cursor))
            else:
                self.account.unread += 1
                return found
        except ValueError:
            self.account.malformed += 1
            return found
        self.account.decoded += 1
        return found

    def _meet(self, cursor: Cursor) -> None:
        cursor.skip(_NAME + 4)
        major, minor, _, _ = cursor.take("BBBB")
        if (major, minor) < _OLDEST or major > _NEWEST:
            raise AcquisitionError(
                "natnet.version",
                f"The tracker sends NatNet {major}.{minor}; versions 3.0 to 4.x are read.",
                "Use Motive 2.0 or newer, and let it send NatNet 3.0 to 4.x.",
            )
        (clock_hz,) = cursor.take("Q")
        if not clock_hz:
            raise ValueError("clock")
        if cursor.left >= 7:
            port, multicast, *address = cursor.take("H?4B")
            if multicast:
                if not port or address[0] >> 4 != _MULTICAST:
                    raise ValueError("multicast address")
                self.group = ".".join(map(str, address)), port
        self._version, self._clock_hz, self.ready = (major, minor), clock_hz, True

    def _frame(self, cursor: Cursor) -> Message:
        sized = self._version >= _WITH_SIZES
        cursor.take("I")
        _pass_over(cursor, sized, _pass_set)
        _pass_over(cursor, sized, lambda one: one.skip(12))
        bodies, size = _rows(cursor, sized, _BODY)
        tracked = any(bodies.skip(size)[_BODY - 2] & 1 for _ in range(bodies.left // size))
        _pass_over(cursor, sized, _pass_skeleton)
        if sized:
            # Assets.
            _pass_over(cursor, sized, _pass_set)
        markers, size = _rows(cursor, sized, _MARKER)
        elements = [_marker(Cursor(markers.skip(size))) for _ in range(markers.left // size)]
        if tracked and not elements:
            raise AcquisitionError(
                "natnet.markers",
                "The tracker sends rigid bodies without their markers, so that the uncertainty of "
                "a tip is unknown.",
                "Switch on the labelled markers in the streaming settings of Motive.",
            )
        for _ in ("force plates", "devices"):
            _pass_over(cursor, sized, _pass_channels)
        if cursor.left < _SUFFIX:
            raise ValueError("end of frame")
        # Time code, time since the start, and the clock at the middle of the exposure.
        *_, exposed = cursor.take("IIdQ")
        return frame_of("Motive", exposed * 10**9 // self._clock_hz, elements)


def packet(kind: int, content: bytes) -> bytes:
    """Return a datagram."""
    return struct.pack("<HH", kind, len(content)) + content


def _pass_over(cursor: Cursor, sized: bool, one: Callable[[Cursor], object]) -> None:
    """Pass over a block of rows that are not read."""
    (count,) = cursor.take("I")
    if sized:
        cursor.skip(*cursor.take("I"))
        return
    for _ in range(count):
        one(cursor)


def _rows(cursor: Cursor, sized: bool, size: int) -> tuple[Cursor, int]:
    """Return a block of rows of one size, and that size, which newer versions may enlarge."""
    (count,) = cursor.take("I")
    whole = cursor.take("I")[0] if sized else count * size
    rest = Cursor(cursor.skip(whole))
    if whole < count * size or (count and whole % count) or (whole and not count):
        raise ValueError("rows")
    return rest, whole // count if count else size


def _pass_set(cursor: Cursor) -> None:
    cursor.text()
    cursor.skip(12 * cursor.take("I")[0])


def _pass_skeleton(cursor: Cursor) -> None:
    _, count = cursor.take("II")
    cursor.skip(_BODY * count)


def _pass_channels(cursor: Cursor) -> None:
    _, channels = cursor.take("II")
    for _ in range(channels):
        cursor.skip(4 * cursor.take("I")[0])


def _marker(row: Cursor) -> MarkerPlace:
    """Return a marker; hidden unless the cameras measured it in this frame."""
    number, x, y, z, _, flags = row.take("I4fH")
    measured = flags & _MEASURED and not flags & (_OCCLUDED | _FROM_MODEL)
    return MarkerPlace(f"{number >> 16}:{number & 0xFFFF}", (x, y, z) if measured else _HIDDEN)
