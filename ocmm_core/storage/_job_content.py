"""The only access for readers of jobs: content of a job file at one moment, with its log.

File and write-ahead log are read by descriptors of regular files and joined in memory. Nothing next
to the job is made, changed or run.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.named_file import FileIdentity
from ocmm_core.side_files import SIDE_FILES, Trusted, open_guarded, refuse_side_files
from ocmm_core.storage._faults import no_job
from ocmm_core.storage._guard import LARGEST_FILE
from ocmm_core.storage._held_files import HELD
from ocmm_core.storage._write_ahead_log import HEAD_SIZE, LogPages, read_log

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
        if _pages_head(log) != pages.head or (log is None) != (not _has_log(there)):
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


def _has_log(path: Path) -> bool:
    return os.path.lexists(_log(path))


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
