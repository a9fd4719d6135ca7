"""CANopen over EtherCAT, master side: object transfers as bytes in, bytes out.

A transfer provides the next mailbox and processes answers; the caller transports them. Nothing
waits: without answer the transfer does not advance. Source: ETG.1000.6, 5.6.2 (SDO services).

Reasons why a camera refuses a mailbox or transfer (ETG.1000.4 and ETG.1000.6).
"""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from enum import IntEnum

from ocmm_core.errors import BusError

ABORT_TEXTS: dict[int, str] = {
    0x05030000: "toggle bit not changed",
    0x05040000: "protocol timeout",
    0x05040001: "unknown command",
    0x05040005: "out of memory",
    0x06010000: "access not supported",
    0x06010001: "object can only be written",
    0x06010002: "object can only be read",
    0x06010003: "entry 0 must be 0 to write this entry",
    0x06010004: "no complete access to this object",
    0x06010005: "object longer than the mailbox",
    0x06010006: "object is mapped to process data",
    0x06020000: "object does not exist",
    0x06040041: "object cannot be mapped",
    0x06040042: "mapped objects are longer than the process data",
    0x06040043: "parameters do not fit together",
    0x06040047: "incompatible inside the camera",
    0x06060000: "hardware fault",
    0x06070010: "wrong length",
    0x06070012: "too long",
    0x06070013: "too short",
    0x06090011: "entry does not exist",
    0x06090030: "value not allowed",
    0x06090031: "value too large",
    0x06090032: "value too small",
    0x06090036: "maximum below minimum",
    0x08000000: "general error",
    0x08000020: "cannot be stored",
    0x08000021: "cannot be stored: the camera is in local control",
    0x08000022: "cannot be stored in this state of the camera",
    0x08000023: "no object dictionary",
}
"""Abort codes of SDO transfers (ETG.1000.6, table 41)."""

MAILBOX_ERRORS: dict[int, str] = {
    1: "syntax error",
    2: "protocol not supported",
    3: "wrong channel",
    4: "service not supported",
    5: "wrong head",
    6: "too short",
    7: "no memory",
    8: "wrong length",
}
"""Details of a mailbox error reply (ETG.1000.4, 5.6)."""


MAILBOX_HEAD = struct.Struct("<HHBB")
COE_HEAD = struct.Struct("<H")
MAX_COUNTER = 7
"""Mailbox counters run from 1 to this and wrap; 0 is unused."""
SERVICE_EMERGENCY, SERVICE_SDO_REQUEST, SERVICE_SDO_RESPONSE = 1, 2, 3

_KIND_ERROR, _KIND_COE = 0, 3
_SDO_HEAD = struct.Struct("<BHB")
_SDO_BYTES = 8
_SEGMENT_BYTES = 7
_ABORT = 0x80
_ABORT_TIMEOUT = 0x05040000
_SMALLEST_MAILBOX = MAILBOX_HEAD.size + COE_HEAD.size + _SDO_BYTES


class _Client(IntEnum):
    DOWNLOAD_SEGMENT = 0
    DOWNLOAD = 1
    UPLOAD = 2
    UPLOAD_SEGMENT = 3


class _Server(IntEnum):
    UPLOAD_SEGMENT = 0
    DOWNLOAD_SEGMENT = 1
    UPLOAD = 2
    DOWNLOAD = 3


def sdo_mailbox(body: bytes, counter: int, size: int) -> bytes:
    """Return a whole mailbox with an SDO request.

    ``body``: SDO from its command on; ``counter``: 1 to `MAX_COUNTER`; a camera skips a repeated
    one; ``size``: of the mailbox; the camera accepts it when its last byte is written.
    """
    content = COE_HEAD.pack(SERVICE_SDO_REQUEST << 12) + body
    head = MAILBOX_HEAD.pack(len(content), 0, 0, _KIND_COE | counter << 4)
    return (head + content).ljust(size, b"\x00")


def mailbox_counter(content: bytes) -> int:
    """Return the counter of a mailbox, for duplicate detection; 0 without one."""
    return content[5] >> 4 & 7 if len(content) >= MAILBOX_HEAD.size else 0


def coe_content(content: bytes) -> tuple[int, bytes] | None:
    """Return CoE service and body of a mailbox, or None if incomplete or not CoE."""
    if len(content) < MAILBOX_HEAD.size + COE_HEAD.size:
        return None
    length, _address, _channel, kind = MAILBOX_HEAD.unpack_from(content)
    if kind & 0x0F != _KIND_COE or length < COE_HEAD.size:
        return None
    end = MAILBOX_HEAD.size + length
    if end > len(content):
        return None
    (head,) = COE_HEAD.unpack_from(content, MAILBOX_HEAD.size)
    return head >> 12, bytes(content[MAILBOX_HEAD.size + COE_HEAD.size : end])


