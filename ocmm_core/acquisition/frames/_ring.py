"""Fixed-size ring of frames in shared memory: one writer, one reader.

The ring is a file mapped by both sides (in ``/dev/shm`` if available), so that the writer may be
another process. The writer of a live source never waits; a reader that falls behind by more than
the capacity loses the oldest frames, which are counted. Writers of other sources first check
`free`.

The header holds int64 words (aligned, written atomically): positions count frames since the start
and never wrap. A frame is published by advancing ``WRITTEN`` after its bytes are in place; before
the first byte the writer advances ``RESERVED``, so that a reader can tell which old frames may be
half overwritten. The header also has the counters with the verdict of every cycle. Another process
reads them during writing, and the writer may be killed at any moment, so there are two pages: the
writer fills the inactive one and then activates it with one word.
"""

from __future__ import annotations

import errno
import logging
import mmap
import os
import struct
import tempfile
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames._frames import FrameBlock, frame_dtype, from_records
from ocmm_core.camera import MAX_CAMERAS, MAX_SLOTS, USUAL_SLOTS
from ocmm_core.cleanup import clear, hold
from ocmm_core.errors import AcquisitionError
from ocmm_core.host import HOST
from ocmm_core.side_files import open_guarded

NEWEST_PAGE = 34
"""Header word: number of written pages; modulo 2 the newest one."""
_FIRST_WORD = 40
_PAGES = 2


class Books(NamedTuple):
    """Counters since the start."""

    elapsed: int = 0
    good: int = 0
    late: int = 0
    lost: int = 0
    bad: int = 0
    """`elapsed`, `good`, `late`, `lost`, `bad`: cycles; ``good + late + lost + bad == elapsed``."""
    frames: int = 0
    frames_lost: int = 0


def read_books(words: memoryview) -> Books:
    """Return the newest page, consistent despite concurrent writing."""
    while True:
        number = words[NEWEST_PAGE]
        begin = _FIRST_WORD + number % _PAGES * len(Books._fields)
        books = Books(*words[begin : begin + len(Books._fields)].tolist())
        # The writer reuses this page only after publishing the other one.
        if words[NEWEST_PAGE] == number:
            return books


_MAGIC = 0x4F434D4D52494E47
_LAYOUT = 5
_HEAD_WORDS = 64
_WORD = struct.Struct("q")
_TEXT_BYTES = 1024
REPORT_BYTES = 131072
"""Space of the writer's report."""
_REPORT_OFFSET = 4096
_DATA_OFFSET = _REPORT_OFFSET + REPORT_BYTES
DEFAULT_CAPACITY = 65536
"""Frames; eight seconds at 8 kHz."""
_MOST_BYTES = 1 << 28
"""Size limit without explicit capacity: 16 cameras get all with 8 slots, with 64 two seconds."""
_PREFIX = "ocmm-ring-"
_TRIES = 10

_log = logging.getLogger(__name__)


class RingHeaderField(IntEnum):
    """Header words, all int64; counters are in `_ring`."""

    MAGIC = 0
    LAYOUT = 1
    N_CAMERAS = 2
    CAPACITY = 3
    WRITTEN = 4
    READ = 5
    STATE = 6
    STOP_REASON = 7
    STOP_REQUEST = 8
    OVERRUN = 16
    HEARTBEAT = 17
    TEXT_LENGTH = 18
    FRAME_PERIOD_NS = 19
    RESERVED = 20
    REPORT_SEQUENCE = 21
    REPORT_LENGTH = 22
    LAST_FRAMES_NS = 23
    """Time of the last frames, `time.monotonic_ns` (common to all processes); 0 before."""
    INTERNAL = 24
    """1 after an unexpected error of the writer."""
    READS = 25
    """Number of reads; 0 without a reader."""
    BUS_NOW_NS = 26
    """Time of a virtual bus while it advances per cycle (`BUS_STEPS`)."""
    BUS_OFFSET_NS = 27
    """Offset of a virtual bus from `time.monotonic_ns` while it flows."""
    BUS_STEPS = 28
    FRAMES_TAKEN = 29
    """Frames received by software cameras, which write this word and the next."""
    FRAMES_ANSWERED = 30
    PACE_PPM = 31
    """Bus time over real time during the last second, 1e-6; 0: real time."""
    MEAN_PACE_PPM = 32
    """The same since the start."""
    N_SLOTS = 33


