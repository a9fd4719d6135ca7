"""Host access to one camera's objects: intrinsics, black image, snapshot, errors.

Pictures of 16 bits become files: PNG and PGM. The access is independent of the transport.
"""

from __future__ import annotations

import hashlib
import struct
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus import device

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

    images: device.BlackImage
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
    if not 1 <= frames <= device.MAX_BLACK_FRAMES:
        raise InputError(
            "bus.black_image",
            f"A black image cannot be the mean of {frames} exposures.",
            f"Give 1 to {device.MAX_BLACK_FRAMES}.",
        )
    access.write(device.BLACK_IMAGE, 2, struct.pack("<H", frames))
    return _black_command(access, device.BlackCommand.MEASURE, progress)


def store_black_image(access: ObjectAccess) -> BlackImageState:
    """Store the active black image permanently."""
    return _black_command(access, device.BlackCommand.STORE)


def load_black_image(access: ObjectAccess) -> BlackImageState:
    """Apply the stored black image."""
    return _black_command(access, device.BlackCommand.LOAD)


def clear_black_image(access: ObjectAccess) -> BlackImageState:
    """Disable and delete the black image."""
    return _black_command(access, device.BlackCommand.CLEAR)


def read_black_image(access: ObjectAccess) -> BlackImageState:
    """Return the available black images."""
    return BlackImageState(
        device.BlackImage(read_number(access, device.BLACK_IMAGE, 5, 1)),
        access.read(device.BLACK_IMAGE, 6, room=_HASH_BYTES).hex(),
        read_number(access, device.BLACK_IMAGE, 8, 2) / 10.0,
    )


def take_snapshot(
    access: ObjectAccess, region: device.Window | None = None, progress: Progress | None = None
) -> NDArray[np.uint16]:
    """Capture a raw image and fetch it: (height, width), grey levels.

    ``region``: left, top, width and height, px; None for the whole sensor. Exceptions of
    ``progress`` abort, and the camera releases the image. BusError ``bus.snapshot`` if the camera
    fails or stalls, or the image differs from the captured one.
    """
    for sub, value in enumerate(region or (0, 0, 0, 0), start=1):
        access.write(device.SNAPSHOT, sub, struct.pack("<H", value))
    try:
        access.write(device.SNAPSHOT, 5, bytes([device.SnapshotCommand.TAKE]))
        _wait(
            access,
            device.SNAPSHOT,
            6,
            "snapshot",
            None if progress is None else lambda *_: progress(0, 0),
        )
        width, height = (read_number(access, device.SNAPSHOT, sub, 2) for sub in (12, 13))
        total = read_number(access, device.SNAPSHOT, 8, 4)
        if total != 2 * width * height or not total or (region and region[2:] != (width, height)):
            raise _failed("snapshot", "its size does not match the request")
        if width * height > _LARGEST_PX:
            raise _failed("snapshot", f"it says that it has {width} x {height} pixels")
        content = bytearray()
        while len(content) < total:
            if progress is not None:
                progress(len(content), total)
            access.write(device.SNAPSHOT, 9, struct.pack("<I", len(content)))
            chunk = access.read(device.SNAPSHOT, 10, room=device.CHUNK_BYTES)
            if len(chunk) != min(device.CHUNK_BYTES, total - len(content)):
                raise _failed("snapshot", f"a chunk has {len(chunk)} bytes")
            content += chunk
        if zlib.crc32(content) != read_number(access, device.SNAPSHOT, 11, 4):
            raise _failed("snapshot", "its checksum is wrong")
        if progress is not None:
            progress(total, total)
    except BaseException:
        _release_after_failure(access)
        raise
    access.write(device.SNAPSHOT, 5, bytes([device.SnapshotCommand.RELEASE]))
    return np.frombuffer(bytes(content), "<u2").reshape(height, width).astype(np.uint16)


def _release_after_failure(access: ObjectAccess) -> None:
    try:
        access.write(device.SNAPSHOT, 5, bytes([device.SnapshotCommand.RELEASE]))
    except BusError:
        # The first error is more specific; the next capture releases the image.
        return


def _black_command(
    access: ObjectAccess, command: device.BlackCommand, progress: Progress | None = None
) -> BlackImageState:
    access.write(device.BLACK_IMAGE, 1, bytes([command]))
    _wait(access, device.BLACK_IMAGE, 3, "black image", progress)
    return read_black_image(access)


def _wait(
    access: ObjectAccess, index: int, state_sub: int, what: str, progress: Progress | None
) -> None:
    """Wait for the end of a command; the entry after the state is the progress in %."""
    last, moved = -1, time.monotonic()
    while (state := read_number(access, index, state_sub, 1)) == device.Work.BUSY:
        percent = read_number(access, index, state_sub + 1, 1)
        if progress is not None:
            progress(percent, 100)
        if percent != last:
            last, moved = percent, time.monotonic()
        if time.monotonic() - moved > _STALL_S:
            raise _failed(what, f"no progress for {_STALL_S:.0f} s")
        time.sleep(_POLL_S)
    if state != device.Work.DONE:
        raise _failed(what, "the camera reports a failure")


