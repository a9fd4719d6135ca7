"""Attacks on the rows of an archive with the login of a station, one hostile value at a time."""

from __future__ import annotations

import contextlib
import random
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core.errors import OcmmError
from ocmm_shop.archive.checks import verify_archive
from ocmm_shop.archive.outbox import Courier, Outbox
from ocmm_shop.archive.questions import Query, cpk_by_month, parts, passed, today, trend, used
from ocmm_shop.archive.records import Delivery
from ocmm_shop.archive.stores import Acknowledgement, Archive, open_archive
from ocmm_shop.archive.stores._reader import JOB_FIELDS, RESULT_FIELDS, USE_FIELDS
from tests.shop.archive.conftest import Place
from tests.shop.archive.made_jobs import made_delivery, made_sender

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "station": ("name", "machine", "host", "since_utc"),
    "station_login": ("login", "station", "role", "since_utc"),
    "station_key": ("station", "key", "proof", "role", "since_utc"),
    "sender": ("outbox", "station", "machine", "username", "role", "since_utc"),
    "file": ("sha256", "size", "content"),
    "job": ("id", *JOB_FIELDS, "sound", "received_utc", "role"),
    "result": ("job", "part", "created_utc", *RESULT_FIELDS),
    "used": ("job", "created_utc", *USE_FIELDS),
    "delivery": ("outbox", "sequence", "job", "sha256", "sent_utc", "signature", "received_utc",
                 "role"),
    "finding": ("id", "kind", "subject", "document", "who", "utc", "role", "received_utc"),
    "mark": ("id", "job_uuid", "kind", "holds", "why", "who", "utc", "finding", "role",
             "received_utc"),
    "migration": ("version", "applied_utc", "program"),
}  # fmt: skip
"""Every column of every table."""
TEXTS = (
    "", " ", "x", "X" * 300, "x" * 100_000, "\0", "a\nb", "\x1b[2J\x1b[1;31mFAKE", "\x9b31m",
    "\u202egnp.exe", "\u2066x", "\u200b", "\ufeff", "\ud83d", "🙂", "=1+1", "+1", "-1", "@SUM(1)",
    "\uff1d1+1", "'; DROP TABLE job; --", "' OR '1'='1", "<script>alert(1)</script>", "<img src=x>",
    "%s%n", "${jndi:x}", "{{7*7}}", "../../etc/passwd", "C:\\x", "NULL", "None", "nan", "inf",
    "0x10", "1e400", "true", "2031-01-01T00:00:00.000+00:00", "2031", "1970-01-01T00:00:00.000Z",
    "9999-12-31T23:59:59.999+00:00", "Station 1", "Station 2", "station 1", "FLANGE", "P", "1",
    "PART CONFORMS", "CONFORM", "NOT PROVEN", "finished", "paused", "SIGNED", "SEALED", "FORGED",
    "0" * 64, "f" * 64, "0" * 36, "mm", "deg", "calibration", "local", "postgres", "station1",
)  # fmt: skip
NUMBERS = (
    0, 1, 2, -1, 7, 10**6, 2**31, 2**53, 2**63 - 1, 2**70, -(2**63), 0.0, -0.0, 0.5, 1e-300, 1e308,
    float("inf"), float("-inf"), float("nan"), True, False, None,
)  # fmt: skip
TAKEN = (
    "job_uuid", "head", "sha256", "station", "serial", "part", "key", "signature", "signer",
    "created_utc", "changed_utc", "steps", "calibration", "outbox", "sequence", "machine",
)  # fmt: skip
"""Columns that the attacker copies from another station."""
KINDS = (*TEXTS, *NUMBERS, *(("taken", name) for name in TAKEN))
HOWS = ("insert", "copy", "insert", "update", "insert", "delete")
"""Each column is attacked by all of them, one a round."""


@dataclass(slots=True)
class AttackCounts:
    """What became of the attacks."""

    tried: int = 0
    refused: int = 0
    allowed: int = 0
    named: int = 0
    """`tried`, `refused`, `allowed`, `named`: Attacks; by the server; that changed something; of
    these, named by verify."""
    effects: list[str] = field(default_factory=list)
    """Answers that differ although verify names nothing, and uploads that failed."""
    hidden: list[str] = field(default_factory=list)
    """Jobs of the other station that are gone, doubled or moved, named or not."""


