"""An archive of OCMM 0.1 (version 2) opens: its jobs are the same, and its logins are bound."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError, StorageError
from ocmm_shop.archive.checks import verify_archive
from ocmm_shop.archive.questions import Query, today
from ocmm_shop.archive.records import Delivery, JobRow, extract_job, snapshot
from ocmm_shop.archive.stores import VERSION, Archive, open_archive, role_statements
from ocmm_shop.archive.stores._reader import JOB_FIELDS, RESULT_FIELDS
from ocmm_shop.archive.stores._schema import APPLICATION_ID, POSTGRESQL, SQLITE, Dialect, statements
from tests.shop.archive.conftest import Place, Server, by_hand
from tests.shop.archive.made_jobs import made_delivery, made_sender
from tests.shop.archive.real_jobs import RealJobs

OLD = 2
OLD_FIELDS = tuple(name for name in JOB_FIELDS if name not in ("key", "signature", "requirements"))
VIEW = (
    "CREATE VIEW archived_job AS SELECT j.id AS job_id, j.fault, j.job_uuid FROM job j",
    "CREATE VIEW archive_today AS SELECT a.* FROM archived_job a",
)
"""In the place of the views of that version, which are made again."""


def old_statements(dialect: Dialect) -> list[str]:
    made = [one for step in range(OLD) for one in statements(step, dialect)]
    versions = [f"INSERT INTO migration (version, program) VALUES ({n}, '0.1')" for n in (1, 2)]  # noqa: S608
    return [*made, *VIEW, *versions]


def rows_of(delivery: Delivery, station: str, word: str) -> list[tuple[str, Sequence[object]]]:
    """Return what version 0.1 wrote of a delivery, as statements with their values."""
    job, sender = delivery.record.job, delivery.sender
    named = ", ".join((*OLD_FIELDS, "sound"))
    values = [getattr(job, name) for name in OLD_FIELDS]
    values[OLD_FIELDS.index("seal")] = word
    values = [int(one) if isinstance(one, bool) else one for one in values]
    given: list[tuple[str, Sequence[object]]] = [
        ("INSERT INTO station (name, machine, host) VALUES (?, ?, ?)",
         (station, sender.machine, sender.host)),
        ("INSERT INTO sender (outbox, station, machine, username) VALUES (?, ?, ?, ?)",
         (sender.outbox, station, sender.machine, sender.user)),
        ("INSERT INTO file (sha256, size, content) VALUES (?, ?, ?)",
         (job.sha256, job.size, delivery.content)),
        (f"INSERT INTO job ({named}) VALUES ({', '.join('?' * (len(OLD_FIELDS) + 1))})",  # noqa: S608
         (*values, int(not job.fault))),
    ]  # fmt: skip
    for row in delivery.record.results:
        fields = ", ".join(("job", "part", "created_utc", *RESULT_FIELDS))
        marks = ", ".join("?" * (len(RESULT_FIELDS) + 3))
        cells = (1, job.part, job.created_utc, *(getattr(row, name) for name in RESULT_FIELDS))
        given.append((f"INSERT INTO result ({fields}) VALUES ({marks})", cells))  # noqa: S608
    given += [
        ("INSERT INTO used (job, kind, identity, name, created_utc) VALUES (?, ?, ?, ?, ?)",
         (1, use.kind, use.identity, use.name, job.created_utc))
        for use in delivery.record.uses
    ]  # fmt: skip
    given.append(
        ("INSERT INTO delivery (outbox, sequence, job, sha256, sent_utc) VALUES (?, ?, ?, ?, ?)",
         (sender.outbox, delivery.sequence, 1, job.sha256, delivery.sent_utc))
    )  # fmt: skip
    return given


@pytest.fixture
def delivery(real_jobs: RealJobs) -> Delivery:
    sender = made_sender("Station 1")
    made = extract_job(snapshot(real_jobs.finished), "job.ocmm", sender.station)
    return Delivery(
        sender=sender, sequence=7, sent_utc=made.record.job.changed_utc, record=made.record,
        content=made.content,
    )  # fmt: skip


def old_file(path: Path, delivery: Delivery) -> None:
    with sqlite3.connect(path) as db:
        for sql in old_statements(SQLITE):
            db.execute(sql)
        for sql, values in rows_of(delivery, "Station 1", "SEALED"):
            db.execute(sql, values)
        db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        db.execute(f"PRAGMA user_version = {OLD}")
    db.close()


def old_server(server: Server, name: str, delivery: Delivery) -> str:
    """Make the archive with a station that had its own login."""
    import psycopg

    server.sql("postgres", f"CREATE DATABASE {name}")
    options = "-c search_path=ocmm"
    server.sql(name, "CREATE SCHEMA ocmm")
    with psycopg.connect(
        host=str(server.socket), dbname=name, user=server.owner, options=options
    ) as db:
        for sql in old_statements(POSTGRESQL):
            db.execute(sql.encode())
        db.execute(b"GRANT ALL ON ALL TABLES IN SCHEMA ocmm TO station1")
        db.execute(b"GRANT ALL ON SCHEMA ocmm TO station1")
    with psycopg.connect(
        host=str(server.socket), dbname=name, user="station1", options=options
    ) as db:
        for sql, values in rows_of(delivery, "Station 1", "SEALED"):
            db.execute(sql.replace("?", "%s").encode(), values)
    return server.address(name)


def check(archive: Archive, delivery: Delivery) -> None:
    """Raise if the job differs from the one sent before the upgrade."""
    assert archive.record(1) == delivery.record
    assert verify_archive(archive).faults == ()
    (row,) = today(archive, Query(first=day_of(delivery.record.job))).rows
    assert row[6] == delivery.record.job.verdict
    assert row[8] in ("", "SIMULATED")


def day_of(job: JobRow):  # type: ignore[no-untyped-def]
    from datetime import datetime

    return datetime.fromisoformat(job.changed_utc).astimezone().date()


def test_a_file_of_the_former_version_is_brought_up_to_date(
    delivery: Delivery, tmp_path: Path
) -> None:
    path = tmp_path / "archive.sqlite"
    old_file(path, delivery)
    # Also by a question, which writes nothing itself.
    with open_archive(str(path), read_only=True) as archive:
        check(archive, delivery)
    with open_archive(str(path)) as archive:
        # Earlier deliveries keep their numbers, and new ones continue the count.
        assert archive.last_sequence(delivery.sender.outbox) == 7
        assert archive.put(delivery).job == 1
        archive.put(made_delivery(3, delivery.sender, sequence=8))
        assert archive.query("SELECT version FROM migration ORDER BY 1").rows == (
            *((n + 1,) for n in range(VERSION)),
        )


def test_a_server_of_the_former_version_is_brought_up_to_date_and_its_login_bound(
    new_database: Callable[[], Place], delivery: Delivery
) -> None:
    server = new_database().server
    assert server is not None
    address = old_server(server, "ocmm_former", delivery)
    station = server.address("ocmm_former", "station1")
    with pytest.raises(StorageError, match="has version 2"):
        open_archive(station)
    with open_archive(address, set_up=True) as archive:
        check(archive, delivery)
    server.sql("ocmm_former", *role_statements())
    with open_archive(station) as archive:
        assert archive.last_sequence(delivery.sender.outbox) == 7
        assert archive.put(delivery).job == 1
        archive.put(made_delivery(3, delivery.sender, sequence=8))
        with pytest.raises(StorageError, match="is not admitted as this station"):
            archive.put(made_delivery(4, made_sender("Station 9", 9)))
        with pytest.raises(OcmmError):
            by_hand(archive, "INSERT INTO station_login (login, station) VALUES ('station1', 'X')")


def test_steps_that_were_released_stay() -> None:
    assert len(list(resource("archive").glob("[0-9].sql"))) == VERSION
    assert VERSION > OLD
