"""TCP server of the protocol: one client, known addresses, bounded buffers."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.failure import contained
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.station.stream import StreamOptions, tls_context
from ocmm_serve.ippdme._dialect import error_line
from ocmm_serve.ippdme._grammar import LONGEST_LINE, NO_TAG
from ocmm_serve.ippdme._session import DmeSession

PORT = 1294
_TICK_S = 0.05
_MOST_UNREAD = 4 * 1024 * 1024
"""Bytes of answers that a client may leave unread before it is disconnected."""
_CLOSE_S = 5.0
_END = b"\r\n"


@dataclass(frozen=True, slots=True)
class ServeOptions:
    host: str = "127.0.0.1"
    port: int = PORT
    """`host`, `port`: address to listen on; port 0 selects a free one."""
    allowed: tuple[str, ...] = ()
    """Addresses or networks of clients; required unless ``host`` is loopback."""
    certificate: Path | None = None
    private_key: Path | None = None
    """`certificate`, `private_key`: PEM files for TLS; None for plain TCP."""


class AllowList:
    """Addresses that may connect; InputError if the server would be open to anyone."""

    def __init__(self, options: ServeOptions) -> None:
        try:
            self._networks = [ipaddress.ip_network(one, strict=False) for one in options.allowed]
        except ValueError as error:
            raise InputError(
                "serve.allow", f"{error}.", "Give an address or a network, such as 192.168.1.0/24."
            ) from error
        if not self._networks and not _is_loopback(options.host):
            raise InputError(
                "serve.open",
                f"The server would be open to anyone who can reach {options.host}.",
                "Give the addresses of the programs with --allow, or listen on 127.0.0.1.",
            )

    def allows(self, address: str) -> bool:
        """Return whether a client may connect; without a list, this computer alone."""
        found = ipaddress.ip_address(address.partition("%")[0])
        mapped = getattr(found, "ipv4_mapped", None)
        found = found if mapped is None else mapped
        return found.is_loopback or any(found in network for network in self._networks)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


class DmeServer:
    """Serve a session on a thread of its own; all calls of the session are made there.

    `failed`: receives unexpected errors. InputError: the options are not safe, or not valid.
    """

    def __init__(
        self,
        session: DmeSession,
        options: ServeOptions,
        failed: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        self._session, self._options, self._failed = session, options, failed
        self._allowed = AllowList(options)
        self._tls = tls_context(
            StreamOptions(certificate=options.certificate, private_key=options.private_key)
        )
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stopping = asyncio.Event()
        self._client: _DmeConnection | None = None
        self._thread: threading.Thread | None = None
        self.address = (options.host, options.port)

    def start(self) -> tuple[str, int]:
        """Listen, and return the address; MeasuringError if it is unavailable."""
        host, port = self.address
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            listener = socket.create_server((host, port), family=family, backlog=16)
        except OSError as error:
            raise MeasuringError(
                "serve.address",
                f"The server cannot listen on {host}:{port} ({error.strerror or error}).",
                "Choose another port, or close the program that uses it; the address must "
                "belong to this computer.",
            ) from error
        found = listener.getsockname()
        self.address = (str(found[0]), int(found[1]))
        ready = threading.Event()
        self._thread = threading.Thread(
            target=self._run, args=(listener, ready), name="ocmm-serve", daemon=True
        )
        self._thread.start()
        ready.wait(_CLOSE_S)
        return self.address

    def close(self) -> bool:
        """Disconnect the client and end; return whether the thread ended in time."""
        self.post(self._stopping.set)
        if self._thread is not None:
            self._thread.join(_CLOSE_S)
            return not self._thread.is_alive()
        return True

    def post(self, call: Callable[[], None]) -> None:
        """Run a call on the thread of the server, and send the lines that it made."""
        loop = self._loop
        if loop is not None:
            # The loop is closed.
            with contextlib.suppress(RuntimeError):
                loop.call_soon_threadsafe(self._run_call, call)

    def touched(self, point: MeasuredPoint) -> None:
        self.post(lambda: self._session.touched(point))

    def refused(self, refusal: Refusal) -> None:
        self.post(lambda: self._session.refused(refusal))

    def _run(self, listener: socket.socket, ready: threading.Event) -> None:
        try:
            with listener:
                asyncio.run(self._serve(listener, ready))
        except Exception as error:
            self._failed(contained(error, "The I++ server"))

    async def _serve(self, listener: socket.socket, ready: threading.Event) -> None:
        self._loop = loop = asyncio.get_running_loop()
        server = await loop.create_server(
            lambda: _DmeConnection(self), sock=listener, ssl=self._tls
        )
        ready.set()
        async with server:
            while not self._stopping.is_set():
                self._run_call(self._session.tick)
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self._stopping.wait(), _TICK_S)
            server.close()
            if self._client is not None:
                self.release(self._client)
        self._loop = None

    def _run_call(self, call: Callable[[], None]) -> None:
        try:
            call()
            self.flush()
        except Exception as error:
            self._failed(contained(error, "The I++ server"))
            if self._client is not None:
                self.release(self._client)

    # Calls of a connection.

    def admit(self, client: _DmeConnection, address: str) -> str:
        """Return why a client is refused, a sentence; empty if it is admitted."""
        if not self._allowed.allows(address):
            return f"{address} is not allowed here. Add it on the measuring computer (--allow)."
        if self._client is not None:
            return (f"This machine is already used by {self._client.address}. Disconnect that "
                    "program first.")  # fmt: skip
        self._client = client
        return ""

    def refusal_line(self, sentence: str) -> bytes:
        """Return the only line to a refused client: an error whose place is the sentence."""
        line = error_line(self._session.state.dialect, NO_TAG, 511, sentence)
        return line.encode("ascii", "replace") + _END

    def receive(self, line: bytes) -> None:
        self._run_call(lambda: self._session.receive(line))

    def flush(self) -> None:
        """Send the lines of the session; a client that does not read is disconnected."""
        lines, client = self._session.take(), self._client
        if client is None or not lines:
            return
        client.send("".join(f"{line}\r\n" for line in lines).encode("ascii", "replace"))
        if client.unread > _MOST_UNREAD:
            self.release(client)

    def release(self, client: _DmeConnection) -> None:
        """Disconnect a client; its session ends."""
        client.cut()
        if self._client is client:
            self._client = None
            try:
                self._session.disconnect()
            except Exception as error:
                self._failed(contained(error, "The I++ server"))


class _DmeConnection(asyncio.Protocol):
    """One connection: lines in, bytes out."""

    def __init__(self, server: DmeServer) -> None:
        self._server = server
        self._transport: asyncio.Transport | None = None
        self._buffer = bytearray()
        self._admitted = False
        self._too_long = b""
        self.address = ""

    @property
    def unread(self) -> int:
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if not isinstance(transport, asyncio.Transport):
            raise TypeError(f"{type(transport)} is no stream")
        self._transport = transport
        self.address = str(transport.get_extra_info("peername")[0])
        connection = transport.get_extra_info("socket")
        if connection is not None:
            notice_loss(connection)
        refused = self._server.admit(self, self.address)
        if refused:
            transport.write(self._server.refusal_line(refused))
            transport.close()
            return
        self._admitted = True

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.release(self)

    def data_received(self, data: bytes) -> None:
        if not self._admitted:
            return
        self._buffer += data
        self._read()

    def send(self, data: bytes) -> None:
        if self._transport is not None:
            self._transport.write(data)

    def cut(self) -> None:
        self._admitted = False
        self._buffer.clear()
        if self._transport is not None:
            self._transport.close()

    def _read(self) -> None:
        """Process the complete lines of the buffer."""
        start = 0
        while self._admitted:
            end = self._buffer.find(_END, start)
            if end < 0:
                break
            line = bytes(self._buffer[start:end])
            start = end + len(_END)
            if self._too_long or len(line) + len(_END) > LONGEST_LINE:
                line, self._too_long = (self._too_long or line).ljust(LONGEST_LINE), b""
            self._server.receive(line)
        del self._buffer[:start]
        if len(self._buffer) > LONGEST_LINE:
            # Keep the tag and a possible first half of the line's end.
            self._too_long = self._too_long or bytes(self._buffer[:16])
            del self._buffer[: -len(_END) + 1]


def notice_loss(connection: socket.socket) -> None:
    """Let the system notice a client that has vanished, in about ten seconds."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (("TCP_KEEPIDLE", 5), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, name):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def clock() -> float:
    """Return the time of sessions, s."""
    return time.monotonic()
