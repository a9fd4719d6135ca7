"""Acyclic requests for objects and EEPROM words of the cameras.

Each camera has its own queue: one that hangs fails only its own requests, after half a second
without progress. Disturbed transfers restart from the beginning. Camera temperatures are read one
camera every few seconds, between other requests.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Protocol

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import INFORMATION
from ocmm_core.fieldbus.objects import _mailbox_line as mailbox_line
from ocmm_core.fieldbus.objects._requests import EepromRequest, ObjectReply, ObjectRequest
from ocmm_core.fieldbus.objects._sdo import SdoRead, SdoTransfer, SdoWrite, coe_content
from ocmm_core.fieldbus.report import Alarm
from ocmm_core.fieldbus.wire import EepromRead, Job

STALL_NS = 500_000_000
"""Time limit of a transfer without progress."""
_TRIES = 4
_OUT_OF_STEP = (b"\x03\x05", b"\x04\x05")
"""High words of abort codes: toggle bit, unknown command (ETG.1000.6, table 41)."""
_TELL_NS = 100_000_000

Request = ObjectRequest | EepromRequest


class RequestPort(Protocol):
    """Source of requests and sink of replies; never blocks."""

    def next_request(self) -> Request | None:
        """Return the next request, or None."""
        ...

    def is_cancelled(self, number: int) -> bool: ...

    def reply(self, reply: ObjectReply) -> None: ...


class CameraLine:
    """Sequential requests to one camera."""

    def __init__(
        self,
        name: str,
        station: int,
        areas: mailbox_line.MailboxAreas,
        on_emergency: Callable[[str, mailbox_line.Emergency], None],
    ) -> None:
        self.queue: deque[Request] = deque()
        self._name = name
        self._station = station
        self._mailbox = mailbox_line.MailboxLine(station, areas, self._mail)
        self._on_emergency = on_emergency
        self._request: Request | None = None
        self._sdo: SdoTransfer | None = None
        self._eeprom: EepromRead | None = None
        self._error: BusError | None = None
        self._again = False
        self._tries = 0
        self._progress = (-1, 0)
        self._moved_ns = self._told_ns = 0

    def unfinished(self) -> list[Request]:
        """Return all unanswered requests, the current one first."""
        return ([] if self._request is None else [self._request]) + list(self.queue)

    def jobs(self) -> Iterator[Job]:
        yield from self._mailbox.jobs()
        if self._eeprom is not None:
            yield from self._eeprom.jobs()

    def work(self, now_ns: int, port: RequestPort) -> ObjectReply | None:
        """Continue the transfer; return the last reply of a finished one."""
        if self._request is None:
            if not self.queue:
                return None
            self._request = self.queue.popleft()
            self._tries = 0
            self._start(now_ns)
        number = self._request.number
        if port.is_cancelled(number):
            self._end()
            return None
        transfer = self._sdo or self._eeprom
        if transfer is None:
            return None
        if isinstance(transfer, EepromRead) and transfer.error is not None:
            self._error = transfer.error
        done, total = transfer.progress
        if self._error is not None:
            self._tries += 1
            if self._again and self._tries < _TRIES:
                self._start(now_ns)
                return None
            return self._finish(done, total, self._error)
        if transfer.done:
            value = transfer.result
            self._end()
            return ObjectReply(number, done, total, finished=True, value=value)
        if (done, total) != self._progress:
            self._progress = (done, total)
            self._moved_ns = now_ns
            if now_ns - self._told_ns > _TELL_NS:
                self._told_ns = now_ns
                port.reply(ObjectReply(number, done, total))
        if now_ns - self._moved_ns > STALL_NS:
            error = BusError(
                Alarm.OBJECT_TIMEOUT,
                f"Camera '{self._name}' did not answer a request within {STALL_NS / 1e9:.1f} s.",
                Alarm.OBJECT_TIMEOUT.spec.remedy,
            )
            return self._finish(done, total, error)
        return None

    def _start(self, now_ns: int) -> None:
        request, size = self._request, self._mailbox.areas.out_bytes
        self._error = None
        self._again = False
        self._progress = (-1, 0)
        self._moved_ns = self._told_ns = now_ns
        if isinstance(request, EepromRequest):
            self._eeprom = EepromRead(self._station, request.word, request.words)
            return
        if request is None:
            return
        if request.value is None:
            self._sdo = SdoRead(request.index, request.sub, request.room, mailbox_bytes=size)
        else:
            self._sdo = SdoWrite(request.index, request.sub, request.value, mailbox_bytes=size)
        self._mailbox.send(self._sdo.request(self._mailbox.next_counter()))

    def _finish(self, done: int, total: int, error: BusError) -> ObjectReply:
        number = 0 if self._request is None else self._request.number
        self._end()
        return ObjectReply(
            number, done, total, finished=True,
            code=error.code, what=error.what, remedy=error.remedy,
        )  # fmt: skip

    def _end(self) -> None:
        self._mailbox.stop_waiting()
        if self._sdo is not None and not self._sdo.done:
            counter = self._mailbox.next_counter()
            self._mailbox.send(self._sdo.abandon(counter), expect=False)
        self._request = self._sdo = self._eeprom = self._error = None

    def _mail(self, content: bytes) -> None:
        emergency = mailbox_line.parse_emergency(content)
        if emergency is not None:
            self._on_emergency(self._name, emergency)
            if self._sdo is not None:
                self._mailbox.expect()
            return
        if self._sdo is None or self._error is not None:
            return
        try:
            self._sdo.answer(content)
        except BusError as error:
            self._error = error
            self._again = error.code == "bus.mailbox" or _is_disturbance(content)
            return
        if not self._sdo.done:
            self._mailbox.send(self._sdo.request(self._mailbox.next_counter()))


class ObjectService:
    """Distributes requests from a port to the cameras, named in rig order.

    `done` and `failed` count transfers, excluding our own (negative numbers).
    """

    def __init__(self, port: RequestPort | None, names: tuple[str, ...]) -> None:
        self._port = port
        self._names = names
        self._lines: dict[str, CameraLine] = {}
        self._turn = 0
        self.done = self.failed = 0
        self.emergencies: deque[tuple[str, mailbox_line.Emergency]] = deque(maxlen=64)
        """Messages not yet fetched: camera and message."""
        self.failures: deque[tuple[str, ObjectReply]] = deque(maxlen=64)
        """Failed requests not yet fetched: camera and last reply."""

    def attach(self, stations: Mapping[str, tuple[int, mailbox_line.MailboxAreas]]) -> None:
        """Connect to the cameras at these stations; restart unfinished requests."""
        before, self._lines = self._lines, {}
        for name, (station, areas) in stations.items():
            line = CameraLine(name, station, areas, lambda *one: self.emergencies.append(one))
            if name in before:
                line.queue.extend(before[name].unfinished())
            self._lines[name] = line

    def jobs(self) -> Iterator[Job]:
        """Yield the requests of this cycle; the cameras take turns at being first."""
        lines = list(self._lines.values())
        self._turn = (self._turn + 1) % max(1, len(lines))
        for line in lines[self._turn :] + lines[: self._turn]:
            yield from line.jobs()

    def work(self, now_ns: int) -> None:
        """Accept new requests and continue running ones; never blocks."""
        port = self._port
        if port is None:
            return
        while (request := port.next_request()) is not None:
            line = self._lines.get(request.camera)
            if line is None:
                self.failed += request.number >= 0
                port.reply(_no_camera(request, self._names))
            else:
                line.queue.append(request)
        for name, line in self._lines.items():
            reply = line.work(now_ns, port)
            if reply is None:
                continue
            port.reply(reply)
            if reply.number < 0:
                continue
            if reply.code:
                self.failed += 1
                self.failures.append((name, reply))
            else:
                self.done += 1


def _is_disturbance(content: bytes) -> bool:
    """Return whether a camera aborted because request and answer got out of step."""
    parts = coe_content(content)
    return parts is not None and parts[1][6:8] in _OUT_OF_STEP


def _no_camera(request: Request, names: tuple[str, ...]) -> ObjectReply:
    known = request.camera in names
    return ObjectReply(
        request.number,
        finished=True,
        code=Alarm.OBJECT_TIMEOUT if known else "bus.request",
        what=f"Camera '{request.camera}' is not in operation."
        if known
        else f"No camera '{request.camera}'; available: {', '.join(names)}.",
        remedy="Wait until the bus is in operation." if known else "Give one of these names.",
    )


INTERVAL_NS = 5_000_000_000
"""Between readings; the cameras take turns."""
_TEMPERATURE = 4
_BYTES = 2


class Thermometer:
    """Port that inserts its own requests between those of another port."""

    def __init__(
        self,
        port: RequestPort | None,
        names: tuple[str, ...],
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.celsius: dict[str, float] = {}
        """Last temperatures; cameras without answer are missing."""
        self._port = port
        self._names = names
        self._now_ns = now_ns
        self._next_ns = now_ns()
        self._turn = 0

    def next_request(self) -> Request | None:
        """Return the next request of the other port, or a due reading."""
        request = None if self._port is None else self._port.next_request()
        now_ns = self._now_ns()
        if request is not None or now_ns < self._next_ns:
            return request
        self._next_ns = now_ns + INTERVAL_NS
        self._turn = (self._turn + 1) % len(self._names)
        # Numbers of other requests are not negative.
        return ObjectRequest(
            -1 - self._turn, self._names[self._turn], INFORMATION, _TEMPERATURE, room=_BYTES
        )

    def is_cancelled(self, number: int) -> bool:
        return number >= 0 and self._port is not None and self._port.is_cancelled(number)

    def reply(self, reply: ObjectReply) -> None:
        """Store the reply to a reading; pass any other on."""
        if reply.number >= 0:
            if self._port is not None:
                self._port.reply(reply)
            return
        name = self._names[-1 - reply.number]
        if reply.code:
            self.celsius.pop(name, None)
        elif reply.finished and len(reply.value) == _BYTES:
            self.celsius[name] = int.from_bytes(reply.value, "little", signed=True) / 10.0
