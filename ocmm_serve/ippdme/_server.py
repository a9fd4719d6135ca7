"""TCP server of the protocol: one client, listed addresses, bounded buffers.

The service joins it with a measuring station: for its command, and next to a job in the window.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ocmm_core.composition import stream_options
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.failure import contained
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.settings import Settings
from ocmm_core.station import MeasuringStation, ServiceSpec, ServiceState
from ocmm_core.station.stream import StreamOptions, check_stream, listen, may_connect, tls_context
from ocmm_serve.ippdme._frames import CsyFrames, ShiftSign
from ocmm_serve.ippdme._grammar import LONGEST_LINE, NO_TAG, DmeDialect, error_line
from ocmm_serve.ippdme._machine import StationMachine
from ocmm_serve.ippdme._session import DmeSession
from ocmm_serve.ippdme._state import DmeState
from ocmm_serve.site import POINTS

_TICK_S = 0.05
_MOST_UNREAD = 4 * 1024 * 1024
"""Bytes of answers that a client may leave unread before it is disconnected."""
_CLOSE_S = 5.0
_MOST_GUESTS = 16
"""Connections that are not admitted yet; more are closed at once."""
_HANDSHAKE_S = 10.0
_GRACE_S = 0.3
"""A client that has just closed makes room for the next one."""
_END = b"\r\n"
_SHOWN = 200
"""Characters of a line that screens show."""


class DmeServer:
    """Serve a session on a separate thread; all calls of the session are made there.

    `failed`: receives unexpected errors; they disconnect the client. InputError: the address would
    be open to others, or the certificate cannot be used.
    """

    def __init__(
        self,
        session: DmeSession,
        options: StreamOptions,
        failed: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        self._session, self._options, self._failed = session, options, failed
        check_stream(options, by_address=True)
        self._tls = tls_context(options)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stopping = asyncio.Event()
        self._client: _DmeConnection | None = None
        self._guests: set[_DmeConnection] = set()
        self._thread: threading.Thread | None = None
        self.address = (options.host, options.port)
        self.last_command = self.last_answer = ""
        """Lines of the client, and to it without acknowledgements; for screens."""

    def start(self) -> tuple[str, int]:
        """Listen, and return the address; MeasuringError if it is unavailable."""
        listener = listen(self._options, _MOST_GUESTS)
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

    def operate(self, words: str) -> None:
        """Obey the operator (`DmeSession.operate`)."""
        self.post(lambda: self._session.operate(words))

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
        limit = None if self._tls is None else _HANDSHAKE_S
        server = await loop.create_server(
            lambda: _DmeConnection(self), sock=listener, ssl=self._tls, ssl_handshake_timeout=limit
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
        self._guests.discard(client)
        if not may_connect(self._options, address):
            return f"{address} is not allowed here. Add it on the measuring computer (--allow)."
        if self._client is not None:
            self._guests.add(client)
            return (f"This machine is already used by {self._client.address}. Disconnect that "
                    "program first.")  # fmt: skip
        self._client = client
        return ""

    @property
    def client(self) -> str:
        """Return the address of the client; empty without one."""
        client = self._client
        return "" if client is None else client.address

    @property
    def is_running(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    @property
    def makes_room(self) -> bool:
        """Return whether a refused connection may wait for the present client to go."""
        return self._client is not None and len(self._guests) <= _MOST_GUESTS

    def refusal_line(self, sentence: str) -> bytes:
        """Return the only line to a refused client: an error whose place is the sentence."""
        line = error_line(self._session.state.dialect, NO_TAG, 511, sentence)
        return line.encode("ascii", "replace") + _END

    def receive(self, line: bytes) -> None:
        self.last_command = line[:_SHOWN].decode("ascii", "replace")
        self._run_call(lambda: self._session.receive(line))

    def flush(self) -> None:
        """Send the lines of the session; a client that does not read is disconnected."""
        lines, client = self._session.pop_lines(), self._client
        if client is None or not lines:
            return
        told = [line for line in lines if line[6:] not in ("&", "%")]
        if told:
            self.last_answer = told[-1][:_SHOWN]
        client.send("".join(f"{line}\r\n" for line in lines).encode("ascii", "replace"))
        if client.unread > _MOST_UNREAD:
            self.release(client)

    def release(self, client: _DmeConnection) -> None:
        """Disconnect a client; its session ends."""
        client.cut()
        self._guests.discard(client)
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
        self._enter(asyncio.get_running_loop().time() + _GRACE_S)

    def _enter(self, until_s: float) -> None:
        """Become the client, or be refused in a sentence."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        refused = self._server.admit(self, self.address)
        loop = asyncio.get_running_loop()
        if refused and self._server.makes_room and loop.time() < until_s:
            transport.pause_reading()
            loop.call_later(_GRACE_S / 10.0, self._enter, until_s)
        elif refused:
            transport.write(self._server.refusal_line(refused))
            transport.close()
        else:
            self._admitted = True
            transport.resume_reading()

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


