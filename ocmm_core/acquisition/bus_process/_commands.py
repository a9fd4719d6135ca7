"""Command port of the bus process: requests on standard input, replies on output.

A separate thread does all reading, writing and JSON, so that the bus cycle thread never waits: it
takes requests from a queue and puts replies into another. Both are bounded and count overflows.
Programs for a short task on the wire read one line (`run_errand`).
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable
from typing import TypeVar

import msgspec

from ocmm_core.acquisition.bus_process._rights import NEEDED, give_up_all_but
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.failure import REOPEN, contained, exit_with
from ocmm_core.fieldbus import objects

MAX_REQUESTS = 64
MAX_REPLIES = 256
_MAX_CANCELLED = 256
_READ_BYTES = 65536
_WRITE_BYTES = 4096
"""Minimum room in a writable pipe (POSIX, PIPE_BUF of Linux)."""
_LAST_WORDS_S = 0.5
_Request = TypeVar("_Request")


def read_first_line(descriptor: int) -> bytes:
    """Return the first line of a stream without reading beyond it."""
    line = bytearray()
    while not line.endswith(b"\n") and len(line) < objects.MAX_LINE_BYTES:
        byte = os.read(descriptor, 1)
        if not byte:
            break
        line += byte
    return bytes(line)


def stopped_by_parent() -> threading.Event:
    """Return an event that is set on SIGTERM, SIGINT, or at the end of standard input."""
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda _number, _frame: stop.set())
    # A daemon: it waits for the end of the parent.
    threading.Thread(target=_until_end, args=(stop,), daemon=True).start()
    return stop


def _until_end(stop: threading.Event) -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    stop.set()


class LineBuffer:
    """Splits a stream into lines; skips and counts overlong ones."""

    def __init__(self, longest: int = objects.MAX_LINE_BYTES) -> None:
        self._longest = longest
        self._rest = bytearray()
        self._skipping = False
        self.too_long = 0

    def push(self, content: bytes) -> list[bytes]:
        """Add input; return the completed lines without line ends."""
        *ends, rest = content.split(b"\n")
        lines = []
        for end in ends:
            self._append(end)
            if not self._skipping:
                lines.append(bytes(self._rest))
            self._rest.clear()
            self._skipping = False
        self._append(rest)
        return lines

    def _append(self, part: bytes) -> None:
        if not self._skipping and len(self._rest) + len(part) > self._longest:
            self._skipping = True
            self.too_long += 1
            self._rest.clear()
        if not self._skipping:
            self._rest += part


class CommandPort:
    """Queues of requests and replies.

    `input_`, `output`: descriptors; they stay open. `on_end`: called once from another thread when
    the input ends. `on_failure`: called before that with an unexpected error of the thread.
    """

    def __init__(
        self,
        input_: int,
        output: int,
        on_end: Callable[[], None],
        on_failure: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        self._input = input_
        self._output = output
        self._on_end, self._on_failure = on_end, on_failure
        self._requests: deque[objects.ObjectRequest | objects.EepromRequest] = deque()
        self._replies: deque[objects.ObjectReply] = deque()
        self._cancelled: deque[int] = deque(maxlen=_MAX_CANCELLED)
        self._lines = LineBuffer()
        self._pending = bytearray()
        self._deaf = self._mute = False
        self._closing = False
        self.refused = 0
        """Requests unreadable or without room."""
        self.dropped = 0
        """Replies without room."""
        self._bell_out, self._bell_in = os.pipe()
        os.set_blocking(self._bell_in, False)
        # A daemon: a failing process must end without waiting for it.
        self._thread = threading.Thread(target=self._run, name="ocmm-bus-commands", daemon=True)
        self._thread.start()

    @classmethod
    def from_standard_streams(
        cls,
        on_end: Callable[[], None],
        on_failure: Callable[[Exception], None] = lambda error: None,
    ) -> CommandPort:
        """Return the port on standard streams; use `read_first_line`: ``sys.stdin`` buffers."""
        return cls(sys.stdin.fileno(), sys.stdout.fileno(), on_end, on_failure)

    def next_request(self) -> objects.ObjectRequest | objects.EepromRequest | None:
        """Return the next request, or None; never waits."""
        while True:
            try:
                request = self._requests.popleft()
            except IndexError:
                return None
            if not self.is_cancelled(request.number):
                return request

    def is_cancelled(self, number: int) -> bool:
        """Return whether a request was cancelled; never waits."""
        return number in self._cancelled

    def reply(self, reply: objects.ObjectReply) -> None:
        """Send a reply; never waits. If replies are not read, progress is dropped first."""
        room = MAX_REPLIES if reply.finished else MAX_REPLIES // 2
        if self._closing or len(self._replies) >= room:
            self.dropped += 1
            return
        self._replies.append(reply)
        self._ring()

    def close(self) -> None:
        """Flush briefly, and end the thread; idempotent."""
        if self._closing:
            return
        self._closing = True
        self._ring()
        self._thread.join(2.0 * _LAST_WORDS_S)
        if not self._thread.is_alive():
            os.close(self._bell_in)
            os.close(self._bell_out)

    def _ring(self) -> None:
        try:
            os.write(self._bell_in, b"\x00")
        except BlockingIOError:
            # Already signalled.
            return

    def _run(self) -> None:
        try:
            while not self._closing:
                self._step(None)
            if self._output_waits():
                self._step(_LAST_WORDS_S)
            while self._output_waits() and self._step(0.0):
                pass
        except Exception as error:
            # Without this thread the end of the application would not be noticed.
            self._on_failure(contained(error, "The connection to the application", remedy=REOPEN))
            self._on_end()

    def _output_waits(self) -> bool:
        return not self._mute and bool(self._pending or self._replies)

    def _step(self, timeout_s: float | None) -> bool:
        sources = [self._bell_out] if self._deaf else [self._bell_out, self._input]
        sinks = [self._output] if self._output_waits() else []
        readable, writable, _ = select.select(sources, sinks, [], timeout_s)
        if self._bell_out in readable:
            os.read(self._bell_out, _READ_BYTES)
        if self._input in readable:
            self._listen()
        if writable:
            self._speak()
        return bool(writable)

    def _listen(self) -> None:
        try:
            content = os.read(self._input, _READ_BYTES)
        except OSError:
            content = b""
        if not content:
            self._deaf = True
            self._on_end()
            return
        too_long = self._lines.too_long
        for line in self._lines.push(content):
            if line.strip():
                self._understand(line)
        if self._lines.too_long > too_long:
            self._refuse(0, "bus.request", "A request is too long.", "Send less at a time.")

    def _understand(self, line: bytes) -> None:
        try:
            request = objects.decode_request(line)
        except OcmmError as error:
            self._refuse(0, error.code, error.what, error.remedy)
            return
        if isinstance(request, objects.CancelRequest):
            self._cancelled.append(request.number)
        elif len(self._requests) >= MAX_REQUESTS:
            self._refuse(
                request.number,
                "bus.busy",
                f"{MAX_REQUESTS} requests to the cameras are already waiting.",
                "Wait until they are answered.",
            )
        else:
            self._requests.append(request)

    def _refuse(self, number: int, code: str, what: str, remedy: str) -> None:
        self.refused += 1
        self.reply(objects.ObjectReply(number, finished=True, code=code, what=what, remedy=remedy))

    def _speak(self) -> None:
        if not self._pending:
            self._pending += objects.encode_line(self._replies.popleft())
        try:
            written = os.write(self._output, self._pending[:_WRITE_BYTES])
        except OSError:
            # The reader is gone; the end of the input determines the reaction.
            self._mute = True
            self._pending.clear()
            return
        del self._pending[:written]


def run_errand(
    request: msgspec.json.Decoder[_Request], run: Callable[[_Request], None], what: str
) -> None:
    """Drop rights, run the task of the first line; errors to stderr, exit 2, unexpected 3."""
    try:
        give_up_all_but(NEEDED)
        try:
            asked = request.decode(read_first_line(sys.stdin.fileno()))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise InputError(
                "bus.request",
                f"Invalid request: {error}.",
                "Use the commands 'ocmm bus'; if this came from them, report it as a program "
                "error.",
            ) from error
        run(asked)
    except Exception as error:
        exit_with(error, what)


def send_line(news: msgspec.Struct | bytes) -> None:
    """Write a message to the parent, as a line of JSON, or these bytes."""
    line = news if isinstance(news, bytes) else msgspec.json.encode(news) + b"\n"
    sys.stdout.buffer.write(line)
    sys.stdout.buffer.flush()
