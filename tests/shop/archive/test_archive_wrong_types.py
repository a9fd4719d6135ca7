"""Values of the wrong type in a file of SQLite: named, and without effect on other rows."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from datetime import UTC, date, datetime
from pathlib import Path

import msgspec
import pytest

from ocmm_core.errors import OcmmError
from ocmm_shop.archive.checks import (
    differences,
    files_in,
    mark_altered,
    rebuild,
    stations_of,
    verify_archive,
)
from ocmm_shop.archive.outbox import exchange_heads, learn_marks
from ocmm_shop.archive.questions import (
    Query,
    cpk_by_month,
    csv_of,
    parts,
    passed,
    rr,
    today,
    trend,
    used,
)
from ocmm_shop.archive.records import MarkRow
from ocmm_shop.archive.stores import VIEW_NAMES, Acknowledgement, Archive, open_archive
from ocmm_shop.archive.stores._schema import columns_of
from ocmm_shop.recalls import ArchiveFinding, ShopPlaces, recall_archive
from tests.host import amount
from tests.shop.archive.made_jobs import made_delivery, made_sender

COLUMNS = columns_of("table")
TABLES = sorted({table for table, *_ in COLUMNS})
WRONG = (None, b"\xff\x00wrong", -7, 0.5, "9" * 1_000_000, "x" * 29)
"""NULL, BLOB, integer, real, huge text, and text with the length of a time."""
EACH = amount(1, len(WRONG))
"""Values tried in each column; the short form takes them in turn."""
OTHERS = 4
NOW = datetime(2026, 11, 29, tzinfo=UTC)


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an archive with a row to be changed and rows of another station in each table.

    Conditions of the tables are removed, as another program can.
    """
    path = tmp_path_factory.mktemp("archive") / "base.sqlite"
    with open_archive(str(path), set_up=True) as archive:
        archive.admit("local", "Station 1")
        archive.put(made_delivery(50))
        for number in range(OTHERS):
            archive.put(made_delivery(number, made_sender("Station 2", 2), sequence=number + 1))
        for job in (50, 1):
            uuid = made_delivery(job).record.job.job_uuid
            mark = MarkRow(
                job_uuid=uuid, kind="quality", holds=job == 50, why="w", who="Ada", utc="2026-11-28"
            )
            archive.add_finding("recall", "s", "{}", "Ada", "2026-11-28", [mark])
    with contextlib.closing(sqlite3.connect(path)) as db, db:
        db.execute("INSERT INTO station_key (station, key, proof) VALUES ('Station 1', 'k', 'p')")
        db.execute("PRAGMA writable_schema = ON")
        for kind in ("TEXT", "INTEGER", "REAL", "BLOB"):
            filled = (f"{kind} NOT NULL", kind)
            db.execute("UPDATE sqlite_master SET sql = replace(sql, ?, ?)", filled)
    return path


def changed(base: Path, folder: Path, table: str, column: str, value: object) -> Path | None:
    """Return a copy with a value in the first row of a table; None if SQLite refuses it."""
    path = folder / "archive.sqlite"
    for one in folder.glob("archive.sqlite*"):
        one.unlink()
    shutil.copy(base, path)
    with contextlib.closing(sqlite3.connect(path)) as db, db:
        db.execute("PRAGMA ignore_check_constraints = ON")
        try:
            db.execute(
                f"UPDATE {table} SET {column} = ? WHERE rowid = (SELECT min(rowid) FROM {table})",  # noqa: S608 - names of ours
                (value,),
            )
        except sqlite3.Error:
            return None
    return path


def lists(archive: Archive) -> Iterator[object]:
    """Yield the rows of the other station in all answers."""
    many = 10**6
    days = Query(first=date(1971, 1, 1), last=date(8000, 1, 1), most=many)
    for made in (
        today(archive, days),
        passed(archive, Query(most=many)),
        used(archive, Query(kind="tip", what="T1", most=many)),
        trend(archive, Query(part="FLANGE", characteristic="D0", most=many)),
        cpk_by_month(archive, Query(part="FLANGE", station="Station 2", most=many)),
    ):
        assert csv_of(made.columns, made.rows)
        # A job in doubt has a remark; the number of other versions belongs to the job.
        yield [row for row in made.rows if "Station 2" in row or "Station" not in made.columns]
    with contextlib.suppress(OcmmError):
        rr(archive, Query(part="FLANGE", characteristic="D0"))
    yield {part for part, _ in parts(archive)} & {"FLANGE"}
    for view in VIEW_NAMES:
        table = archive.query(f"SELECT * FROM {view}")  # noqa: S608 - names of ours
        assert csv_of(table.columns, table.rows)
    yield [one for one in archive.findings() if one.id > 1]
    yield [mark for number, mark in archive.marks() if number > 1]
    job = made_delivery(1).record.job
    yield archive.heads(job.job_uuid, "Station 2")
    yield archive.last_sequence(made_sender("Station 2", 2).outbox)
    yield archive.arrived(made_sender("Station 2", 2).outbox, range(1, 9))


def act(archive: Archive, path: Path) -> None:
    """Exchange, hold, recall, compare, rebuild, and store the next job of the other station."""
    exchange_heads(archive, "Station 3")
    learn_marks(archive, path.with_name("held.json"))
    finding = ArchiveFinding(
        "tip", made_delivery(1).record.uses[2].identity, NOW.replace(year=2020)
    )
    found = recall_archive(ShopPlaces(str(path), ()), NOW, finding=finding)
    assert len(found.jobs) + len(found.unread) >= OTHERS
    again = path.with_name("again.sqlite")
    again.unlink(missing_ok=True)
    with open_archive(str(again), set_up=True) as new:
        unread: list[str] = []
        # The files are no jobs: each is named.
        done = rebuild(new, files_in(archive, unread.append), stations_of(archive))
        assert len(done.unread) + len(unread) == OTHERS + 1
        assert len(differences(archive, new)) >= OTHERS
    sent = made_delivery(60, made_sender("Station 2", 2), sequence=60)
    assert archive.put(sent).answer is Acknowledgement.STORED


@pytest.mark.parametrize("table", TABLES)
def test_a_value_of_the_wrong_type_is_named_and_stops_no_other_row(
    base: Path, tmp_path: Path, table: str, record_property: Callable[[str, object], None]
) -> None:
    with open_archive(str(base)) as archive:
        honest = [msgspec.json.encode(one) for one in lists(archive)]
        known = set(verify_archive(archive).faults)
    tried = refused = 0
    for place, (of, column, kind, empty) in enumerate(COLUMNS):
        for number in range(EACH) if of == table else ():
            value = WRONG[(place + number) % len(WRONG)]
            where = f"{table}.{column} {value!r:.40}"
            path = changed(base, tmp_path, table, column, value)
            tried += 1
            if path is None:
                refused += 1
                continue
            with contextlib.closing(sqlite3.connect(path)) as db:
                (found,) = db.execute(
                    f"SELECT typeof({column}) FROM {table}"  # noqa: S608 - names of ours
                    " ORDER BY rowid"
                ).fetchone()
            with open_archive(str(path)) as archive:
                assert [msgspec.json.encode(one) for one in lists(archive)] == honest, where
                checked = verify_archive(archive)
                new = set(checked.faults) - known
                right = found == kind.lower() or (found == "null" and empty)
                assert right or any(column in why for _, why in new), f"{where}: {new}"
                mark_altered(archive, checked, "Ada")
                act(archive, path)
    record_property(table, f"{tried} values, {refused} refused by SQLite")
