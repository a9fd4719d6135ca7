"""The objects of one camera as a host reaches them, whatever is in between."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ocmm_core.errors import BusError

Progress = Callable[[int, int], None]
"""Called with how much of how much is done; what it raises ends the operation."""

STRING_BYTES = 64
"""No text of the camera is longer."""


class ObjectAccess(Protocol):
    """The objects of one camera; each call waits for its end."""

    def read(
        self, index: int, sub: int, *, room: int = ..., progress: Progress | None = None
    ) -> bytes:
        """Return the value of an entry of at most ``room`` bytes."""
        ...

    def write(
        self, index: int, sub: int, value: bytes, *, progress: Progress | None = None
    ) -> None:
        """Write the value of an entry."""
        ...


def read_exactly(access: ObjectAccess, index: int, sub: int, size: int) -> bytes:
    """Return a value of so many bytes, or raise BusError."""
    value = access.read(index, sub, room=size)
    if len(value) != size:
        raise unfit(index, sub, f"it has {len(value)} bytes instead of {size}")
    return value


def read_number(access: ObjectAccess, index: int, sub: int, size: int) -> int:
    """Return an unsigned number of so many bytes, or raise BusError."""
    return int.from_bytes(read_exactly(access, index, sub, size), "little")


def read_text(access: ObjectAccess, index: int, sub: int) -> str:
    """Return a text, or raise BusError."""
    try:
        return access.read(index, sub, room=STRING_BYTES).rstrip(b"\x00").decode("ascii")
    except UnicodeDecodeError as error:
        raise unfit(index, sub, "not text") from error


def unfit(index: int, sub: int, why: str) -> BusError:
    """Return the error of an entry that this program cannot use."""
    return BusError(
        "bus.object",
        f"Object {index:#06x}:{sub:02x} of the camera cannot be used: {why}.",
        "Install the camera firmware that matches this program.",
    )
