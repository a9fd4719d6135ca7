"""A station attacks the rows of another by its own login, and three computers send the same job."""

from __future__ import annotations

import contextlib
import random
import shutil
import sqlite3
import uuid
from collections.abc import Callable
from datetime import UTC, date, datetime
from pathlib import Path

import msgspec
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Touch
from ocmm_core.seals import KeyFolder, KnownEnd, recall, remember, shown_key
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import load_probe
from ocmm_shop.archive.checks import mark_altered, verify_archive
from ocmm_shop.archive.outbox import Courier, Outbox, exchange_heads
from ocmm_shop.archive.questions import Query, parts, passed, today, trend
from ocmm_shop.archive.records import Delivery, snapshot
from ocmm_shop.archive.stores import HEADS, Archive, open_archive
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench
from tests.host import amount
from tests.other_station import other_station
from tests.shop.archive.conftest import Place, by_hand
from tests.shop.archive.made_jobs import made_delivery, made_sender
from tests.shop.archive.row_attacks import COLUMNS, KINDS, Shop, attack

ATTACKS = 80
"""In one test, within its time limit."""
PIECES = amount(1, 25)
RESENDS = amount(3, 60)


def measure(bench: Bench, path: Path, serial: str, pause: Path | None = None) -> Path:
    """Measure the quick plan; the job as it was half-way goes to ``pause``."""
    head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial=serial)
    with JobFile.create(path, head) as job:
        session: InspectionSession = bench.session(job)
        half = len(bench.touches) // 2
        for touch in bench.touches[:half]:
            session.touches.record_touch(touch)
        if pause is not None:
            session.pausing.pause()
            pause.write_bytes(snapshot(path))
            session.pausing.resume()
        for touch in bench.touches[half:]:
            session.touches.record_touch(touch)
    return path


@pytest.fixture(scope="module")
def jobs(
    quick_touches: tuple[Touch, ...], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Path]:
    """Return files of the attacked station, and one of the attacker with its own key."""
    folder = tmp_path_factory.mktemp("attacked")
    bench = Bench(load_plan(PLAN), load_rig(RIG), load_probe(PROBE), quick_touches, folder)
    found = {"paused": folder / "paused.ocmm", "attacker": folder / "attacker"}
    found["one"] = measure(bench, folder / "one.ocmm", "V-1")
    found["two"] = measure(bench, folder / "two.ocmm", "V-2", found["paused"])
    with other_station(found["attacker"]):
        found["theirs"] = measure(bench, folder / "theirs.ocmm", "A-1")
        key = KeyFolder().station_key().public
    KeyFolder().trust(key, "Station 2", "Anna", "of the shop", datetime.now(UTC))
    return found


@pytest.fixture
def shop(new_database: Callable[[], Place], jobs: dict[str, Path], tmp_path: Path) -> Shop:
    ours = {jobs[name]: jobs[name] for name in ("paused", "one", "two")}
    return Shop(new_database(), ours, jobs["theirs"], tmp_path)


@pytest.mark.parametrize("piece", range(PIECES))
def test_a_station_cannot_hide_double_or_move_a_job_of_another_one(
    piece: int, shop: Shop, record_property: Callable[[str, object], None]
) -> None:
    assert len(KINDS) >= 100
    rng = random.Random(36 + piece)  # noqa: S311 - attacks that can be repeated
    outcome = attack(shop, rng, ATTACKS, lambda what: None, piece * ATTACKS)
    record_property(
        "rows",
        f"{outcome.tried} attacks on {sum(map(len, COLUMNS.values()))} columns with {len(KINDS)} "
        f"kinds: {outcome.refused} refused, {outcome.allowed} allowed, of them {outcome.named} "
        f"named; {len(outcome.effects)} effects, {len(outcome.hidden)} hidden",
    )
    assert outcome.effects == []
    assert outcome.hidden == []
    assert outcome.refused > ATTACKS // 3
    assert outcome.allowed > 0


