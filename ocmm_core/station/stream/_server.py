"""The live stream: points, button and poses for other programs, as lines of JSON over TCP.

Off by default. It listens on loopback unless another address is given, and then only with a token.
Clients can only read. One thread serves all in an event loop without waiting for any; `_reception`
handles connections.

Points and the button are never dropped: each message is kept (`_client`), and a returning client
resumes after its last number. Poses are for display: a slow client misses some, and of several
state changes gets the latest. The same applies to verdicts, which a separate thread computes
(`_messages`).
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import logging
import socket
import threading
import time
import uuid
from collections.abc import Callable
from functools import partial

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.station.stream import _messages as messages
from ocmm_core.station.stream._client import StreamClient, StreamLog
from ocmm_core.station.stream._messages import StepReader, StreamSource, VerdictWatch
from ocmm_core.station.stream._reception import (
    MOST_CLIENTS,
    Reception,
    check_stream,
    listen,
    may_connect,
    tls_context,
)
from ocmm_core.station.stream._reception import StreamOptions as StreamOptions
from ocmm_core.storage import JobStep

_log = logging.getLogger(__name__)

GOODBYE_S = 0.5
"""s: time at the end for clients to read pending messages."""
_BACKLOG = 128


class StreamServer:
    """Serve the stream of a station, job after job; a context manager, or `start` and `close`.

    `failed`: receives unexpected errors that ended the stream or a client. `plain`: lines of points
    in place of JSON, for programs that send nothing. InputError: the stream is open to others (see
    `check_stream`), or the certificate cannot be used.
    """

    def __init__(
        self,
        source: StreamSource,
        options: StreamOptions,
        failed: Callable[[Exception], None] = lambda error: None,
        plain: PlainLines | None = None,
    ) -> None:
        check_stream(options, by_address=plain is not None)
        self._plain = plain
        self._tls = tls_context(options)
        self._failed = failed
        self._source = source
        self._options = options
        self._id = uuid.uuid4().hex
        self._messages = StreamLog(source.job.path.parent)
        self._steps = StepReader(source.job)
        self._storing = threading.Lock()
        """Guards the position of the last read step."""
        self._pressed = False
        self._changed = threading.Event()
        """The current job differs from that of the latest verdict."""
        self._verdicts = VerdictWatch(
            source.job.view, lambda: source.job.path.stem, lambda: len(self._messages), self._wake
        )
        self._state: tuple[str, ...] = ()
        self._states = 0
        self._stopping = threading.Event()
        self._reception: Reception
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._woken = asyncio.Event()
        self._calls = False
        """A wake-up of the loop is pending."""
        self.address = (options.host, options.port)
        """The port is known after the start."""
        self.poses_missed = 0
        """Poses dropped for slow clients."""

    def start(self) -> tuple[str, int]:
        """Start to listen, and return the address; MeasuringError if the address is unavailable."""
        listener = listen(self._options, _BACKLOG)
        listener.setblocking(False)
        address = listener.getsockname()
        self.address = (str(address[0]), int(address[1]))
        # Priority over listeners that may fail: later ones are not called then.
        self._source.events.changed.connect(self._on_change, priority=1)
        self._source.events.button.connect(self._on_button, priority=1)
        self._on_change()
        if self._plain is None:
            self._verdicts.start()
        else:
            # Points of an earlier start.
            self._plain.sent = len(self._messages)
        self._thread = threading.Thread(target=self._run, args=(listener,), name="ocmm-stream")
        self._thread.start()
        return self.address

    def close(self, timeout_s: float = 2.0) -> bool:
        """Send goodbyes and end; return whether the thread ended in time."""
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
        return True

    def __str__(self) -> str:
        return "{}:{}".format(*self.address)

    def __enter__(self) -> StreamServer:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _on_change(self) -> None:
        # On the thread of the change: the next change may close this job.
        with self._storing:
            try:
                for job, step in self._steps.read():
                    self._add(job, step)
            except OcmmError:
                # Reported elsewhere; the next change tries again.
                _log.exception("The stream could not read the points.")
            except Exception as error:
                self._give_up(error)
        self._changed.set()
        self._wake()

    def _on_button(self, change: messages.ButtonChange) -> None:
        if self._plain is not None:
            return
        try:
            job = self._source.job.path.stem
            self._pressed = change.event == "press"
            self._messages.append(partial(messages.button_line, job=job, change=change))
        except Exception as error:
            self._give_up(error)
        self._wake()

    def _give_up(self, error: Exception) -> None:
        """End the stream: a missing message would break its promise."""
        self._stopping.set()
        self._failed(error)

    def _add(self, job: str, step: JobStep) -> None:
        if self._plain is None:
            self._messages.append(partial(_step_line, job=job, step=step))
        elif line := self._plain.line_of(step, live=self._thread is not None):
            self._messages.append(lambda _: line)

    def _wake(self) -> None:
        # Changes never wait here, and any number of them wakes the loop once.
        loop = self._loop
        if loop is None or self._calls:
            return
        self._calls = True
        # The loop is closed.
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(self._woken.set)

    def _run(self, listener: socket.socket) -> None:
        try:
            with listener:
                asyncio.run(self._serve(listener))
        except Exception as error:
            self._failed(error)

    async def _serve(self, listener: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(self._on_loop_failed)
        reception = Reception(
            listener, self._tls, self._greet, self._start, self._failed,
            partial(may_connect, self._options), plain=self._plain is not None,
        )  # fmt: skip
        self._reception, self._loop = reception, loop
        receiving = loop.create_task(reception.receive())
        try:
            period = 1.0 / self._options.poses_hz
            next_look = time.monotonic()
            while not self._stopping.is_set():
                await self._woken_within(max(next_look - time.monotonic(), 0.0))
                now = time.monotonic()
                if now >= next_look:
                    next_look = max(next_look + period, now)
                    if self._plain is None:
                        self._poll()
                self._fill_all()
                reception.prune(now)
            receiving.cancel()
            await self._say_goodbye()
        finally:
            self._loop = None
            receiving.cancel()
            reception.close()

    async def _woken_within(self, patience_s: float) -> None:
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._woken.wait(), patience_s)
        # In this order: a concurrent call is handled next time.
        self._calls = False
        self._woken.clear()

    def _on_loop_failed(self, loop: asyncio.AbstractEventLoop, context: dict[str, object]) -> None:
        error = context.get("exception")
        if isinstance(error, OSError):
            # A broken connection; the client is gone.
            return
        self._failed(error if isinstance(error, Exception) else RuntimeError(context["message"]))

    def _greet(self, client: StreamClient) -> bytes:
        if self._plain is not None:
            if self._reception.is_full:
                self._reception.end(client, "")
            else:
                # Earlier points would arrive as points of the feature that is measured now.
                client.begun, client.next_seq = True, self._plain.sent + 1
            return b""
        job = "" if self._steps.path is None else self._steps.path.stem
        needed = bool(self._options.token)
        simulated = self._source.instruments.simulated
        return messages.hello_line(
            messages.Hello(self._id, job, 1, len(self._messages), needed, simulated)
        )

    def _start(self, client: StreamClient, line: bytes) -> None:
        end = partial(self._reception.end, client)
        try:
            request = messages.read_request(line)
        except InputError as error:
            end(f"{error.what} {error.remedy}")
            return
        expected = self._options.token.encode()
        if expected and not hmac.compare_digest(
            request.token.encode("utf-8", "surrogatepass"), expected
        ):
            end("the token is wrong")
            return
        last = len(self._messages)
        if request.resume > last:
            end(f"this stream is at {last}; it is not the one you had: resume from 0")
            return
        if self._reception.is_full:
            end(f"already {MOST_CLIENTS} clients")
            return
        client.begun, client.poses, client.next_seq = True, request.poses, request.resume + 1

    def _poll(self) -> None:
        """Send changes of the state, and poses."""
        listening = self._reception.listening
        if not listening:
            return
        if self._changed.is_set():
            self._changed.clear()
            self._verdicts.request()
        live = self._source.looks.live()
        job = self._source.job.path.stem
        state = (job, live.status.value, live.reason)
        if state != self._state:
            self._state, self._states = state, self._states + 1
        pose = messages.pose_line(live, pressed=self._pressed)
        for client in listening:
            with self._reception.dropping(client):
                if client.told_state != self._states and client.has_room:
                    client.write(messages.status_line(job, live))
                    client.told_state = self._states
                elif self._tell_verdict(client):
                    pass
                elif client.poses and client.waiting:
                    # At most one pose may wait; this one is early.
                    self.poses_missed += 1
                elif client.poses:
                    client.write(pose)

    def _tell_verdict(self, client: StreamClient) -> bool:
        """Send a client the latest verdict if new; return whether sent."""
        latest = self._verdicts.latest
        if client.told_verdict == latest.count or not client.has_room:
            return False
        client.write(latest.line)
        client.told_verdict = latest.count
        return True

    def _fill_all(self) -> None:
        last = len(self._messages)
        if self._plain is not None:
            self._plain.note_sent(last, to_clients=len(self._reception.listening))
        for client in self._reception.listening:
            with self._reception.dropping(client):
                try:
                    client.fill(self._messages)
                except OSError as error:
                    self._reception.end(client, f"older messages can no longer be read ({error})")

    async def _say_goodbye(self) -> None:
        """Send the rest and the reason of the end; stalled clients miss it."""
        reception = self._reception
        until = time.monotonic() + GOODBYE_S
        while reception.clients and time.monotonic() < until:
            last = len(self._messages)
            self._fill_all()
            for client in reception.clients:
                if client.listens:
                    self._tell_verdict(client)
                if not client.begun or client.next_seq > last:
                    reception.end(client, "the station was closed")
            reception.prune(time.monotonic())
            await asyncio.sleep(0.01)


def _step_line(seq: int, job: str, step: JobStep) -> bytes:
    if step.point is None:
        return messages.annulled_line(seq, job, step.number)
    return messages.point_line(seq, job, step.point)


class PlainLines:
    """Make one line of each new point, for programs that only read.

    Receivers neither acknowledge such a line nor can annul it, so each point is sent once, when it
    is durable. `line`: bytes of a point with their line end. `note`: receives a sentence for the
    operator.
    """

    def __init__(self, line: Callable[[MeasuredPoint], bytes], note: Callable[[str], None]) -> None:
        self._line, self._note = line, note
        self.sent = 0
        """Lines that have left, or had no receiver."""

    def line_of(self, step: JobStep, *, live: bool) -> bytes:
        """Return the line of a new point; empty for other steps. `live`: after the start."""
        if step.point is not None:
            # A restored point has a new number: the operator has deleted its first line.
            return self._line(step.point)
        if live:
            self._note(
                f"Point {step.number} was annulled after it was sent: delete it in the receiving "
                "program."
            )
        return b""

    def note_sent(self, last: int, *, to_clients: int) -> None:
        """Note that all lines up to a number leave now; without clients, inform the operator."""
        lost = last - self.sent
        self.sent = last
        if lost and not to_clients:
            self._note(
                f"No program is connected: {lost} point(s) went out to none. They are in the job; "
                "connect the program, then touch again what it lacks."
            )
