"""Packets of Qualisys Track Manager, real-time protocol 1.25: labelled markers, analog devices.

Source: the open-source client qtm-rt of Qualisys; it is not used, because a packet of size 0 stops
it in an endless loop and a packet of an unknown kind ends it. Little endian (port 22223), mm.
"""

from __future__ import annotations

import struct

from lxml import etree

from ocmm_core.errors import AcquisitionError
from ocmm_trackers._messages import (
    Cursor,
    Decoder,
    DeviceStatus,
    MarkerPlace,
    Message,
    frame_of,
    printable,
    sensor_of,
)

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
                "Open a project, start a new measurement (or its preview), then open the job "
                "again.",
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
        time_us, _, components = cursor.take("QII")
        found: list[Message] = []
        markers = None
        for _ in range(components):
            size, kind = cursor.take("II")
            part = Cursor(cursor.skip(size - _HEADER.size))
            if kind == _MARKERS:
                # NaN if not seen.
                markers = [MarkerPlace(one, part.take("4f")[:3]) for one in self._labelled(part)]
            elif kind == _ANALOG:
                for _ in range(*part.take("I")):
                    number, channels = part.take("II")
                    found.append(sensor_of(str(number), part.take(f"{channels}f")))
        if markers is None:
            raise ValueError("component")
        return found + frame_of(self.name, 1000 * time_us + _FIRST_NS, markers)

    def _labelled(self, part: Cursor) -> tuple[str, ...]:
        """Return the labels of a component; ValueError if there are new ones."""
        if part.take("IHH")[0] != len(self._labels):
            # Request them, once.
            self._pending, self._labels = (_PARAMETERS,) if self._labels else (), ()
            raise ValueError("labels")
        return self._labels
