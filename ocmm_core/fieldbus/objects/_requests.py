"""Requests to the bus owner and its replies, one line of JSON each.

Only one process accesses the cameras. Others write requests to its standard input and read replies
from its standard output; object bytes are base64.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from ocmm_core.errors import InputError

MAX_VALUE_BYTES = 1 << 20
"""Longest object; a snapshot of a whole 16-bit sensor of 512 x 512 pixels is half of it."""
MAX_LINE_BYTES = 4 * MAX_VALUE_BYTES // 3 + 4096
"""Longest line: the longest object in base64 plus the other fields."""
MAX_EEPROM_WORDS = 2048
"""A camera's 4 KiB."""


Number = Annotated[int, msgspec.Meta(ge=0)]
"""Request number; negative ones are reserved for the bus process."""


class ObjectRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="object"):
    """Read or write one entry of a camera's object dictionary."""

    number: Number
    """Chosen by the requester; repeated in replies."""
    camera: str
    index: int
    sub: int
    value: bytes | None = None
    room: int = MAX_VALUE_BYTES
    """Maximum bytes of the answer; a longer object is an error."""


class EepromRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="eeprom"):
    """Read words of a camera's EEPROM."""

    number: Number
    camera: str
    word: int
    words: int


class CancelRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="cancel"):
    """Cancel the request with this number; no reply follows."""

    number: Number


Request = ObjectRequest | EepromRequest | CancelRequest


class ObjectReply(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Progress or result of a request."""

    number: int
    """Request number; 0 for unreadable requests."""
    done: int = 0
    total: int = 0
    """`done`, `total`: bytes; a total of 0 is unknown."""
    finished: bool = False
    value: bytes = b""
    code: str = ""
    what: str = ""
    remedy: str = ""
    """`code`, `what`, `remedy`: error in the last reply; empty on success."""


def encode_line(message: Request | ObjectReply) -> bytes:
    """Return a message as one line of JSON."""
    return msgspec.json.encode(message) + b"\n"


def decode_request(line: bytes) -> Request:
    """Return the request in `line`; raise InputError if invalid or out of range."""
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
    """Return the reply in `line`; raise InputError if invalid."""
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
