"""Frames of markers as bytes of a tracker: what protocols share, faults, and their server.

Streams: OpenIGTLink, NatNet 3.0 to 4.1 (OptiTrack Motive), Qualisys Track Manager.
"""

from __future__ import annotations

import contextlib
import socket
import struct
from abc import ABC, abstractmethod
from dataclasses import dataclass
from html import escape
from typing import Literal, TypeAlias

import numpy as np

from ocmm_core.camera import TrackerDocument
from ocmm_core.geometry import Float
from ocmm_trackers import IDENTITY, checksum, fraction_of

_RESTART_NS = 3_600_000_000_000

NamedPlaces: TypeAlias = "dict[str, tuple[float, float, float] | None]"
"""Markers in unit and axes of the device; None if hidden and not reported otherwise."""


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
    scalar_first: bool = False
    """Quaternions in another order of their elements."""
    restarted: bool = False
    """The clock is that of a device that was started again."""
    unstamped: bool = False


class MarkerEncoder(ABC):
    """Frames of markers in one protocol; hidden markers as stated in the document."""

    datagrams = False
    """Its bytes are datagrams, each with its size in the third and fourth byte."""
    greeting = b""
    """Sent to a client that connects."""
    ready = True
    """A client waits for the next frame."""

    def __init__(self, document: TrackerDocument, seed: int = 0) -> None:
        self.faults = TrackerFaults()
        self.document = document
        self.rng = np.random.default_rng([seed, 46])
        self._held = b""
        self._before = np.zeros((len(document.markers), 3))

    def answer(self, _data: bytes) -> bytes:
        """Return the replies to requests of a client."""
        return b""

    def frame(self, places: Float, time_ns: int, *, pressed: bool = False) -> bytes:
        """Return the messages for markers (M, 3), mm, world, NaN if hidden, of one exposure."""
        faults = self.faults
        lose, late, double, swap, damage = self.rng.random(5) < (
            faults.lose, faults.late, faults.double, faults.swap, faults.damage
        )  # fmt: skip
        device = self._in_device(places)
        if swap:
            chosen = self.rng.permutation(len(device))[:2]
            device[chosen] = device[chosen[::-1]]
        time_ns += -_RESTART_NS if faults.restarted else 0
        named: NamedPlaces = {
            name: (x, y, z) if np.isfinite(x) else None
            for name, (x, y, z) in zip(self.document.markers, device.tolist(), strict=False)
        }
        sent = self._packets(named, 0 if faults.unstamped else time_ns, pressed)
        if damage and sent:
            sent = sent[:-1] + bytes([sent[-1] ^ 1])
        sent = b"" if lose else sent * (2 if double else 1)
        self._held, sent = (sent, b"") if late else (b"", sent + self._held)
        return sent

    @abstractmethod
    def _packets(self, named: NamedPlaces, time_ns: int, pressed: bool) -> bytes:
        """Return the bytes of one exposure; time 0: not stamped. ``pressed``: of the button."""

    def _in_device(self, places: Float) -> Float:
        """Return the markers in axes and unit of the device, hidden ones as it reports them."""
        document, faults = self.document, self.faults
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


_CHUNK = 1 << 16
_HOST = "127.0.0.1"
_SEND_S = 5.0


class TrackerServer:
    """A server that answers requests and sends frames, by UDP if its encoder makes datagrams."""

    def __init__(self, encoder: MarkerEncoder, port: int = 0) -> None:
        self._encoder = encoder
        if encoder.datagrams:
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.bind((_HOST, port))
        else:
            self._socket = socket.create_server((_HOST, port))
        self._socket.setblocking(False)
        self._client: socket.socket | None = None
        self._peer: tuple[str, int] | None = None

    @property
    def port(self) -> int:
        return int(self._socket.getsockname()[1])

    def accepted(self) -> bool:
        """Answer requests; return whether a client waits for a frame. It does not wait."""
        requests = b""
        # Nothing has arrived, or the client has ended.
        with contextlib.suppress(BlockingIOError):
            if self._encoder.datagrams:
                requests, self._peer = self._socket.recvfrom(_CHUNK)
            elif self._client is None:
                self._client = self._socket.accept()[0]
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self.send(self._encoder.greeting)
            else:
                requests = self._requests(self._client)
        self.send(self._encoder.answer(requests))
        return (self._client or self._peer) is not None and self._encoder.ready

    def _requests(self, client: socket.socket) -> bytes:
        client.settimeout(0.0)
        try:
            data = client.recv(_CHUNK)
        except ConnectionError:
            data = b""
        if not data:
            client.close()
            self._client = None
        return data

    def send(self, data: bytes) -> bool:
        """Return whether the client took the data."""
        try:
            if self._peer is not None:
                for one in datagrams_of(data):
                    self._socket.sendto(one, self._peer)
            elif self._client is not None:
                self._client.settimeout(_SEND_S)
                self._client.sendall(data)
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Close all sockets; idempotent."""
        if self._client is not None:
            self._client.close()
        self._socket.close()


def datagrams_of(data: bytes) -> list[bytes]:
    """Return the datagrams in bytes; each states its size."""
    found = []
    while data:
        size = 4 + struct.unpack_from("<H", data, 2)[0]
        found.append(data[:size])
        data = data[size:]
    return found


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
        quaternion = quaternion[3:] + quaternion[:3] if self.faults.scalar_first else quaternion
        seen = [(name, place) for name, place in named.items() if place is not None]
        single: dict[Kind, tuple[str, tuple[float, ...], tuple[float, ...]]] = {
            "TRANSFORM": (">12f", rotation, ()), "POSITION": (">7f", (), quaternion),
        }  # fmt: skip
        if self._kind in single:
            form, before, after = single[self._kind]
            return sent + b"".join(
                message(self._kind, name, time_ns, struct.pack(form, *before, *place, *after),
                        self._version)
                for name, place in seen
            )  # fmt: skip
        listed: dict[Kind, tuple[str, tuple[object, ...], tuple[object, ...]]] = {
            "TDATA": (">20sBB12f", (3, 0, *rotation), ()),
            "QTDATA": (">20sBB7f", (3, 0), quaternion),
            "POINT": (">64s32s4B4f20s", (b"", 0, 0, 0, 0), (1.0, b"")),
        }
        row, head, tail = listed[self._kind]
        rows = (struct.pack(row, name.encode(), *head, *place, *tail) for name, place in seen)
        return sent + message(self._kind, "Tracker", time_ns, b"".join(rows), self._version)


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
