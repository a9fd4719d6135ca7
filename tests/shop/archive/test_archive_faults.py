"""Faults of the archive, provoked on the real server: what each is called; nothing is lost."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from ocmm_core.cluster import Site
from ocmm_core.errors import InputError, StorageError
from ocmm_shop.archive.checks import verify_archive
from ocmm_shop.archive.outbox import Courier, Handed, Outbox, hand_over
from ocmm_shop.archive.questions import Query, parts, used
from ocmm_shop.archive.records import snapshot
from ocmm_shop.archive.stores import Archive, open_archive, parse_server
from ocmm_shop.archive.stores._postgresql import PostgresArchive
from tests.shop.archive.conftest import Place, Server
from tests.shop.archive.flaky_cable import FlakyCable
from tests.shop.archive.made_jobs import made_delivery, made_sender
from tests.shop.archive.outbox_campaign import quick_extract
from tests.shop.archive.real_jobs import RealJobs

LIMIT_MS = 1500
"""A statement and a silent server are given up after this, with five seconds of grace for the
latter: the product waits 30 s."""


@dataclass
class Bench:
    """A shop with one station, and a cable to its server."""

    place: Place
    server: Server
    cable: FlakyCable
    outbox: Outbox
    cable_folder: Path

    def __post_init__(self) -> None:
        self._made: list[Courier] = []
        self.courier = self.new_courier(self.outbox)

    def new_courier(self, outbox: Outbox) -> Courier:
        one = Courier(outbox, self.connect, "S", quick_extract)
        self._made.append(one)
        return one

    def connect(self) -> Archive:
        folder = self.cable_folder
        address = f"postgresql:///{self.place.database}?host={folder}&user={self.server.owner}"
        return PostgresArchive(replace(parse_server(address), limit_ms=LIMIT_MS))

    def put(self, *numbers: int) -> None:
        for number in numbers:
            self.outbox.put_content(b"%d" % number, self.outbox.folder / f"{number}.ocmm")

    def sql(self, *statements: str) -> None:
        self.server.sql(self.place.database, *statements)

    def numbers(self) -> set[int]:
        with self.place.open() as archive:
            rows = archive.query("SELECT content FROM file").rows
        return {int(row[0]) for row in rows if isinstance(row[0], bytes)}

    def close(self) -> None:
        for one in self._made:
            one.close()


@pytest.fixture
def bench(new_database: Callable[[], Place], tmp_path: Path) -> Iterator[Bench]:
    place = new_database()
    assert place.server is not None
    # The path of a socket is short.
    folder = Path(tempfile.mkdtemp(prefix="ocmm-cable-"))
    try:
        with (
            FlakyCable(folder, place.server.socket) as cable,
            Outbox(tmp_path / "outbox") as outbox,
        ):
            made = Bench(place, place.server, cable, outbox, folder)
            try:
                yield made
            finally:
                made.close()
    finally:
        shutil.rmtree(folder)


def gone(bench: Bench) -> Handed:
    """Pull the cable in the middle: one job is there, one is not."""
    bench.put(1)
    assert bench.courier.send_waiting().sent == 1
    bench.cable.pull()
    bench.put(2)
    return bench.courier.send_waiting()


def silent(bench: Bench) -> Handed:
    """Hold the cable: the server keeps the connection and stays silent."""
    bench.put(1)
    assert bench.courier.send_waiting().sent == 1
    bench.put(2)
    bench.cable.held.set()
    return bench.courier.send_waiting()


def slow(bench: Bench) -> Handed:
    """Lock a table for longer than a station waits."""
    import psycopg

    bench.put(1)
    with psycopg.connect(
        host=str(bench.server.socket), dbname=bench.place.database, user=bench.server.owner
    ) as db:
        db.execute("LOCK TABLE ocmm.job IN ACCESS EXCLUSIVE MODE")
        return bench.courier.send_waiting()


def full(bench: Bench) -> Handed:
    """Return the server's error for a full disk (SQLSTATE 53100)."""
    bench.sql(
        "CREATE FUNCTION ocmm.full_disk() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN RAISE"
        " 'could not extend file: No space left on device' USING ERRCODE = '53100'; END $$",
        "CREATE TRIGGER full_disk BEFORE INSERT ON ocmm.file EXECUTE FUNCTION ocmm.full_disk()",
    )
    bench.put(1)
    return bench.courier.send_waiting()


def newer(bench: Bench) -> Handed:
    """Bring the archive to a later version, as a newer program does."""
    bench.sql("INSERT INTO ocmm.migration (version, program) VALUES (99, 'later')")
    bench.put(1)
    return bench.courier.send_waiting()


def older(bench: Bench) -> Handed:
    """Take the archive back to its first version, as it was before an update of the stations."""
    bench.sql("DELETE FROM ocmm.migration WHERE version > 1")
    bench.put(1)
    return bench.courier.send_waiting()


