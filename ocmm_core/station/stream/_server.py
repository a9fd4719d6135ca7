"""The live stream: points, button and poses for other programs, as lines of JSON over TCP.

Off unless asked for. It listens on this computer alone unless another address is given, and then
only with a token. Clients can read, nothing else. One thread serves all of them and waits for none.

Points and the button are never dropped: each message is kept (`_log`), and a client that was
away resumes after the last number it has. Poses are for looking: a client that reads too slowly
misses some, and of several changes of the state in between it is told the latest. So with the
verdicts, which a thread of their own computes (`_verdict_watch`).
"""

from __future__ import annotations

import contextlib
import hmac
import logging
import selectors
import socket
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from ocmm_core.errors import InputError, MeasuringError, OcmmError
from ocmm_core.station.stream._client import (
    LONGEST_REQUEST,
    MOST_WAITING,
    REQUEST_TIMEOUT_S,
    StreamClient,
)
from ocmm_core.station.stream._log import StreamLog
from ocmm_core.station.stream._messages import (
    Hello,
    annulled_line,
    button_line,
    bye_line,
    hello_line,
    point_line,
    pose_line,
    read_request,
    status_line,
)
from ocmm_core.station.stream._options import StreamOptions as StreamOptions
from ocmm_core.station.stream._options import check_stream
from ocmm_core.station.stream._probe_button import ButtonChange
from ocmm_core.station.stream._source import StreamSource
from ocmm_core.station.stream._verdict_watch import VerdictWatch
from ocmm_core.storage import JobStep

_log = logging.getLogger(__name__)

MOST_CLIENTS = 8
GOODBYE_S = 0.5
"""So long the end waits for clients to take what they have not had yet."""
_READ = 65536


