"""Connections to trackers: a stream (TCP), or datagrams (UDP)."""

from __future__ import annotations

import select
import socket

from ocmm_core.errors import AcquisitionError

_CHUNK = 1 << 16
_MOST_WAITING = 64
"""Datagrams of one read."""


class StreamLink:
    """A connection by TCP; OSError if there is none."""

    def __init__(self, address: tuple[str, int], connect_s: float) -> None:
        self._socket = socket.create_connection(address, connect_s)
        # Markers that arrive late are worth less than small packets.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """Send bytes."""
        self._socket.sendall(data)

    def receive(self, wait_s: float) -> list[bytes]:
        """Return what has arrived, or nothing after a wait, s; AcquisitionError at its end."""
        self._socket.settimeout(wait_s)
        try:
            data = self._socket.recv(_CHUNK)
        except TimeoutError:
            return []
        except OSError as error:
            data, why = b"", error.strerror or str(error)
        else:
            why = "closed"
        if not data:
            raise AcquisitionError(
                "tracker.closed",
                f"The tracker ended the connection ({why}).",
                "Check its program, cable and power, then open the job again.",
            )
        return [data]

    def close(self) -> None:
        """End the connection; idempotent."""
        self._socket.close()


class DatagramLink:
    """Datagrams (UDP) to and from one computer; those of others are dropped."""

    def __init__(self, address: tuple[str, int], _connect_s: float) -> None:
        self._address = (socket.gethostbyname(address[0]), address[1])
        self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM)]

    def send(self, data: bytes) -> None:
        """Send a datagram."""
        self._sockets[0].sendto(data, self._address)

    def receive(self, wait_s: float) -> list[bytes]:
        """Return the datagrams that have arrived, or nothing after a wait, s."""
        found: list[bytes] = []
        ready = select.select(self._sockets, [], [], wait_s)[0]
        while ready and len(found) < _MOST_WAITING:
            for one in ready:
                data, sender = one.recvfrom(_CHUNK)
                found += [data] if sender[0] == self._address[0] else []
            ready = select.select(self._sockets, [], [], 0.0)[0]
        return found

    def join(self, group: str, port: int) -> None:
        """Receive datagrams to a multicast address also."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as route:
            # Of several interfaces, the one towards the tracker.
            route.connect(self._address)
            local = route.getsockname()[0]
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sockets.append(one)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        one.bind((group, port))
        both = socket.inet_aton(group) + socket.inet_aton(local)
        one.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, both)

    def close(self) -> None:
        """Close all sockets; idempotent."""
        for one in self._sockets:
            one.close()
