"""The archive of a shop: every job with its file and its rows, in a file or on a PostgreSQL server.

In: finished and paused jobs of many stations. Out: the same files, rows and views that answer what
was measured where, when, by whom, with what; marks of what became known later.

Read `_rows` (what is kept of a job, and what must hold), `_extract` (rows from a job file alone),
`_store` (the interface, and what both stores do alike), `_sqlite` and `_postgresql`, `_address`
(where it is, and its password), `_schema`, `_views` and `_roles` (its SQL), `_faults` (sentences).
Then how jobs come: `_outbox` with `_outbox_rows` (durable, with their files), `_courier` (hands
over), `_follow` (the process that does), `_status` (how it stands, in words).
It must not know a running station: jobs come through an outbox, and measuring never waits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.archive._address import check_address, is_server, parse_server
    from ocmm_core.archive._courier import BackOff, Courier, Handed, sender_of
    from ocmm_core.archive._extract import ExtractedJob, extract_job, snapshot
    from ocmm_core.archive._faults import Remedy, remedy_of
    from ocmm_core.archive._follow import ArchivePlace, HandOverProcess, follow, main, only_one
    from ocmm_core.archive._open import default_archive, open_archive
    from ocmm_core.archive._outbox import Outbox, default_outbox
    from ocmm_core.archive._outbox_rows import Contact, Item, ItemState, machine_identity
    from ocmm_core.archive._roles import ROLES, role_statements, roles_sql
    from ocmm_core.archive._rows import (
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
    from ocmm_core.archive._store import Answer, Archive, Finding, Receipt, Table
else:
    __getattr__ = door(
        __name__,
        _address="check_address is_server parse_server",
        _courier="BackOff Courier Handed sender_of",
        _extract="ExtractedJob extract_job snapshot",
        _faults="Remedy remedy_of",
        _follow="ArchivePlace HandOverProcess follow main only_one",
        _open="default_archive open_archive",
        _outbox="Outbox default_outbox",
        _outbox_rows="Contact Item ItemState machine_identity",
        _roles="ROLES role_statements roles_sql",
        _rows="Delivery JobRecord JobRow MarkRow ResultRow Sender UseRow utc_text",
        _schema="VERSION",
        _status="HandOver hand_over",
        _store="Answer Archive Finding Receipt Table",
    )

__all__ = [
    "ROLES",
    "VERSION",
    "Answer",
    "Archive",
    "ArchivePlace",
    "BackOff",
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
    "Receipt",
    "Remedy",
    "ResultRow",
    "Sender",
    "Table",
    "UseRow",
    "check_address",
    "default_archive",
    "default_outbox",
    "extract_job",
    "follow",
    "hand_over",
    "is_server",
    "machine_identity",
    "main",
    "only_one",
    "open_archive",
    "parse_server",
    "remedy_of",
    "role_statements",
    "roles_sql",
    "sender_of",
    "snapshot",
    "utc_text",
]
