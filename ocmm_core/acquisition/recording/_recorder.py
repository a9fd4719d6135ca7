"""Recording of frames, their replay as a source, and the last seconds in memory."""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import (
    Cycle,
    CycleVerdict,
    FrameBlock,
    SourceDescription,
    frame_dtype,
    from_records,
    to_records,
)
from ocmm_core.acquisition.recording import _recording as recording
from ocmm_core.camera import Rig
from ocmm_core.errors import AcquisitionError
from ocmm_core.named_file import NamedFile, write_rescued

SYNC_PERIOD_S = 1.0
"""Maximum time that recorded frames stay in the system's write cache."""

RESERVE_BYTES = 16 << 20
"""Disk space that a recording leaves free: points need it more than frames."""

FRAMES_PER_READ = 256
"""Most frames of one cycle of a replay; far less than any ring holds."""

_LONGEST_WAIT_S = 0.1


class FrameRecorder:
    """Append frames to a new file; close it or use it in ``with``; for one thread.

    Only `check_name` is for any thread. Each block is written at once, so a crash of the program
    loses none; the file is synced every `SYNC_PERIOD_S` and on `close`, so a power failure loses
    about that time at most. A sync can take long: record in a thread that may wait, such as the one
    that empties the ring. AcquisitionError: the file exists or cannot be written.
    """

    def __init__(self, path: Path | str, description: SourceDescription, rig: Rig) -> None:
        self.path = Path(path)
        self.frames = 0
        self._shape = (len(description.camera_serials), description.n_slots)
        self._sequence = 0
        self._size = 0
        head = recording.RecordingHead(
            schema=recording.schema_of(description.n_slots),
            source=description.name,
            rig_name=rig.name,
            rig_identity=rig.identity,
            camera_serials=description.camera_serials,
            frame_period_ns=description.frame_period_ns,
            cycle_period_ns=description.cycle_period_ns,
            started_utc=datetime.now(UTC).isoformat(timespec="microseconds"),
            simulated=description.simulated,
            n_slots=description.n_slots,
            untimed=description.untimed,
        )
        try:
            self._stream = self.path.open("x+b", buffering=0)
        except FileExistsError as error:
            raise AcquisitionError(
                "recording.exists",
                f"{self.path}: this file already exists.",
                "Choose another name; a recording is never overwritten.",
            ) from error
        except OSError as error:
            raise self._failure(error) from error
        self._name = NamedFile(self.path, os.fstat(self._stream.fileno()))
        self._rescue: BinaryIO | None = None
        self._saved: Path | None = None
        self._naming = threading.Lock()
        self._write(recording.encode_head(head))
        self._sync()

    def append(self, block: FrameBlock) -> None:
        """Add the frames of `block`.

        AcquisitionError: the disk is nearly full or fails, or the recording is closed. The
        recording then ends with the previous frames and is closed. Or the file was removed, moved
        or replaced: `close` then copies the previous frames to another one. ValueError: the block
        has another number of cameras or slots.
        """
        if block.uv.shape[1:3] != self._shape:
            msg = f"cameras and slots {block.uv.shape[1:3]} in a recording of {self._shape}"
            raise ValueError(msg)
        if self._stream.closed:
            raise AcquisitionError(
                "recording.closed", f"{self.path}: the recording is closed.", "Start a new one."
            )
        if not len(block):
            return
        lost = self.check_name()
        if lost is not None:
            raise lost
        content = recording.encode_chunk(self._sequence, to_records(block).tobytes())
        if self._free_bytes() < RESERVE_BYTES + len(content):
            self.close()
            raise AcquisitionError(
                "recording.disk_full",
                f"{self.path}: the disk is nearly full; the recording ended after {self.frames} "
                "frames, which can be replayed.",
                "Free disk space and start a new recording.",
            )
        self._write(content)
        self._sequence += 1
        self.frames += len(block)
        if time.monotonic() - self._synced_s >= SYNC_PERIOD_S:
            self._sync()

    def close(self) -> None:
        """Sync and close; idempotent; AcquisitionError if it fails or the file moved."""
        if self._stream.closed:
            return
        lost = self.check_name()
        try:
            if self._rescue is None:
                self._sync()
            else:
                self._stream.seek(0)
                shutil.copyfileobj(self._stream, self._rescue, RESERVE_BYTES)
                os.fsync(self._rescue.fileno())
                self._rescue.close()
        except OSError as error:
            raise self._failure(error) from error
        finally:
            self._stream.close()
        if lost is not None:
            raise lost

    def check_name(self) -> AcquisitionError | None:
        """Return why the path is another file, or None; a closed recording may be moved."""
        with self._naming:
            return None if self._stream.closed else self._name_loss()

    def _name_loss(self) -> AcquisitionError | None:
        loss = self._name.loss()
        if loss is None:
            return None
        saved = self._saved = loss.moved_to or self._saved or write_rescued(self.path.name, b"")
        if saved is not None and loss.moved_to is None and self._rescue is None:
            # Frames are copied when the job is closed: until then points need the disk.
            self._rescue = saved.open("r+b", buffering=0)
        where = f"Its {self.frames} frames are in {saved} when the job is closed."
        return AcquisitionError(
            "recording.lost",
            f"{self.path}: {loss.words}. {where if saved else 'No other folder takes its frames.'}",
            "Start a new recording.",
        )

    def __enter__(self) -> FrameRecorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _free_bytes(self) -> int:
        """Return the disk space left for us; if unknown, writing will fail instead."""
        try:
            disk = os.fstatvfs(self._stream.fileno())
        except OSError:
            return RESERVE_BYTES << 10
        return disk.f_bavail * disk.f_frsize

    def _write(self, content: bytes) -> None:
        rest = memoryview(content)
        try:
            while rest:
                # A full disk first accepts a part, and fails the next time.
                rest = rest[self._stream.write(rest) :]
        except OSError as error:
            self._give_up()
            raise self._failure(error) from error
        self._size += len(content)

    def _sync(self) -> None:
        try:
            os.fsync(self._stream.fileno())
        except OSError as error:
            # No retry: after a failure the system may have dropped the frames.
            self._stream.close()
            raise self._failure(error) from error
        self._synced_s = time.monotonic()

    def _give_up(self) -> None:
        try:
            os.truncate(self._stream.fileno(), self._size)
        except OSError:
            # The torn chunk stays; readers skip it.
            return
        finally:
            self._stream.close()

    def _failure(self, error: OSError) -> AcquisitionError:
        return AcquisitionError(
            "recording.not_writable",
            f"{self.path}: the recording cannot be written ({error.strerror}).",
            "Choose an existing, writable folder with enough space.",
        )


