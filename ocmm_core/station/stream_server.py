"""The live stream: points and poses for other programs, as lines of JSON over TCP.

Off unless asked for. It listens on this computer alone unless another address is given, and then
only with a token. Clients can read, nothing else. One thread serves all of them.

Points are never dropped: each is kept, and a client that was away resumes after the last sequence
number it has. Poses are for looking: a client that reads too slowly misses some.
"""

from __future__ import annotations

import contextlib
import hmac
import ipaddress
import logging
import selectors
import socket
import threading
import time
import uuid
from dataclasses import dataclass, field
from typing import Protocol

from psygnal import SignalInstance

from ocmm_core.errors import InputError, MeasuringError, OcmmError
from ocmm_core.inspection.view import LiveView
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.station.stream_messages import (
    Hello,
    annulled_line,
    bye_line,
    hello_line,
    point_line,
    pose_line,
    read_request,
)

_log = logging.getLogger(__name__)

SHORTEST_TOKEN = 16
MOST_CLIENTS = 8
LONGEST_REQUEST = 4096
REQUEST_TIMEOUT_S = 10.0
STALLED_S = 60.0
"""A client that takes nothing for so long is cut off; it may resume."""
MOST_WAITING = 65536
"""Bytes that wait for one client; more are made only when it has read."""
_READ = 65536


class StreamSource(Protocol):
    """What is streamed, e.g. the measuring station."""

    @property
    def changed(self) -> SignalInstance:
        """Emitted after every change of the job."""
        ...

    def live(self) -> LiveView:
        """Return what the machine sees now."""
        ...

    def stored_job(self) -> tuple[str, list[MeasuredPoint]]:
        """Return the name of the job that is measured, and its durable points that count."""
        ...


@dataclass(frozen=True, slots=True)
class StreamOptions:
    """Where and how the stream is given.

    Attributes
    ----------
    host, port
        Address to listen on; port 0 takes a free one.
    token
        Clients must send it; needed unless ``host`` is this computer alone.
    poses_hz
        How often poses are sent at most.
    """

    host: str = "127.0.0.1"
    port: int = 0
    token: str = ""
    poses_hz: float = 60.0


@dataclass(slots=True)
class _Client:
    """One client: what it said, what waits for it, and how far it has come."""

    connection: socket.socket
    since_s: float
    heard: bytearray = field(default_factory=bytearray)
    waiting: bytearray = field(default_factory=bytearray)
    begun: bool = False
    ending: bool = False
    poses: bool = True
    next_seq: int = 1
    moved_s: float = 0.0