class SdoTransfer(ABC):
    """One transfer: send `request`, pass answers to `answer`, until `done`."""

    def __init__(self, index: int, sub: int, mailbox_bytes: int) -> None:
        if mailbox_bytes < _SMALLEST_MAILBOX:
            raise BusError(
                "bus.mailbox",
                f"Mailboxes of {mailbox_bytes} bytes are too small for objects.",
                "Install the camera firmware that matches this program.",
            )
        self.index = index
        self.sub = sub
        self._mailbox_bytes = mailbox_bytes
        self._toggle = 0
        self._started = False
        self._done = False

    @property
    def done(self) -> bool:
        return self._done

    @property
    @abstractmethod
    def result(self) -> bytes:
        """Return the value read so far; empty for writes."""

    @property
    @abstractmethod
    def progress(self) -> tuple[int, int]:
        """Return bytes done and in total; 0 while unknown."""

    def request(self, counter: int) -> bytes:
        """Return the next mailbox; unchanged until an answer arrives."""
        return sdo_mailbox(self._body().ljust(_SDO_BYTES, b"\x00"), counter, self._mailbox_bytes)

    def abandon(self, counter: int) -> bytes:
        """Return the mailbox that aborts the transfer in the camera; it is not answered."""
        body = _SDO_HEAD.pack(_ABORT, self.index, self.sub) + struct.pack("<I", _ABORT_TIMEOUT)
        return sdo_mailbox(body, counter, self._mailbox_bytes)

    def answer(self, content: bytes) -> None:
        """Process the camera's answer.

        BusError ends it: ``bus.refused`` by the camera, ``bus.mailbox`` for mismatched answers.
        """
        if self._done:
            raise self._unfit("it comes after the end")
        parts = coe_content(content)
        if parts is None:
            raise self._unfit(_complaint(content))
        service, body = parts
        if not body:
            raise self._unfit("it is empty")
        # The standard sends an abort as a request; not every device does.
        if body[0] == _ABORT and service in (SERVICE_SDO_REQUEST, SERVICE_SDO_RESPONSE):
            _command, index, sub = _SDO_HEAD.unpack_from(body.ljust(_SDO_BYTES, b"\x00"))
            # Late abort of a previous transfer; some devices send no address.
            if index and (index, sub) != (self.index, self.sub):
                raise self._unfit(f"it is about {index:#06x}:{sub:02x}")
            raise self._refused(body)
        if service != SERVICE_SDO_RESPONSE:
            raise self._unfit(f"it belongs to another service ({service})")
        if self._started:
            self._take_segment(body)
        else:
            if len(body) < _SDO_BYTES:
                raise self._unfit("it is too short")
            _command, index, sub = _SDO_HEAD.unpack_from(body)
            if (index, sub) != (self.index, self.sub):
                raise self._unfit(f"it is about {index:#06x}:{sub:02x}")
            self._take_first(body)

    @abstractmethod
    def _body(self) -> bytes:
        """Return the SDO to send."""

    @abstractmethod
    def _take_first(self, body: bytes) -> None:
        """Process the first answer; address checked, 8 bytes at least."""

    @abstractmethod
    def _take_segment(self, body: bytes) -> None:
        """Process a segment; one byte at least."""

    def _check_segment(self, command: int, specifier: _Server) -> None:
        if command >> 5 != specifier:
            raise self._unfit(f"its command {command:#04x} is not a segment")
        if command >> 4 & 1 != self._toggle:
            raise self._unfit("a segment is missing or came twice")
        self._toggle = 1 - self._toggle

    def _refused(self, body: bytes) -> BusError:
        code = int.from_bytes(body[4:8], "little")
        text = ABORT_TEXTS.get(code, "unknown reason")
        return BusError(
            "bus.refused",
            f"Object {self.index:#06x}:{self.sub:02x} was refused by the camera: {text} "
            f"({code:#010x}).",
            "Check the object and its value; where the camera is too old for it, install newer "
            "firmware: ocmm camera firmware CAMERA FILE",
        )

    def _unfit(self, why: str) -> BusError:
        return BusError(
            "bus.mailbox",
            f"The camera's answer for object {self.index:#06x}:{self.sub:02x} cannot be used: "
            f"{why}.",
            "Repeat the request; if it happens again, have the camera checked.",
        )


