"""Host access to one camera's objects: intrinsics, black image, snapshot, errors.

The access is independent of the transport.
"""

from __future__ import annotations

import hashlib
import struct
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.device import (
    BLACK_IMAGE,
    BLOB_BYTES,
    CALIBRATION,
    CHUNK_BYTES,
    HISTORY,
    HISTORY_FIRST,
    HISTORY_MESSAGES,
    IDENTIFY,
    MAX_BLACK_FRAMES,
    NOTE_BYTES,
    SNAPSHOT,
    BlackCommand,
    BlackImage,
    DiagnosisMessage,
    Intrinsics,
    SnapshotCommand,
    Window,
    Work,
)

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


_POLL_S = 0.02
_STALL_S = 10.0
"""Time limit without progress of a camera command."""
_HASH_BYTES = 32
_LARGEST_PX = 1 << 26
"""Sizes up to 4.3 gigapixels can be encoded; no smart camera has 67 million."""


@dataclass(frozen=True, slots=True)
class BlackImageState:
    """Available black images of a camera."""

    images: BlackImage
    sha256: str
    """SHA-256 of the active pixels, hexadecimal; empty without one."""
    mean: float


def measure_black_image(
    access: ObjectAccess, frames: int, progress: Progress | None = None
) -> BlackImageState:
    """Average `frames` exposures without light, and apply the mean.

    No spots are sent meanwhile. The image is volatile until `store_black_image`. Raises BusError
    ``bus.black_image`` if the camera fails or stalls.
    """
    if not 1 <= frames <= MAX_BLACK_FRAMES:
        raise InputError(
            "bus.black_image",
            f"A black image cannot be the mean of {frames} exposures.",
            f"Give 1 to {MAX_BLACK_FRAMES}.",
        )
    access.write(BLACK_IMAGE, 2, struct.pack("<H", frames))
    return _black_command(access, BlackCommand.MEASURE, progress)


def store_black_image(access: ObjectAccess) -> BlackImageState:
    """Store the active black image permanently."""
    return _black_command(access, BlackCommand.STORE)


def load_black_image(access: ObjectAccess) -> BlackImageState:
    """Apply the stored black image."""
    return _black_command(access, BlackCommand.LOAD)


def clear_black_image(access: ObjectAccess) -> BlackImageState:
    """Disable and delete the black image."""
    return _black_command(access, BlackCommand.CLEAR)


def read_black_image(access: ObjectAccess) -> BlackImageState:
    """Return the available black images."""
    return BlackImageState(
        BlackImage(read_number(access, BLACK_IMAGE, 5, 1)),
        access.read(BLACK_IMAGE, 6, room=_HASH_BYTES).hex(),
        read_number(access, BLACK_IMAGE, 8, 2) / 10.0,
    )


def take_snapshot(
    access: ObjectAccess, region: Window | None = None, progress: Progress | None = None
) -> NDArray[np.uint16]:
    """Capture a raw image and fetch it: (height, width), grey levels.

    ``region``: left, top, width and height, px; None for the whole sensor. Exceptions of
    ``progress`` abort, and the camera releases the image. BusError ``bus.snapshot`` if the camera
    fails or stalls, or the image differs from the captured one.
    """
    for sub, value in enumerate(region or (0, 0, 0, 0), start=1):
        access.write(SNAPSHOT, sub, struct.pack("<H", value))
    try:
        access.write(SNAPSHOT, 5, bytes([SnapshotCommand.TAKE]))
        _wait(
            access, SNAPSHOT, 6, "snapshot", None if progress is None else lambda *_: progress(0, 0)
        )
        width, height = (read_number(access, SNAPSHOT, sub, 2) for sub in (12, 13))
        total = read_number(access, SNAPSHOT, 8, 4)
        if total != 2 * width * height or not total or (region and region[2:] != (width, height)):
            raise _failed("snapshot", "its size does not match the request")
        if width * height > _LARGEST_PX:
            raise _failed("snapshot", f"it says that it has {width} x {height} pixels")
        content = bytearray()
        while len(content) < total:
            if progress is not None:
                progress(len(content), total)
            access.write(SNAPSHOT, 9, struct.pack("<I", len(content)))
            chunk = access.read(SNAPSHOT, 10, room=CHUNK_BYTES)
            if len(chunk) != min(CHUNK_BYTES, total - len(content)):
                raise _failed("snapshot", f"a chunk has {len(chunk)} bytes")
            content += chunk
        if zlib.crc32(content) != read_number(access, SNAPSHOT, 11, 4):
            raise _failed("snapshot", "its checksum is wrong")
        if progress is not None:
            progress(total, total)
    except BaseException:
        _release_after_failure(access)
        raise
    access.write(SNAPSHOT, 5, bytes([SnapshotCommand.RELEASE]))
    return np.frombuffer(bytes(content), "<u2").reshape(height, width).astype(np.uint16)


