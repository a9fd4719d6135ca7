"""SDO requests to the camera under test, also malformed ones (ETG.1000.6, 5.6).

`objects` never sends requests that a camera could refuse. A conformance test must, so requests are
assembled and answers parsed byte by byte here.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from ocmm_bench.conform._findings import NotAsDescribedError

COE, FOE = 3, 4
EMERGENCY, REQUEST, RESPONSE, INFORMATION = 1, 2, 3, 8
_HEAD = struct.Struct("<HHBB")
_SDO = struct.Struct("<BHB")
_ABORT = 0x80
_MOST_SEGMENTS = 4096

Ask = Callable[[bytes], bytes]
"""Sends a CoE mailbox as an SDO request; returns the answering mailbox."""


@dataclass(frozen=True, slots=True)
class SdoRefusal:
    """SDO abort: code and entry."""

    code: int
    index: int
    sub: int

    def __str__(self) -> str:
        return f"refused with {self.code:#010x}"


def mailbox(kind: int, content: bytes, counter: int) -> bytes:
    return _HEAD.pack(len(content), 0, 0, counter << 4 | kind) + content


def parts(content: bytes) -> tuple[int, int, bytes]:
    """Return protocol, counter and content of a mailbox."""
    length, _address, _channel, kind = _HEAD.unpack_from(content)
    body = content[_HEAD.size : _HEAD.size + length]
    if len(body) != length:
        raise NotAsDescribedError(f"A mailbox says {length} bytes, which it has not room for.")
    return kind & 0x0F, kind >> 4 & 7, body


def sdo_body(content: bytes) -> tuple[int, bytes]:
    """Return service and body of a CoE mailbox that answers an SDO request."""
    kind, _counter, body = parts(content)
    if kind != COE or len(body) < 3:
        raise NotAsDescribedError(f"An SDO request is answered with a mailbox of protocol {kind}.")
    return int(struct.unpack_from("<H", body)[0]) >> 12, body[2:]


def refusal(content: bytes) -> SdoRefusal | None:
    """Return the abort in an answer, or None."""
    service, body = sdo_body(content)
    if body[:1] != bytes([_ABORT]):
        if service != RESPONSE:
            raise NotAsDescribedError(f"An SDO request is answered with CoE service {service}.")
        return None
    _command, index, sub = _SDO.unpack_from(body.ljust(8, b"\x00"))
    return SdoRefusal(int(struct.unpack_from("<I", body.ljust(8, b"\x00"), 4)[0]), index, sub)


def upload(ask: Ask, index: int, sub: int, *, complete: bool = False) -> bytes | SdoRefusal:
    """Read an entry or a whole record."""
    bit = 0x10 if complete else 0
    answer = ask(_SDO.pack(0x40 | bit, index, sub) + bytes(4))
    refused = refusal(answer)
    if refused is not None:
        return refused
    body = sdo_body(answer)[1]
    command, found, found_sub = _SDO.unpack_from(body)
    if command >> 5 != 2 or (found, found_sub) != (index, sub) or command & 0x10 != bit:
        raise NotAsDescribedError(
            f"Reading {index:#06x}:{sub:02X} is answered for {found:#06x}:{found_sub:02X} with "
            f"the command {command:#04x}."
        )
    if command & 2:
        return body[4 : 8 - (command >> 2 & 3)] if command & 1 else body[4:8]
    size = int(struct.unpack_from("<I", body, 4)[0])
    content, toggle = body[8:], 0
    for _ in range(_MOST_SEGMENTS):
        if len(content) >= size:
            break
        answer = ask(bytes([0x60 | toggle << 4]) + bytes(7))
        refused = refusal(answer)
        if refused is not None:
            return refused
        body = sdo_body(answer)[1]
        if body[0] >> 5 != 0 or body[0] >> 4 & 1 != toggle:
            raise NotAsDescribedError(f"A segment has the command {body[0]:#04x}.")
        part = body[1:]
        content += part[: 7 - (body[0] >> 1 & 7)] if len(part) <= 7 else part
        toggle = 1 - toggle
        if body[0] & 1 and len(content) < size:
            break
    if len(content) != size:
        raise NotAsDescribedError(
            f"{index:#06x}:{sub:02X} announces {size} bytes and sends {len(content)}."
        )
    return content


def download(
    ask: Ask,
    index: int,
    sub: int,
    value: bytes,
    *,
    complete: bool = False,
    room: int = 240,
    expedited: bool = True,
) -> SdoRefusal | None:
    """Write an entry or a whole record; return the refusal, if any."""
    bit = 0x10 if complete else 0
    if expedited and 1 <= len(value) <= 4:
        command = 0x23 | bit | (4 - len(value)) << 2
        answer = ask(_SDO.pack(command, index, sub) + value.ljust(4, b"\x00"))
        return _taken(answer, index, sub, 3)
    first = value[:room]
    answer = ask(_SDO.pack(0x21 | bit, index, sub) + struct.pack("<I", len(value)) + first)
    refused = _taken(answer, index, sub, 3)
    rest, toggle = value[room:], 0
    while refused is None and rest:
        part, rest = rest[:room], rest[room:]
        command = toggle << 4 | max(0, 7 - len(part)) << 1 | (0 if rest else 1)
        answer = ask(bytes([command]) + part.ljust(7, b"\x00"))
        refused = refusal(answer)
        if refused is None:
            body = sdo_body(answer)[1]
            if body[0] >> 5 != 1 or body[0] >> 4 & 1 != toggle:
                raise NotAsDescribedError(f"A segment is taken with the command {body[0]:#04x}.")
        toggle = 1 - toggle
    return refused


def _taken(answer: bytes, index: int, sub: int, specifier: int) -> SdoRefusal | None:
    refused = refusal(answer)
    if refused is not None:
        return refused
    command, found, found_sub = _SDO.unpack_from(sdo_body(answer)[1])
    if command >> 5 != specifier or (found, found_sub) != (index, sub):
        raise NotAsDescribedError(
            f"Writing {index:#06x}:{sub:02X} is answered for {found:#06x}:{found_sub:02X} with "
            f"the command {command:#04x}."
        )
    return None
