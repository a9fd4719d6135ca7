"""Transport-independent access to the objects of one camera."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ocmm_core.errors import BusError

Progress = Callable[[int, int], None]
"""Called with the amount done and in total; its exceptions abort the operation."""

STRING_BYTES = 64
"""Maximum length of texts in a camera."""


class ObjectAccess(Protocol):
    """Objects of one camera; calls block."""

    def read(
        self, index: int, sub: int, *, room: int = ..., progress: Progress | None = None
    ) -> bytes:
        """Return the value of an entry of at most `room` bytes."""
        ...

    def write(
        self, index: int, sub: int, value: bytes, *, progress: Progress | None = None
    ) -> None: ...


def read_exactly(access: ObjectAccess, index: int, sub: int, size: int) -> bytes:
    """Return a value of exactly `size` bytes, or raise BusError."""
    value = access.read(index, sub, room=size)
    if len(value) != size:
        raise unfit(index, sub, f"it has {len(value)} bytes instead of {size}")
    return value


def read_number(access: ObjectAccess, index: int, sub: int, size: int) -> int:
    """Return an unsigned number of `size` bytes, or raise BusError."""
    return int.from_bytes(read_exactly(access, index, sub, size), "little")


def read_text(access: ObjectAccess, index: int, sub: int) -> str:
    """Return a text, or raise BusError."""
    try:
        return access.read(index, sub, room=STRING_BYTES).rstrip(b"\x00").decode("ascii")
    except UnicodeDecodeError as error:
        raise unfit(index, sub, "not text") from error


def unfit(index: int, sub: int, why: str) -> BusError:
    """Return the error for an unusable entry."""
    return BusError(
        "bus.object",
        f"Object {index:#06x}:{sub:02x} of the camera cannot be used: {why}.",
        "Install the camera firmware that matches this program.",
    )
