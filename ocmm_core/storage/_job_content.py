"""The only access for readers of jobs: content of a job file at one moment, with its log.

File and write-ahead log are read by descriptors of regular files and joined in memory. Nothing next
to the job is made, changed or run.

The log is read as SQLite recovers it. A frame counts if it carries the salts of the head and its
checksum continues that of the frame before; a step counts up to its commit frame (SQLite, "WAL-mode
File Format"). Reading the log here needs no second file and shows an incomplete end.

The checksum is linear modulo 2^32: with the pairs of words x, y of a frame and M = [[1, 1], [1, 2]]
the next state is M s + (x, x + y). So the contribution of each frame is one product with powers of
M, computed for many frames at a time.
"""

from __future__ import annotations

import contextlib
import os
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.named_file import FileIdentity
from ocmm_core.side_files import SIDE_FILES, Trusted, open_guarded, refuse_side_files
from ocmm_core.storage._faults import no_job
from ocmm_core.storage._guard import HELD, LARGEST_FILE

_HEAD = struct.Struct(">8I")
_FRAME = struct.Struct(">6I")
HEAD_SIZE = _HEAD.size
_LOG_MAGIC, _VERSION = 0x377F0682, 3007000
_MASK = 0xFFFFFFFF
_FEWEST, _MOST = 512, 65536
"""Bytes of a page."""
_TOGETHER = 1 << 20
"""Bytes read and checked at a time."""
_OLDER = 1 << 16
"""Range of the salt of older generations behind the current one: it grows by one for each."""

Words = npt.NDArray[np.uint32]
Read = Callable[[int, int], bytes]
"""Bytes from an offset on, fewer at the end."""


@dataclass(frozen=True, slots=True)
class LogPages:
    """Complete steps of a log."""

    pages: dict[int, bytes]
    """Newest content of each page by its number, from 1."""
    page_size: int = 0
    n_pages: int = 0
    """Bytes of a page, and pages of the file after the last step; 0 without a complete step."""
    head: bytes = b""
    """Head of the log: changes when the log starts again."""
    left_out: str = ""
    """Sentence about an incomplete end of the log; empty without one."""


