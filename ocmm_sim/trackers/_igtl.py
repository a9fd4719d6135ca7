"""Markers as messages of OpenIGTLink."""

from __future__ import annotations

import struct
from typing import Literal

from ocmm_core.camera import TrackerDocument
from ocmm_sim.trackers._encoder import MarkerEncoder, NamedPlaces
from ocmm_trackers import IDENTITY, checksum, fraction_of

Kind = Literal["TDATA", "QTDATA", "POSITION", "TRANSFORM", "POINT"]
_TURNED = (0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_METADATA = b"\0\0"


def message(kind: str, device: str, time_ns: int, content: bytes, version: int = 1) -> bytes:
    """Return a message; version 3 with its extended header and empty metadata."""
    body = content
    if version >= 3:
        body = struct.pack(">HHII", 12, len(_METADATA), 0, 1) + content + _METADATA
    head = struct.pack(
        ">H12s20sIIQQ", min(version, 2), kind.encode(), device.encode(), *fraction_of(time_ns),
        len(body), checksum(body),
    )  # fmt: skip
    return head + body


class IgtlEncoder(MarkerEncoder):
    """Frames of markers as messages of a kind."""

    def __init__(
        self, document: TrackerDocument, kind: Kind = "TDATA", version: int = 1, seed: int = 0
    ) -> None:
        super().__init__(document, seed)
        self._kind, self._version = kind, version

    def _packets(self, named: NamedPlaces, time_ns: int, pressed: bool) -> bytes:
        value = struct.pack(">BBQd", 1, 0, 0, float(pressed))
        sensor = message("SENSOR", self.document.button, time_ns, value)
        sent = sensor if self.document.button else b""
        rotation = _TURNED if self.faults.poses else IDENTITY
        quaternion = (0.0, 0.0, 0.6, 0.8) if self.faults.poses else (0.0, 0.0, 0.0, 1.0)
        seen = [(name, place) for name, place in named.items() if place is not None]
        if self._kind == "TDATA":
            content = b"".join(
                struct.pack(">20sBB12f", name.encode(), 3, 0, *rotation, *place)
                for name, place in seen
            )
        elif self._kind == "QTDATA":
            content = b"".join(
                struct.pack(">20sBB7f", name.encode(), 3, 0, *place, *quaternion)
                for name, place in seen
            )
        elif self._kind == "POINT":
            content = b"".join(
                struct.pack(">64s32s4B4f20s", name.encode(), b"", 0, 0, 0, 0, *place, 1.0, b"")
                for name, place in seen
            )
        else:
            single = {"TRANSFORM": (">12f", rotation, ()), "POSITION": (">7f", (), quaternion)}
            form, before, after = single[self._kind]
            return sent + b"".join(
                message(self._kind, name, time_ns, struct.pack(form, *before, *place, *after),
                        self._version)
                for name, place in seen
            )  # fmt: skip
        return sent + message(self._kind, "Tracker", time_ns, content, self._version)
