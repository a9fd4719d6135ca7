"""Storage of job files that neither lose nor change points.

In: points, events, documents of a job. Out: one SQLite file per job, and the same read back.

Read `_job_file` (the file and its guarantees), `_job_reader` (contents, in order; a summary),
`_tables` and `_rows` (rows, bit for bit, and their checks), `_audit` (the hash-linked chain, and
versions), `_job_seal` (signatures), `_connection` (transactions until the disk fails),
`_job_keeper` (rescue if the name is lost), `_faults` (faults as sentences), `_job_content` (the
only access for readers), `_guard` (limits of foreign files), `_held_jobs` (jobs held by an
archive). It must not know plans, features or verdicts.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.storage._audit import AUDITED, AuditedStep, digest_row, now_utc
    from ocmm_core.storage._faults import damaged, saved_sentence
    from ocmm_core.storage._guard import HeldConnection, database_content, open_in_place
    from ocmm_core.storage._held_jobs import (
        HeldJobs, held_jobs_file, held_sentences, read_held_jobs, write_held_jobs,
    )  # fmt: skip
    from ocmm_core.storage._job_content import JobContent, read_job
    from ocmm_core.storage._job_file import LEFT_OUT, JobFile
    from ocmm_core.storage._job_keeper import RESCUED
    from ocmm_core.storage._job_reader import NAMED, JobStep, JobSummary, read_summary
    from ocmm_core.storage._job_seal import ADOPTED, JobSeal, judge_head
    from ocmm_core.storage._rows import (
        JobEvent, JobHead, JobReference, bad_event, event_value, make_head,
    )  # fmt: skip
    from ocmm_core.storage._tables import CLOCK, Observed
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ADOPTED", "AUDITED", "CLOCK", "LEFT_OUT", "NAMED", "RESCUED", "AuditedStep", "HeldConnection",
    "HeldJobs", "JobContent", "JobEvent", "JobFile", "JobHead", "JobReference", "JobSeal",
    "JobStep", "JobSummary", "Observed", "bad_event", "damaged", "database_content", "digest_row",
    "event_value", "held_jobs_file", "held_sentences", "judge_head", "make_head", "now_utc",
    "open_in_place", "read_held_jobs", "read_job", "read_summary", "saved_sentence",
    "write_held_jobs",
]  # fmt: skip