class StreamServer:
    """Serve the stream of a station, job after job; used in ``with``, or with `start` and `close`.

    Parameters
    ----------
    source
        What is streamed.
    options
        See `StreamOptions`.

    Raises
    ------
    InputError
        The address is open to others and there is no token worth the name.
    """

    def __init__(self, source: StreamSource, options: StreamOptions) -> None:
        check_stream(options)
        self._source = source
        self._job = ""
        self._options = options
        self._id = uuid.uuid4().hex
        self._log: list[bytes] = []
        self._counting: set[int] = set()
        self._clients: dict[socket.socket, _Client] = {}
        self._selector = selectors.DefaultSelector()
        self._stopping = threading.Event()
        self._changed = threading.Event()
        self._thread: threading.Thread | None = None
        self._listener: socket.socket | None = None
        self._wake_read, self._wake_write = socket.socketpair()
        self.address = (options.host, options.port)
        """Where it listens; the port is known once it was started."""
        self.poses_missed = 0
        """Poses that clients were too slow for."""

    def start(self) -> tuple[str, int]:
        """Begin to listen, and return the address.

        Raises
        ------
        MeasuringError
            The address cannot be had.
        """
        try:
            self._listener = socket.create_server((self._options.host, self._options.port))
        except OSError as error:
            raise MeasuringError(
                "stream.address",
                f"The stream cannot be given on {self._options.host}:{self._options.port} "
                f"({error.strerror or error}).",
                "Choose another port, or end the program that uses it.",
            ) from error
        self._listener.setblocking(False)
        self._wake_read.setblocking(False)
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._wake_read, selectors.EVENT_READ)
        self._source.changed.connect(self._on_change)
        self._changed.set()
        self._thread = threading.Thread(target=self._run, name="ocmm-stream")
        self._thread.start()
        host, port = self._listener.getsockname()[:2]
        self.address = (str(host), int(port))
        return self.address

    def close(self, timeout_s: float = 2.0) -> bool:
        """Say goodbye to the clients and end; say whether the thread ended in time."""
        with contextlib.suppress(ValueError):
            self._source.changed.disconnect(self._on_change)
        self._stopping.set()
        self._wake()
        if self._thread is not None:
            self._thread.join(timeout_s)
            if self._thread.is_alive():
                return False
        for item in (self._wake_read, self._wake_write):
            item.close()
        return True

    def __enter__(self) -> StreamServer:
        """Begin to listen."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        self.close()

    def _on_change(self) -> None:
        self._changed.set()
        self._wake()

    def _wake(self) -> None:
        # Already woken, or closed.
        with contextlib.suppress(OSError):
            self._wake_write.send(b"x")

    def _run(self) -> None:
        try:
            period = 1.0 / self._options.poses_hz
            next_pose = time.monotonic()
            while not self._stopping.is_set():
                for key, mask in self._selector.select(max(next_pose - time.monotonic(), 0.0)):
                    self._serve(key.fileobj, mask)
                if self._changed.is_set():
                    self._changed.clear()
                    self._take_points()
                now = time.monotonic()
                if now >= next_pose:
                    next_pose = max(next_pose + period, now)
                    self._send_poses()
                self._fill_and_prune(now)
            for client in list(self._clients.values()):
                client.waiting += bye_line("the station was closed")
                self._write(client)
        finally:
            for client in list(self._clients.values()):
                self._drop(client)
            if self._listener is not None:
                self._listener.close()
            self._selector.close()

    def _serve(self, item: object, mask: int) -> None:
        if item is self._listener:
            self._accept()
        elif item is self._wake_read:
            with contextlib.suppress(BlockingIOError):
                self._wake_read.recv(_READ)
        elif isinstance(item, socket.socket) and item in self._clients:
            client = self._clients[item]
            if mask & selectors.EVENT_READ:
                self._read(client)
            if mask & selectors.EVENT_WRITE and item in self._clients:
                self._write(client)

    def _accept(self) -> None:
        assert self._listener is not None  # noqa: S101 - the loop runs only while listening
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return
        connection.setblocking(False)
        now = time.monotonic()
        client = _Client(connection, now, moved_s=now)
        self._clients[connection] = client
        self._selector.register(connection, selectors.EVENT_READ)
        if len(self._clients) > MOST_CLIENTS:
            self._end(client, f"there are {MOST_CLIENTS} clients already")
            return
        hello = Hello(self._id, self._job, 1, len(self._log), bool(self._options.token))
        client.waiting += hello_line(hello)

    def _read(self, client: _Client) -> None:
        try:
            heard = client.connection.recv(_READ)
        except BlockingIOError:
            return
        except OSError:
            heard = b""
        if not heard:
            self._drop(client)
            return
        if client.begun:
            # It has nothing more to say; what it sends is not kept.
            return
        client.heard += heard
        line, newline, _ = client.heard.partition(b"\n")
        if newline:
            self._begin(client, bytes(line))
        elif len(client.heard) > LONGEST_REQUEST:
            self._end(client, "the first line is too long")

    def _begin(self, client: _Client, line: bytes) -> None:
        try:
            request = read_request(line)
        except InputError as error:
            self._end(client, f"{error.what} {error.remedy}")
            return
        expected = self._options.token.encode()
        if expected and not hmac.compare_digest(request.token.encode(), expected):
            self._end(client, "the token is wrong")
            return
        if request.resume > len(self._log):
            self._end(
                client,
                f"this stream has come to {len(self._log)}; it is another one than yours: "
                "resume from 0",
            )
            return
        client.begun, client.poses, client.next_seq = True, request.poses, request.resume + 1

    def _end(self, client: _Client, why: str) -> None:
        client.waiting += bye_line(why)
        client.begun, client.poses, client.ending = True, False, True

    def _take_points(self) -> None:
        try:
            job, points = self._source.stored_job()
        except OcmmError:
            # Told elsewhere; the next change tries again.
            _log.exception("The stream could not read the points.")
            return
        if job != self._job:
            # The points of the job before count as they did; this one has numbers of its own.
            self._job, self._counting = job, set()
        counting = {point.number for point in points}
        for number in sorted(self._counting - counting):
            self._log.append(annulled_line(len(self._log) + 1, self._job, number))
        for point in points:
            if point.number not in self._counting:
                self._log.append(point_line(len(self._log) + 1, self._job, point))
        self._counting = counting

    def _send_poses(self) -> None:
        wanting = [client for client in self._clients.values() if client.begun and client.poses]
        if not wanting:
            return
        line = pose_line(self._source.live())
        for client in wanting:
            # One pose may wait; where one does already, this one is the newer but comes too soon.
            if client.waiting:
                self.poses_missed += 1
            else:
                client.waiting += line

    def _fill_and_prune(self, now: float) -> None:
        for client in list(self._clients.values()):
            if client.begun and not client.ending:
                while client.next_seq <= len(self._log) and len(client.waiting) < MOST_WAITING:
                    client.waiting += self._log[client.next_seq - 1]
                    client.next_seq += 1
            if client.waiting:
                self._write(client)
            else:
                client.moved_s = now
                if client.ending:
                    self._drop(client)
            silent = not client.begun and now - client.since_s > REQUEST_TIMEOUT_S
            if silent or now - client.moved_s > STALLED_S:
                self._drop(client)

    def _write(self, client: _Client) -> None:
        try:
            sent = client.connection.send(client.waiting)
        except BlockingIOError:
            sent = 0
        except OSError:
            self._drop(client)
            return
        if sent:
            del client.waiting[:sent]
            client.moved_s = time.monotonic()
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.waiting else 0)
        self._selector.modify(client.connection, events)

    def _drop(self, client: _Client) -> None:
        if self._clients.pop(client.connection, None) is None:
            return
        self._selector.unregister(client.connection)
        client.connection.close()


def check_stream(options: StreamOptions) -> None:
    """Raise InputError if the stream would be open to others without a token worth the name."""
    if not _is_loopback(options.host) and len(options.token) < SHORTEST_TOKEN:
        raise InputError(
            "stream.token",
            f"The stream would be open to everybody who can reach {options.host}.",
            f"Give a token of {SHORTEST_TOKEN} characters or more, or listen on 127.0.0.1.",
        )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