class Shop:
    """Two stations on one server: one is attacked by the login of the other.

    Parameters
    ----------
    place
        An empty archive on a server.
    ours, theirs
        Job files of the station that is attacked, and of the attacker, each with its key.
    """

    def __init__(self, place: Place, ours: Mapping[Path, Path], theirs: Path, folder: Path) -> None:
        assert place.server is not None
        self.owner = place.address
        self.attacker = place.server.address(place.database, "station2")
        self.victim = place.server.address(place.database, "station1")
        self._folder = folder
        for path in ours:
            self.send("victim", self.victim, "Station 1", path)
        self.base = self.tables()
        self.theirs = theirs
        self.count = 10_000
        with open_archive(self.owner) as archive:
            self.answers = self.honest = answers(archive)
            self.victims = victims(archive)
            assert self.victims
            assert verify_archive(archive).faults == ()
            job = archive.record(1).job
            row = archive.query("SELECT outbox, sequence FROM delivery WHERE job = 1").rows[0]
            machine = archive.query("SELECT machine FROM station").rows[0][0]
        self.taken: dict[str, Any] = {name: getattr(job, name, None) for name in TAKEN}
        self.taken |= {"outbox": row[0], "sequence": row[1], "machine": machine}

    def send(self, box: str, address: str, station: str, path: Path) -> str:
        """Hand a file over as a computer does; return the obstacle."""
        with Outbox(self._folder / box) as outbox:
            outbox.put(path)
            with contextlib.closing(
                Courier(outbox, lambda: open_archive(address), station)
            ) as courier:
                handed = courier.send_waiting()
            return "" if handed.error is None else str(handed.error)

    def rows_of_theirs(self, archive: Archive) -> list[tuple[str, dict[str, Any]]]:
        """Return the rows that an honest delivery of the attacker consists of."""
        mine = "(SELECT id FROM job WHERE role = 'station2')"
        of = {
            "station": "name = 'Station 2'", "station_key": "role = 'station2'",
            "sender": "role = 'station2'", "job": "role = 'station2'",
            "file": "sha256 IN (SELECT sha256 FROM job WHERE role = 'station2')",
        }  # fmt: skip
        found: list[tuple[str, dict[str, Any]]] = []
        for table in OWN:
            rows = archive.query(f"SELECT * FROM {table} WHERE {of.get(table, f'job IN {mine}')}")  # noqa: S608
            found += [(table, dict(zip(rows.columns, row, strict=True))) for row in rows.rows]
        return found

    def tables(self) -> dict[str, set[Any]]:
        """Return the rows of all tables, but for the content of files."""
        with open_archive(self.owner) as archive:
            return {
                table: set(
                    archive.query(
                        f"SELECT {'sha256' if table == 'file' else '*'} FROM {table}"  # noqa: S608
                    ).rows
                )
                for table in COLUMNS
            }


def answers(archive: Archive) -> tuple[object, ...]:
    """Return the most frequent answers of an archive, without remarks."""
    found: list[object] = []
    lists = today(archive, Query(first=date(1971, 1, 1), last=date(8000, 1, 1), most=10**6))
    found.append(sorted(map(repr, (row[:8] for row in lists.rows))))
    found.append(sorted(map(repr, passed(archive, Query(most=10**6)).rows)))
    for part, name in parts(archive)[:2]:
        with contextlib.suppress(OcmmError):
            for question in (trend, cpk_by_month):
                answer = question(archive, Query(part=part, characteristic=name, most=10**6))
                found.append((part, name, sorted(map(repr, answer.rows))))
    for kind in ("plan", "probe", "rig"):
        (what,) = archive.query(
            "SELECT min(name) FROM archived_use WHERE used_kind = :kind", {"kind": kind}
        ).rows[0]
        answer = used(archive, Query(kind=kind, what=str(what), most=10**6))
        found.append(sorted(map(repr, (row[:7] for row in answer.rows))))
    return tuple(found)


def victims(archive: Archive) -> Counter[str]:
    """Return the lines of the attacked station in lists, and what there is of its jobs."""
    lists = today(archive, Query(first=date(1971, 1, 1), last=date(8000, 1, 1), most=10**6))
    found = Counter(repr(row[1:8]) for row in lists.rows if row[1] == "Station 1")
    # By SQL as well, as a dashboard queries.
    table = archive.query(
        "SELECT job_uuid, station, steps, serial, verdict, fault FROM archived_job"
        " WHERE job_uuid IN (SELECT job_uuid FROM job WHERE role = 'station1')"
    )
    return found + Counter(map(repr, table.rows))