def taken_name(bench: Bench) -> Handed:
    """Let another computer be this station."""
    with bench.place.open() as archive:
        archive.put(made_delivery(1, made_sender("S", 7)))
    bench.put(1)
    return bench.courier.send_waiting()


def no_login(bench: Bench) -> Handed:
    """Take the rights of the station away."""
    bench.sql(
        "DO $$ BEGIN CREATE ROLE nothing LOGIN; EXCEPTION WHEN duplicate_object THEN NULL; END $$"
    )
    bench.put(1)
    address = bench.server.address(bench.place.database, "nothing")
    courier = Courier(bench.outbox, lambda: open_archive(address), "S", quick_extract)
    with contextlib.closing(courier):
        return courier.send_waiting()


def triggered(bench: Bench, table: str, body: str, when: str = "BEFORE INSERT") -> Handed:
    """Install a trigger that acts on each row of a table."""
    kind = "CONSTRAINT TRIGGER" if "DEFERRED" in when else "TRIGGER"
    name = when.partition(" DEFERRED")[0]
    bench.sql(
        f"CREATE FUNCTION ocmm.odd() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN {body} END $$",
        f"CREATE {kind} odd {name} ON ocmm.{table}"
        f"{' DEFERRABLE INITIALLY DEFERRED' if 'DEFERRED' in when else ''}"
        " FOR EACH ROW EXECUTE FUNCTION ocmm.odd()",
    )
    bench.put(1)
    handed = bench.courier.send_waiting()
    with bench.place.open() as archive:
        assert archive.query("SELECT count(*) FROM delivery").rows == ((0,),)
    return handed


def dropping(bench: Bench) -> Handed:
    """Let the server acknowledge a delivery and keep nothing of it."""
    return triggered(bench, "delivery", "RETURN NULL;")


def changing(bench: Bench) -> Handed:
    """Let the server store other values than it is given."""
    return triggered(bench, "result", "NEW.value := NEW.value + 0.01; RETURN NEW;")


def changing_late(bench: Bench) -> Handed:
    """Let it do so when everything is done, at the end of the transaction."""
    return triggered(
        bench, "result", "UPDATE ocmm.result SET value = value + 0.01 WHERE job = NEW.job AND"
        " position = NEW.position; RETURN NULL;", "AFTER INSERT DEFERRED",
    )  # fmt: skip


@dataclass(frozen=True)
class Said:
    """A fault's name: its code, and the beginning of its line."""

    provoke: Callable[[Bench], Handed]
    code: str
    line: str
    remedy: str


FAULTS = {
    "dropping": Said(
        dropping, "archive.not_kept", "1 job waits for the archive; server keeps nothing since ",
        "looks for a trigger or rule that drops rows",
    ),
    "changing": Said(
        changing, "archive.changes",
        "1 job waits for the archive; server changes values since ",
        "looks for a trigger or rule that changes rows",
    ),
    "changing late": Said(
        changing_late, "archive.changes",
        "1 job waits for the archive; server changes values since ",
        "looks for a trigger or rule that changes rows",
    ),
    "gone": Said(
        gone, "archive.unreachable", "1 job waits for the archive; server not reached since ",
        "jobs wait here and are sent by themselves",
    ),
    "silent": Said(
        silent, "archive.slow", "1 job waits for the archive; server too slow since ",
        "It is tried again",
    ),
    "slow": Said(
        slow, "archive.slow", "1 job waits for the archive; server too slow since ",
        "It is tried again",
    ),
    "full": Said(
        full, "archive.full", "1 job waits for the archive; disk of the archive full since ",
        "Free disk space there",
    ),
    "newer": Said(
        newer, "archive.newer",
        "1 job waits for the archive; archive newer than this program since ",
        "Install the newer program on this station",
    ),
    "older": Said(
        older, "archive.older",
        "1 job waits for the archive; archive older than this program since ",
        "ocmm archive set-up",
    ),
    "name": Said(
        taken_name, "archive.station",
        "1 job waits for the archive; name of the station taken since ",
        "Give this station a name of its own",
    ),
    "rights": Said(
        no_login, "archive.rights", "1 job waits for the archive; rights missing since ",
        "Use a login of the right role",
    ),
}  # fmt: skip
"""Fault: its cause, and its message."""


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_has_its_sentence_and_the_job_waits(bench: Bench, fault: str) -> None:
    said = FAULTS[fault]
    handed = said.provoke(bench)
    assert handed.error is not None
    assert handed.error.code == said.code
    assert handed.aside == 0
    told = hand_over(bench.outbox.folder)
    assert told.waiting == 1
    assert told.line.startswith(said.line), told.line
    assert said.remedy in told.line
    assert told.needs_attention


