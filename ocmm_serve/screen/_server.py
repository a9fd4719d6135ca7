"""The server of the second screen: one thread, an event loop, and a bounded number of readers.

A reader gets the next snapshot after it has acknowledged the last one, so nothing queues for a slow
one: it misses snapshots, which are counted. Without readers nothing is evaluated. Actions run one
at a time on a separate thread.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import mimetypes
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import msgspec
from aiohttp import WSMessage, web
from aiohttp.typedefs import Handler

from ocmm_core.documents import read_bytes
from ocmm_core.errors import MeasuringError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.station import MeasuringStation
from ocmm_core.station.stream import listen, tls_context
from ocmm_core.wording import ENGLISH, LANGUAGES, Speech
from ocmm_serve.screen import _access, _snapshot
from ocmm_serve.screen._job import JobOnScreen, ScreenCall

MOST_READERS = 16
PERIOD_S = 0.1
STALLED_S = 10.0
"""s: limit until a reader acknowledges a snapshot."""
PAUSE_S = 0.1
"""Minimum pause between two evaluations, so that the page never takes a whole processor."""
_PACE_S = 0.005
"""s: messages of one reader are read at most 200 times a second."""
_STOP_S, _GOODBYE_S = 2.0, 0.5
_MOST_PICTURE = 8_000_000
"""Bytes."""
_FULL, _WRONG, _STALLED = 4029, 4001, 4008
"""Codes of the WebSocket for the page."""


@dataclass(slots=True, eq=False)
class _Reader:
    socket: web.WebSocketResponse
    right: _access.Right
    speech: Speech
    wake: asyncio.Event = field(default_factory=asyncio.Event)
    answers: list[_snapshot.ScreenAnswer] = field(default_factory=list)
    number: int = 0
    seen: int = 0
    job_sent: int = -1
    """`number`, `seen`, `job_sent`: Last snapshot sent, last acknowledged, sequence of the job."""


class ScreenServer:
    """Serve the second screen of a station; `start` and `close`, on any thread.

    `failed`: receives unexpected errors. InputError: the certificate cannot be used.
    """

    def __init__(
        self,
        station: MeasuringStation,
        options: _access.ScreenOptions,
        failed: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        self._station, self._options, self._failed = station, options, failed
        self._tls = tls_context(options.address)
        self._files = _access.PageFiles()
        self._reception = _access.ScreenReception(options.address, self._tls)
        self._readers: set[_Reader] = set()
        self._job = JobOnScreen(station)
        self._live: dict[str, msgspec.Raw] = {}
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._changed, self._stopping = asyncio.Event(), asyncio.Event()
        self._actions = ThreadPoolExecutor(1, "ocmm-screen-action")
        self._evaluations = ThreadPoolExecutor(1, "ocmm-screen-evaluation")
        self.address = (options.address.host, options.address.port)
        """The port is known after the start."""
        self.missed = 0
        """Snapshots not sent because a reader was slow."""
        self.refused = 0
        """Wrong tokens, readers above the limit, actions without the right, invalid messages."""

    @property
    def readers(self) -> int:
        return len(self._readers)

    def start(self) -> tuple[str, int]:
        """Listen, and return the address; MeasuringError if it is unavailable."""
        listener = listen(self._options.address, MOST_READERS)
        listener.setblocking(False)
        address = listener.getsockname()
        self.address = (str(address[0]), int(address[1]))
        self._loop = loop = asyncio.new_event_loop()
        self._station.events.changed.connect(self._on_change, priority=1)
        self._thread = threading.Thread(target=self._run, args=(listener, loop), name="ocmm-screen")
        self._thread.start()
        return self.address

    def close(self) -> bool:
        """Disconnect all readers; return whether the thread ended in time."""
        thread, self._thread = self._thread, None
        if thread is None:
            return True
        self._station.events.changed.disconnect(self._on_change)
        self._wake(self._stopping)
        thread.join(2.0 * _STOP_S)
        return not thread.is_alive()

    def _on_change(self) -> None:
        # On the thread of the change, which never waits here.
        self._job.note_change()
        self._wake(self._changed)

    def _wake(self, event: asyncio.Event) -> None:
        if self._loop is not None:
            # The loop is closed.
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(event.set)

    def _run(self, listener: socket.socket, loop: asyncio.AbstractEventLoop) -> None:
        try:
            with listener, asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(self._serve(listener))
        except Exception as error:
            self._failed(error)
        finally:
            for pool in (self._actions, self._evaluations):
                pool.shutdown(cancel_futures=True)

    async def _serve(self, listener: socket.socket) -> None:
        app = web.Application(client_max_size=1024, middlewares=[self._guard])
        self._files.add_to(app)
        app.router.add_get("/picture", self._picture)
        app.router.add_get("/live", self._talk)
        runner = web.AppRunner(
            app, access_log=None, handle_signals=False, shutdown_timeout=0.1, max_line_size=2048,
            # Faults of clients are answered; in the log they would be tracebacks without end.
            max_field_size=2048, logger=logging.Logger("ocmm-screen", logging.CRITICAL),  # noqa: LOG001 - without handlers
        )  # fmt: skip
        await runner.setup()
        assert runner.server is not None  # noqa: S101 - after the set-up
        tasks = [
            asyncio.create_task(work)
            for work in (
                self._reception.receive(listener, runner.server),
                self._evaluate(),
                self._tick(),
            )
        ]
        stop = asyncio.create_task(self._stopping.wait())
        try:
            done, _ = await asyncio.wait([*tasks, stop], return_when=asyncio.FIRST_COMPLETED)
            for task in done - {stop}:
                task.result()
        finally:
            for task in (*tasks, stop):
                task.cancel()
            goodbyes = [asyncio.create_task(one.socket.close(code=1001)) for one in self._readers]
            if goodbyes:
                await asyncio.wait(goodbyes, timeout=_GOODBYE_S)
            await runner.cleanup()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        try:
            return await handler(request)
        except (web.HTTPException, ConnectionError):
            raise
        except Exception as error:
            self._failed(error)
            raise

    async def _picture(self, request: web.Request) -> web.Response:
        """Return the picture of a feature, with the token in a header."""
        token = request.headers.get("Authorization", "").removeprefix("Bearer ")
        if not self._options.access.right_of(token):
            self.refused += 1
            return _access.response(b"", "text/plain", 403)
        plan, file = self._station.job.plan, self._station.job.plan_file
        wanted = request.query.get("feature", "")
        picture = next((one.picture for one in plan.features if one.name == wanted), "")
        if file is None or not picture:
            return _access.response(b"", "text/plain", 404)
        path = file.parent / picture
        try:
            content = await asyncio.to_thread(read_bytes, path, _MOST_PICTURE)
        except OcmmError:
            return _access.response(b"", "text/plain", 404)
        return _access.response(content, mimetypes.guess_type(path.name)[0] or "image/png")

    async def _talk(self, request: web.Request) -> web.StreamResponse:
        """Serve one page until it leaves."""
        talk = web.WebSocketResponse(max_msg_size=4096, compress=False, timeout=1.0)
        try:
            await talk.prepare(request)
        except ValueError:
            # A key that is not ASCII.
            return _access.response(b"", "text/plain", 400)
        reader = await self._admit(talk)
        if reader is None:
            return talk
        self._reception.admit(request.transport)
        self._readers.add(reader)
        self._changed.set()
        sending = asyncio.create_task(self._send(reader))
        try:
            async for message in talk:
                if not await self._hear(reader, message):
                    break
                await asyncio.sleep(_PACE_S)
        finally:
            self._readers.discard(reader)
            sending.cancel()
            await talk.close()
        return talk

    async def _admit(self, talk: web.WebSocketResponse) -> _Reader | None:
        """Return the reader that the first message makes; None after closing."""
        try:
            first = await talk.receive(timeout=_access.UNDECIDED_S)
            hello = msgspec.json.decode(first.data, type=ScreenCall)
        except (TimeoutError, TypeError, msgspec.DecodeError, UnicodeError):
            hello = ScreenCall()
        right = self._options.access.right_of(hello.token)
        if right and len(self._readers) < MOST_READERS:
            language = hello.language if hello.language in LANGUAGES else ENGLISH
            return _Reader(talk, right, Speech(language))
        self.refused += 1
        await talk.close(code=_FULL if right else _WRONG)
        return None

    async def _hear(self, reader: _Reader, message: WSMessage) -> bool:
        """Process a message of a page; return whether it stays."""
        try:
            call = msgspec.json.decode(message.data, type=ScreenCall)
        except (TypeError, msgspec.DecodeError, UnicodeError):
            self.refused += 1
            return False
        if not call.do:
            reader.seen = max(reader.seen, min(call.seen, reader.number))
            return True
        try:
            if reader.right != "control":
                raise MeasuringError(
                    "screen.read_only",
                    "This page can only read.",
                    "Use the buttons of the station.",
                )
            await asyncio.get_running_loop().run_in_executor(self._actions, self._job.act, call)
            what, remedy = "", ""
        except Exception as error:
            self.refused += isinstance(error, MeasuringError) and error.code == "screen.read_only"
            told = error if isinstance(error, OcmmError) else contained(error, "The action")
            what, remedy = reader.speech.text(told.what), reader.speech.text(told.remedy)
        reader.answers.append(_snapshot.ScreenAnswer(id=call.id, what=what, remedy=remedy))
        # A page that sends but does not read gets its last answers only.
        del reader.answers[:-MOST_READERS]
        return True

    async def _evaluate(self) -> None:
        """Evaluate the job after changes, while there are readers."""
        loop = asyncio.get_running_loop()
        while True:
            await self._changed.wait()
            self._changed.clear()
            if self._readers and not self._job.is_current:
                await loop.run_in_executor(self._evaluations, self._job.evaluate)
            await asyncio.sleep(PAUSE_S)

    async def _tick(self) -> None:
        """Take a snapshot of the machine for all readers."""
        while True:
            await asyncio.sleep(PERIOD_S)
            if not self._readers:
                continue
            live, job = self._station.looks.live(), self._job.evaluated
            view = None if job is None else job.view
            for language in {reader.speech.language for reader in self._readers}:
                made = _snapshot.live_of(live, view, Speech(language))
                self._live[language] = msgspec.Raw(msgspec.json.encode(made))
            for reader in self._readers:
                self.missed += reader.wake.is_set() or reader.number > reader.seen
                reader.wake.set()

    async def _send(self, reader: _Reader) -> None:
        """Send the latest snapshot whenever the last one was acknowledged."""
        sent_s = time.monotonic()
        try:
            while True:
                await reader.wake.wait()
                reader.wake.clear()
                if reader.number == reader.seen:
                    sent_s = time.monotonic()
                    async with asyncio.timeout(STALLED_S):
                        await reader.socket.send_str(self._message(reader))
                elif time.monotonic() - sent_s > STALLED_S:
                    await reader.socket.close(code=_STALLED)
                    return
        except (ConnectionError, TimeoutError):
            await reader.socket.close(code=_STALLED)
        except Exception as error:
            await reader.socket.close(code=1011)
            self._failed(error)

    def _message(self, reader: _Reader) -> str:
        first, job = reader.number == 0, self._job.evaluated
        reader.number += 1
        answers, reader.answers = reader.answers, []
        raw: msgspec.Raw | None = None
        if job is not None and job.sequence != reader.job_sent:
            reader.job_sent = job.sequence
            raw = self._job.encoded(job, reader.speech)
        made = {
            "schema": _snapshot.SCHEMA,
            "number": reader.number,
            "controls": reader.right == "control",
            "current": self._job.is_current,
            "live": self._live[reader.speech.language],
            "job": raw,
            "answers": answers,
            "texts": _snapshot.texts_of(reader.speech) if first else {},
        }
        return msgspec.json.encode(made).decode("utf-8")