class StreamServer:
    """Serve the stream of a station, job after job; used in ``with``, or with `start` and `close`.

    Parameters
    ----------
    source
        What is streamed.
    options
        See `StreamOptions`.
    failed
        Told what ended the stream or a client of it, where something nobody foresaw did.

    Raises
    ------
    InputError
        The address is open to others and there is no token worth the name.
    """

    def __init__(
        self,
        source: StreamSource,
        options: StreamOptions,
        failed: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        check_stream(options)
        self._failed = failed
        self._source = source
        self._options = options
        self._id = uuid.uuid4().hex
        self._messages = StreamLog(source.job.path.parent)
        self._job: Path | None = None
        self._after = 0
        self._storing = threading.Lock()
        """Guards which step of which job was taken last."""
        self._pressed = False
        self._changed = threading.Event()
        """The job is another one than that of the latest verdict."""
        self._verdicts = VerdictWatch(
            source.job.view,
            lambda: source.job.path.stem,
            lambda: len(self._messages),
            self._wake,
        )
        self._state: tuple[str, ...] = ()
        self._states = 0
        self._clients: dict[socket.socket, StreamClient] = {}
        self._selector = selectors.DefaultSelector()
        self._stopping = threading.Event()
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
        host, port = self._options.host, self._options.port
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._listener = socket.create_server((host, port), family=family)
        except OSError as error:
            raise MeasuringError(
                "stream.address",
                f"The stream cannot listen on {host}:{port} ({error.strerror or error}).",
                "Choose another port, or close the program that uses it; the address must "
                "belong to this computer.",
            ) from error
        self._listener.setblocking(False)
        self._wake_read.setblocking(False)
        # A full pipe wakes as well as one byte more: who makes a change never waits here.
        self._wake_write.setblocking(False)
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._wake_read, selectors.EVENT_READ)
        # Before any listener that may fail: what comes after that one is not told.
        self._source.events.changed.connect(self._on_change, priority=1)
        self._source.events.button.connect(self._on_button, priority=1)
        self._on_change()
        self._verdicts.start()
        self._thread = threading.Thread(target=self._run, name="ocmm-stream")
        self._thread.start()
        address = self._listener.getsockname()
        self.address = (str(address[0]), int(address[1]))
        return self.address

    def close(self, timeout_s: float = 2.0) -> bool:
        """Say goodbye to the clients and end; say whether the thread ended in time."""
        for signal, slot in (
            (self._source.events.changed, self._on_change),
            (self._source.events.button, self._on_button),
        ):
            with contextlib.suppress(ValueError):
                signal.disconnect(slot)
        until = time.monotonic() + timeout_s
        self._stopping.set()
        self._wake()
        if self._thread is not None:
            self._thread.join(timeout_s)
            if self._thread.is_alive():
                return False
        # It may be evaluating a job; the clients have had their goodbye by now.
        if not self._verdicts.close(max(until - time.monotonic(), 0.0)):
            return False
        self._messages.close()
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
        # On the thread that made the change: the next one may close this job.
        with self._storing:
            try:
                while self._take_steps():
                    pass
            except OcmmError:
                # Told elsewhere; the next change tries again.
                _log.exception("The stream could not read the points.")
            except Exception as error:
                self._give_up(error)
        self._changed.set()
        self._wake()

    def _on_button(self, change: ButtonChange) -> None:
        try:
            job = self._source.job.path.stem
            self._pressed = change.event == "press"
            self._messages.append(partial(button_line, job=job, change=change))
        except Exception as error:
            self._give_up(error)
        self._wake()

    def _give_up(self, error: Exception) -> None:
        """End the stream: with a message that is missing it would not be what it says it is."""
        self._stopping.set()
        self._failed(error)

    def _take_steps(self) -> bool:
        """Take over what was stored since the last time, and say whether there was something."""
        path, steps = self._source.job.steps_since(self._job, self._after)
        if path != self._job:
            # Its points have numbers of their own; those of the job before count as they did.
            self._job, self._after = path, 0
        for step in steps:
            self._messages.append(partial(_step_line, job=path.stem, step=step))
            self._after = step.sequence
        return bool(steps)

    def _wake(self) -> None:
        # Already woken, or closed.
        with contextlib.suppress(OSError):
            self._wake_write.send(b"x")

    def _run(self) -> None:
        try:
            period = 1.0 / self._options.poses_hz
            next_look = time.monotonic()
            while not self._stopping.is_set():
                self._serve(max(next_look - time.monotonic(), 0.0))
                now = time.monotonic()
                if now >= next_look:
                    next_look = max(next_look + period, now)
                    self._look()
                self._fill_and_prune(now)
            self._say_goodbye()
        except Exception as error:
            self._failed(error)
        finally:
            for client in list(self._clients.values()):
                self._drop(client)
            if self._listener is not None:
                self._listener.close()
            self._selector.close()

    def _serve(self, patience_s: float) -> None:
        for key, mask in self._selector.select(patience_s):
            item = key.fileobj
            if item is self._listener:
                self._accept(self._listener)
            elif item is self._wake_read:
                with contextlib.suppress(BlockingIOError):
                    self._wake_read.recv(_READ)
            elif isinstance(item, socket.socket) and item in self._clients:
                client = self._clients[item]
                with self._dropping(client):
                    if mask & selectors.EVENT_READ:
                        self._read(client)
                    if mask & selectors.EVENT_WRITE and item in self._clients:
                        self._write(client)

    @contextlib.contextmanager
    def _dropping(self, client: StreamClient) -> Iterator[None]:
        """Drop a client over which something nobody foresaw happens; the others stay."""
        try:
            yield
        except Exception as error:
            self._drop(client)
            self._failed(error)

    def _accept(self, listener: socket.socket) -> None:
        try:
            connection, _ = listener.accept()
        except OSError:
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # What the system holds for a slow client is old when it is read.
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST_WAITING)
        now = time.monotonic()
        client = StreamClient(connection, now, now)
        self._clients[connection] = client
        self._selector.register(connection, selectors.EVENT_READ)
        if len(self._clients) > MOST_CLIENTS:
            self._end(client, f"already {MOST_CLIENTS} clients")
            return
        job = "" if self._job is None else self._job.stem
        needed = bool(self._options.token)
        simulated = self._source.instruments.simulated
        hello = Hello(self._id, job, 1, len(self._messages), needed, simulated)
        client.waiting += hello_line(hello)

    def _read(self, client: StreamClient) -> None:
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

    def _begin(self, client: StreamClient, line: bytes) -> None:
        try:
            request = read_request(line)
        except InputError as error:
            self._end(client, f"{error.what} {error.remedy}")
            return
        expected = self._options.token.encode()
        if expected and not hmac.compare_digest(request.token.encode(), expected):
            self._end(client, "the token is wrong")
            return
        last = len(self._messages)
        if request.resume > last:
            self._end(
                client,
                f"this stream is at {last}; it is not the one you had: resume from 0",
            )
            return
        client.begun, client.poses, client.next_seq = True, request.poses, request.resume + 1

    @staticmethod
    def _end(client: StreamClient, why: str) -> None:
        client.waiting += bye_line(why)
        client.begun = client.ending = True

    def _look(self) -> None:
        """Tell what the machine sees: every change of its state, and poses."""
        listening = [client for client in self._clients.values() if client.listens]
        if not listening:
            return
        if self._changed.is_set():
            self._changed.clear()
            self._verdicts.ask()
        live = self._source.looks.live()
        job = self._source.job.path.stem
        state = (job, live.status.value, live.reason)
        if state != self._state:
            self._state, self._states = state, self._states + 1
        pose = pose_line(live, pressed=self._pressed)
        for client in listening:
            if client.told_state != self._states and client.has_room:
                client.waiting += status_line(job, live)
                client.told_state = self._states
            elif self._tell_verdict(client):
                pass
            elif client.poses and client.waiting:
                # One pose may wait; where one does already, this one comes too soon.
                self.poses_missed += 1
            elif client.poses:
                client.waiting += pose

    def _tell_verdict(self, client: StreamClient) -> bool:
        """Give a client the latest verdict, where it has not had it, and say whether so."""
        latest = self._verdicts.latest
        if client.told_verdict == latest.count or not client.has_room:
            return False
        client.waiting += latest.line
        client.told_verdict = latest.count
        return True

    def _fill_and_prune(self, now: float) -> None:
        for client in list(self._clients.values()):
            with self._dropping(client):
                self._fill(client, now)

    def _fill(self, client: StreamClient, now: float) -> None:
        if client.listens:
            try:
                client.fill(self._messages)
            except OSError as error:
                self._end(client, f"older messages can no longer be read ({error})")
        if client.waiting:
            self._write(client)
        else:
            client.moved_s = now
            if client.ending:
                self._drop(client)
        if client.is_silent(now):
            self._end(client, f"no request within {REQUEST_TIMEOUT_S:g} s")
        if client.is_stalled(now):
            self._drop(client)

    def _say_goodbye(self) -> None:
        """Give everybody what is left and the reason of the end; who stalls has to do without."""
        if self._listener is not None:
            self._selector.unregister(self._listener)
        until = time.monotonic() + GOODBYE_S
        while self._clients and time.monotonic() < until:
            last = len(self._messages)
            for client in self._clients.values():
                if client.listens:
                    self._tell_verdict(client)
                if not client.ending and (not client.begun or client.next_seq > last):
                    self._end(client, "the station was closed")
            self._fill_and_prune(time.monotonic())
            self._serve(0.01)

    def _write(self, client: StreamClient) -> None:
        try:
            client.write()
        except OSError:
            self._drop(client)
            return
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.waiting else 0)
        self._selector.modify(client.connection, events)

    def _drop(self, client: StreamClient) -> None:
        if self._clients.pop(client.connection, None) is None:
            return
        self._selector.unregister(client.connection)
        client.connection.close()


def _step_line(seq: int, job: str, step: JobStep) -> bytes:
    if step.point is None:
        return annulled_line(seq, job, step.number)
    return point_line(seq, job, step.point)