def sent_from(
    place: Place, folder: Path, box: str, station: str, path: Path, login: str = ""
) -> str:
    """Send a file from a computer that has its own keys, or none at all."""
    address = place.address
    if login and place.server is not None:
        address = place.server.address(place.database, login)
    with Outbox(folder / box) as outbox:
        outbox.put(path)
        with contextlib.closing(Courier(outbox, lambda: open_archive(address), station)) as courier:
            handed = courier.send_waiting()
    return "" if handed.error is None else handed.error.code


def altered(path: Path, to: Path) -> Path:
    """Write a copy of a job in which a stored value was changed."""
    to.write_bytes(snapshot(path))
    with contextlib.closing(sqlite3.connect(to)) as db, db:
        for (name,) in db.execute(
            "SELECT name FROM sqlite_master WHERE type = 'trigger'"
        ).fetchall():
            db.execute(f"DROP TRIGGER {name}")
        db.execute("UPDATE observation SET chi2_per_dof = chi2_per_dof + 1 WHERE number = 1")
    return to


def lists(archive: Archive) -> tuple[list[tuple[object, ...]], list[tuple[object, ...]]]:
    days = Query(first=date(1971, 1, 1), last=date(8000, 1, 1))
    name = archive.query("SELECT min(characteristic) FROM archived_result WHERE part = 'P'").rows[
        0
    ][0]
    values = trend(archive, Query(part="P", characteristic=str(name))).rows
    return [row[:8] for row in today(archive, days).rows], [row[:9] for row in values]


def test_a_job_sent_again_by_three_computers_stays_where_it_is(
    place: Place,
    jobs: dict[str, Path],
    tmp_path: Path,
    record_property: Callable[[str, object], None],
) -> None:
    assert sent_from(place, tmp_path, "a", "Station 1", jobs["two"], "station1") == ""
    with place.open() as archive:
        before = lists(archive)
        assert len(before[0]) == 1
    bad = altered(jobs["two"], tmp_path / "altered.ocmm")
    rng = random.Random(36)  # noqa: S311 - resends that can be repeated
    files = {"untouched": jobs["two"], "altered": bad, "paused": jobs["paused"]}
    named = 0
    for number in range(RESENDS):
        kind = rng.choice(sorted(files))
        computer = ("with its key", "without keys", "with another key")[number % 3]
        folder = jobs["attacker"] if computer == "with another key" else tmp_path / "nobody"
        here = contextlib.nullcontext() if computer == "with its key" else other_station(folder)
        with here:
            login = "station1" if computer == "with its key" else "station2"
            station = "Station 1" if computer == "with its key" else "Station 2"
            box = f"box {computer}" if computer != "with its key" else "a"
            assert sent_from(place, tmp_path, box, station, files[kind], login) == ""
        with place.open() as archive:
            assert lists(archive) == before, f"{kind} {computer}"
            found = verify_archive(archive)
            # Only an altered copy must be named, and it stays in the archive.
            sent_bad = archive.query("SELECT count(*) FROM job WHERE sound = 0").rows[0][0]
            assert any("damaged" in why for _, why in found.faults) == bool(sent_bad)
            assert found.suspect == frozenset()
            named += bool(sent_bad)
            # Marking altered copies removes no good job from statistics.
            assert mark_altered(archive, found, "Anna") == 0
    record_property(place.store, f"{RESENDS} resends from 3 computers, {named} named, 0 displaced")


def test_lists_of_another_station_hide_none_of_this_one(
    place: Place, jobs: dict[str, Path], tmp_path: Path
) -> None:
    own, known = KeyFolder().station_key().public, KnownEnd(name="job 1", count=3, link="a" * 64)
    remember(known)
    assert sent_from(place, tmp_path, "a", "Station 1", jobs["one"], "station1") == ""
    with open_archive(login_of(place, "station1")) as archive:
        exchange_heads(archive, "Station 1")
    with open_archive(login_of(place, "station2")) as archive:
        for number in range(120):
            archive.add_finding(HEADS, "Station 1", f'{{"{number}":1}}', "x", "2026-11-28")
    with open_archive(login_of(place, "station1")) as archive:
        count = len(archive.findings())
        exchange_heads(archive, "Station 1")
        assert len(archive.findings()) == count
    with other_station(tmp_path / "third"), open_archive(login_of(place, "station2")) as archive:
        KeyFolder().trust(own, "Station 1", "Anna", "of the shop", datetime.now(UTC))
        exchange_heads(archive, "Station 3")
        learned = recall(known.name)
    assert learned is not None
    assert (learned.count, learned.link) == (known.count, known.link)