def test_what_waited_is_sent_once_when_the_server_is_back(bench: Bench) -> None:
    handed = silent(bench)
    assert handed.error is not None
    bench.cable.held.clear()
    # Pauses grow up to five minutes; this test skips them.
    assert bench.courier.send_waiting().error is None
    assert bench.numbers() == {1, 2}
    with bench.place.open() as archive:
        assert archive.query("SELECT count(*) FROM job").rows == ((2,),)
    assert hand_over(bench.outbox.folder).line == ""


def test_a_server_that_was_restored_from_last_week_gets_again_what_it_lost(bench: Bench) -> None:
    name = bench.place.database
    bench.put(1, 2)
    bench.courier.send_waiting()
    bench.courier.close()
    bench.server.sql("postgres", f"CREATE DATABASE {name}_week TEMPLATE {name}")
    bench.put(3, 4)
    bench.courier.send_waiting()
    assert bench.numbers() == {1, 2, 3, 4}
    bench.courier.close()
    bench.server.sql(
        "postgres", f"DROP DATABASE {name} WITH (FORCE)",
        f"ALTER DATABASE {name}_week RENAME TO {name}",
    )  # fmt: skip
    assert bench.numbers() == {1, 2}
    handed = bench.courier.send_waiting()
    assert (handed.again, handed.sent, handed.error) == (2, 2, None)
    assert bench.numbers() == {1, 2, 3, 4}


def test_a_wrong_clock_is_told_by_that_of_the_server(bench: Bench) -> None:
    late = datetime.now(UTC) + timedelta(hours=26)
    with bench.place.open() as archive:
        receipt = archive.put(msgspec.structs.replace(made_delivery(1), sent_utc=late.isoformat()))
    bench.outbox.note_contact(None, receipt.clock_off_s)
    told = hand_over(bench.outbox.folder)
    assert "The clock of this computer is 1560 min ahead of that of the archive" in told.line
    assert told.needs_attention


def test_a_job_that_was_altered_after_it_was_archived_is_named_and_displaces_nothing(
    bench: Bench, real_jobs: RealJobs, tmp_path: Path
) -> None:
    path = tmp_path / "altered.ocmm"
    path.write_bytes(snapshot(real_jobs.finished))
    with contextlib.closing(Courier(bench.outbox, bench.connect, "S")) as courier:
        bench.outbox.put(path)
        assert courier.send_waiting().sent == 1
        with bench.place.open() as archive:
            before = archive.query("SELECT sum(counted), count(*) FROM archived_result").rows
            assert before[0][1] != 0
        with contextlib.closing(sqlite3.connect(path)) as db, db:
            for (name,) in db.execute(
                "SELECT name FROM sqlite_master WHERE type = 'trigger'"
            ).fetchall():
                db.execute(f"DROP TRIGGER {name}")
            db.execute("UPDATE observation SET chi2_per_dof = chi2_per_dof + 1 WHERE number = 1")
        bench.outbox.put(path)
        assert courier.send_waiting().sent == 1
    with bench.place.open() as archive:
        # The copy as it was archived first stays: what came later displaces nothing, and is named.
        assert archive.query("SELECT fault, others FROM archived_job").rows == (("", 1),)
        assert archive.query("SELECT sum(counted), count(*) FROM archived_result").rows == before
        (named,) = [why for _, why in verify_archive(archive).faults]
        assert "the job file is damaged (point 1 was changed" in named


def test_a_scheduler_without_tls_on_a_network_is_refused_unless_told() -> None:
    with pytest.raises(InputError, match="without TLS anybody in that network can run programs"):
        Site("tcp://10.0.0.7:8786").check()


def test_a_reader_and_a_station_are_offered_what_is_there(
    new_database: Callable[[], Place],
) -> None:
    shop = new_database()
    assert shop.server is not None
    with shop.open() as archive:
        archive.put_all([made_delivery(seed) for seed in range(4)])
    for user in ("looker", "station1", "anna"):
        with open_archive(shop.server.address(shop.database, user), read_only=True) as archive:
            assert parts(archive) == (("FLANGE", "D0"), ("FLANGE", "D1"), ("FLANGE", "D2"))
            answer = used(archive, Query(kind="artefact", what="B-17"))
            assert len(answer.rows) == 4


def test_a_clock_of_2099_does_not_remove_the_copies(bench: Bench) -> None:
    bench.put(1)
    assert bench.courier.send_waiting().sent == 1
    later = datetime(2099, 1, 1, tzinfo=UTC)
    ahead = (later - datetime.now(UTC)).total_seconds()
    bench.outbox.note_contact(None, ahead)
    assert bench.outbox.prune(later) == 0
    bench.outbox.note_contact(None, 0.0)
    assert bench.outbox.prune(later) == 1


def test_somebody_who_asks_cannot_end_the_transaction_in_which_nothing_is_written(
    new_database: Callable[[], Place],
) -> None:
    with new_database().open() as archive:
        with pytest.raises(StorageError):
            archive.query("COMMIT; CREATE TABLE ocmm.mine (x int)")
        assert archive.query("SELECT to_regclass('ocmm.mine') IS NULL").rows == ((True,),)
