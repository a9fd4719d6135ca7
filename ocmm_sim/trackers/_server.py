"""The server of a software tracker on this computer, for one client."""

from __future__ import annotations

import socket
import struct

from ocmm_sim.trackers._encoder import MarkerEncoder

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