def test_a_key_that_is_unknown_here_is_shown_as_such(
    place: Place, jobs: dict[str, Path], tmp_path: Path
) -> None:
    for name in ("theirs", "one"):
        assert sent_from(place, tmp_path, "a", "Station 1", jobs[name]) == ""
    with place.open() as archive:
        days = Query(first=date(1971, 1, 1), last=date(8000, 1, 1))
        assert [row[8] for row in today(archive, days).rows if "key" in str(row[8])] == []
        shown = KeyFolder(jobs["attacker"] / "xdg_data_home" / "ocmm" / "keys").station_key()
        words = f"Signed by a key that is unknown here ({shown_key(shown.fingerprint)})."
        with other_station(tmp_path / "reader"):
            # Another reader, who trusts neither.
            rows = today(archive, days).rows
            assert [row[6] for row in rows] == ["NOT PROVEN", "NOT PROVEN"]
            assert words in {str(row[8]) for row in rows}
            answer = trend(archive, Query(part="P", characteristic=parts(archive)[0][1]))
            assert words in {str(row[9]) for row in answer.rows}
            assert answer.trends[0].values.size == 0
            assert passed(archive, Query()).rows == ()
            # An unknown key is not an alteration.
            assert verify_archive(archive).faults == ()


def test_an_invented_version_with_more_steps_hides_nothing(
    place: Place, jobs: dict[str, Path], tmp_path: Path
) -> None:
    """One station signs a later version of a job of another one, by its own key that is trusted."""
    assert sent_from(place, tmp_path, "a", "Station 1", jobs["one"], "station1") == ""
    with place.open() as archive:
        before = lists(archive)
        job = archive.record(1).job
    with other_station(jobs["attacker"]):
        own = made_delivery(
            5, made_sender("Station 2", 2), job_uuid=job.job_uuid, steps=10**6, part="FLANGE",
            serial=job.serial, created_utc="2031-01-01T00:00:00.000+00:00",
        )  # fmt: skip
    with open_archive(login_of(place, "station2")) as archive:
        archive.put(own)
    with place.open() as archive:
        assert lists(archive) == before
        (row,) = today(archive, Query(first=date(1971, 1, 1), last=date(8000, 1, 1))).rows
        assert "Other versions of this job, not shown: 1." in str(row[8])
        found = verify_archive(archive)
        assert any("job 5" in why or "no job file" in why or "damaged" in why or "not" in why
                   for _, why in found.faults)  # fmt: skip
        assert found.suspect == frozenset()


def test_a_signature_of_another_station_on_invented_rows_counts_nowhere(
    place: Place, jobs: dict[str, Path], tmp_path: Path
) -> None:
    """One station writes invented rows with the file and the signature of another one."""
    assert sent_from(place, tmp_path, "a", "Station 1", jobs["one"], "station1") == ""
    with place.open() as archive:
        before, real = lists(archive), archive.record(1)
        content = archive.content(real.job.sha256)
    invented = msgspec.structs.replace(
        real.job, job_uuid=str(uuid.UUID(int=5)), station="Station 2", serial="V-9"
    )
    sender = made_sender("Station 2", 2)
    with open_archive(login_of(place, "station2")) as archive:
        archive.put(
            Delivery(
                sender=sender, sequence=1, sent_utc=real.job.changed_utc, content=content,
                record=msgspec.structs.replace(real, job=invented),
            )
        )  # fmt: skip
    with place.open() as archive:
        days = Query(first=date(1971, 1, 1), last=date(8000, 1, 1))
        by_serial = {row[3]: row for row in today(archive, days).rows}
        assert by_serial["V-9"][1] == "Station 2"
        assert by_serial["V-9"][6] == "NOT PROVEN"
        assert str(by_serial["V-9"][8]).startswith("Sent by another station")
        assert [row for row in lists(archive)[0] if row[3] != "V-9"] == before[0]
        assert any("signed by the key of 'Station 1'" in why
                   for _, why in verify_archive(archive).faults)  # fmt: skip


