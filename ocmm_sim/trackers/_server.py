"""A server of OpenIGTLink: messages of markers, and faults on request."""

from __future__ import annotations

import socket
import struct
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ocmm_core.camera import TrackerDocument
from ocmm_core.geometry import Float
from ocmm_trackers import IDENTITY, checksum, fraction_of

Kind = Literal["TDATA", "QTDATA", "POSITION", "TRANSFORM", "POINT"]
_TURNED = (0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_METADATA = b"\0\0"
_RESTART_NS = 3_600_000_000_000


@dataclass(slots=True)
class TrackerFaults:
    """Shares of frames from 0 to 1, and faults of all frames."""

    lose: float = 0.0
    late: float = 0.0
    """Sent after the next one."""
    double: float = 0.0
    swap: float = 0.0
    """Two markers exchange their names."""
    damage: float = 0.0
    """With a wrong checksum."""
    metres: bool = False
    mirrored: bool = False
    poses: bool = False
    """Tools with a rotation in place of markers."""
    restarted: bool = False
    """The clock is that of a device that was started again."""
    unstamped: bool = False


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


class IgtlEncoder:
    """Frames of markers as messages of a kind; hidden markers as the document says."""

    def __init__(
        self, document: TrackerDocument, kind: Kind = "TDATA", version: int = 1, seed: int = 0
    ) -> None:
        self.faults = TrackerFaults()
        self._document, self._kind, self._version = document, kind, version
        self._rng = np.random.default_rng([seed, 46])
        self._held = b""
        self._before = np.zeros((len(document.markers), 3))

    def frame(self, places: Float, time_ns: int, *, pressed: bool = False) -> bytes:
        """Return the messages for markers (M, 3), mm, world, NaN if hidden, of one exposure."""
        faults = self.faults
        lose, late, double, swap, damage = self._rng.random(5) < (
            faults.lose, faults.late, faults.double, faults.swap, faults.damage
        )  # fmt: skip
        device = self._in_device(places)
        if swap:
            chosen = self._rng.permutation(len(device))[:2]
            device[chosen] = device[chosen[::-1]]
        time_ns += -_RESTART_NS if faults.restarted else 0
        sent = self._messages(device, 0 if faults.unstamped else time_ns)
        if damage:
            sent = sent[:-1] + bytes([sent[-1] ^ 1])
        sent = b"" if lose else sent * (2 if double else 1)
        self._held, sent = (sent, b"") if late else (b"", sent + self._held)
        if self._document.button:
            value = struct.pack(">BBQd", 1, 0, 0, float(pressed))
            sent = message("SENSOR", self._document.button, time_ns, value) + sent
        return sent

    def _in_device(self, places: Float) -> Float:
        """Return the markers in axes and unit of the device, hidden ones as it reports them."""
        document, faults = self._document, self.faults
        unit = 0.001 if (document.device_unit == "m") is not faults.metres else 1.0
        left = (document.handedness == "left") is not faults.mirrored
        device = places * unit * [1.0, 1.0, -1.0 if left else 1.0]
        hidden = ~np.isfinite(device[:, 0])
        if document.missing == "zero":
            device[hidden] = 0.0
        elif document.missing == "frozen":
            device[hidden] = self._before[: len(device)][hidden]
        self._before[: len(device)] = np.where(
            np.isfinite(device), device, self._before[: len(device)]
        )
        return device

    def _messages(self, device: Float, time_ns: int) -> bytes:
        rotation = _TURNED if self.faults.poses else IDENTITY
        quaternion = (0.0, 0.0, 0.6, 0.8) if self.faults.poses else (0.0, 0.0, 0.0, 1.0)
        named = [
            (name, place)
            for name, place in zip(self._document.markers, device.tolist(), strict=False)
            if np.isfinite(place[0])
        ]
        if self._kind == "TDATA":
            content = b"".join(
                struct.pack(">20sBB12f", name.encode(), 3, 0, *rotation, *place)
                for name, place in named
            )
        elif self._kind == "QTDATA":
            content = b"".join(
                struct.pack(">20sBB7f", name.encode(), 3, 0, *place, *quaternion)
                for name, place in named
            )
        elif self._kind == "POINT":
            content = b"".join(
                struct.pack(">64s32s4B4f20s", name.encode(), b"", 0, 0, 0, 0, *place, 1.0, b"")
                for name, place in named
            )
        else:
            single = {"TRANSFORM": (">12f", rotation, ()), "POSITION": (">7f", (), quaternion)}
            form, before, after = single[self._kind]
            return b"".join(
                message(self._kind, name, time_ns, struct.pack(form, *before, *place, *after),
                        self._version)
                for name, place in named
            )  # fmt: skip
        return message(self._kind, "Tracker", time_ns, content, self._version)


class IgtlServer:
    """A server for one client on this computer."""

    def __init__(self, port: int = 0) -> None:
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.setblocking(False)
        self._client: socket.socket | None = None

    @property
    def port(self) -> int:
        return int(self._listener.getsockname()[1])

    def accepted(self) -> bool:
        """Return whether a client is connected; does not wait."""
        if self._client is None:
            try:
                self._client = self._listener.accept()[0]
            except BlockingIOError:
                return False
            self._client.settimeout(5.0)
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return True

    def send(self, data: bytes) -> bool:
        """Return whether the client took the data."""
        try:
            if self._client is not None:
                self._client.sendall(data)
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Close both sockets; idempotent."""
        if self._client is not None:
            self._client.close()
        self._listener.close()
