"""Jobs held by the archive, as far as known to this computer.

A later finding reaches a station as a mark in the archive. It is stored here, so that a job is held
even without network; opening a job reads this file and never the archive.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.documents import decode_json, read_bytes, write_atomic
from ocmm_core.errors import OcmmError, StorageError

SCHEMA = "ocmm.held-jobs/1"


class HeldJobs(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    schema: str = SCHEMA
    archive: str = ""
    after: int = 0
    """Number of the last mark."""
    jobs: Mapping[str, Mapping[str, str]] = {}
    """Reasons per held job, by kind of the mark."""


def held_jobs_file() -> Path:
    return platformdirs.user_data_path("ocmm") / "held_jobs.json"


def read_held_jobs(path: Path | None = None) -> HeldJobs:
    """Return the held jobs, none if no archive was ever read; StorageError if unreadable."""
    path = path or held_jobs_file()
    if not path.exists():
        return HeldJobs()
    try:
        return decode_json(read_bytes(path).decode("utf-8"), HeldJobs)
    except (msgspec.MsgspecError, UnicodeDecodeError, OcmmError, OSError) as error:
        raise StorageError(
            "held.unreadable",
            f"{path}: which jobs the archive holds back cannot be read ({error}).",
            "Remove the file; it is fetched again from the archive.",
        ) from error


def write_held_jobs(held: HeldJobs, path: Path | None = None) -> None:
    """Store the held jobs; StorageError on failure."""
    path = path or held_jobs_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(path, msgspec.json.encode(held))
    except OSError as error:
        raise StorageError(
            "held.unwritable",
            f"{path}: which jobs the archive holds back cannot be kept ({error.strerror}).",
            "Free disk space or restore write permission.",
        ) from error


def held_sentences(job_uuid: str) -> tuple[str, ...]:
    """Return why the archive holds a job; an unreadable file holds every job."""
    try:
        found = read_held_jobs().jobs.get(job_uuid, {})
    except StorageError as error:
        return (f"{error.what} {error.remedy}",)
    return tuple(f"Held back by the archive: {why}" for _, why in sorted(found.items()))
