"""A copy of a job file to look at, made without touching the file or the program that measures it.

Even opening an SQLite file for reading makes files beside it, and its last close writes into it.
A job that is looked at is therefore copied first: the file and its write-ahead log, into a folder
of its own. The log only grows while the file stays as it is, so a copy whose file and whose head
of the log were the same before and after is one moment of the job; what was being written just
then is not in it, and nothing that was acknowledged before is missing (SQLite, "The WAL File
Format": a frame counts only with the salts of the head and a checksum that follows from the frames
before it).
"""

from __future__ import annotations

import contextlib
import sqlite3
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.inspection.archive._stored_documents import named
from ocmm_core.leftovers import scratch_folder
from ocmm_core.storage import (
    LARGEST_FILE,
    JobFile,
    damaged,
    guarded_connection,
    is_current,
    no_job,
    not_writable,
    require_size,
    settled_trace,
)

_TRIES = 50
_PAUSE_S = 0.02
_DOUBTS = 5
"""A file that cannot be read so many times and once more is damaged."""

_WAL_HEAD = 32
"""Bytes of the head of the log; its salts change when the log begins anew."""


@contextlib.contextmanager
def copy_of_job(path: Path) -> Iterator[Path]:
    """Give a copy of the job at ``path`` under the same name, removed again at the end.

    Raises
    ------
    StorageError
        The file is missing, cannot be read, is none of SQLite, or changes faster than it can be
        copied.
    """
    file, log = content_of_job(path)
    with copy_of_content(path.name, file, log) as copy:
        yield copy


@contextlib.contextmanager
def job_to_look_at(path: Path) -> Iterator[JobFile]:
    """Give the job at ``path`` to be read, as it was at one moment; closed again at the end.

    Raises
    ------
    StorageError
        As `copy_of_job`, or the file is no whole job.
    """
    file, log = content_of_job(path)
    with content_to_look_at(path, file, log) as job:
        yield job


@contextlib.contextmanager
def content_to_look_at(path: Path, file: bytes, log: bytes = b"") -> Iterator[JobFile]:
    """Give the job in the bytes of a file and of its log, called ``path``; as `job_to_look_at`."""
    if not log and is_current(file):
        with JobFile.in_memory(path, file) as job:
            yield job
        return
    # What a log has more, and what an older version lacks, SQLite brings together in a file.
    with copy_of_content(path.name, file, log) as copy:
        try:
            with JobFile.open(copy, scratch=True) as job:
                yield job
        except OcmmError as error:
            raise named(error, str(copy), str(path)) from error


@contextlib.contextmanager
def copy_of_content(name: str, file: bytes, log: bytes) -> Iterator[Path]:
    """Give a job file of these bytes with its log, removed again at the end.

    Raises
    ------
    StorageError
        There is no room for it.
    """
    with contextlib.ExitStack() as stack:
        try:
            folder = stack.enter_context(scratch_folder("job"))
        except OSError as error:
            there = Path(tempfile.gettempdir())
            raise not_writable(there, error.strerror or str(error)) from error
        copy = folder / name
        try:
            copy.write_bytes(file)
            if log:
                copy.with_name(f"{copy.name}-wal").write_bytes(log)
        except OSError as error:
            raise not_writable(copy, error.strerror or str(error)) from error
        yield copy


def content_of_job(path: Path) -> tuple[bytes, bytes]:
    """Return the bytes of the job at ``path`` and of its log, of one moment; as `copy_of_job`."""
    if not path.is_file():
        raise StorageError(
            "job.missing", f"{path}: file not found.", "Check the name and the folder."
        )
    trace = settled_trace(path)
    if trace is not None:
        # Nobody was writing, and whoever began meanwhile left a trace.
        content = _content(path)
        if settled_trace(path) == trace:
            return content, b""
    log = path.with_name(f"{path.name}-wal")
    for attempt in range(_TRIES):
        try:
            before, head = _content(path), _log(log)[:_WAL_HEAD]
            content = _log(log)
            same = _content(path) == before
        except StorageError:
            # A file that is just being made or moved together cannot be read for a moment.
            if attempt >= _DOUBTS:
                raise
            same = False
        if same and _log(log)[:_WAL_HEAD] == head == content[:_WAL_HEAD]:
            return before, content
        time.sleep(_PAUSE_S)
    raise StorageError(
        "job.busy",
        f"{path}: the job is changing too fast to be copied.",
        "Open it again when fewer points are being stored.",
    )


def _content(path: Path) -> bytes:
    """Return the content of the file itself, without its log.

    SQLite reads it: were it opened and closed beside SQLite, the locks that this same process may
    hold on it would be gone (POSIX advisory locks; SQLite, "How To Corrupt An SQLite Database
    File", 2.2).
    """
    require_size(path)
    try:
        with contextlib.closing(guarded_connection(path, "ro&immutable=1")) as db:
            return db.serialize()
    except (sqlite3.Error, UnicodeDecodeError) as error:
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF
        if code == sqlite3.SQLITE_NOTADB:
            raise no_job(path) from error
        if code in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM):
            raise StorageError(
                "job.unreadable",
                f"{path}: the file cannot be read ({error}).",
                "Check read permission.",
            ) from error
        if path.stat().st_size == 0:
            raise no_job(path) from error
        raise damaged(path, "SQLite cannot read its pages") from error


def _log(path: Path) -> bytes:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise damaged(path, "its log is larger than any job")
        return path.read_bytes()
    except FileNotFoundError:
        return b""
    except OSError as error:
        raise StorageError(
            "job.unreadable",
            f"{path}: the log of the job cannot be read ({error.strerror}).",
            "Check read permission, also of the file beside the job ending in -wal.",
        ) from error
