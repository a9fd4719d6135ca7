"""The outbox: durable, in order, once; and its messages about an archive that does not answer."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from ocmm_core.errors import OcmmError, StorageError
from ocmm_shop.archive.outbox import (
    BackOff,
    ConnectionState,
    Courier,
    HandOver,
    ItemState,
    Outbox,
    hand_over,
)
from ocmm_shop.archive.stores import open_archive
from ocmm_shop.archive.stores._store import Archive
from tests.shop.archive.conftest import Place
from tests.shop.archive.outbox_campaign import count, finish, quick_extract, run
from tests.shop.archive.real_jobs import RealJobs


def courier(outbox: Outbox, place: Place, station: str = "S") -> Courier:
    return Courier(outbox, place.open, station, quick_extract)


def put(outbox: Outbox, *numbers: int) -> None:
    for number in numbers:
        assert outbox.put_content(b"%d" % number, outbox.folder / f"{number}.ocmm") is not None


def delivered(place: Place) -> int:
    with place.open() as archive:
        return count(archive)[1]


def jobs(place: Place) -> int:
    with place.open() as archive:
        return int(str(archive.query("SELECT count(*) FROM job").rows[0][0]))


@pytest.fixture
def outbox(tmp_path: Path) -> Iterator[Outbox]:
    with Outbox(tmp_path / "outbox") as opened:
        yield opened


def test_what_waits_is_handed_over_once(outbox: Outbox, place: Place) -> None:
    put(outbox, 1, 2, 3)
    assert outbox.put_content(b"3", outbox.folder / "3.ocmm") is None
    one = courier(outbox, place)
    assert one.send_waiting().sent == 3
    assert one.send_waiting().sent == 0
    one.close()
    assert outbox.count(ItemState.SENT) == jobs(place) == 3
    assert hand_over(outbox.folder).line == ""


def test_a_real_job_is_handed_over_paused_and_then_finished(
    outbox: Outbox, place: Place, real_jobs: RealJobs
) -> None:
    one = Courier(outbox, place.open, "Station 1")
    outbox.put_content(real_jobs.paused_content, real_jobs.went_on)
    assert one.send_waiting().sent == 1
    outbox.put(real_jobs.went_on)
    outbox.put(real_jobs.finished)
    assert one.send_waiting().sent == 2
    one.close()
    with place.open() as archive:
        rows = archive.query("SELECT state, fault FROM archived_job ORDER BY changed_utc").rows
        assert rows == (("finished", ""), ("finished", ""))
        assert archive.query("SELECT count(*) FROM job").rows == ((3,),)


def test_an_archive_that_was_restored_from_a_backup_gets_again_what_it_lost(
    outbox: Outbox, tmp_path: Path
) -> None:
    file, backup = tmp_path / "a.sqlite", tmp_path / "backup.sqlite"
    place = Place(str(file), "sqlite")
    put(outbox, 1, 2)
    one = courier(outbox, place)
    one.send_waiting()
    one.close()
    shutil.copy(file, backup)
    put(outbox, 3, 4)
    one.send_waiting()
    one.close()
    shutil.copy(backup, file)
    for leftover in ("-wal", "-shm"):
        Path(f"{file}{leftover}").unlink(missing_ok=True)
    handed = one.send_waiting()
    one.close()
    assert (handed.again, handed.sent) == (2, 2)
    with place.open() as archive:
        assert count(archive)[0] == {1, 2, 3, 4}


def test_a_server_that_is_gone_is_said_since_when_and_what_waits(
    outbox: Outbox, tmp_path: Path
) -> None:
    place = Place(f"postgresql:///none?host={tmp_path}&user=nobody", "postgresql")
    put(outbox, 1, 2)
    one = courier(outbox, place)
    first = one.send_waiting()
    assert first.error is not None
    second = one.send_waiting()
    assert second.error is not None
    told = hand_over(outbox.folder)
    assert told.waiting == 2
    assert told.needs_attention
    if first.error.code == "archive.unreachable":
        assert told.line.startswith("2 jobs wait for the archive; server not reached since ")


def test_a_job_that_cannot_be_kept_is_set_aside_and_the_next_one_goes(
    outbox: Outbox, place: Place
) -> None:
    put(outbox, 1)
    outbox.put_content(b"no job at all", outbox.folder / "bad.ocmm")
    put(outbox, 2)
    one = Courier(
        outbox, place.open, "S",
        lambda content, name, station, known: quick_extract(content, name, station, known)
        if content.isdigit()
        else (_ for _ in ()).throw(StorageError("job.foreign", "It is no job.", "Look at it.")),
    )  # fmt: skip
    handed = one.send_waiting()
    one.close()
    assert (handed.sent, handed.aside) == (2, 1)
    assert [item.name for item in outbox.aside()] == ["bad.ocmm"]
    assert "1 job cannot be archived, bad.ocmm last: It is no job." in hand_over(outbox.folder).line
    outbox.try_aside_again()
    assert outbox.count(ItemState.WAITING) == 1


def test_a_real_file_that_is_no_job_is_set_aside(outbox: Outbox, place: Place) -> None:
    outbox.put_content(b"\0" * 5000, outbox.folder / "zeros.ocmm")
    one = Courier(outbox, place.open, "S")
    assert one.send_waiting().aside == 1
    one.close()


def test_a_copied_disk_is_told_and_given_an_outbox_of_its_own(
    outbox: Outbox, place: Place, tmp_path: Path
) -> None:
    shutil.copytree(outbox.folder, tmp_path / "copied")
    put(outbox, 1)
    one = courier(outbox, place)
    one.send_waiting()
    one.close()
    with Outbox(tmp_path / "copied") as copied:
        put(copied, 2)
        two = courier(copied, place)
        assert two.send_waiting().aside == 1
        two.close()
        assert "two computers share this outbox" in copied.aside()[0].said
        copied.renew()
        two = courier(copied, place)
        assert two.send_waiting().sent == 1
        two.close()
    assert jobs(place) == 2


def test_another_computer_of_this_name_waits_and_says_why(outbox: Outbox, place: Place) -> None:
    put(outbox, 1)
    one = courier(outbox, place)
    one.send_waiting()
    one.close()
    with Outbox(outbox.folder.parent / "other") as other:
        other.machine = "another computer"
        put(other, 2)
        two = courier(other, place)
        handed = two.send_waiting()
        two.close()
        assert handed.error is not None
        assert other.count(ItemState.WAITING) == 1
        assert "name of the station taken" in hand_over(other.folder).line


def test_copies_are_kept_for_a_month_and_then_removed(outbox: Outbox, place: Place) -> None:
    put(outbox, 1, 2)
    one = courier(outbox, place)
    one.send_waiting()
    one.close()
    put(outbox, 3)
    assert outbox.prune() == 0
    assert outbox.prune(datetime.now(UTC) + timedelta(days=31)) == 2
    assert outbox.content(outbox.waiting()[0]) == b"3"


def test_a_damaged_copy_is_sent_from_the_job_itself(
    outbox: Outbox, place: Place, real_jobs: RealJobs
) -> None:
    item = outbox.put(real_jobs.finished)
    assert item is not None
    (outbox.folder / "files" / item.sha256[:2] / item.sha256).write_bytes(b"damaged")
    one = Courier(outbox, place.open, "S")
    assert one.send_waiting().sent == 1
    one.close()


def test_an_outbox_of_something_else_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "box"
    folder.mkdir()
    (folder / "outbox.sqlite").write_bytes(b"not a database, and larger than a page" * 200)
    with pytest.raises(OcmmError):
        Outbox(folder)
    assert (folder / "outbox.sqlite").read_bytes().startswith(b"not a database")


def test_pauses_grow_and_are_not_the_same_for_all_stations() -> None:
    pauses = BackOff(random.Random(1))  # noqa: S311 - pauses
    found = [pauses.next_s() for _ in range(12)]
    assert found[0] <= 1.0
    assert all(150.0 <= pause <= 300.0 for pause in found[-2:])
    pauses.good()
    assert pauses.next_s() <= 1.0
    first = {BackOff(random.Random(seed)).next_s() for seed in range(20)}  # noqa: S311
    assert len(first) == 20


def test_a_wrong_clock_is_told() -> None:
    ahead = HandOver(0, (), ConnectionState(clock_off_s=3600.0))
    assert "60 min ahead of that of the archive" in ahead.line
    assert HandOver(0, (), ConnectionState(clock_off_s=-10.0)).line == ""


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_kills_and_disconnections_lose_and_double_nothing(
    place: Place,
    tmp_path: Path,
    repeats: Callable[..., int],
    record_property: Callable[[str, object], None],
) -> None:
    kills = repeats(30, 1000)
    folder = tmp_path / "box"
    Outbox(folder).close()
    cut = None
    if place.server is not None:
        import psycopg

        admin = psycopg.connect(
            host=str(place.server.socket), dbname=place.database, user=place.server.owner,
            autocommit=True,
        )  # fmt: skip

        def cut() -> None:
            admin.execute(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
                " WHERE application_name = 'ocmm' AND datname = current_database()"
            )

    def connect() -> Archive:
        return open_archive(place.address)

    done = run(folder, connect, kills, seed=22, cut=cut)
    before = delivered(place)
    if place.server is not None:
        admin.close()
    finish(folder, connect)
    with place.open() as archive:
        numbers, n_jobs, results, files = count(archive)
    record_property(
        f"{place.store}",
        f"{done.kills} kills, {done.cuts} disconnections, {len(done.said)} jobs acknowledged, "
        f"{before} of them delivered between kills, "
        f"{len(done.said - numbers)} lost, {n_jobs - len(numbers)} doubled",
    )
    assert done.said <= numbers
    assert n_jobs == files == len(numbers)
    assert results == 3 * n_jobs
    # Kills met both: putting in, and handing over.
    assert len(done.said) > kills // 10
    assert before > kills // 20
