"""What is kept: job files that lose no point and change none.

In: points, events, documents of a job. Out: one SQLite file per job, and the same read back.

Read `_job_file` (the file and its promises), `_tables` and `_rows` (what stands in it, bit for
bit), `_job_steps` (points and annulments in order), `_audit` (the hash-linked chain),
`_connection` and `_faults` (what is the matter, in one sentence), `_migrations` (versions),
`_glance` (a summary without opening it to write).
It must not know plans, features or verdicts: it keeps what it is given.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.storage._audit import now_utc
    from ocmm_core.storage._faults import damaged, no_job, not_writable
    from ocmm_core.storage._glance import JobSummary, read_summary
    from ocmm_core.storage._job_file import JobFile
    from ocmm_core.storage._job_steps import JobStep
    from ocmm_core.storage._rows import JobEvent, JobHead, JobReference, make_head
else:
    __getattr__ = door(
        __name__,
        _audit="now_utc",
        _faults="damaged no_job not_writable",
        _glance="JobSummary read_summary",
        _job_file="JobFile",
        _job_steps="JobStep",
        _rows="JobEvent JobHead JobReference make_head",
    )

__all__ = [
    "JobEvent",
    "JobFile",
    "JobHead",
    "JobReference",
    "JobStep",
    "JobSummary",
    "damaged",
    "make_head",
    "no_job",
    "not_writable",
    "now_utc",
    "read_summary",
]
