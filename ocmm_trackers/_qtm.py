"""Packets of Qualisys Track Manager, real-time protocol 1.25: labelled markers (3DRes).

Source: the open-source client qtm-rt of Qualisys; it is not used, because a packet of size 0 stops
it in an endless loop and a packet of an unknown kind ends it. Little endian (port 22223), mm.
"""

from __future__ import annotations

import struct

from lxml import etree

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError
from ocmm_trackers._messages import (
    MOST_NAME,
    Cursor,
    DeviceStatus,
    MarkerPlace,
    Message,
    MessageAccount,
    frame_of,
)

_HEADER = struct.Struct("<II")
_ERROR, _ANSWER, _XML, _DATA, _END, _EVENT = 0, 1, 2, 3, 4, 6
_MARKERS = 9
"""Component with markers and residuals."""
_MOST_BYTES = 1 << 20
_VERSION, _PARAMETERS = "Version 1.25", "GetParameters 3d"
_STREAM = "StreamFrames AllFrames 3DRes"
_FIRST_NS = 1000
"""Added to all times: that of a first frame can be zero, which stands for no time stamp."""


class QtmDecoder:
    """A `Decoder` of Qualisys Track Manager; markers are named by their labels."""

    wait_s = 0.1
    group = None

    def __init__(self, _document: TrackerDocument) -> None:
        self.account = MessageAccount()
        self.ready = False
        self._labels: list[str] = []
        self._pending: list[str] = [_VERSION, _PARAMETERS]
        self._buffer = bytearray()

    def requests(self, _now_s: float) -> bytes:
        """Return the commands that lead to frames."""
        pending, self._pending = self._pending, []
        return b"".join(packet(_ANSWER, one.encode() + b"\0") for one in pending)

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages that these bytes complete.

        AcquisitionError if they are of another protocol, or an error before the first frame.
        """
        found: list[Message] = []
        self._buffer += data
        while len(self._buffer) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(self._buffer)
            if not _HEADER.size <= size <= _MOST_BYTES:
                raise AcquisitionError(
                    "qtm.stream",
                    "The tracker sent bytes that are no packet of Qualisys Track Manager.",
                    "Check host and port: 22223 is that of the little-endian protocol.",
                )
            if len(self._buffer) < size:
                break
            content = bytes(self._buffer[_HEADER.size : size])
            del self._buffer[:size]
            found += self._packet(kind, content)
        return found

    def _packet(self, kind: int, content: bytes) -> list[Message]:
        self.account.received += 1
        message = None
        try:
            if kind == _DATA and self.ready:
                message = self._frame(Cursor(content))
            elif kind == _XML:
                self._label(content)
            elif kind == _ERROR:
                message = self._refused(content)
            elif kind == _END:
                message = _status("no measurement is running")
            else:
                self.account.unread += 1
                return []
        except ValueError:
            self.account.malformed += 1
            return []
        self.account.decoded += 1
        return [] if message is None else [message]

    def _refused(self, content: bytes) -> Message:
        text = content.split(b"\0", 1)[0].decode("ascii", "replace")
        text = "".join(one for one in text if one.isprintable())[:100]
        if not self.ready:
            raise AcquisitionError(
                "qtm.refused",
                f"Qualisys Track Manager refused the request: {text}.",
                "Open a project, start a new measurement (or its preview), then open the job "
                "again.",
            )
        return _status(text)

    def _label(self, content: bytes) -> None:
        """Take the labels of the markers, in the order of those in a frame."""
        parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)
        try:
            tree = etree.fromstring(content.rstrip(b"\0"), parser)
        except etree.XMLSyntaxError as error:
            raise ValueError("XML") from error
        names = [one.text or "" for one in tree.iterfind("The_3D/Label/Name")]
        if not names or not all(0 < len(one) <= MOST_NAME and one.isprintable() for one in names):
            raise ValueError("labels")
        if not self.ready:
            self._pending.append(_STREAM)
        self._labels, self.ready = names, True

    def _frame(self, cursor: Cursor) -> Message:
        time_us, _, components = cursor.take("QII")
        for _ in range(components):
            size, kind = cursor.take("II")
            part = Cursor(cursor.skip(size - _HEADER.size))
            if kind == _MARKERS:
                return frame_of("QTM", 1000 * time_us + _FIRST_NS, self._markers(part))
        raise ValueError("component")

    def _markers(self, part: Cursor) -> list[MarkerPlace]:
        count, _, _ = part.take("IHH")
        if count != len(self._labels):
            # Its markers were labelled again: request them, once.
            self._pending, self._labels = [_PARAMETERS] * bool(self._labels), []
            raise ValueError("labels")
        # NaN if not seen.
        return [MarkerPlace(name, part.take("4f")[:3]) for name in self._labels]


def packet(kind: int, content: bytes) -> bytes:
    """Return a packet."""
    return _HEADER.pack(_HEADER.size + len(content), kind) + content


def _status(text: str) -> Message:
    return Message("status", "QTM", 0, DeviceStatus(0, text))