@dataclass(frozen=True, slots=True)
class DmeOptions:
    """Options of a server; those of points are in `ocmm_core.options`."""

    address: StreamOptions
    dialect: DmeDialect = DmeDialect.V14
    sign: ShiftSign = ShiftSign.ORIGIN
    surface: bool = False
    any_place: bool = False
    patience_s: float = 600.0
    tries: int = 3


class DmeService:
    """A server on a station, which belongs to the caller.

    `hand`: virtual hand; None for real probes. `tell`: receives sentences for the operator, on any
    thread. `failed`: receives unexpected errors. InputError as `DmeServer`.
    """

    def __init__(
        self,
        station: MeasuringStation,
        hand: Any,
        header: JobHeader,
        options: DmeOptions,
        tell: Callable[[str], None] = lambda words: None,
        failed: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        self._tell, self._sentence = tell, ""
        self.machine = StationMachine(station, hand, header, self._report)
        self.dme = DmeState(
            self.machine, options.dialect, CsyFrames(options.sign), options.any_place,
            options.surface,
        )  # fmt: skip
        self.session = DmeSession(self.dme, options.patience_s, options.tries)
        self.server = DmeServer(self.session, options.address, failed)

    def start(self) -> None:
        """Listen; MeasuringError if the address is unavailable."""
        self.machine.attach(self.server.touched, self.server.refused)
        try:
            self.server.start()
        except BaseException:
            self.machine.detach()
            raise

    def state(self) -> ServiceState:
        server, sentence = self.server, self._sentence
        if sentence == self.machine.asked:
            # The guidance shows it.
            sentence = ""
        return ServiceState(
            f"I++ DME {self.dme.dialect.version}", "{}:{}".format(*server.address), server.client,
            server.last_command, server.last_answer, sentence,
        )  # fmt: skip

    def operate(self, words: str) -> None:
        self.server.operate(words)

    def close(self) -> bool:
        """End; return whether its thread ended in time."""
        ended = self.server.close()
        self.machine.detach()
        return ended

    def _report(self, words: str) -> None:
        self._sentence = words
        self._tell(words)


def serve_beside(station: MeasuringStation, hand: Any, settings: Settings) -> DmeService:
    """Start a server on a running station, with a job of single points; OcmmError: neither is."""
    address = stream_options(
        settings.serve_port, settings.serve_host, None, allow=settings.serve_allow
    )
    assert address is not None  # noqa: S101 - there is a port
    header = station.job.view().header
    options = DmeOptions(
        address, DmeDialect(settings.serve_dialect), ShiftSign(settings.serve_shift_sign),
        settings.serve_point == "surface",
    )  # fmt: skip
    left = station.jobs.change_plan(resource("plans", POINTS), header)
    if hand is not None:
        hand.stop()
    header = replace(header, part=station.job.plan.part)

    def note(error: Exception) -> None:
        if isinstance(error, OcmmError):
            station.faults.tell(error)

    made = DmeService(station, hand, header, options, failed=note)
    made.start()
    made.machine.tell(left or "The measuring program can connect now.")
    return made


SERVICE = ServiceSpec(serve_beside)
