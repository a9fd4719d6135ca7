"""Access to the second screen: tokens of one secret, the address of the page, connections.

Everything that costs resources without a token is bounded: connections, seconds and bytes.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import hmac
import socket
import ssl
from dataclasses import dataclass, field
from typing import Literal

import segno
from aiohttp import web

from ocmm_core.documents import read_bytes, resource
from ocmm_core.errors import InputError
from ocmm_core.host import is_loopback
from ocmm_core.station.stream import StreamOptions, may_connect

SHORTEST_TOKEN = 16
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
Right = Literal["", "read", "control"]
_BLOCKS = {(0, 0): "█", (0, 1): "▀", (1, 0): "▄", (1, 1): " "}


@dataclass(frozen=True, slots=True)
class ScreenAccess:
    """Tokens of the page; InputError if the secret is too short.

    The token for reading is derived from the secret by a one-way function: its owner cannot make
    the one for the buttons.
    """

    secret: str = field(repr=False)
    """Token of the page with buttons."""
    may_control: bool = False
    """Whether the secret opens the page with buttons."""

    def __post_init__(self) -> None:
        if len(self.secret) < SHORTEST_TOKEN:
            raise InputError(
                "screen.token",
                f"The token has {len(self.secret)} characters.",
                f"Put {SHORTEST_TOKEN} letters and digits or more into its file.",
            )

    @property
    def read_token(self) -> str:
        found = hmac.new(self.secret.encode(), b"ocmm.screen/read", hashlib.sha256).digest()
        return base64.urlsafe_b64encode(found[:18]).decode("ascii")

    def right_of(self, token: str) -> Right:
        """Return the right of a token; all comparisons take equal time."""
        given = token.encode("utf-8", "surrogatepass")
        if hmac.compare_digest(given, self.read_token.encode()):
            return "read"
        is_secret = hmac.compare_digest(given, self.secret.encode())
        return "control" if is_secret and self.may_control else ""


@dataclass(frozen=True, slots=True)
class ScreenOptions:
    """Options of the server; InputError: buttons in a network without TLS."""

    address: StreamOptions
    access: ScreenAccess

    def __post_init__(self) -> None:
        if self.access.may_control and self.warning:
            raise InputError(
                "screen.control_tls",
                f"Without TLS anyone in the network of {self.address.host} could read the token "
                "and press the buttons.",
                "State the certificate and its key, or serve the page for reading only.",
            )

    @property
    def warning(self) -> str:
        """Return that others in the network could read the token; empty if they cannot."""
        if is_loopback(self.address.host) or self.address.certificate is not None:
            return ""
        return (
            "Without TLS the page can be read and changed in the network. State a certificate and "
            "its key: --cert and --key, or Settings, Live stream."
        )

    def page(self, port: int, token: str) -> str:
        """Return the address of the page; browsers never send the token behind the ``#``."""
        host = self.address.host
        if host in ("0.0.0.0", "::"):  # noqa: S104 - compared, not listened on
            # Tablets rarely know names of computers; a certificate is for one.
            named = self.address.certificate is not None
            host = socket.gethostname() if named else _own_address()
        scheme = "http" if self.address.certificate is None else "https"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}/#{token}"


def _own_address() -> str:
    """Return the address of this computer in its network, or its name without one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Chooses the interface; nothing is sent.
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return socket.gethostname()
        return str(probe.getsockname()[0])


def code_rows(text: str) -> tuple[bytes, ...]:
    """Return a QR code as rows of modules, 1 for dark, with a light border."""
    return tuple(map(bytes, segno.make(text, micro=False).matrix_iter(border=2)))


def code_lines(text: str) -> tuple[str, ...]:
    """Return a QR code as lines of a terminal, light modules filled; two modules a character."""
    rows = list(code_rows(text))
    rows += [bytes(len(rows[0]))] * (len(rows) % 2)
    return tuple(
        "".join(_BLOCKS[int(above), int(below)] for above, below in zip(*pair, strict=True))
        for pair in zip(rows[::2], rows[1::2], strict=True)
    )


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