class FrameRing:
    """The mapped ring, from `create` (owner; `close` removes the file) or `attach` (other side)."""

    def __init__(self, path: Path, *, owner: bool) -> None:
        self.path = path
        self._owner = owner
        try:
            descriptor = open_guarded(path, follow=False, flags=os.O_RDWR)
            with open(descriptor, "r+b") as stream:  # noqa: PTH123 - the guard opens it
                if os.fstat(stream.fileno()).st_size < _DATA_OFFSET:
                    raise _no_ring(path)
                # Held while mapped; released by the kernel when the process ends.
                if owner and not hold(stream.fileno(), path):
                    raise FileNotFoundError(errno.ENOENT, "it was removed", str(path))
                self._map = mmap.mmap(stream.fileno(), 0)
        except OSError as error:
            raise AcquisitionError(
                "ring.missing",
                f"{path}: the frame ring cannot be opened ({error.strerror}).",
                "Open the job again.",
            ) from error
        # A memoryview, because an array creates a number object per word; each word is accessed
        # atomically.
        self._words = memoryview(self._map)[: _HEAD_WORDS * _WORD.size].cast("q")
        if not self._has_this_layout():
            self._words.release()
            self._map.close()
            raise _no_ring(path)
        self.n_cameras = self.word(RingHeaderField.N_CAMERAS)
        self.n_slots = self.word(RingHeaderField.N_SLOTS)
        self.capacity = self.word(RingHeaderField.CAPACITY)
        layout = frame_dtype(self.n_cameras, self.n_slots)
        self._frames: NDArray[np.void] = np.frombuffer(
            self._map, dtype=layout, count=self.capacity, offset=_DATA_OFFSET
        )
        # Cached; frames are written a thousand times a second.
        names = self._frames.dtype.names or ()
        self._columns = tuple((name, self._frames[name]) for name in names)

    @classmethod
    def create(
        cls, n_cameras: int, capacity: int | None = None, n_slots: int = USUAL_SLOTS
    ) -> FrameRing:
        """Create a ring as owner; default `DEFAULT_CAPACITY` frames, fewer if they are large."""
        frame_bytes = frame_dtype(n_cameras, n_slots).itemsize
        if capacity is None:
            capacity = min(DEFAULT_CAPACITY, _MOST_BYTES // frame_bytes)
        folder = HOST.shared_memory()
        orphans = clear(Path(folder or tempfile.gettempdir()).glob(f"{_PREFIX}*"))
        if orphans:
            _log.info("Frame rings of killed programs removed: %d.", orphans)
        size = _DATA_OFFSET + capacity * frame_bytes
        head = np.zeros(_HEAD_WORDS, dtype="<i8")
        head[RingHeaderField.MAGIC], head[RingHeaderField.LAYOUT] = _MAGIC, _LAYOUT
        head[RingHeaderField.N_CAMERAS], head[RingHeaderField.CAPACITY] = n_cameras, capacity
        head[RingHeaderField.N_SLOTS] = n_slots
        for attempt in range(1, _TRIES + 1):
            name = _new_file(folder, size, head.tobytes())
            try:
                return cls(Path(name), owner=True)
            except AcquisitionError:
                # Another program, just starting, took it for an orphan; see `cleanup`.
                Path(name).unlink(missing_ok=True)
                if attempt == _TRIES:
                    raise
        raise AssertionError

    @classmethod
    def attach(cls, path: Path | str) -> FrameRing:
        """Map a ring created by another process."""
        return cls(Path(path), owner=False)

    def word(self, which: RingHeaderField) -> int:
        return self._words[which]

    def set_word(self, which: RingHeaderField, value: int) -> None:
        """Set one header word; each word has one writer."""
        self._words[which] = value

    @property
    def books(self) -> Books:
        """Return the cycle counters as one consistent page."""
        return read_books(self._words)

    def enter(self, **amounts: int) -> None:
        """Add to the counters; only the writer of the ring may call this."""
        words, number = self._words, self._words[NEWEST_PAGE] + 1
        size = len(Books._fields)
        now, then = (_FIRST_WORD + page % _PAGES * size for page in (number - 1, number))
        for place, name in enumerate(Books._fields):
            words[then + place] = words[now + place] + amounts.get(name, 0)
        # Last: a writer killed before this leaves the page in use as it was.
        words[NEWEST_PAGE] = number

    def set_text(self, text: str) -> None:
        """Set the writer's message, such as the reason for stopping."""
        content = text.encode("utf-8")[:_TEXT_BYTES]
        start = _HEAD_WORDS * 8
        self._map[start : start + len(content)] = content
        self._words[RingHeaderField.TEXT_LENGTH] = len(content)

    def text(self) -> str:
        """Return the writer's message, or an empty text."""
        start = _HEAD_WORDS * 8
        content = self._map[start : start + self.word(RingHeaderField.TEXT_LENGTH)]
        return content.decode("utf-8", errors="replace")

    def set_report(self, content: bytes) -> None:
        """Publish a report of the writer; overlong ones are dropped."""
        if len(content) > REPORT_BYTES:
            return
        # Odd during writing, so that readers never mix two reports.
        self._words[RingHeaderField.REPORT_SEQUENCE] += 1
        self._map[_REPORT_OFFSET : _REPORT_OFFSET + len(content)] = content
        self._words[RingHeaderField.REPORT_LENGTH] = len(content)
        self._words[RingHeaderField.REPORT_SEQUENCE] += 1

    def report(self) -> bytes:
        """Return the last report; empty if absent or being written."""
        before = self.word(RingHeaderField.REPORT_SEQUENCE)
        content = self._map[
            _REPORT_OFFSET : _REPORT_OFFSET + self.word(RingHeaderField.REPORT_LENGTH)
        ]
        if before % 2 or before != self.word(RingHeaderField.REPORT_SEQUENCE):
            return b""
        return content

    def free(self) -> int:
        """Return the number of frames that can be written without loss to the reader."""
        return self.capacity - (
            self.word(RingHeaderField.WRITTEN) - self.word(RingHeaderField.READ)
        )

    def write(self, block: FrameBlock) -> None:
        """Publish frames; raise AcquisitionError if their number or shape does not fit."""
        shape = block.uv.shape[1:3]
        count = len(block)
        if count > self.capacity or shape != (self.n_cameras, self.n_slots):
            raise AcquisitionError(
                "ring.block",
                f"A block of {count} frames of {shape[0]} cameras with {shape[1]} slots does "
                f"not fit into a ring of {self.capacity} frames of {self.n_cameras} cameras with "
                f"{self.n_slots}.",
                "Choose the rig the source was made for, then open the job again.",
            )
        written = self.word(RingHeaderField.WRITTEN)
        self._words[RingHeaderField.RESERVED] = written + count
        start = written % self.capacity
        first = min(count, self.capacity - start)
        if first == count:
            for name, places in self._columns:
                places[start : start + count] = getattr(block, name)
        else:
            for name, places in self._columns:
                values = getattr(block, name)
                places[start:] = values[:first]
                places[: count - first] = values[first:]
        self._words[RingHeaderField.WRITTEN] = written + count

    def read(self, limit: int) -> FrameBlock | None:
        """Return up to `limit` oldest unread frames, or None; ``OVERRUN`` counts overwritten."""
        self._words[RingHeaderField.READS] += 1
        # Read before WRITTEN, so that a write in between can only make it too small, which the
        # second check below detects.
        reserved = self.word(RingHeaderField.RESERVED)
        written = self.word(RingHeaderField.WRITTEN)
        read = self.word(RingHeaderField.READ)
        if reserved - read > self.capacity:
            self._skip(reserved - self.capacity - read)
            read = reserved - self.capacity
        count = min(limit, self.capacity, written - read)
        if count <= 0:
            return None
        start = read % self.capacity
        first = min(count, self.capacity - start)
        records = np.concatenate(
            [self._frames[start : start + first], self._frames[: count - first]]
        )
        overtaken = self.word(RingHeaderField.RESERVED) - self.capacity - read
        self._words[RingHeaderField.READ] = read + count
        if overtaken > 0:
            lost = min(overtaken, count)
            self._words[RingHeaderField.OVERRUN] += lost
            records = records[lost:]
        return from_records(records) if len(records) else None

    def close(self) -> None:
        """Unmap; the owner also removes the file; idempotent."""
        if self._map.closed:
            return
        # The views must be released before the map can be closed.
        words = self._words
        self._words = memoryview(bytearray(_HEAD_WORDS * _WORD.size)).cast("q")
        words.release()
        self._frames = np.zeros(0, dtype=np.void(1).dtype)
        self._columns = ()
        self._map.close()
        if self._owner:
            self.path.unlink(missing_ok=True)

    def _has_this_layout(self) -> bool:
        if (
            self.word(RingHeaderField.MAGIC) != _MAGIC
            or self.word(RingHeaderField.LAYOUT) != _LAYOUT
        ):
            return False
        n_cameras, n_slots, capacity = (
            self.word(RingHeaderField.N_CAMERAS),
            self.word(RingHeaderField.N_SLOTS),
            self.word(RingHeaderField.CAPACITY),
        )
        if not (1 <= n_cameras <= MAX_CAMERAS and 1 <= n_slots <= MAX_SLOTS and capacity >= 1):
            return False
        frame_bytes = frame_dtype(n_cameras, n_slots).itemsize
        return len(self._map) == _DATA_OFFSET + capacity * frame_bytes

    def _skip(self, count: int) -> None:
        self._words[RingHeaderField.READ] += count
        self._words[RingHeaderField.OVERRUN] += count


def _new_file(folder: Path | None, size: int, head: bytes) -> str:
    """Return the name of a new file with this header and its full size reserved."""
    name = ""
    try:
        descriptor, name = tempfile.mkstemp(prefix=_PREFIX, dir=folder)
        try:
            HOST.reserve(descriptor, size)
            os.write(descriptor, head)
        finally:
            os.close(descriptor)
    except OSError as error:
        if name:
            Path(name).unlink(missing_ok=True)
        place = folder or tempfile.gettempdir()
        raise AcquisitionError(
            "ring.no_room",
            f"{place}: no room for the frame ring of {(size >> 20) + 1} MB ({error.strerror}).",
            "Make it writable with at least 512 MB (sudo mount -o remount,rw,size=512M /dev/shm), "
            "and check ulimit -f.",
        ) from error
    return name


def _no_ring(path: Path) -> AcquisitionError:
    return AcquisitionError(
        "ring.layout", f"{path}: not a frame ring of this version.", "Open the job again."
    )
