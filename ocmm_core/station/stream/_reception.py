"""Address and access control of the live stream: connections, their number, request timeouts.

Everything that costs resources without the token is bounded here: places, bytes and seconds. A
connection without a request waits in a separate queue and never displaces an accepted one; if the
queue is full, the oldest one of the computer with most of them is closed. So a thousand silent
connections hold a few dozen descriptors, and prompt clients get in. Everything runs in one event
loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import socket
import ssl
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.host import is_loopback
from ocmm_core.station.stream._client import (
    LONGEST_REQUEST,
    MOST_CHATTER,
    MOST_WAITING,
    REQUEST_TIMEOUT_S,
    StreamClient,
)
from ocmm_core.station.stream._messages import bye_line

SHORTEST_TOKEN = 16


@dataclass(frozen=True, slots=True)
class StreamOptions:
    host: str = "127.0.0.1"
    port: int = 0
    """`host`, `port`: Address to listen on; port 0 selects a free one."""
    token: str = ""
    """Required from clients unless ``host`` is loopback."""
    poses_hz: float = 60.0
    """Maximum rate of poses, and of checks for state changes."""
    certificate: Path | None = None
    private_key: Path | None = None
    """`certificate`, `private_key`: PEM files for TLS; None for plain TCP."""
    allow: tuple[str, ...] = ()
    """Addresses (192.168.1.20) and networks (10.0.0.0/24) of clients; empty: any. This computer is
    always allowed."""


def check_stream(options: StreamOptions, *, by_address: bool = False) -> None:
    """Raise InputError if the stream would be open to others.

    `by_address`: its clients cannot send a token; an allow-list of addresses replaces it.
    """
    for one in options.allow:
        try:
            ipaddress.ip_network(one)
        except ValueError as error:
            raise InputError(
                "stream.allow",
                f'"{one}" is not an address or a network ({error}).',
                "Write it as 192.168.1.20 or 192.168.1.0/24.",
            ) from error
    if is_loopback(options.host):
        return
    if by_address and not options.allow:
        raise InputError(
            "stream.allow_missing",
            f"Any computer that reaches {options.host} could connect.",
            "State the addresses of the clients (option allow), or listen on 127.0.0.1.",
        )
    if not by_address and len(options.token) < SHORTEST_TOKEN:
        raise InputError(
            "stream.token",
            f"The stream would be open to anyone who can reach {options.host}.",
            f"Give a token of {SHORTEST_TOKEN} characters or more, or listen on 127.0.0.1.",
        )


def tls_context(options: StreamOptions) -> ssl.SSLContext | None:
    """Return the TLS context, or None; InputError: missing, unreadable, mismatched or expired."""
    certificate, private_key = options.certificate, options.private_key
    if certificate is None and private_key is None:
        return None
    if certificate is None or private_key is None:
        raise InputError(
            "stream.tls",
            "TLS needs both a certificate and its private key.",
            "Give both together (Settings, Live stream).",
        )
    _require_in_date(certificate)
    read_bytes(private_key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        # Otherwise OpenSSL would ask for a password on the terminal.
        context.load_cert_chain(certificate, private_key, password="")
    except (ssl.SSLError, OSError, ValueError) as error:
        raise InputError(
            "stream.tls_files",
            f"{certificate} and {private_key} cannot be used for TLS ({error}).",
            "Give a certificate and its own private key without a password, both as PEM files.",
        ) from error
    return context


def _require_in_date(path: Path) -> None:
    from cryptography import x509

    content = read_bytes(path)
    try:
        certificate = x509.load_pem_x509_certificate(content)
    except ValueError as error:
        raise InputError(
            "stream.certificate",
            f"{path}: this is not a certificate ({error}).",
            "Give a PEM file that begins with BEGIN CERTIFICATE.",
        ) from error
    now, end = datetime.now(UTC), certificate.not_valid_after_utc
    if not certificate.not_valid_before_utc <= now <= end:
        raise InputError(
            "stream.certificate_date",
            f"{path}: the certificate is valid from {certificate.not_valid_before_utc:%Y-%m-%d} "
            f"to {end:%Y-%m-%d}.",
            "Renew it.",
        )


def may_connect(options: StreamOptions, address: str) -> bool:
    """Return whether the allow-list contains the address of a client, or is empty."""
    if not options.allow or is_loopback(address):
        return True
    client = ipaddress.ip_address(address.partition("%")[0])
    # A dual-stack socket reports IPv4 clients as ::ffff:192.168.1.20.
    client = getattr(client, "ipv4_mapped", None) or client
    return any(client in ipaddress.ip_network(one) for one in options.allow)


def listen(options: StreamOptions, backlog: int) -> socket.socket:
    """Return a socket that listens; MeasuringError if the address is unavailable."""
    host, port = options.host, options.port
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=backlog)
    except OSError as error:
        raise MeasuringError(
            "stream.address",
            f"This program cannot listen on {host}:{port} ({error.strerror or error}).",
            "Choose another port, or close the program that uses it; the address must "
            "belong to this computer.",
        ) from error


MOST_CLIENTS = 8
MOST_UNDECIDED = 32
"""Connections without a request so far."""
LAST_WORDS_S = 5.0
"""s: time for a client to read its goodbye."""
_PAUSE_S = 0.1
"""s: pause if the system has no free descriptors."""


class Reception:
    """Accept and close connections; for one event loop, not thread-safe.

    `listener`: bound, and listening. `tls`: None for plain TCP. `greet`: returns the first line to
    a client. `begin`: receives a client and its request. `failed`: receives unexpected errors;
    the client in question is disconnected. `may`: of addresses. `plain`: clients send nothing, may
    close their half of the connection, and get no goodbye.
    """

    def __init__(
        self,
        listener: socket.socket,
        tls: ssl.SSLContext | None,
        greet: Callable[[StreamClient], bytes],
        begin: Callable[[StreamClient, bytes], None],
        failed: Callable[[Exception], None],
        may: Callable[[str], bool],
        *,
        plain: bool,
    ) -> None:
        self._listener, self._tls = listener, tls
        self._greet, self._begin, self._failed = greet, begin, failed
        self._may, self.plain = may, plain
        self._guests: dict[StreamClient, tuple[socket.socket, asyncio.Task[None]]] = {}

    @property
    def clients(self) -> tuple[StreamClient, ...]:
        """Return all connections, oldest first."""
        return tuple(self._guests)

    @property
    def listening(self) -> list[StreamClient]:
        return [client for client in self._guests if client.listens]

    @property
    def is_full(self) -> bool:
        """Return whether the number of clients is at its limit."""
        return len(self.listening) >= MOST_CLIENTS

    async def receive(self) -> None:
        """Accept connections until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                connection, address = await loop.sock_accept(self._listener)
            except OSError:
                await asyncio.sleep(_PAUSE_S)
                continue
            if not self._may(str(address[0])):
                connection.close()
                continue
            connection.setblocking(False)
            now = time.monotonic()
            client = StreamClient(str(address[0]), now, now)
            task = loop.create_task(self._shake_hands(client, connection))
            self._guests[client] = connection, task
            self._make_room()
            # Fast reconnects must not starve others.
            await asyncio.sleep(0)

    def prune(self, now: float) -> None:
        """Close clients that are silent, stalled, too talkative, or had their goodbye."""
        for client in self.clients:
            with self.dropping(client):
                client.note_movement(now)
                heard_goodbye = not client.waiting or now - client.since_s > LAST_WORDS_S
                if client.is_stalled(now) or (client.ending and heard_goodbye):
                    self.cut(client)
                elif client.is_silent(now):
                    self.end(client, f"no request within {REQUEST_TIMEOUT_S:g} s")
                elif client.said > MOST_CHATTER:
                    self.end(client, "only the first line is read")

    def end(self, client: StreamClient, why: str) -> None:
        """Send a goodbye with a reason; the connection ends when it is read."""
        if client.ending:
            return
        client.ending, client.since_s = True, time.monotonic()
        if client.transport is None:
            self.cut(client)
            return
        client.write(b"" if self.plain else bye_line(why))
        # Further input costs nothing.
        client.transport.pause_reading()

    def cut(self, client: StreamClient) -> None:
        guest = self._guests.pop(client, None)
        if guest is None:
            return
        connection, task = guest
        task.cancel()
        if client.transport is not None:
            # The rest of a goodbye is in the system's buffers by now, or never read.
            client.transport.abort() if client.waiting else client.transport.close()
        else:
            connection.close()

    def close(self) -> None:
        for client in self.clients:
            self.cut(client)

    @contextlib.contextmanager
    def dropping(self, client: StreamClient) -> Iterator[None]:
        """Disconnect a client on unexpected errors; the others stay."""
        try:
            yield
        except Exception as error:
            self.cut(client)
            self._failed(error)

    async def _shake_hands(self, client: StreamClient, connection: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        try:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            # Data buffered by the system for a slow client are stale when read.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST_WAITING)
            limit = REQUEST_TIMEOUT_S if self._tls is not None else None
            await loop.connect_accepted_socket(
                lambda: _Talk(self, client), connection, ssl=self._tls,
                ssl_handshake_timeout=limit,
            )  # fmt: skip
        except (OSError, ssl.SSLError):
            # It hung up, or does not use TLS.
            self._guests.pop(client, None)
            connection.close()

    def _make_room(self) -> None:
        undecided = [one for one in self._guests if not one.begun and not one.ending]
        if len(undecided) <= MOST_UNDECIDED:
            return
        (most, _), *_ = Counter(client.address for client in undecided).most_common(1)
        self.end(next(one for one in undecided if one.address == most), "too many connections wait")

    def joined(self, client: StreamClient) -> None:
        """Greet a client after the handshake."""
        with self.dropping(client):
            client.write(self._greet(client))

    def heard(self, client: StreamClient, said: bytes) -> None:
        with self.dropping(client):
            request = client.hear(said)
            if request is not None:
                self._begin(client, request)
            elif len(client.heard) > LONGEST_REQUEST:
                self.end(client, "the first line is too long")


class _Talk(asyncio.Protocol):
    """Event loop callbacks of one connection."""

    def __init__(self, reception: Reception, client: StreamClient) -> None:
        self._reception, self._client = reception, client

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if not isinstance(transport, asyncio.Transport):
            raise TypeError(f"{type(transport)} is no stream")
        self._client.transport = transport
        self._reception.joined(self._client)

    def data_received(self, data: bytes) -> None:
        self._reception.heard(self._client, data)

    def eof_received(self) -> bool:
        if not self._reception.plain:
            self._reception.cut(self._client)
        # True: what it reads is still open.
        return self._reception.plain

    def connection_lost(self, exc: Exception | None) -> None:
        self._reception.cut(self._client)
