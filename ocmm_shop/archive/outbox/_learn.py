"""Later findings on jobs from the archive, by which the station holds them."""

from __future__ import annotations

import contextlib
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.seals import KeyFolder, learn_heads, signed_heads, signed_job_heads
from ocmm_core.storage import HeldJobs, read_held_jobs, write_held_jobs
from ocmm_shop.archive.stores import HEADS, Archive

_MOST, _LONGEST = 200, 1_000_000
_JOBS = "".join(('{"content":', '{"jobs":'))
"""Start of a list of `signed_job_heads`. The newest `_MOST` lists of each kind are read."""


def learn_marks(archive: Archive, path: Path | None = None) -> int:
    """Store new marks in `path` (None: this user's), return how many; StorageError."""
    known = read_held_jobs(path)
    # Another archive numbers its marks from 1; holds of the former one are not final.
    after = known.after if known.archive in ("", archive.place) else 0
    newest = archive.ask("SELECT id FROM archive_mark ORDER BY id DESC LIMIT 1", {}, int).rows
    if not newest or int(str(newest[0][0])) < after:
        # It was restored from a backup, and continues numbering from there.
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


def exchange_heads(archive: Archive, station: str) -> None:
    """Store the ends of this station's histories and jobs in the archive, and read others'.

    Thus a second computer, or this one after a loss of memory, recognises older copies. Raises
    StorageError if the archive cannot be read or written, or this station has no key.
    """
    keys = KeyFolder()
    for which, signed in (("<>", signed_heads), ("=", signed_job_heads)):
        rows = archive.ask(
            f"SELECT document FROM finding WHERE kind = '{HEADS}'"  # noqa: S608 - constants
            f" AND substr(document, 1, {len(_JOBS)}) {which} :jobs"
            f" AND length(document) < {_LONGEST} ORDER BY id DESC LIMIT {_MOST}",
            {"jobs": _JOBS}, str,
        ).rows  # fmt: skip
        known = [str(text) for (text,) in rows]
        for text in reversed(known):
            # Untrusted stations are ignored.
            with contextlib.suppress(StorageError):
                learn_heads(text, archive.place, keys)
        for own in signed(keys, known):
            archive.add_finding(HEADS, station, own, station, datetime.now(UTC).isoformat())
