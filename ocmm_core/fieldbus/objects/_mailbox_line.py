"""Mailboxes of one camera over the service channel (ETG.1000.4, 5.6.2 and 6.7).

Mailboxes are written and read with single datagrams. A lost read answer loses the mailbox; the
camera keeps a copy, requested by the repeat bit of its sync manager. Emergency messages are sent by
a camera unrequested (ETG.1000.6, 5.6.4).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ocmm_core.fieldbus.objects import _sdo as sdo
from ocmm_core.fieldbus.wire import Command, Datagram, Job

_CONTENT = struct.Struct("<HB5s")

# First match: specific codes, then classes by their highest digits.
_TEXTS = (
    (0xFFFF, 0x0000, "error reset"),
    (0xFFFF, 0xA000, "state change impossible"),
    (0xFFFF, 0xA001, "state change refused"),
    (0xFF00, 0x1000, "general error"),
    (0xFF00, 0x2100, "current at the input"),
    (0xFF00, 0x2200, "current inside the device"),
    (0xFF00, 0x2300, "current at the output"),
    (0xF000, 0x2000, "current"),
    (0xFF00, 0x3100, "mains voltage"),
    (0xFF00, 0x3200, "voltage inside the device"),
    (0xFF00, 0x3300, "output voltage"),
    (0xF000, 0x3000, "voltage"),
    (0xFF00, 0x4100, "ambient temperature"),
    (0xFF00, 0x4200, "device temperature"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "device hardware"),
    (0xFF00, 0x6100, "internal software"),
    (0xFF00, 0x6200, "user software"),
    (0xFF00, 0x6300, "stored data"),
    (0xF000, 0x6000, "device software"),
    (0xF000, 0x7000, "additional modules"),
    (0xFF00, 0x8100, "communication"),
    (0xFF00, 0x8200, "protocol"),
    (0xF000, 0x8000, "monitoring"),
    (0xFF00, 0x9000, "external error"),
    (0xFF00, 0xF000, "additional functions"),
    (0xFF00, 0xFF00, "device specific"),
)


@dataclass(frozen=True, slots=True)
class Emergency:
    code: int
    """Error code; 0: the previous error is over."""
    register: int
    """Error register (object 0x1001): bit 0 any error, 3 temperature, 4 communication."""
    data: bytes

    @property
    def is_over(self) -> bool:
        """Return whether the previous error is over (ETG.1000.6, 5.6.4.1)."""
        return self.code == 0

    @property
    def text(self) -> str:
        """Return the meaning of the code's class."""
        found = (text for mask, value, text in _TEXTS if self.code & mask == value)
        return next(found, "unknown error")


def parse_emergency(mailbox: bytes) -> Emergency | None:
    """Return the emergency message in a mailbox, or None."""
    parts = sdo.coe_content(mailbox)
    if parts is None:
        return None
    service, body = parts
    if service != sdo.SERVICE_EMERGENCY or len(body) < _CONTENT.size:
        return None
    return Emergency(*_CONTENT.unpack_from(body))


SYNC_MANAGERS = 0x0800
SYNC_MANAGER_BYTES = 16
"""Registers of the two mailbox sync managers."""
_STATUS_IN = 0x080D
_ACTIVATE_IN = 0x080E
_FULL = 0x08
_ACTIVE, _REPEAT = 0x01, 0x02
_IDLE_CYCLES = 8
"""Cycles between polls for unsolicited messages."""
_UNSURE_CYCLES = 25
"""A possibly delivered mailbox is not rewritten before its answer could have arrived."""


@dataclass(frozen=True, slots=True)
class MailboxAreas:
    """Mailbox areas of a camera, from its sync managers."""

    out_start: int
    out_bytes: int
    in_start: int
    in_bytes: int
    """`out_start`, `out_bytes`, `in_start`, `in_bytes`: mailbox to and from the camera."""
    repeat: bool

    @classmethod
    def decode(cls, content: bytes) -> MailboxAreas:
        """Return the areas in the registers from `SYNC_MANAGERS` on."""
        out_start, out_bytes = struct.unpack_from("<HH", content, 0)
        in_start, in_bytes = struct.unpack_from("<HH", content, 8)
        return cls(out_start, out_bytes, in_start, in_bytes, bool(content[14] & _REPEAT))


