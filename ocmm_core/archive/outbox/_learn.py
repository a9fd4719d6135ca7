"""A station learns what became known of jobs, and holds back what it shows of them."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.archive.stores import Archive
from ocmm_core.storage import HeldJobs, read_held_jobs, write_held_jobs


def learn_marks(archive: Archive, path: Path | None = None) -> int:
    """Take in the marks that this computer does not know yet; return how many there were.

    Parameters
    ----------
    path
        Where it is kept; None: for this user.

    Raises
    ------
    StorageError
        The archive cannot be read, or what it says cannot be kept.
    """
    known = read_held_jobs(path)
    # Another archive counts its marks anew; what the former one held back is not taken for good.
    after = known.after if known.archive in ("", archive.place) else 0
    newest = archive.ask("SELECT id FROM archive_mark ORDER BY id DESC LIMIT 1", {}, int).rows
    if not newest or int(str(newest[0][0])) < after:
        # It was restored from a backup, and counts anew from there.
        after = 0
    marks = archive.marks(after)
    if not marks:
        return 0
    jobs = {job: dict(kinds) for job, kinds in known.jobs.items()}
    for number, mark in marks:
        after = max(after, number)
        kinds = jobs.setdefault(mark.job_uuid, {})
        if mark.holds:
            kinds[mark.kind] = f"{mark.why} ({mark.who}, {mark.utc[:10]})"
        else:
            kinds.pop(mark.kind, None)
        if not kinds:
            del jobs[mark.job_uuid]
    write_held_jobs(HeldJobs(archive=archive.place, after=after, jobs=jobs), path)
    return len(marks)
