"""What each role of a server may do, tried with the role itself."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

import pytest

from ocmm_core.errors import OcmmError, StorageError
from ocmm_shop.archive.records import MarkRow
from ocmm_shop.archive.stores import HEADS, Acknowledgement, open_archive
from ocmm_shop.archive.stores._store import Archive
from tests.shop.archive.conftest import TABLES, Place, by_hand
from tests.shop.archive.made_jobs import made_delivery, made_record, made_sender


@pytest.fixture
def shop(new_database: Callable[[], Place]) -> Place:
    return new_database()


def as_user(place: Place, user: str) -> Archive:
    assert place.server is not None
    return open_archive(place.server.address(place.database, user))


def test_a_station_hands_over_and_reads_what_arrived(shop: Place) -> None:
    with as_user(shop, "station1") as archive:
        archive.put(made_delivery(1))
        assert archive.last_sequence(made_delivery(1).sender.outbox) == 2
        assert archive.heads(made_record(1).job.job_uuid, "Station 1") == {
            10: made_record(1).job.head
        }
        assert archive.query("SELECT role FROM job").rows == (("station1",),)


def test_nobody_but_the_owner_changes_or_deletes(shop: Place) -> None:
    with as_user(shop, "station1") as archive:
        archive.put(made_delivery(1))
    for user in ("station1", "looker", "anna"):
        with as_user(shop, user) as archive:
            for table in TABLES:
                with pytest.raises(OcmmError):
                    by_hand(archive, f"DELETE FROM {table}")  # noqa: S608 - names above
                with pytest.raises(OcmmError):
                    by_hand(archive, f"TRUNCATE {table} CASCADE")
            for change in (
                "UPDATE job SET verdict = 'PART CONFORMS'",
                "UPDATE result SET value = 1.0",
                "UPDATE station SET name = 'X'",
                "DROP VIEW archived_job",
                "CREATE TABLE ocmm.mine (x int)",
                "SET ROLE postgres",
            ):
                with pytest.raises(OcmmError):
                    by_hand(archive, change)


def test_a_reader_reads_views_and_writes_nothing(shop: Place) -> None:
    with as_user(shop, "station1") as archive:
        archive.put(made_delivery(1))
    with as_user(shop, "looker") as archive:
        assert archive.query("SELECT count(*) FROM archived_result WHERE counted = 1").rows == (
            (3,),
        )
        with pytest.raises(StorageError, match="may not do that"):
            archive.put(made_delivery(2))
        with pytest.raises(StorageError, match="may not do that"):
            archive.content(made_record(1).job.sha256)
        with pytest.raises(StorageError, match="may not do that"):
            add_mark(archive)


def test_a_station_keeps_the_ends_of_its_histories_and_no_other_finding(shop: Place) -> None:
    utc = "2026-11-28T05:00:00+00:00"
    with as_user(shop, "station1") as archive:
        archive.add_finding(HEADS, "Station 1", "{}", "Station 1", utc)
        with pytest.raises(StorageError, match="may not do that"):
            archive.add_finding("recall", "B-17", "{}", "Station 1", utc)
        assert [one.kind for one in archive.findings()] == [HEADS]


def test_quality_marks_and_a_station_does_not(shop: Place) -> None:
    with as_user(shop, "station1") as archive:
        archive.put(made_delivery(1))
        with pytest.raises(StorageError, match="may not do that"):
            add_mark(archive)
        with pytest.raises(StorageError, match="may not do that"):
            archive.replace_computer("Station 1", made_delivery(1).sender)
    with as_user(shop, "anna") as archive:
        add_mark(archive)
        assert archive.query("SELECT role FROM archive_mark").rows == (("anna",),)
        with pytest.raises(StorageError, match="may not do that"):
            archive.put(made_delivery(2))
        archive.replace_computer("Station 1", made_delivery(1).sender)
        assert archive.content(made_record(1).job.sha256) == b"job file 1"


def test_a_station_cannot_say_that_somebody_else_added_a_row(shop: Place) -> None:
    with as_user(shop, "station1") as archive:
        archive.put(made_delivery(1))
        with pytest.raises(OcmmError):
            by_hand(
                archive,
                "INSERT INTO delivery (outbox, sequence, job, sha256, sent_utc, role)"
                " SELECT outbox, 99, job, sha256, sent_utc, 'anna' FROM delivery",
            )


def test_a_server_without_an_archive_is_told_and_only_its_owner_sets_it_up(shop: Place) -> None:
    server = shop.server
    assert server is not None
    server.sql("postgres", "CREATE DATABASE empty_one")
    with pytest.raises(StorageError, match="no archive in this database"):
        open_archive(server.address("empty_one"))
    with pytest.raises(StorageError):
        open_archive(server.address("empty_one", "station1"), set_up=True)
    with open_archive(server.address("empty_one"), set_up=True):
        pass
    with open_archive(server.address("empty_one"), set_up=True):
        pass


def test_a_login_that_is_not_known_is_told(shop: Place) -> None:
    assert shop.server is not None
    with pytest.raises(StorageError) as caught:
        open_archive(shop.server.address(shop.database, "nobody_here"))
    assert caught.value.code == "archive.login"


def add_mark(archive: Archive) -> None:
    utc = datetime.now(UTC).isoformat()
    mark = MarkRow(
        job_uuid=made_record(1).job.job_uuid, kind="quality", holds=True, why="Dirty.", who="Anna",
        utc=utc,
    )  # fmt: skip
    archive.add_finding("note", "", "{}", "Anna", utc, [mark])


def test_a_login_sends_as_a_station_only_when_quality_has_admitted_it(shop: Place) -> None:
    new = made_sender("Station 9", 9)
    with as_user(shop, "station2") as archive:
        with pytest.raises(StorageError, match="is not admitted as this station") as caught:
            archive.put(made_delivery(1, new))
        assert "ocmm archive admit LOGIN STATION" in caught.value.remedy
        # It reserves no name, and admits no login.
        assert archive.query("SELECT count(*) FROM station").rows == ((0,),)
        with pytest.raises(StorageError, match="may not do that"):
            archive.admit("station2", "Station 9")
    with as_user(shop, "anna") as archive:
        archive.admit("station2", "Station 9")
    with as_user(shop, "station2") as archive:
        archive.put(made_delivery(1, new))
        with pytest.raises(StorageError, match="is not admitted"):
            archive.put(made_delivery(2, made_sender("Station 1", 1)))


def test_a_number_of_an_outbox_belongs_to_its_login(shop: Place) -> None:
    ours, theirs = made_sender("Station 1", 1), made_sender("Station 2", 1)
    with as_user(shop, "station2") as archive:
        # The attacker has the identity of the other outbox, and uses up its numbers first.
        for number in range(1, 6):
            archive.put(made_delivery(50 + number, theirs, sequence=number))
    with as_user(shop, "station1") as archive:
        assert archive.last_sequence(ours.outbox) == 0
        assert archive.arrived(ours.outbox, [1, 2, 3]) == set()
        for number in range(1, 4):
            receipt = archive.put(made_delivery(number, ours, sequence=number))
            assert receipt.answer is Acknowledgement.STORED
        assert archive.last_sequence(ours.outbox) == 3