def _release_after_failure(access: ObjectAccess) -> None:
    try:
        access.write(SNAPSHOT, 5, bytes([SnapshotCommand.RELEASE]))
    except BusError:
        # The first error is more specific; the next capture releases the image.
        return


def _black_command(
    access: ObjectAccess, command: BlackCommand, progress: Progress | None = None
) -> BlackImageState:
    access.write(BLACK_IMAGE, 1, bytes([command]))
    _wait(access, BLACK_IMAGE, 3, "black image", progress)
    return read_black_image(access)


def _wait(
    access: ObjectAccess, index: int, state_sub: int, what: str, progress: Progress | None
) -> None:
    """Wait for the end of a command; the entry after the state is the progress in %."""
    last, moved = -1, time.monotonic()
    while (state := read_number(access, index, state_sub, 1)) == Work.BUSY:
        percent = read_number(access, index, state_sub + 1, 1)
        if progress is not None:
            progress(percent, 100)
        if percent != last:
            last, moved = percent, time.monotonic()
        if time.monotonic() - moved > _STALL_S:
            raise _failed(what, f"no progress for {_STALL_S:.0f} s")
        time.sleep(_POLL_S)
    if state != Work.DONE:
        raise _failed(what, "the camera reports a failure")


def _failed(what: str, why: str) -> BusError:
    return BusError(
        f"bus.{what.replace(' ', '_')}",
        f"The {what} of the camera failed: {why}.",
        "Retry; see the error history of the camera.",
    )


def read_error_history(access: ObjectAccess) -> tuple[DiagnosisMessage, ...]:
    """Return the camera's stored errors, oldest first."""
    newest = read_number(access, HISTORY, 2, 1)
    if newest == 0:
        return ()
    if not HISTORY_FIRST <= newest < HISTORY_FIRST + HISTORY_MESSAGES:
        raise unfit(HISTORY, 2, f"it names message {newest}")
    order = (
        HISTORY_FIRST + (newest - HISTORY_FIRST + 1 + step) % HISTORY_MESSAGES
        for step in range(HISTORY_MESSAGES)
    )
    contents = (access.read(HISTORY, place, room=STRING_BYTES) for place in order)
    return tuple(DiagnosisMessage.decode(content) for content in contents if content)


def blink(access: ObjectAccess, seconds: int) -> int:
    """Make the camera blink for 0 to 600 s; return the accepted time."""
    access.write(IDENTIFY, 1, seconds.to_bytes(2, "little"))
    return read_number(access, IDENTIFY, 2, 2)


def clear_error_history(access: ObjectAccess) -> None:
    """Clear the camera's error history."""
    access.write(HISTORY, 3, b"\x00")


def write_intrinsics(access: ObjectAccess, intrinsics: Intrinsics, note: str = "") -> None:
    """Store intrinsics in the camera and verify them.

    The camera refuses those of another serial number. ``note``: at most 1200 bytes as UTF-8.
    BusError ``bus.intrinsics`` if verification fails, ``bus.refused`` if the camera refuses them.
    """
    block, words = intrinsics.encode(), note.encode("utf-8")
    if len(words) > NOTE_BYTES:
        raise InputError(
            "bus.note",
            f"The note stored with the intrinsics has {len(words)} bytes.",
            f"Shorten it to {NOTE_BYTES} bytes.",
        )
    access.write(CALIBRATION, 1, block)
    access.write(CALIBRATION, 5, words)
    found = access.read(CALIBRATION, 1, room=BLOB_BYTES)
    sha256 = access.read(CALIBRATION, 3, room=_HASH_BYTES)
    if found != block or sha256 != hashlib.sha256(block).digest():
        raise _lost_intrinsics()
    if access.read(CALIBRATION, 5, room=NOTE_BYTES) != words:
        raise _lost_intrinsics()


def read_intrinsics(access: ObjectAccess) -> Intrinsics | None:
    """Return the stored intrinsics, or None; BusError ``bus.intrinsics`` if damaged."""
    block = access.read(CALIBRATION, 1, room=BLOB_BYTES)
    sha256 = access.read(CALIBRATION, 3, room=_HASH_BYTES)
    if not block:
        return None
    if sha256 != hashlib.sha256(block).digest():
        raise _lost_intrinsics()
    return Intrinsics.decode(block)


def _lost_intrinsics() -> BusError:
    return BusError(
        "bus.intrinsics",
        "The camera did not retain the intrinsics written to it.",
        "Write them again; if that does not help, have the camera checked.",
    )
