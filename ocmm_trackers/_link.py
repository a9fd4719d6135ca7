"""The connection to a tracker: a stream (TCP), or datagrams (UDP)."""

from __future__ import annotations

import select
import socket

from ocmm_core.errors import AcquisitionError

_CHUNK = 1 << 16
_MOST_WAITING = 64
"""Packets of one read."""


class TrackerLink:
    """A connection to one computer, whose datagrams alone are received; OSError if it fails."""

    def __init__(self, address: tuple[str, int], *, datagrams: bool, connect_s: float) -> None:
        self._datagrams, self._address = datagrams, address
        if datagrams:
            self._address = (socket.gethostbyname(address[0]), address[1])
            self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM)]
        else:
            self._sockets = [socket.create_connection(address, connect_s)]
            # Markers that arrive late are worth less than small packets.
            self._sockets[0].setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """Send bytes, as one datagram if it sends these."""
        if self._datagrams:
            self._sockets[0].sendto(data, self._address)
        else:
            self._sockets[0].sendall(data)

    def receive(self, wait_s: float) -> list[bytes]:
        """Return the bytes received within a wait, s; AcquisitionError at the end."""
        found: list[bytes] = []
        while len(found) < _MOST_WAITING:
            ready = select.select(self._sockets, [], [], 0.0 if found else wait_s)[0]
            if not ready:
                break
            for one in ready:
                data, why = b"", "closed"
                try:
                    data, sender = one.recvfrom(_CHUNK)
                except OSError as error:
                    why = error.strerror or str(error)
                if self._datagrams:
                    found.append(data if data and sender[0] == self._address[0] else b"")
                elif data:
                    found.append(data)
                else:
                    raise AcquisitionError(
                        "tracker.closed",
                        f"The tracker ended the connection ({why}).",
                        "Check its program, cable and power, then open the job again.",
                    )
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
        """End the connection; idempotent."""
        for one in self._sockets:
            one.close()
