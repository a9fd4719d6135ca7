"""Connections of the second screen: how many, for how long, and the files of the page.

Everything that costs resources without a token is bounded: connections, seconds and bytes.
"""

from __future__ import annotations

import asyncio
import socket
import ssl

from aiohttp import web

from ocmm_core.documents import read_bytes, resource
from ocmm_core.station.stream import StreamOptions, may_connect

MOST_UNDECIDED = 32
"""Connections that are not readers; the oldest gives way."""
UNDECIDED_S = 10.0
"""s: limit until a connection is a reader."""
_PAUSE_S = 0.1
"""s: pause if the system has no free descriptors."""
_FILES = {
    "/": ("index.html", "text/html"),
    "/screen.css": ("screen.css", "text/css"),
    "/screen.js": ("screen.js", "text/javascript"),
}
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
    "Server": "OCMM",
}


class PageFiles:
    """The static files of the page, loaded once: no request names a file of the disk."""

    def __init__(self) -> None:
        folder = resource("screen", "index.html").parent
        self._files = {
            path: (read_bytes(folder / name), kind) for path, (name, kind) in _FILES.items()
        }

    def add_to(self, app: web.Application) -> None:
        for path in self._files:
            app.router.add_get(path, self._file)

    async def _file(self, request: web.Request) -> web.Response:
        return response(*self._files[request.path])


class ScreenReception:
    """Accept connections; for one event loop, not thread-safe."""

    def __init__(self, address: StreamOptions, tls: ssl.SSLContext | None) -> None:
        self._address, self._tls = address, tls
        self._undecided: dict[object, tuple[socket.socket, asyncio.Transport | None]] = {}
        """By the address of the other side."""

    async def receive(self, listener: socket.socket, server: web.Server) -> None:
        """Accept connections; each has `UNDECIDED_S` to become a reader."""
        loop = asyncio.get_running_loop()
        handshakes: set[asyncio.Task[None]] = set()
        while True:
            try:
                connection, address = await loop.sock_accept(listener)
            except OSError:
                # No free descriptors.
                await asyncio.sleep(_PAUSE_S)
                continue
            if not may_connect(self._address, str(address[0])):
                connection.close()
                continue
            connection.setblocking(False)
            task = loop.create_task(self._greet(connection, address, server))
            handshakes.add(task)
            task.add_done_callback(handshakes.discard)
            await asyncio.sleep(0)

    async def _greet(self, connection: socket.socket, address: object, server: web.Server) -> None:
        loop = asyncio.get_running_loop()
        for one, (_, transport) in tuple(self._undecided.items()):
            if transport is not None and transport.is_closing():
                del self._undecided[one]
        self._undecided[address] = connection, None
        if len(self._undecided) > MOST_UNDECIDED:
            self._drop(next(iter(self._undecided)))
        try:
            limit = UNDECIDED_S if self._tls is not None else None
            transport, _ = await loop.connect_accepted_socket(
                server, connection, ssl=self._tls, ssl_handshake_timeout=limit
            )
        except OSError:
            # It hung up, or does not use TLS.
            self._drop(address)
            return
        if address in self._undecided:
            self._undecided[address] = connection, transport
            loop.call_later(UNDECIDED_S, self._expire, address, transport)
        else:
            transport.abort()

    def _expire(self, address: object, transport: asyncio.Transport) -> None:
        # Another connection can have the address by now.
        if self._undecided.get(address, (None, None))[1] is transport:
            self._drop(address)

    def _drop(self, address: object) -> None:
        """Close a connection that has not become a reader."""
        connection, transport = self._undecided.pop(address, (None, None))
        if transport is not None:
            transport.abort()
        elif connection is not None:
            connection.close()

    def admit(self, transport: asyncio.BaseTransport | None) -> None:
        """Exempt the connection of a reader from the limits of the others."""
        if transport is not None:
            self._undecided.pop(transport.get_extra_info("peername"), None)


def response(content: bytes, kind: str, status: int = 200) -> web.Response:
    """Return a response with the headers of the page; its connection ends."""
    found = web.Response(body=content, content_type=kind, status=status, headers=_HEADERS)
    if kind.startswith("text/"):
        found.charset = "utf-8"
    # One request a connection: an idle one holds no place.
    found.force_close()
    return found
