"""Line between the conformance test and a camera, and its mailboxes.

The line has datagrams and a clock; the rules use nothing else: they also run on a camera in this
process, in the line's time. Mailboxes: requests, objects and response times. An exchange has
states, deadlines and results.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ocmm_bench.conform import _sdo_talk as sdo_talk
from ocmm_bench.conform._findings import NotAsDescribedError
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.wire import Datagram, RawLine

INIT, PREOP, BOOT, SAFEOP, OP = 1, 2, 3, 4, 8
ERROR = 0x10
NAMES = {INIT: "INIT", PREOP: "PREOP", BOOT: "BOOT", SAFEOP: "SAFEOP", OP: "OP"}
MS = 1_000_000
SDO_LIMIT_NS, STATE_LIMIT_NS, BACK_LIMIT_NS = 80 * MS, 1000 * MS, 500 * MS
FIRST_LIMIT_NS, BOOT_LIMIT_NS, ERASE_LIMIT_NS, PACKET_LIMIT_NS = (
    60 * MS, 5000 * MS, 10_000 * MS, 2000 * MS,
)  # fmt: skip
"""Deadlines of the object description, ns."""
SDO_TIME, STATE_TIME = "Answer to an SDO request", "Change of state"


@dataclass(frozen=True, slots=True)
class Status:
    """State of a camera with error bit, and AL status code."""

    state: int
    code: int

    def __str__(self) -> str:
        name = NAMES.get(self.state & 0x0F, f"{self.state:#x}")
        return f"{name}{' with error' if self.state & ERROR else ''} (code {self.code:#06x})"


@dataclass(frozen=True, slots=True)
class ExchangeCycle:
    """One exchange of process data."""

    working_counter: int
    content: bytes
    header: device.Header
    system_ns: int
    """Bus time of the camera when the frame passed it."""
    sent_ns: int
    came_ns: int
    """`sent_ns`, `came_ns`: line time before and after."""

    def frame(self, number: int) -> bytes:
        begin = device.HEADER_STRUCT.size + number * device.FRAME_DTYPE.itemsize
        return self.content[begin : begin + device.FRAME_DTYPE.itemsize]


_PAUSE_NS = 10_000_000
"""Longer pauses of the computer distort timings and trip camera watchdogs."""


class ConformLine(Protocol):
    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        """Send datagrams in one frame; return the answers; raise BusError if lost."""
        ...

    def now_ns(self) -> int: ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def paused_ns(self) -> int:
        """Return the longest pause of this computer since the last call; 0 if none."""
        ...


class WireLine:
    """Network interface with this computer's clock; implements `ConformLine`."""

    def __init__(self, line: RawLine) -> None:
        self._line = line
        self._paused_ns = 0

    def exchange(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        begin = time.monotonic_ns()
        answers = self._line.exchange_all(datagrams)
        # The controller answers in hardware: delays come from this computer or a lost frame.
        self._note(time.monotonic_ns() - begin)
        return answers

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        begin = time.monotonic_ns()
        time.sleep(seconds)
        self._note(time.monotonic_ns() - begin - round(seconds * 1e9))

    def paused_ns(self) -> int:
        longest, self._paused_ns = self._paused_ns, 0
        return longest

    def _note(self, late_ns: int) -> None:
        if late_ns > _PAUSE_NS:
            self._paused_ns = max(self._paused_ns, late_ns)


_SM_STATUS_IN, _FULL = 0x080D, 0x08
_POLL_S = 0.0005


class MailLine:
    """Mailboxes of one camera; ``timed`` is called with measured times and their limits."""

    def __init__(
        self,
        line: ConformLine,
        get: Callable[[int, int], bytes],
        put: Callable[[int, bytes], int],
        feed: Callable[[], None],
        timed: Callable[[str, int, int], None],
    ) -> None:
        self._line = line
        self._get, self._put, self._feed, self._timed = get, put, feed, timed
        self.emergencies: list[tuple[int, int, bytes]] = []
        """Code, error register and data of each emergency."""
        self.reply_counters: list[int] = []
        self._counter = 0

    def post(self, content: bytes) -> bool:
        """Write a mailbox; return whether the camera accepted it."""
        for _ in range(5):
            if self._put(device.MAILBOX_OUT_START, content.ljust(device.MAILBOX_BYTES, b"\x00")):
                return True
            self._line.sleep(_POLL_S)
        return False

    def fetch(self, limit_ns: int) -> bytes | None:
        """Return the next mailbox of the camera, or None after the limit."""
        deadline = self._line.now_ns() + limit_ns
        while True:
            self._feed()
            if self._get(_SM_STATUS_IN, 1)[0] & _FULL:
                content = self._get(device.MAILBOX_IN_START, device.MAILBOX_BYTES)
                self.reply_counters.append(content[5] >> 4 & 7)
                return content
            if self._line.now_ns() > deadline:
                return None
            self._line.sleep(_POLL_S)

    def talk(self, kind: int, content: bytes, limit_ns: int = 2 * SDO_LIMIT_NS) -> bytes | None:
        """Send a mailbox; return its answer; store emergencies."""
        self.drain()
        if not self.post(sdo_talk.mailbox(kind, content, self.next_counter())):
            raise NotAsDescribedError("The camera does not take a mailbox.")
        while (answer := self.fetch(limit_ns)) is not None:
            if not self._is_emergency(answer):
                return answer
        return None

    def drain(self, wait_ns: int = 0) -> None:
        """Fetch all waiting mailboxes of the camera."""
        while (answer := self.fetch(wait_ns)) is not None:
            self._is_emergency(answer)

    def next_counter(self) -> int:
        self._counter = self._counter % 7 + 1
        return self._counter

    def sdo(self, body: bytes) -> bytes:
        """Send an SDO request; return the answering mailbox and record the time."""
        before = self._line.now_ns()
        answer = self.talk(sdo_talk.COE, struct.pack("<H", sdo_talk.REQUEST << 12) + body)
        if answer is None:
            raise NotAsDescribedError(
                f"The SDO request {body[:4].hex(' ')} is not answered within "
                f"{2 * SDO_LIMIT_NS // MS} ms."
            )
        self._timed(SDO_TIME, self._line.now_ns() - before, SDO_LIMIT_NS)
        return answer

    def read(self, index: int, sub: int, *, complete: bool = False) -> bytes | sdo_talk.SdoRefusal:
        return sdo_talk.upload(self.sdo, index, sub, complete=complete)

    def write(
        self, index: int, sub: int, value: bytes, *, complete: bool = False
    ) -> sdo_talk.SdoRefusal | None:
        """Write an entry; return the refusal, if any."""
        return sdo_talk.download(self.sdo, index, sub, value, complete=complete)

    def value(self, index: int, sub: int = 0) -> bytes:
        """Read a required entry."""
        found = self.read(index, sub)
        if isinstance(found, sdo_talk.SdoRefusal):
            raise NotAsDescribedError(f"{index:#06x}:{sub:02X} is {found}.")
        return found

    def count(self, index: int, sub: int) -> int:
        """Read a required number."""
        return int.from_bytes(self.value(index, sub), "little")

    def set(self, index: int, sub: int, value: bytes) -> None:
        """Write an entry that must be accepted."""
        refused = self.write(index, sub, value)
        if refused is not None:
            raise NotAsDescribedError(
                f"Writing {value[:8].hex(' ')} to {index:#06x}:{sub:02X} is {refused}."
            )

    def _is_emergency(self, content: bytes) -> bool:
        kind, _counter, body = sdo_talk.parts(content)
        if kind != sdo_talk.COE or len(body) < 10 or body[1] >> 4 != sdo_talk.EMERGENCY:
            return False
        code, register = struct.unpack_from("<HB", body, 2)
        self.emergencies.append((code, register, body[5:10]))
        return True
