"""Non-volatile memory, errors and black image of a software camera.

Memory: named blocks with checksums. Errors: register, diagnosis history and emergencies. The black
image (object 0x8020) is made in the background: it exceeds time limits.
"""

from __future__ import annotations

import hashlib
import os
import struct
import threading
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.failure import contained
from ocmm_core.fieldbus.device import (
    BLACK_IMAGE,
    DATA_BYTES,
    ERROR_REGISTER,
    HISTORY,
    HISTORY_FIRST,
    HISTORY_MESSAGES,
    BlackCommand,
    BlackImage,
    DiagnosisMessage,
    Work,
)
from ocmm_sim.slave._frames import SensorControl
from ocmm_sim.slave._sdo_values import Abort, AbortError, Address

_CRC_BYTES = 4


class CameraStore:
    """Flash memory of one camera: a file per block in `folder`, or in memory if None.

    Pass the same object after a power cycle.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._blocks: dict[str, bytes] = {}

    def save(self, name: str, content: bytes) -> None:
        """Store `content` atomically; raise StorageError on failure."""
        block = zlib.crc32(content).to_bytes(_CRC_BYTES, "little") + content
        if self._folder is None:
            self._blocks[name] = block
            return
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_atomic(self._path(self._folder, name), block)
        except OSError as error:
            raise _unwritable(name, error) from error

    def load(self, name: str) -> bytes | None:
        """Return the content, or None; raise StorageError if damaged."""
        if self._folder is None:
            block = self._blocks.get(name)
        else:
            path = self._path(self._folder, name)
            block = read_bytes(path) if path.exists() else None
        if block is None:
            return None
        content = block[_CRC_BYTES:]
        if zlib.crc32(content).to_bytes(_CRC_BYTES, "little") != block[:_CRC_BYTES]:
            raise StorageError(
                "camera.stored",
                f"The {name} that the camera keeps is damaged.",
                "Write or measure it again.",
            )
        return content

    def forget(self, name: str) -> None:
        """Delete the content; raise StorageError on failure."""
        self._blocks.pop(name, None)
        if self._folder is None:
            return
        try:
            self._path(self._folder, name).unlink(missing_ok=True)
        except OSError as error:
            raise _unwritable(name, error) from error

    @staticmethod
    def _path(folder: Path, name: str) -> Path:
        return folder / f"{name.replace(' ', '_')}.bin"


def _unwritable(name: str, error: OSError) -> StorageError:
    return StorageError(
        "camera.stored",
        f"The camera cannot keep its {name} ({error.strerror}).",
        "Check the folder of the software camera.",
    )


_NEWEST, _ACKNOWLEDGED, _AVAILABLE, _FLAGS = 2, 3, 4, 5
_SEND = 1


class Diagnosis:
    """Errors of the camera since power-on.

    ``clock`` returns bus time, ns; ``send`` gets code, error register and five bytes.
    """

    def __init__(self, clock: Callable[[], int], send: Callable[[int, int, bytes], object]) -> None:
        self._clock = clock
        self._send = send
        self.register = 0
        self.count = 0
        self._messages: dict[int, bytes] = {}
        self._newest = self._acknowledged = 0
        self._flags = _SEND

    @property
    def pending(self) -> bool:
        """Return whether the newest message is unacknowledged."""
        return self._newest != self._acknowledged

    def report(self, code: int, register: int, data: bytes) -> None:
        """Record an error, or with code 0 its end, and notify the master."""
        data = data[:DATA_BYTES].ljust(DATA_BYTES, b"\x00")
        self.register = register
        self.count += 1
        if self._newest:
            self._newest = HISTORY_FIRST + (self._newest - HISTORY_FIRST + 1) % HISTORY_MESSAGES
        else:
            self._newest = HISTORY_FIRST
        if self._newest == self._acknowledged:
            # The acknowledged message is overwritten.
            self._acknowledged = 0
        message = DiagnosisMessage(code, self._clock(), register, data)
        self._messages[self._newest] = message.encode()
        if self._flags & _SEND:
            self._send(code, register, data)

    def live(self) -> dict[Address, Callable[[], bytes]]:
        entries: dict[Address, Callable[[], bytes]] = {
            (ERROR_REGISTER, 0): lambda: bytes([self.register]),
            (HISTORY, _NEWEST): lambda: bytes([self._newest]),
            (HISTORY, _ACKNOWLEDGED): lambda: bytes([self._acknowledged]),
            (HISTORY, _AVAILABLE): lambda: bytes([self.pending]),
        }
        for place in range(HISTORY_FIRST, HISTORY_FIRST + HISTORY_MESSAGES):
            entries[HISTORY, place] = lambda place=place: self._messages.get(place, b"")  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
        return entries

    def written(self) -> dict[Address, Callable[[bytes], object]]:
        return {(HISTORY, _ACKNOWLEDGED): self._acknowledge, (HISTORY, _FLAGS): self._set_flags}

    def _acknowledge(self, value: bytes) -> None:
        place = value[0]
        if place == 0:
            self._messages.clear()
            self._newest = self._acknowledged = 0
        elif place in self._messages:
            self._acknowledged = place
        else:
            raise AbortError(Abort.VALUE)

    def _set_flags(self, value: bytes) -> None:
        (self._flags,) = struct.unpack("<H", value)


T = TypeVar("T")


class BackgroundJob(Generic[T]):
    """Work on its own thread."""

    def __init__(self, name: str, work: Callable[[], T]) -> None:
        self.result: T | None = None
        self.error: OcmmError | None = None
        self._work = work
        self._thread = threading.Thread(target=self._run, name=name)
        self._thread.start()

    def finished(self) -> bool:
        """Return whether it ended, successfully or not."""
        if self._thread.is_alive():
            return False
        self._thread.join()
        return True

    def _run(self) -> None:
        _lower_priority()
        try:
            self.result = self._work()
        except Exception as error:
            self.error = contained(error, "The work of a software camera")


def _lower_priority() -> None:
    """Drop the real-time priority inherited from the thread that answers the master."""
    if hasattr(os, "sched_setscheduler"):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


STORED_NAME = "black image"
_SHAPE = struct.Struct("<HH")
_COMMAND, _FRAMES, _STATE, _PROGRESS, _IMAGES, _SHA, _CRC, _MEAN = range(1, 9)


@dataclass(frozen=True, slots=True)
class _InUse:
    """A black image with its object values."""

    pixels: NDArray[np.uint16]
    sha256: bytes
    crc: int
    mean: float

    @classmethod
    def from_pixels(cls, pixels: NDArray[np.uint16]) -> _InUse:
        content = np.ascontiguousarray(pixels, "<u2").tobytes()
        digest = hashlib.sha256(content).digest()
        return cls(pixels, digest, zlib.crc32(content), float(pixels.mean()))

    def block(self) -> bytes:
        """Return its stored form."""
        height, width = self.pixels.shape
        return _SHAPE.pack(width, height) + np.ascontiguousarray(self.pixels, "<u2").tobytes()

    @classmethod
    def from_block(cls, block: bytes) -> _InUse:
        width, height = _SHAPE.unpack_from(block)
        if len(block) != _SHAPE.size + 2 * width * height:
            raise StorageError(
                "camera.stored", "The stored black image is incomplete.", "Measure it again."
            )
        pixels = np.frombuffer(block, "<u2", offset=_SHAPE.size).reshape(height, width)
        return cls.from_pixels(pixels.astype(np.uint16))


class BlackImages:
    """The black image objects and their work.

    ``darken`` is called with the number of exposures without LEDs; it returns their duration, ns.
    """

    def __init__(
        self,
        sensor: SensorControl,
        camera: int,
        store: CameraStore,
        darken: Callable[[int], int],
        failed: Callable[[OcmmError], object],
    ) -> None:
        self._sensor = sensor
        self._camera = camera
        self._store = store
        self._darken = darken
        self._failed = failed
        self._frames = 64
        self._state = Work.IDLE
        self._in_use: _InUse | None = None
        self._stored_sha: bytes | None = None
        self._job: BackgroundJob[_InUse | None] | None = None
        self._began_ns = self._takes_ns = 0
        self._now_ns = 0

    def switch_on(self) -> None:
        """Use the stored image as at power-on; without one the factory image stays."""
        try:
            block = self._store.load(STORED_NAME)
            if block is None:
                return
            loaded = _InUse.from_block(block)
            self._use(loaded)
        except OcmmError as error:
            self._failed(error)
            return
        self._stored_sha = loaded.sha256

    def work(self, now_ns: int) -> bool:
        """Process finished work; return whether there was any."""
        self._now_ns = now_ns
        job = self._job
        if job is None or now_ns - self._began_ns < self._takes_ns or not job.finished():
            return False
        self._job = None
        error = job.error
        if error is None:
            try:
                # Not in the job: only the thread that makes the frames may set the sensor.
                self._use(job.result)
            except OcmmError as refused:
                error = refused
        self._state = Work.DONE if error is None else Work.FAILED
        if error is not None:
            self._failed(error)
        return True

    def live(self) -> dict[Address, Callable[[], bytes]]:
        """Return readers of the entries."""
        return {
            (BLACK_IMAGE, _STATE): lambda: bytes([self._state]),
            (BLACK_IMAGE, _PROGRESS): lambda: bytes([self._percent()]),
            (BLACK_IMAGE, _IMAGES): lambda: bytes([self._images()]),
            (BLACK_IMAGE, _SHA): lambda: b"" if self._in_use is None else self._in_use.sha256,
            (BLACK_IMAGE, _CRC): lambda: struct.pack(
                "<I", 0 if self._in_use is None else self._in_use.crc
            ),
            (BLACK_IMAGE, _MEAN): lambda: struct.pack(
                "<H", 0 if self._in_use is None else min(0xFFFF, round(10 * self._in_use.mean))
            ),
        }

    def written(self) -> dict[Address, Callable[[bytes], object]]:
        """Return the actions for written entries."""
        return {(BLACK_IMAGE, _COMMAND): self._command, (BLACK_IMAGE, _FRAMES): self._set_frames}

    def _set_frames(self, value: bytes) -> None:
        (self._frames,) = struct.unpack("<H", value)

    def _command(self, value: bytes) -> None:
        if self._job is not None:
            raise AbortError(Abort.BUSY)
        command = BlackCommand(value[0])
        if command is BlackCommand.MEASURE:
            frames = self._frames
            self._start(
                lambda: _InUse.from_pixels(self._sensor.black_image(self._camera, frames)),
                self._darken(frames),
            )
        elif command is BlackCommand.STORE:
            in_use = self._in_use
            if in_use is None:
                raise AbortError(Abort.NO_DATA)
            self._start(lambda: self._keep(in_use), 0)
        elif command is BlackCommand.LOAD:
            if self._stored_sha is None:
                raise AbortError(Abort.NO_DATA)
            self._start(self._load, 0)
        else:
            self._start(self._clear, 0)

    def _start(self, work: Callable[[], _InUse | None], takes_ns: int) -> None:
        self._state = Work.BUSY
        self._began_ns, self._takes_ns = self._now_ns, takes_ns
        self._job = BackgroundJob(STORED_NAME, work)

    def _keep(self, in_use: _InUse) -> _InUse:
        self._store.save(STORED_NAME, in_use.block())
        self._stored_sha = in_use.sha256
        return in_use

    def _load(self) -> _InUse:
        block = self._store.load(STORED_NAME)
        if block is None:
            raise StorageError(
                "camera.stored", "There is no stored black image.", "Measure and store one."
            )
        return _InUse.from_block(block)

    def _clear(self) -> None:
        self._store.forget(STORED_NAME)
        self._stored_sha = None

    def _use(self, image: _InUse | None) -> None:
        if image is not self._in_use or image is None:
            self._sensor.set_black_image(self._camera, None if image is None else image.pixels)
        self._in_use = image

    def _images(self) -> BlackImage:
        images = BlackImage(0)
        if self._in_use is not None:
            images |= BlackImage.IN_USE
            if self._in_use.sha256 == self._stored_sha:
                images |= BlackImage.SAME
        if self._stored_sha is not None:
            images |= BlackImage.STORED
        return images

    def _percent(self) -> int:
        if self._state is not Work.BUSY:
            return 100 if self._state is Work.DONE else 0
        if not self._takes_ns:
            return 0
        return max(0, min(99, 100 * (self._now_ns - self._began_ns) // self._takes_ns))
