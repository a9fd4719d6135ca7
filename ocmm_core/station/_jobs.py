"""Job files of a running station."""

from __future__ import annotations

import logging
import uuid
from dataclasses import replace
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.failure import contained
from ocmm_core.inspection.archive import SUFFIX, require_new_serial
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.plan import Plan, note_release
from ocmm_core.inspection.session import HEADER_EVENT, check_header, header_text
from ocmm_core.names import file_stem
from ocmm_core.seals import NO_RELEASE, ReleaseState
from ocmm_core.storage import NAMED, JobFile, JobHead, now_utc

_log = logging.getLogger(__name__)


def job_for(
    header: JobHeader, like: JobHead, plan: Plan, folder: Path, release: ReleaseState = NO_RELEASE
) -> JobFile:
    """Return a new job file for a part, with the documents of a former job.

    `like`: head of the former job. `plan`: names the file. InputError: a name is invalid, or the
    batch has this part; StorageError: the file cannot be made.
    """
    check_header(header)
    require_new_serial(folder, header.batch, header.serial)
    head = replace(
        like,
        job_uuid=str(uuid.uuid4()),
        created_utc=now_utc(),
        operator=header.operator,
        part=header.part,
        serial=header.serial,
    )
    job = JobFile.create(free_path(folder, plan), head)
    try:
        job.change(events=((NAMED, job.path.stem), (HEADER_EVENT, header_text(header))))
        note_release(job, release)
    except BaseException:
        job.close(remove=True)
        raise
    return job


def drop_if_empty(job: JobFile) -> None:
    """Close a job, removing an empty file; StorageError, and still open, if unreadable."""
    job.close(remove=job.next_number() == 1)


def drop_job_without_points(path: Path) -> bool:
    """Remove a closed job without points, return if so; StorageError: in use or damaged, kept."""
    job = JobFile.open(path)
    drop_if_empty(job)
    return not path.exists()


def give_back(job: JobFile, *, made: bool) -> None:
    """Close a job not measured after all, remove it if new and empty; never raises."""
    try:
        if made:
            drop_if_empty(job)
    except Exception as error:
        _log.warning("%s was not removed: %s", job.path, contained(error, "The removal"))
    finally:
        job.close()


def free_path(folder: Path, plan: Plan) -> Path:
    """Return an unused path of a job file in ``folder``; StorageError if none."""
    stem = file_stem(plan.name)
    for number in range(1, 100_000):
        path = folder / f"{stem}-{number:03d}{SUFFIX}"
        # An orphaned log would be read as that of the new file.
        if not path.exists() and not path.with_name(f"{path.name}-wal").exists():
            return path
    raise StorageError(
        "job.names", f"{folder}: no free name for a new job.", "Choose another folder."
    )
