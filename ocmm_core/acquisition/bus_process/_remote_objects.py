"""Camera objects through the bus process; threads share its line, by numbered requests."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Protocol

from ocmm_core.errors import BusError, InputError, OcmmError
from ocmm_core.fieldbus.objects import (
    MAX_EEPROM_WORDS,
    MAX_VALUE_BYTES,
    CancelRequest,
    EepromRequest,
    ObjectReply,
    ObjectRequest,
    Request,
    decode_reply,
    encode_line,
)

TIMEOUT_S = 10.0
"""For a silent bus process; it gives up silent cameras much earlier."""

Progress = Callable[[int, int], None]
"""Called with bytes done and in total; its exceptions abort the transfer."""


class LineSender(Protocol):
    """Sends lines to the bus process."""

    def send(self, line: bytes) -> None:
        """Send a line; raise BusError on failure."""
        ...


class ObjectLine:
    """Pending requests by number."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._number = 0
        self._waiting: dict[int, queue.SimpleQueue[ObjectReply | BusError]] = {}
        self._ended: BusError | None = None
        self.garbled = 0

    def request(
        self,
        sender: LineSender,
        make: Callable[[int], Request],
        progress: Progress | None = None,
        timeout_s: float = TIMEOUT_S,
    ) -> bytes:
        """Send the request that `make` returns for a number, and wait for its end.

        `timeout_s`: between replies. BusError: camera or bus process refuses, is silent, or ended.
        """
        answers: queue.SimpleQueue[ObjectReply | BusError] = queue.SimpleQueue()
        with self._lock:
            if self._ended is not None:
                raise self._ended
            self._number += 1
            number = self._number
            self._waiting[number] = answers
        finished = False
        try:
            sender.send(encode_line(make(number)))
            while True:
                reply = _next(answers, timeout_s)
                if isinstance(reply, BusError):
                    finished = True
                    raise reply
                if reply.finished:
                    finished = True
                    return _value(reply)
                if progress is not None:
                    progress(reply.done, reply.total)
        finally:
            with self._lock:
                self._waiting.pop(number, None)
            if not finished:
                self._cancel(sender, number)

    def receive(self, line: bytes) -> None:
        """Pass a reply line to its requester."""
        try:
            reply = decode_reply(line)
        except InputError:
            self.garbled += 1
            return
        with self._lock:
            answers = self._waiting.get(reply.number)
        if answers is not None:
            answers.put(reply)

    def end(self, error: BusError) -> None:
        """Raise this error in all pending and later requests."""
        with self._lock:
            self._ended = error
            waiting = list(self._waiting.values())
        for answers in waiting:
            answers.put(error)

    def _cancel(self, sender: LineSender, number: int) -> None:
        try:
            sender.send(encode_line(CancelRequest(number)))
        except BusError:
            # The process that would process it is gone.
            return


class ObjectProcess(LineSender, Protocol):
    """Process that owns the bus, with its pending requests."""

    @property
    def objects(self) -> ObjectLine: ...


class RemoteObjects:
    """Objects of one camera, through the process that owns the bus."""

    def __init__(
        self, process: ObjectProcess, camera: str, *, timeout_s: float = TIMEOUT_S
    ) -> None:
        self._process = process
        self._camera = camera
        self._timeout_s = timeout_s

    def read(
        self, index: int, sub: int, *, room: int = MAX_VALUE_BYTES, progress: Progress | None = None
    ) -> bytes:
        """Return an entry's value, `room` bytes at most; BusError as `ObjectLine.request`."""
        return self._ask(
            lambda number: ObjectRequest(number, self._camera, index, sub, None, room), progress
        )

    def write(
        self, index: int, sub: int, value: bytes, *, progress: Progress | None = None
    ) -> None:
        """Write the value of an entry; errors as `read`."""
        if len(value) > MAX_VALUE_BYTES:
            raise InputError(
                "bus.value",
                f"A value of {len(value)} bytes is too long for object {index:#06x}:{sub:02x}.",
                f"Write at most {MAX_VALUE_BYTES} bytes.",
            )
        self._ask(
            lambda number: ObjectRequest(number, self._camera, index, sub, value, 0), progress
        )

    def eeprom(self, word: int, words: int, *, progress: Progress | None = None) -> bytes:
        """Return words of the camera's EEPROM; errors as `read`."""
        if not (1 <= words <= MAX_EEPROM_WORDS and 0 <= word <= MAX_EEPROM_WORDS - words):
            raise InputError(
                "bus.value",
                f"An EEPROM has no {words} words at {word}.",
                f"Read within the first {MAX_EEPROM_WORDS} words.",
            )
        return self._ask(lambda number: EepromRequest(number, self._camera, word, words), progress)

    def _ask(self, make: Callable[[int], Request], progress: Progress | None) -> bytes:
        try:
            return self._process.objects.request(self._process, make, progress, self._timeout_s)
        except OcmmError as error:
            if self._camera in error.what:
                raise
            what = f"Camera '{self._camera}': {error.what}"
            raise BusError(error.code, what, error.remedy) from error


def _next(
    answers: queue.SimpleQueue[ObjectReply | BusError], timeout_s: float
) -> ObjectReply | BusError:
    try:
        return answers.get(timeout=timeout_s)
    except queue.Empty:
        raise BusError(
            "bus.object_timeout",
            f"The bus process has not answered a request for {timeout_s:g} s.",
            "Open the job again.",
        ) from None


def _value(reply: ObjectReply) -> bytes:
    if reply.code:
        raise BusError(reply.code, reply.what, reply.remedy)
    return reply.value
