"""Frames of markers as bytes of a tracker: what protocols share, faults, and their server."""

from __future__ import annotations

import socket
import struct
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ocmm_core.camera import TrackerDocument
from ocmm_core.geometry import Float

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
        self._rng = np.random.default_rng([seed, 46])
        self._held = b""
        self._before = np.zeros((len(document.markers), 3))

    def answer(self, _data: bytes) -> bytes:
        """Return the replies to requests of a client."""
        return b""

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

    @property
    def port(self) -> int:
        return int(self._socket.getsockname()[1])

    def accepted(self) -> bool:
        """Answer requests; return whether a client waits for a frame. It does not wait."""
        requests = b""
        try:
            if self._client is not None:
                self._client.settimeout(0.0)
                requests = self._client.recv(_CHUNK)
            elif self._encoder.datagrams:
                requests, address = self._socket.recvfrom(_CHUNK)
                self._socket.connect(address)
                self._client = self._socket
            else:
                self._client = self._socket.accept()[0]
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self.send(self._encoder.greeting)
        except OSError:
            # Nothing has arrived, or the client has ended.
            pass
        self.send(self._encoder.answer(requests))
        return self._client is not None and self._encoder.ready

    def send(self, data: bytes) -> bool:
        """Return whether the client took the data."""
        try:
            if self._client is not None:
                self._client.settimeout(_SEND_S)
                for one in datagrams_of(data) if self._encoder.datagrams else [data]:
                    self._client.sendall(one)
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