def _failed(what: str, why: str) -> BusError:
    return BusError(
        f"bus.{what.replace(' ', '_')}",
        f"The {what} of the camera failed: {why}.",
        "Retry; see the error history of the camera.",
    )


def read_error_history(access: ObjectAccess) -> tuple[device.DiagnosisMessage, ...]:
    """Return the camera's stored errors, oldest first."""
    newest = read_number(access, device.HISTORY, 2, 1)
    if newest == 0:
        return ()
    if not device.HISTORY_FIRST <= newest < device.HISTORY_FIRST + device.HISTORY_MESSAGES:
        raise unfit(device.HISTORY, 2, f"it names message {newest}")
    order = (
        device.HISTORY_FIRST + (newest - device.HISTORY_FIRST + 1 + step) % device.HISTORY_MESSAGES
        for step in range(device.HISTORY_MESSAGES)
    )
    contents = (access.read(device.HISTORY, place, room=STRING_BYTES) for place in order)
    return tuple(device.DiagnosisMessage.decode(content) for content in contents if content)


def blink(access: ObjectAccess, seconds: int) -> int:
    """Make the camera blink for 0 to 600 s; return the accepted time."""
    access.write(device.IDENTIFY, 1, seconds.to_bytes(2, "little"))
    return read_number(access, device.IDENTIFY, 2, 2)


def clear_error_history(access: ObjectAccess) -> None:
    """Clear the camera's error history."""
    access.write(device.HISTORY, 3, b"\x00")


def write_intrinsics(access: ObjectAccess, intrinsics: device.Intrinsics, note: str = "") -> None:
    """Store intrinsics in the camera and verify them.

    The camera refuses those of another serial number. ``note``: at most 1200 bytes as UTF-8.
    BusError ``bus.intrinsics`` if verification fails, ``bus.refused`` if the camera refuses them.
    """
    block, words = intrinsics.encode(), note.encode("utf-8")
    if len(words) > device.NOTE_BYTES:
        raise InputError(
            "bus.note",
            f"The note stored with the intrinsics has {len(words)} bytes.",
            f"Shorten it to {device.NOTE_BYTES} bytes.",
        )
    access.write(device.CALIBRATION, 1, block)
    access.write(device.CALIBRATION, 5, words)
    found = access.read(device.CALIBRATION, 1, room=device.BLOB_BYTES)
    sha256 = access.read(device.CALIBRATION, 3, room=_HASH_BYTES)
    if found != block or sha256 != hashlib.sha256(block).digest():
        raise _lost_intrinsics()
    if access.read(device.CALIBRATION, 5, room=device.NOTE_BYTES) != words:
        raise _lost_intrinsics()


def read_intrinsics(access: ObjectAccess) -> device.Intrinsics | None:
    """Return the stored intrinsics, or None; BusError ``bus.intrinsics`` if damaged."""
    block = access.read(device.CALIBRATION, 1, room=device.BLOB_BYTES)
    sha256 = access.read(device.CALIBRATION, 3, room=_HASH_BYTES)
    if not block:
        return None
    if sha256 != hashlib.sha256(block).digest():
        raise _lost_intrinsics()
    return device.Intrinsics.decode(block)


def _lost_intrinsics() -> BusError:
    return BusError(
        "bus.intrinsics",
        "The camera did not retain the intrinsics written to it.",
        "Write them again; if that does not help, have the camera checked.",
    )


_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_GREYSCALE, _BITS = 0, 16


def encode_png(picture: NDArray[np.uint16]) -> bytes:
    """Return a picture (height, width) as 16 bit greyscale PNG, not scaled."""
    height, width = picture.shape
    head = struct.pack(">IIBBBBB", width, height, _BITS, _GREYSCALE, 0, 0, 0)
    rows = np.zeros((height, 1 + 2 * width), np.uint8)
    # Each row starts with its filter, 0: none.
    rows[:, 1:] = picture.astype(">u2").view(np.uint8).reshape(height, 2 * width)
    content = _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6))
    return _PNG_MAGIC + content + _chunk(b"IEND", b"")


def encode_pgm(picture: NDArray[np.uint16]) -> bytes:
    """Return a picture (height, width) as binary 16 bit PGM, not scaled."""
    height, width = picture.shape
    return f"P5\n{width} {height}\n65535\n".encode("ascii") + picture.astype(">u2").tobytes()


def encoder_for(path: Path) -> Callable[[NDArray[np.uint16]], bytes]:
    """Return the encoder for a file name's suffix; InputError if unknown."""
    encoders = {".png": encode_png, ".pgm": encode_pgm}
    encoder = encoders.get(path.suffix.lower())
    if encoder is None:
        raise InputError(
            "picture.kind",
            f"{path}: not a picture file name.",
            "Give a file that ends with .png or .pgm.",
        )
    return encoder


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)