def read_log(read: Read, size: int, most: int) -> LogPages:
    """Return the complete steps of a log of ``size`` bytes; ``most`` limits the result."""
    if not size:
        return LogPages({})
    head = read(0, HEAD_SIZE)
    fields = _HEAD.unpack(head) if len(head) == HEAD_SIZE else None
    if fields is None or not _is_head(fields, head):
        return LogPages(
            {},
            head=head,
            left_out=f"The write-ahead log has no valid head: its {size:,} bytes cannot be read, "
            "and steps that were stored in them are missing.",
        )
    page_size, order = fields[2], ">" if fields[0] & 1 else "<"
    salts, state = (fields[4], fields[5]), (fields[6], fields[7])
    taken: dict[int, bytes] = {}
    pending: dict[int, bytes] = {}
    offset, whole, n_pages = HEAD_SIZE, HEAD_SIZE, 0
    frame_size = _FRAME.size + page_size
    together = max(_TOGETHER // frame_size, 1) * frame_size
    stale = False
    while block := read(offset, together):
        n_frames = len(block) // frame_size
        parts = _contributions(block[: n_frames * frame_size], page_size, order)
        for k in range(n_frames):
            at = k * frame_size
            number, commit, *rest = _FRAME.unpack_from(block, at)
            state = _next(state, parts[k], page_size)
            fits = (rest[0], rest[1]) == salts and (rest[2], rest[3]) == state
            if not fits or not 0 < number <= most // page_size or commit > most // page_size:
                stale = 0 < (salts[0] - rest[0]) & _MASK < _OLDER
                break
            pending[number] = block[at + _FRAME.size : at + frame_size]
            if commit:
                taken.update(pending)
                pending.clear()
                n_pages, whole = commit, offset + at + frame_size
        else:
            offset += n_frames * frame_size
            if len(block) == together:
                continue
        break
    # Behind the newest step lie frames of an older generation, of which nothing is missing.
    left = 0 if stale and not pending else size - whole
    return LogPages(taken, page_size, n_pages, head, _left_out(left) if left else "")


def _left_out(left: int) -> str:
    return (
        f"The last {left:,} bytes of the write-ahead log are no complete step: what was being "
        "stored when writing stopped is not in the job. Compare its last point with your notes."
    )


def _is_head(fields: tuple[int, ...], head: bytes) -> bool:
    magic, version, page_size = fields[:3]
    if magic | 1 != _LOG_MAGIC | 1 or version != _VERSION:
        return False
    if not _FEWEST <= page_size <= _MOST or page_size & (page_size - 1):
        return False
    words = np.frombuffer(head[:24], dtype=">u4" if magic & 1 else "<u4")
    s0 = s1 = 0
    for x, y in words.reshape(-1, 2).tolist():
        s0 = (s0 + x + s1) & _MASK
        s1 = (s1 + y + s0) & _MASK
    return fields[6:] == (s0, s1)


def _contributions(block: bytes, page_size: int, order: str) -> list[tuple[int, int]]:
    """Return the contribution of each frame to the checksum."""
    if not block:
        return []
    words = np.frombuffer(block, dtype=f"{order}u4").reshape(-1, (_FRAME.size + page_size) // 4)
    weights, _ = _powers(page_size)
    # The checksum covers number and commit of the frame, and the page.
    sums = words[:, :2].astype(np.uint32) @ weights[:2]
    sums += words[:, _FRAME.size // 4 :].astype(np.uint32) @ weights[2:]
    return [(int(a), int(b)) for a, b in sums]


def _next(state: tuple[int, int], part: tuple[int, int], page_size: int) -> tuple[int, int]:
    a, b, c = _powers(page_size)[1]
    return (
        (a * state[0] + b * state[1] + part[0]) & _MASK,
        (b * state[0] + c * state[1] + part[1]) & _MASK,
    )


@lru_cache(maxsize=4)
def _powers(page_size: int) -> tuple[Words, tuple[int, int, int]]:
    """Return the weights of the words of a frame, and the power of M that a frame applies."""
    n = (8 + page_size) // 8
    a, b, c = 1, 0, 1
    weights = np.empty((2 * n, 2), dtype=np.uint32)
    for k in reversed(range(n)):
        # M^(n-1-k) = [[a, b], [b, c]], applied to (x, x + y).
        weights[2 * k] = ((a + b) & _MASK, (b + c) & _MASK)
        weights[2 * k + 1] = (b, c)
        a, b, c = (a + b) & _MASK, (b + c) & _MASK, (b + 2 * c) & _MASK
    return weights, (a, b, c)


_TRIES = 50
_PAUSE_S = 0.02
_SETTLED_NS = 1_000_000_000
"""A more recently written file may change again without a new modification time."""
_AT_ONCE = 4 << 20
_MAGIC = b"SQLite format 3\0"
_MOST_LOG = next(one.most for one in SIDE_FILES[Trusted.JOB] if one.name == "{}-wal")


@dataclass(frozen=True, slots=True)
class JobContent:
    """A job at one moment."""

    file: bytes
    """Of the file, with all complete steps of its log."""
    identity: FileIdentity
    left_out: str = ""
    """Bytes outside complete steps, as a sentence; empty if none."""


def read_job(path: Path) -> JobContent:
    """Return the content of the job at ``path`` at one moment.

    Raises StorageError if it is missing, unreadable, no job, too large, has a file next to it that
    this program never makes, or changes too fast.
    """
    try:
        # For a link, the files next to its target belong to the job.
        there = path.resolve(strict=True) if path.is_symlink() else path
        for _ in range(_TRIES):
            content = _at_once(path, there)
            if content is not None:
                return content
            time.sleep(_PAUSE_S)
    except (FileNotFoundError, IsADirectoryError) as error:
        raise missing(path) from error
    except (OSError, RuntimeError) as error:
        raise unreadable(path, error) from error
    raise StorageError(
        "job.busy",
        f"{path}: the job is changing too fast to be copied.",
        "Open it again when fewer points are being stored.",
    )


def missing(path: Path) -> StorageError:
    return StorageError("job.missing", f"{path}: file not found.", "Check the name and the folder.")


def unreadable(path: Path, error: Exception) -> StorageError:
    """Return the error for a job, or a file next to it, that the guard refuses."""
    there = getattr(error, "filename", None)
    why = getattr(error, "strerror", None) or str(error)
    folder = path.resolve().parent
    if there and Path(there).name != path.name and Path(there).parent.resolve() == folder:
        return StorageError(
            "job.side_file",
            f"{there}: this file next to the job {path.name} is refused: {why}.",
            "The job is not opened with it. Ask who can write this folder, move that file away, "
            "and open the job again.",
        )
    return StorageError(
        "job.unreadable",
        f"{path}: the file cannot be read ({why}).",
        "Check that it is a job file and that you have read permission.",
    )


def _at_once(path: Path, there: Path) -> JobContent | None:
    """Return the content of a job, or None if it changed meanwhile."""
    refuse_side_files(there, Trusted.JOB)
    with HELD.reading(there) as file, _log_of(there) as log:
        before = os.fstat(file)
        size = min(before.st_size, LARGEST_FILE)
        content = _read(file, size)
        pages = _pages(log)
        settled = 0 <= before.st_mtime_ns <= time.time_ns() - _SETTLED_NS
        # The log only grows while the file is unchanged, so a file that was the same before and
        # after, with the same head of the log, is one moment of the job.
        if (log is not None or not settled) and _read(file, size) != content:
            return None
        after = os.fstat(file)
        if (after.st_size, after.st_mtime_ns) != (before.st_size, before.st_mtime_ns):
            return None
        if _pages_head(log) != pages.head or (log is None) != (not os.path.lexists(_log(there))):
            return None
    joined = _joined(content, pages)
    if not joined.startswith(_MAGIC):
        raise no_job(path)
    identity = FileIdentity(path, before.st_dev, before.st_ino)
    return JobContent(joined, identity, pages.left_out)


@contextlib.contextmanager
def _log_of(path: Path) -> Iterator[int | None]:
    try:
        descriptor = open_guarded(_log(path), follow=False, most=_MOST_LOG)
    except FileNotFoundError:
        yield None
        return
    except OSError as error:
        error.filename = str(_log(path))
        raise
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _log(path: Path) -> Path:
    return path.with_name(f"{path.name}-wal")


def _pages(log: int | None) -> LogPages:
    if log is None:
        return LogPages({})
    return read_log(lambda at, n: HOST.read_at(log, n, at), os.fstat(log).st_size, LARGEST_FILE)


def _pages_head(log: int | None) -> bytes:
    return b"" if log is None else HOST.read_at(log, HEAD_SIZE, 0)


def _read(descriptor: int, size: int) -> bytes:
    found = bytearray()
    while len(found) < size:
        part = HOST.read_at(descriptor, min(size - len(found), _AT_ONCE), len(found))
        if not part:
            break
        found += part
    return bytes(found)


def _joined(content: bytes, log: LogPages) -> bytes:
    """Return the bytes of a file with the steps of its log."""
    if not log.n_pages:
        return content
    size = log.n_pages * log.page_size
    joined = bytearray(content[:size].ljust(size, b"\0"))
    for number, page in log.pages.items():
        if number <= log.n_pages:
            joined[(number - 1) * log.page_size : number * log.page_size] = page
    return bytes(joined)