class ReplaySource:
    """A recording as source, bit for bit; AcquisitionError; `speed`: multiple, 0 unlimited."""

    def __init__(self, path: Path | str, speed: float = 0.0) -> None:
        if not 0.0 <= speed < float("inf"):
            msg = f"a replay at speed {speed}"
            raise ValueError(msg)
        self.recording = recording.Recording(path)
        """The recording; ``warning`` is set if its end was skipped."""
        head = self.recording.head
        self._description = SourceDescription(
            name=f"replay ({self.recording.path.name})",
            camera_serials=head.camera_serials,
            frame_period_ns=head.frame_period_ns,
            cycle_period_ns=head.cycle_period_ns,
            live=False,
            simulated=head.is_simulated,
            n_slots=head.n_slots,
            untimed=head.untimed,
        )
        self._speed = speed
        self._next = 0
        self._last_counter: int | None = None
        self._clock: tuple[float, int] | None = None

    @property
    def description(self) -> SourceDescription:
        return self._description

    def open(self) -> None:
        self.seek(0)

    def seek(self, index: int) -> None:
        """Continue with frame `index`; IndexError if it is neither a frame nor the end."""
        if not 0 <= index <= len(self.recording):
            msg = f"frame {index} of a recording with {len(self.recording)} frames"
            raise IndexError(msg)
        self._next = index
        self._last_counter = None
        self._clock = None

    def read(self) -> Cycle:
        """Return the next frames, all of one recorded block; none while none is due."""
        if self._next >= len(self.recording):
            return Cycle(CycleVerdict.GOOD, finished=True)
        block = self.recording.read(self._next, FRAMES_PER_READ)
        if self._speed > 0.0 and not self._due(int(block.time_ns[-1])):
            return Cycle(CycleVerdict.GOOD)
        lost = int(np.sum(np.diff(block.counter) - 1))
        if self._last_counter is not None:
            lost += int(block.counter[0]) - self._last_counter - 1
        self._last_counter = int(block.counter[-1])
        self._next += len(block)
        return Cycle(
            CycleVerdict.GOOD,
            frames=block,
            frames_lost=max(lost, 0),
            finished=self._next == len(self.recording),
        )

    def close(self) -> None:
        """Close the file; idempotent."""
        self.recording.close()

    def _due(self, time_ns: int) -> bool:
        if self._clock is None:
            self._clock = (time.monotonic(), time_ns)
        began_s, first_ns = self._clock
        wait_s = began_s + (time_ns - first_ns) * 1e-9 / self._speed - time.monotonic()
        if wait_s > 0.0:
            time.sleep(min(wait_s, _LONGEST_WAIT_S))
        return wait_s <= _LONGEST_WAIT_S


