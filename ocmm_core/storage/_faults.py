"""Errors of SQLite and the disk, as sentences for the person at the machine."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST


def primary_code(error: BaseException) -> int:
    """Return SQLite's code without its extension, 0 for other errors."""
    return int(getattr(error, "sqlite_errorcode", 0)) & 0xFF


FAULTS = (sqlite3.Error, UnicodeDecodeError)
"""Exceptions of reading a job: SQLite errors, and names that are not UTF-8."""


def storage_error(path: Path, error: sqlite3.Error | UnicodeDecodeError) -> StorageError:
    if isinstance(error, UnicodeDecodeError):
        return damaged(path, "a text in it is not UTF-8")
    code = primary_code(error)
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        holder = HOST.holder_of(path)
        return StorageError(
            "job.locked",
            f"{path}: the job is in use by another program{f' ({holder})' if holder else ''}.",
            "Close it there and retry.",
        )
    if code == sqlite3.SQLITE_FULL:
        return StorageError(
            "job.disk_full",
            f"{path}: the disk is full; this was not stored, everything before it is.",
            "Free disk space and repeat the last step.",
        )
    if code in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM):
        return not_writable(path, str(error))
    if code == sqlite3.SQLITE_NOTADB:
        return no_job(path)
    if code == sqlite3.SQLITE_INTERRUPT:
        return damaged(path, "reading it takes longer than a job of its size does")
    if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_TOOBIG, sqlite3.SQLITE_ERROR, 0):
        # No code: a text that is not UTF-8. Otherwise our statements have no error.
        return damaged(path, " ".join(str(error).split())[:200])
    if code == sqlite3.SQLITE_IOERR:
        return disk_failed(path)
    return StorageError(
        "job.refused",
        f"{path}: the job file rejected this step ({error}).",
        "Repeat the last step.",
    )


def not_writable(path: Path, why: str) -> StorageError:
    return StorageError(
        "job.not_writable",
        f"{path}: the file cannot be opened or written ({why}).",
        "Choose an existing, writable folder.",
    )


def no_job(path: Path) -> StorageError:
    return StorageError(
        "job.foreign", f"{path}: this is not a job file.", "Choose a file made by this program."
    )


def damaged(path: Path, why: str) -> StorageError:
    """Return the error for a file with untrusted content."""
    return StorageError(
        "job.damaged",
        f"{path}: the job file is damaged ({why}).",
        "Keep the file as it is and open a backup of it.",
    )


def disk_failed(path: Path, saved: Path | None = None) -> StorageError:
    """Return the error for a disk that failed; `saved`: new file with all steps, or None."""
    if saved is not None:
        return StorageError(
            "job.disk",
            f"{path}: the last point or note could not be written to disk. {saved_sentence(saved)}",
            "Resume that job, on another disk.",
        )
    return StorageError(
        "job.disk",
        (
            f"{path}: the last point or note could not be written to disk; everything before "
            "it is stored."
        ),
        "Close the job, copy it with its -wal file to another disk, and continue the copy.",
    )


def saved_sentence(saved: Path | None) -> str:
    """Return the place of all acknowledged points; None is memory."""
    if saved is None:
        return "All points taken are only in the memory of this program."
    return f"All points taken are saved in {saved.absolute()}."


def lost_name(path: Path, words: str, saved: Path | None, *, tried: bool) -> StorageError:
    """Return the error for a job not found on the disk any more under its name.

    `words`: event. `saved`: new file with all acknowledged steps; None if no folder accepted them,
    or none was `tried` yet.
    """
    if saved is None:
        return StorageError(
            "job.lost",
            f"{path}: {words}.",
            "No folder takes the points, which are in the memory of this program. Leave it open "
            "and free disk space: it tries again."
            if tried
            else "They are being saved in another file. Leave the program open until its name is "
            "shown.",
        )
    return StorageError(
        "job.lost",
        f"{path}: {words}. {saved_sentence(saved)}",
        "Resume that job. Exclude the job folder from programs that synchronise or clean up.",
    )


def bad_text(path: Path, error: UnicodeEncodeError) -> StorageError:
    """Return the error for text that is not Unicode, e.g. from a broken file name."""
    return StorageError(
        "job.text", f"{path}: {error.object!r} is not valid text.", "Enter that text again."
    )
