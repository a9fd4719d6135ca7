"""Job files that a running station goes on with."""

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
    """Return a new job file for a part that is measured like the one before.

    Parameters
    ----------
    header
        Operator, part, serial number, order and batch.
    like
        Head of the job before: its documents are those of the new one.
    plan
        What is measured; the file is named after it.
    folder
        Where the file is made.

    Raises
    ------
    InputError
        A name of the header cannot be used, or this part of the batch was measured already.
    StorageError
        The file cannot be made.
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
        job.close()
        job.path.unlink(missing_ok=True)
        raise
    return job


def drop_if_empty(job: JobFile) -> None:
    """Close a job, and remove its file where no point was ever taken in it.

    Raises
    ------
    StorageError
        It cannot be read; it is still open then.
    """
    empty = job.next_number() == 1
    job.close()
    # The name of a lost job may mean another one.
    if empty and job.given_up is None:
        try:
            job.path.unlink(missing_ok=True)
        except OSError as error:
            # An empty file is left over; nothing is lost by it.
            _log.warning("%s was not removed: %s", job.path, error.strerror)


def drop_job_without_points(path: Path) -> bool:
    """Remove a closed job in which no point was ever taken, and say whether it was one.

    Raises
    ------
    StorageError
        It cannot be opened: another program measures it, or it is damaged. It stays then.
    """
    job = JobFile.open(path)
    drop_if_empty(job)
    return not path.exists()


def give_back(job: JobFile, *, made: bool) -> None:
    """Close a job that is not measured after all; remove an empty one that was made for it.

    Never raises: what is told is why it is not measured.
    """
    try:
        if made:
            drop_if_empty(job)
    except Exception as error:
        _log.warning("%s was not removed: %s", job.path, contained(error, "The removal"))
    finally:
        job.close()


def free_path(folder: Path, plan: Plan) -> Path:
    """Return a name of a job file in ``folder`` that is not taken; StorageError if all are."""
    stem = file_stem(plan.name)
    for number in range(1, 100_000):
        path = folder / f"{stem}-{number:03d}{SUFFIX}"
        # A log without its file would be taken for that of the new one.
        if not path.exists() and not path.with_name(f"{path.name}-wal").exists():
            return path
    raise StorageError(
        "job.names", f"{folder}: no free name for a new job.", "Choose another folder."
    )
