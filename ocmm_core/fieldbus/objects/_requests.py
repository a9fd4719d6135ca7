"""What other programs may ask the owner of the bus for, and its answers: one line of JSON each.

Only one process talks to the cameras. Everybody else writes requests to its standard input and
reads the answers from its standard output; the bytes of objects travel as base64.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from ocmm_core.errors import InputError

MAX_VALUE_BYTES = 1 << 20
"""Longest object; a snapshot of a whole 16-bit sensor of 512 x 512 pixels is half of it."""
MAX_LINE_BYTES = 4 * MAX_VALUE_BYTES // 3 + 4096
"""Longest line: the longest object in base64, and the words around it."""
MAX_EEPROM_WORDS = 2048
"""One request reads at most the 4 KiB that a camera has."""


Number = Annotated[int, msgspec.Meta(ge=0)]
"""Of a request; those below zero are the bus process's own and are taken from nobody else."""


class ObjectRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="object"):
    """Read or write one entry of a camera's object dictionary."""

    number: Number
    """Chosen by who asks; the answers carry it."""
    camera: str
    """Name of the camera in the rig."""
    index: int
    sub: int
    """`index`, `sub`: Address of the entry."""
    value: bytes | None = None
    """What to write; None to read."""
    room: int = MAX_VALUE_BYTES
    """How many bytes the answer may have; a longer object is an error."""


class EepromRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="eeprom"):
    """Read words of a camera's EEPROM."""

    number: Number
    camera: str
    """`number`, `camera`: As in `ObjectRequest`."""
    word: int
    """Address of the first word."""
    words: int
    """How many."""


class CancelRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="cancel"):
    """Give up the request with this number; there is no answer to it any more."""

    number: Number


Request = ObjectRequest | EepromRequest | CancelRequest


class ObjectReply(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How far a request is, or how it ended."""

    number: int
    """Of the request; 0 where the request could not be read."""
    done: int = 0
    total: int = 0
    """`done`, `total`: Bytes so far and in all; a total of 0 is not known yet."""
    finished: bool = False
    """This is the last answer."""
    value: bytes = b""
    """What was read, in the last answer."""
    code: str = ""
    what: str = ""
    remedy: str = ""
    """`code`, `what`, `remedy`: The error in the last answer; all empty where it went well."""


def encode_line(message: Request | ObjectReply) -> bytes:
    """Return a message as one line of JSON."""
    return msgspec.json.encode(message) + b"\n"


def decode_request(line: bytes) -> Request:
    """Return the request in ``line``.

    Raises
    ------
    InputError
        It is none, or asks for what no camera has.
    """
    try:
        request: Request = msgspec.json.decode(line, type=Request)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise _wrong(f"is not valid ({error})") from error
    if request.number < 1:
        raise _wrong(f"has the number {request.number}")
    if isinstance(request, ObjectRequest):
        if not (0 <= request.index <= 0xFFFF and 0 <= request.sub <= 0xFF):
            raise _wrong(f"names no object ({request.index}:{request.sub})")
        if not 0 <= request.room <= MAX_VALUE_BYTES:
            raise _wrong(f"gives the answer {request.room} bytes")
        if request.value is not None and len(request.value) > MAX_VALUE_BYTES:
            raise _wrong(f"writes {len(request.value)} bytes")
    elif isinstance(request, EepromRequest) and not (
        1 <= request.words <= MAX_EEPROM_WORDS
        and 0 <= request.word <= MAX_EEPROM_WORDS - request.words
    ):
        raise _wrong(f"asks for {request.words} words at {request.word}")
    return request


def decode_reply(line: bytes) -> ObjectReply:
    """Return the answer in ``line``; raise InputError where it is none."""
    try:
        return msgspec.json.decode(line, type=ObjectReply)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(
            "bus.request",
            f"An answer of the bus process is not valid ({error}).",
            "Install the program completely; its parts are of different versions.",
        ) from error


def _wrong(why: str) -> InputError:
    return InputError(
        "bus.request",
        f"A request to the bus process {why}.",
        "Use the commands 'ocmm bus'; if this came from them, report it as a program error.",
    )