class SdoRead(SdoTransfer):
    """Read one entry; a value longer than ``room`` bytes fails before it is read."""

    def __init__(self, index: int, sub: int, room: int, *, mailbox_bytes: int) -> None:
        super().__init__(index, sub, mailbox_bytes)
        self._room = room
        self._total = 0
        self._value = bytearray()

    @property
    def result(self) -> bytes:
        """Return the value read so far; complete once `done`."""
        return bytes(self._value)

    @property
    def progress(self) -> tuple[int, int]:
        """Return bytes read and in total; 0 while unknown."""
        return len(self._value), self._total

    def _body(self) -> bytes:
        if self._started:
            return bytes([_Client.UPLOAD_SEGMENT << 5 | self._toggle << 4])
        return _SDO_HEAD.pack(_Client.UPLOAD << 5, self.index, self.sub)

    def _take_first(self, body: bytes) -> None:
        command = body[0]
        if command >> 5 != _Server.UPLOAD:
            raise self._unfit(f"its command {command:#04x} starts nothing that was requested")
        if command & 2:
            self._total = 4 - (command >> 2 & 3) if command & 1 else 4
            part = body[4 : 4 + self._total]
        else:
            (self._total,) = struct.unpack_from("<I", body, 4)
            part = body[_SDO_BYTES:]
        if self._total > self._room:
            raise self._unfit(f"it has {self._total} bytes where {self._room} are expected")
        self._started = True
        self._append(part)

    def _take_segment(self, body: bytes) -> None:
        self._check_segment(body[0], _Server.UPLOAD_SEGMENT)
        part = body[1:]
        if len(part) <= _SEGMENT_BYTES:
            part = part[: _SEGMENT_BYTES - (body[0] >> 1 & 7)]
        last = bool(body[0] & 1)
        if not part and not last:
            raise self._unfit("a segment is empty")
        self._append(part)
        if last and not self._done:
            raise self._unfit(f"it ends after {len(self._value)} of {self._total} bytes")
        if self._done and not last:
            raise self._unfit("it continues after its end")

    def _append(self, part: bytes) -> None:
        if len(self._value) + len(part) > self._total:
            raise self._unfit(f"it is longer than the {self._total} bytes that were announced")
        self._value += part
        self._done = len(self._value) == self._total


class SdoWrite(SdoTransfer):
    """Write one entry."""

    def __init__(self, index: int, sub: int, value: bytes, *, mailbox_bytes: int) -> None:
        super().__init__(index, sub, mailbox_bytes)
        self._value = value
        self._acknowledged = 0
        room = mailbox_bytes - MAILBOX_HEAD.size - COE_HEAD.size
        self._expedited = 1 <= len(value) <= 4
        self._first = len(value) if self._expedited else room - _SDO_BYTES
        self._segment = room - 1

    @property
    def result(self) -> bytes:
        return b""

    @property
    def progress(self) -> tuple[int, int]:
        return self._acknowledged, len(self._value)

    def _body(self) -> bytes:
        if self._started:
            return self._segment_body()
        size = len(self._value)
        if self._expedited:
            command = _Client.DOWNLOAD << 5 | (4 - size) << 2 | 3
            return _SDO_HEAD.pack(command, self.index, self.sub) + self._value
        head = _SDO_HEAD.pack(_Client.DOWNLOAD << 5 | 1, self.index, self.sub)
        return head + struct.pack("<I", size) + self._value[: self._first]

    def _segment_body(self) -> bytes:
        part = self._value[self._acknowledged : self._acknowledged + self._segment]
        command = _Client.DOWNLOAD_SEGMENT << 5 | self._toggle << 4
        command |= max(0, _SEGMENT_BYTES - len(part)) << 1
        if self._acknowledged + len(part) == len(self._value):
            command |= 1
        return bytes([command]) + part.ljust(_SEGMENT_BYTES, b"\x00")

    def _take_first(self, body: bytes) -> None:
        if body[0] >> 5 != _Server.DOWNLOAD:
            raise self._unfit(f"its command {body[0]:#04x} confirms nothing that was written")
        self._started = True
        self._next_segment(self._first)

    def _take_segment(self, body: bytes) -> None:
        self._check_segment(body[0], _Server.DOWNLOAD_SEGMENT)
        self._next_segment(self._segment)

    def _next_segment(self, size: int) -> None:
        self._acknowledged = min(self._acknowledged + size, len(self._value))
        self._done = self._acknowledged == len(self._value)


def _complaint(content: bytes) -> str:
    """Return why a mailbox is not CoE, or the camera's own error."""
    if len(content) >= MAILBOX_HEAD.size + 4 and content[5] & 0x0F == _KIND_ERROR:
        (detail,) = struct.unpack_from("<H", content, MAILBOX_HEAD.size + 2)
        text = MAILBOX_ERRORS.get(detail, "unknown reason")
        return f"the camera could not read the request ({text}, {detail})"
    return "not a CANopen message"