HISTORY_S = 30.0
MOST_BYTES = 96 << 20
"""30 s of two cameras at 8 kHz take 67 MB; more cameras shorten the history."""


class FrameHistory:
    """Keep the newest frames, bounded in time and memory.

    Frames are copied into one circular array. Keeping the incoming blocks would avoid the copy, but
    fragments the heap: a window grew by 18 MiB an hour. One thread appends; reading is thread-safe.
    """

    def __init__(
        self, description: SourceDescription, rig: Rig, most_bytes: int = MOST_BYTES
    ) -> None:
        self.description = description
        self._rig = rig
        self._span_ns = round(HISTORY_S * 1e9)
        layout = frame_dtype(len(description.camera_serials), description.n_slots)
        frames = self._span_ns // max(1, description.frame_period_ns) + 1
        # Pages are only committed when frames are written to them.
        self._ring = np.zeros(max(1, min(frames, most_bytes // layout.itemsize)), layout)
        self._next = self._count = self._touched = 0
        self._lock = threading.Lock()

    def append(self, block: FrameBlock) -> None:
        """Append a block, and drop old frames."""
        records = to_records(block)
        with self._lock:
            capacity = len(self._ring)
            records = records[-capacity:]
            if not len(records) or not capacity:
                return
            newest = self._ring["time_ns"][self._next - 1]
            if self._count and records["time_ns"][-1] < newest:
                # The bus clock was reset: earlier frames are not comparable.
                self._count = 0
            first = min(len(records), capacity - self._next)
            self._ring[self._next : self._next + first] = records[:first]
            self._ring[: len(records) - first] = records[first:]
            self._next = (self._next + len(records)) % capacity
            self._count = min(capacity, self._count + len(records))
            self._touched = max(self._touched, self._count)

    def clear(self) -> None:
        """Drop all frames and stop keeping new ones."""
        with self._lock:
            self._ring = self._ring[:0].copy()
            self._next = self._count = self._touched = 0

    @property
    def seconds(self) -> float:
        """Return the current time span, s."""
        with self._lock:
            times = self._ring["time_ns"][self._places()[[0, -1]]] if self._count else np.zeros(2)
        return float(times[-1] - times[0]) * 1e-9

    @property
    def size_bytes(self) -> int:
        """Return the memory in use."""
        return self._touched * self._ring.itemsize

    def blocks(self) -> Sequence[FrameBlock]:
        """Return copies of the kept frames, oldest first."""
        with self._lock:
            records = self._ring[self._places()]
        return [
            from_records(records[first : first + FRAMES_PER_READ])
            for first in range(0, len(records), FRAMES_PER_READ)
        ]

    def _places(self) -> NDArray[np.int64]:
        """Return the indices of kept frames, oldest first; requires the lock."""
        places = np.arange(self._next - self._count, self._next) % max(1, len(self._ring))
        if not len(places):
            return places
        # Lost frames leave room for frames older than the span.
        times = self._ring["time_ns"][places]
        return places[np.searchsorted(times, times[-1] - self._span_ns) :]

    def write(self, path: Path, blocks: Sequence[FrameBlock] | None = None) -> int:
        """Write a recording; return its frame count; AcquisitionError if it cannot be."""
        kept = self.blocks() if blocks is None else blocks
        with FrameRecorder(path, self.description, self._rig) as recorder:
            for block in kept:
                recorder.append(block)
            return recorder.frames
