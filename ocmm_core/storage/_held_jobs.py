"""Jobs that the archive holds back, as far as this computer has learned of it.

A later finding reaches a station as a mark in the archive. It is kept here, so that a job is held
back also where the network is gone; whoever opens the job asks this file and never the archive.
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
    """What was learned."""

    schema: str = SCHEMA
    """`SCHEMA`."""
    archive: str = ""
    """Which archive says so."""
    after: int = 0
    """Number of the last mark that was learned."""
    jobs: Mapping[str, Mapping[str, str]] = {}
    """For each job that is held back why, by the kind of the mark."""


def held_jobs_file() -> Path:
    """Return the file of this user."""
    return platformdirs.user_data_path("ocmm") / "held_jobs.json"


def read_held_jobs(path: Path | None = None) -> HeldJobs:
    """Return what was learned; nothing where nobody has asked an archive.

    Raises
    ------
    StorageError
        The file is there and cannot be read.
    """
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
    """Keep what was learned; StorageError where that fails."""
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


def held_sentences(job_uuid: str, path: Path | None = None) -> tuple[str, ...]:
    """Return why the archive holds a job back, a sentence each.

    A file that cannot be read holds every job back: silence would say that nothing is wrong.
    """
    try:
        found = read_held_jobs(path).jobs.get(job_uuid, {})
    except StorageError as error:
        return (f"{error.what} {error.remedy}",)
    return tuple(f"Held back by the archive: {why}" for _, why in sorted(found.items()))
