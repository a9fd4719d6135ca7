"""Markers as packets of Qualisys Track Manager, real-time protocol."""

from __future__ import annotations

import struct
from html import escape

from ocmm_core.camera import TrackerDocument
from ocmm_sim.trackers._encoder import MarkerEncoder, NamedPlaces

_ERROR, _ANSWER, _XML, _DATA = 0, 1, 2, 3
_MARKERS, _BODIES, _ANALOG = 9, 11, 13
_NAN = (float("nan"),) * 3


class QtmEncoder(MarkerEncoder):
    """Frames of markers as components 3DRes."""

    greeting = struct.pack("<II", 35, _ANSWER) + b"QTM RT Interface connected\0"
    ready = False

    def __init__(self, document: TrackerDocument, seed: int = 0) -> None:
        super().__init__(document, seed)
        self._number = 0
        self._requests = b""

    def answer(self, data: bytes) -> bytes:
        self._requests += data
        replies = b""
        while len(self._requests) >= 8:
            size, _ = struct.unpack_from("<II", self._requests)
            if len(self._requests) < size:
                break
            replies += self._reply(self._requests[8:size].rstrip(b"\0").decode("ascii").lower())
            self._requests = self._requests[size:]
        return replies

    def _reply(self, command: str) -> bytes:
        if command.startswith("version "):
            return _packet(_ANSWER, f"Version set to {command[8:]}".encode() + b"\0")
        if command.startswith("getparameters"):
            names = "".join(
                f"<Label><Name>{escape(name)}</Name><RGBColor>255</RGBColor></Label>"
                for name in self.document.markers
            )
            text = (
                "<QTM_Parameters_Ver_1.25><The_3D><AxisUpwards>+Z</AxisUpwards><Labels>"
                f"{len(self.document.markers)}</Labels>{names}</The_3D></QTM_Parameters_Ver_1.25>"
            )
            return _packet(_XML, text.encode() + b"\0")
        if command.startswith("streamframes"):
            self.ready = not command.endswith("stop")
            return _packet(_ANSWER, b"Ok\0")
        return _packet(_ERROR, b"Parse error\0")

    def _packets(self, named: NamedPlaces, time_ns: int, pressed: bool) -> bytes:
        self._number += 1
        places = [named.get(name) or _NAN for name in self.document.markers]
        markers = b"".join(struct.pack("<4f", *place, 0.2) for place in places)
        # The pose of a body that is not seen, which is not read.
        body = struct.pack("<IHH13f", 1, 0, 0, *((float("nan"),) * 13))
        parts = [
            (_BODIES, body), (_MARKERS, struct.pack("<IHH", len(places), 0, 0) + markers),
            (_ANALOG, struct.pack("<IIIf", 1, 1, 1, float(pressed))),
        ]  # fmt: skip
        content = struct.pack("<QII", time_ns // 1000, self._number, len(parts))
        for kind, part in parts:
            content += struct.pack("<II", 8 + len(part), kind) + part
        return _packet(_DATA, content)


def _packet(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", 8 + len(content), kind) + content
