"""The archive of a shop: every job with its file and its rows, in a file or on a PostgreSQL server.

In: finished and paused jobs of many stations. Out: the same files, rows and views that answer what
was measured where, when, by whom, with what; marks of what became known later.

Read `_rows` (what is kept of a job, and what must hold), `_extract` (rows from a job file alone),
`_store` (the interface, and what both stores do alike), `_sqlite` and `_postgresql`, `_address`
(where it is, and its password), `_schema`, `_views` and `_roles` (its SQL), `_faults` (sentences).
Then how jobs come: `_outbox` with `_outbox_rows` (durable, with their files), `_courier` (hands
over), `_follow` (the process that does), `_status` (how it stands, in words).
Then what it is for: `_questions` with `_answers`; `_rebuild` (from files alone, and held against
them).
It must not know a running station: jobs come through an outbox, and measuring never waits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.archive._address import check_address, is_server, parse_server
    from ocmm_core.archive._answers import ArchiveAnswer, csv_of, export_answer, parquet_of
    from ocmm_core.archive._courier import BackOff, Courier, Handed, sender_of
    from ocmm_core.archive._extract import ExtractedJob, extract_job, snapshot
    from ocmm_core.archive._faults import Remedy, remedy_of
    from ocmm_core.archive._follow import ArchivePlace, HandOverProcess, follow, main, only_one
    from ocmm_core.archive._learn import learn_marks
    from ocmm_core.archive._open import default_archive, open_archive
    from ocmm_core.archive._outbox import Outbox, default_outbox
    from ocmm_core.archive._outbox_rows import Contact, Item, ItemState, machine_identity
    from ocmm_core.archive._questions import (
        QUESTIONS,
        Asked,
        Question,
        cpk_by_month,
        parts,
        passed,
        rr,
        today,
        trend,
        used,
    )
    from ocmm_core.archive._rebuild import (
        Checked,
        Rebuilt,
        differences,
        files_in,
        files_of,
        mark_altered,
        rebuild,
        records_of,
        stations_of,
        verify_archive,
        verify_files,
    )
    from ocmm_core.archive._roles import ROLES, give_roles, role_statements, roles_sql
    from ocmm_core.archive._rows import (
        USES,
        Delivery,
        JobRecord,
        JobRow,
        MarkRow,
        ResultRow,
        Sender,
        UseRow,
        utc_text,
    )
    from ocmm_core.archive._schema import VERSION
    from ocmm_core.archive._status import HandOver, hand_over
    from ocmm_core.archive._store import Answer, Archive, Finding, Receipt, SqlArchive, Table
    from ocmm_core.archive._views import VIEW_NAMES
else:
    __getattr__ = door(
        __name__,
        _address="check_address is_server parse_server",
        _answers="ArchiveAnswer csv_of export_answer parquet_of",
        _courier="BackOff Courier Handed sender_of",
        _extract="ExtractedJob extract_job snapshot",
        _faults="Remedy remedy_of",
        _follow="ArchivePlace HandOverProcess follow main only_one",
        _learn="learn_marks",
        _open="default_archive open_archive",
        _outbox="Outbox default_outbox",
        _outbox_rows="Contact Item ItemState machine_identity",
        _questions="Asked QUESTIONS Question cpk_by_month parts passed rr today trend used",
        _rebuild=(
            "Checked Rebuilt differences files_in files_of mark_altered rebuild records_of "
            "stations_of verify_archive verify_files"
        ),
        _roles="ROLES give_roles role_statements roles_sql",
        _rows="USES Delivery JobRecord JobRow MarkRow ResultRow Sender UseRow utc_text",
        _schema="VERSION",
        _status="HandOver hand_over",
        _views="VIEW_NAMES",
        _store="Answer Archive Finding Receipt SqlArchive Table",
    )

__all__ = [
    "QUESTIONS",
    "ROLES",
    "USES",
    "VERSION",
    "VIEW_NAMES",
    "Answer",
    "Archive",
    "ArchiveAnswer",
    "ArchivePlace",
    "Asked",
    "BackOff",
    "Checked",
    "Contact",
    "Courier",
    "Delivery",
    "ExtractedJob",
    "Finding",
    "HandOver",
    "HandOverProcess",
    "Handed",
    "Item",
    "ItemState",
    "JobRecord",
    "JobRow",
    "MarkRow",
    "Outbox",
    "Question",
    "Rebuilt",
    "Receipt",
    "Remedy",
    "ResultRow",
    "Sender",
    "SqlArchive",
    "Table",
    "UseRow",
    "check_address",
    "cpk_by_month",
    "csv_of",
    "default_archive",
    "default_outbox",
    "differences",
    "export_answer",
    "extract_job",
    "files_in",
    "files_of",
    "follow",
    "give_roles",
    "hand_over",
    "is_server",
    "learn_marks",
    "machine_identity",
    "main",
    "mark_altered",
    "only_one",
    "open_archive",
    "parquet_of",
    "parse_server",
    "parts",
    "passed",
    "rebuild",
    "records_of",
    "remedy_of",
    "role_statements",
    "roles_sql",
    "rr",
    "sender_of",
    "snapshot",
    "stations_of",
    "today",
    "trend",
    "used",
    "utc_text",
    "verify_archive",
    "verify_files",
]