class MailboxLine:
    """Mailboxes to and from one camera; `deliver` gets each received mailbox once."""

    def __init__(self, station: int, areas: MailboxAreas, deliver: Callable[[bytes], None]) -> None:
        self.areas = areas
        self.repeats = 0
        self._station = station
        self._deliver = deliver
        # Reused objects, so that the frame's form is cached.
        self._ask_status = Datagram(Command.FPRD, station, _STATUS_IN, bytes(3))
        self._ask_mailbox = Datagram(Command.FPRD, station, areas.in_start, bytes(areas.in_bytes))
        self._out: bytes | None = None
        self._writing = self._reading = self._asking = False
        self._unsure = 0
        self._expecting = False
        self._full = False
        self._repeat_bit = areas.repeat
        self._repeating = False
        self._after_repeat = False
        self._counter = 0
        self._seen_counter = 0
        self._idle = 0

    def next_counter(self) -> int:
        self._counter = self._counter % sdo.MAX_COUNTER + 1
        return self._counter

    def send(self, content: bytes, *, expect: bool = True) -> None:
        """Write a mailbox once there is room, replacing a waiting one; `expect`: poll for it."""
        self._out = content
        self._unsure = 0
        self._expecting = expect

    def expect(self) -> None:
        """Keep polling in every cycle: the received mailbox was not the answer."""
        self._expecting = True

    def stop_waiting(self) -> None:
        """Stop polling; late answers are still delivered."""
        self._out = None
        self._expecting = False

    def jobs(self) -> Iterator[Job]:
        if self._unsure:
            self._unsure -= 1
        if self._out is not None and not self._writing and not self._unsure:
            self._writing = True
            datagram = Datagram(Command.FPWR, self._station, self.areas.out_start, self._out)
            yield Job(datagram, self._written)
        if self._repeating:
            yield from self._repeat_jobs()
        elif (self._expecting or self._full) and not self._reading:
            self._reading = True
            yield Job(self._ask_mailbox, self._read)
        elif not self._expecting:
            self._idle += 1
            if self._idle >= _IDLE_CYCLES and not self._asking:
                self._idle = 0
                self._asking = True
                yield Job(self._ask_status, self._status)

    def _repeat_jobs(self) -> Iterator[Job]:
        if self._asking:
            return
        self._asking = True
        wanted = bytes([_ACTIVE | (_REPEAT if self._repeat_bit else 0)])
        # Rewriting is harmless if it arrived before.
        yield Job(Datagram(Command.FPWR, self._station, _ACTIVATE_IN, wanted), lambda _answer: None)
        yield Job(self._ask_status, self._status)

    def _written(self, answer: Datagram | None) -> None:
        self._writing = False
        if answer is None:
            self._unsure = _UNSURE_CYCLES
        elif answer.working_counter == 1:
            self._out = None

    def _read(self, answer: Datagram | None) -> None:
        self._reading = False
        if answer is None:
            self.repeats += 1
            self._repeat_bit = not self._repeat_bit
            self._repeating = True
            return
        self._full = False
        if answer.working_counter != 1:
            return
        counter = sdo.mailbox_counter(answer.data)
        again = self._after_repeat and counter != 0 and counter == self._seen_counter
        self._after_repeat = False
        if again:
            return
        self._seen_counter = counter
        if self._unsure:
            # The answer proves that the mailbox arrived.
            self._out, self._unsure = None, 0
        self._expecting = False
        self._deliver(answer.data)

    def _status(self, answer: Datagram | None) -> None:
        self._asking = False
        if answer is None or answer.working_counter != 1:
            return
        status, _activate, acknowledged = answer.data
        self._full = bool(status & _FULL)
        if self._repeating and bool(acknowledged & _REPEAT) == self._repeat_bit:
            self._repeating = False
            self._after_repeat = True