def attack(
    shop: Shop, rng: random.Random, many: int, told: Callable[[str], None], first: int = 0
) -> AttackCounts:
    """Send hostile rows, each judged alone and removed afterwards.

    `first`: Number of the first one, which selects its column and its kind of statement.
    """
    outcome = AttackCounts()
    assert shop.send("attacker", shop.attacker, "Station 2", shop.theirs) == ""
    with open_archive(shop.owner) as archive:
        rows = shop.rows_of_theirs(archive)
    with contextlib.closing(open_archive(shop.attacker)) as station:
        take_away(shop)
        # With its own value there is nothing to refuse, and nothing to name.
        assert hostile(station, shop, rows, ("insert", "job", "serial"), "A-1")
        with open_archive(shop.owner) as archive:
            assert verify_archive(archive).faults == ()
            shop.honest = answers(archive)
            assert shop.honest != shop.answers
        take_away(shop)
        plan = [(table, column) for table, columns in COLUMNS.items() for column in columns]
        for number in range(first, first + many):
            table, column = plan[number % len(plan)]
            kind = rng.choice(KINDS)
            value = shop.taken[kind[1]] if isinstance(kind, tuple) else kind
            how = HOWS[(number % len(plan) + number // len(plan)) % len(HOWS)]
            what = f"{how} {table}.{column} {kind!r:.60}"
            outcome.tried += 1
            with contextlib.suppress(UnicodeError):
                if not hostile(station, shop, rows, (how, table, column), value):
                    outcome.refused += 1
                    continue
            judge(shop, what, outcome)
            told(what)
    return outcome


def hostile(
    station: Archive,
    shop: Shop,
    rows: list[tuple[str, dict[str, Any]]],
    where: tuple[str, str, str],
    value: object,
) -> bool:
    """Write one hostile value, within an otherwise good delivery if it belongs to one."""
    how, table, column = where
    try:
        with station._transaction():  # noqa: SLF001 - as a person with a tool of the server
            run = station._run  # noqa: SLF001
            if how == "update":
                return bool(run(f"UPDATE {table} SET {column} = :v RETURNING 1", {"v": value}).rows)  # type: ignore[dict-item]  # noqa: S608
            if how == "delete":
                return bool(
                    run(f"DELETE FROM {table} WHERE {column} = :v RETURNING 1", {"v": value}).rows  # type: ignore[dict-item]  # noqa: S608
                )
            if table not in OWN:
                return bool(run(*insert(table, {column: value})).rows)
            number: object = None
            changed = False
            for name, row in rows:
                cells = {one: cell for one, cell in row.items() if one not in GIVEN}
                if name in ("result", "used", "delivery"):
                    cells["job"] = number
                if how == "copy" and name == "job":
                    cells |= {
                        one: shop.taken[one] for one in ("job_uuid", "serial") if one != column
                    }
                if name == table and not changed:
                    cells[column] = value
                    changed = True
                made = run(*insert(name, cells, "id" if name == "job" else "1"))
                number = made.rows[0][0] if name == "job" else number
            return True
    except (OcmmError, OverflowError, TypeError, ValueError):
        return False


GIVEN = ("id", "received_utc", "role", "since_utc")
"""Columns that the server fills in."""
OWN = ("station", "station_key", "sender", "file", "job", "result", "used", "delivery")
"""Tables of an honest delivery, in their order."""


def insert(table: str, cells: Mapping[str, Any], back: str = "1") -> tuple[str, dict[str, Any]]:
    names, marks = ", ".join(cells), ", ".join(f":{name}" for name in cells)
    again = " ON CONFLICT DO NOTHING" if table == "file" else ""
    return f"INSERT INTO {table} ({names}) VALUES ({marks}){again} RETURNING {back}", dict(cells)  # noqa: S608


def judge(shop: Shop, what: str, outcome: AttackCounts) -> None:
    """Count unreported changes of an attack, and revert it."""
    outcome.allowed += 1
    shop.count += 1
    with open_archive(shop.owner) as archive:
        changed = answers(archive) not in (shop.answers, shop.honest)
        found = verify_archive(archive).faults
        outcome.named += bool(found)
        if changed and not found:
            outcome.effects.append(f"{what}: counted, and verify names nothing")
        if victims(archive) != shop.victims:
            outcome.hidden.append(what)
    with open_archive(shop.victim) as archive:
        try:
            receipt = archive.put(made_upload(shop))
            assert receipt.answer is Acknowledgement.STORED
        except (OcmmError, AssertionError) as error:
            outcome.effects.append(f"{what}: {error}")
    take_away(shop)


def made_upload(shop: Shop) -> Delivery:
    """Return the next job of the attacked station."""
    sender = msgspec.structs.replace(made_sender("Station 1"), machine=shop.taken["machine"])
    return made_delivery(shop.count, sender, sequence=shop.count)


def take_away(shop: Shop) -> None:
    """Remove all that came after the base, as the owner of the database."""
    assert shop.owner.startswith("postgresql:")
    import psycopg

    from ocmm_shop.archive.stores import parse_server

    with psycopg.connect(**parse_server(shop.owner, None).parameters()) as db:  # type: ignore[arg-type]
        db.execute("SET search_path = ocmm")
        for table in ("delivery", "used", "result", "job", "file", "sender", "station_key",
                      "station", "mark", "finding"):  # fmt: skip
            if table == "file":
                db.execute("DELETE FROM file WHERE sha256 NOT IN (SELECT sha256 FROM job)")
            elif table in ("used", "result"):
                db.execute(
                    f"DELETE FROM {table} WHERE job NOT IN (SELECT job FROM delivery)".encode()  # noqa: S608
                )
            elif table == "job":
                db.execute("DELETE FROM job WHERE id NOT IN (SELECT job FROM delivery)")
            elif table == "delivery":
                db.execute("DELETE FROM delivery WHERE role <> 'station1' OR sequence > 9999")
            elif table in ("sender", "station_key", "mark", "finding"):
                db.execute(f"DELETE FROM {table} WHERE role <> 'station1'".encode())  # noqa: S608
            else:
                db.execute("DELETE FROM station WHERE name NOT IN (SELECT station FROM sender)")
