"""Decided recalls: the document and its marks in the archive, in one transaction."""

from __future__ import annotations

from datetime import UTC, datetime

import msgspec

from ocmm_core.calibration.records import seal
from ocmm_core.errors import InputError
from ocmm_core.inspection.archive import Outcome, RecalledJob, RecallRecord
from ocmm_core.inspection.recall import headline
from ocmm_shop.archive.records import MarkRow
from ocmm_shop.archive.stores import Archive, time_of


def decide_archived(
    archive: Archive, record: RecallRecord, who: str, now: datetime
) -> tuple[RecallRecord, int]:
    """Store a recall with its marks; return it signed, and its number in the archive.

    Jobs whose verdicts and values all hold are released, others are held. Stations learn of it with
    their next upload. InputError: no name, or another recall was stored since this one was
    computed. StorageError: it cannot be stored, or this login may not.
    """
    if not who:
        raise InputError(
            "recall.nobody",
            "No name given for the decision.",
            "Give the name of the person who decides.",
        )
    # Compare by the archive's clock: a fast local clock would block every later recall.
    made = datetime.fromisoformat(record.made_utc) + (archive.now() - datetime.now(UTC))
    for one in archive.findings():
        if one.kind == "recall" and time_of(archive.place, one.received_utc) > made:
            raise InputError(
                "recall.overtaken",
                f"{one.who} has stored another recall since this one was computed.",
                "Run the recall again.",
            )
    decided = msgspec.structs.replace(record, made_by=who)
    utc = now.astimezone(UTC).isoformat(timespec="milliseconds")
    number = archive.add_finding(
        "recall", headline(decided), seal(decided).decode("utf-8"), who, utc,
        marks_of(decided, who, utc),
    )  # fmt: skip
    return decided, number


def marks_of(record: RecallRecord, who: str, utc: str) -> tuple[MarkRow, ...]:
    """Return the mark of each job of a recall; the latest mark of a job counts."""
    return tuple(
        MarkRow(
            job_uuid=job.job_uuid, kind="recall", holds=not _let_go(job),
            why=f"Recall: {job.outcome.value}. {job.judgement}"[:2000], who=who, utc=utc,
        )
        for job in record.jobs
    )  # fmt: skip


def _let_go(job: RecalledJob) -> bool:
    """Return whether a job is released: verdicts hold, and values also."""
    return job.outcome is Outcome.HOLDS and all(one.released for one in job.characteristics)