def test_a_job_that_was_continued_at_another_station_is_one_job(
    place: Place, jobs: dict[str, Path], bench: Bench, tmp_path: Path
) -> None:
    assert sent_from(place, tmp_path, "a", "Station 1", jobs["paused"], "station1") == ""
    later = tmp_path / "later.ocmm"
    later.write_bytes(jobs["paused"].read_bytes())
    own = KeyFolder().station_key().public
    # With the key of the other station, and without its memory of the other store.
    shutil.copytree(jobs["attacker"] / "xdg_data_home", tmp_path / "b" / "xdg_data_home")
    with other_station(tmp_path / "b"):
        KeyFolder().trust(own, "Station 1", "Anna", "of the shop", datetime.now(UTC))
        with JobFile.open(later) as job:
            session = bench.session(job)
            session.pausing.resume()
            for touch in bench.touches[len(bench.touches) // 2 :]:
                session.touches.record_touch(touch)
        assert sent_from(place, tmp_path, "box b", "Station 2", later, "station2") == ""
    with place.open() as archive:
        rows = today(archive, Query(first=date(1971, 1, 1), last=date(8000, 1, 1))).rows
        assert [(row[1], row[3], row[5]) for row in rows] == [("Station 2", "V-2", "finished")]
        assert verify_archive(archive).faults == ()


@pytest.mark.parametrize("column", ["part", "created_utc", "serial", "fault", "verdict"])
def test_verify_names_a_column_that_is_not_of_the_file(
    place: Place, jobs: dict[str, Path], tmp_path: Path, column: str
) -> None:
    bad = altered(jobs["one"], tmp_path / "altered.ocmm")
    assert sent_from(place, tmp_path, "a", "Station 1", bad) == ""
    other = {
        "part": "FLANGE", "created_utc": "2031-01-01T00:00:00.000+00:00", "serial": "9",
        "fault": "Another fault.", "verdict": "PART CONFORMS",
    }[column]  # fmt: skip
    with place.open() as archive:
        by_hand(archive, f"UPDATE job SET {column} = '{other}'")  # noqa: S608 - names above
        # Row and file both have a fault, and are still compared.
        told = [why for _, why in verify_archive(archive).faults]
        assert any(f"{column} '{other}', by the file" in why for why in told), told


@pytest.mark.parametrize(("table", "column"), [("result", "part"), ("result", "created_utc"),
                                               ("used", "created_utc")])  # fmt: skip
def test_verify_names_what_rows_repeat_of_their_job(
    place: Place, jobs: dict[str, Path], tmp_path: Path, table: str, column: str
) -> None:
    assert sent_from(place, tmp_path, "a", "Station 1", jobs["one"]) == ""
    value = {"part": "FLANGE", "created_utc": "2031-01-01T00:00:00.000+00:00"}[column]
    with place.open() as archive:
        before = lists(archive)
        by_hand(archive, f"UPDATE {table} SET {column} = '{value}'")  # noqa: S608 - names above
        assert any("of another job" in why for _, why in verify_archive(archive).faults)
        # Values belong to the part of the job, independent of the row's other columns.
        if table == "result":
            assert lists(archive)[0] == before[0]
            assert archive.query("SELECT DISTINCT part FROM archived_result").rows == (("P",),)


def login_of(place: Place, user: str) -> str:
    return place.address if place.server is None else place.server.address(place.database, user)
