"""The same tests on both stores: storage is complete, unique and unchanged."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime, timedelta

import msgspec
import pytest

from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_shop.archive.records import MarkRow
from ocmm_shop.archive.stores import VERSION, Acknowledgement
from tests.shop.archive.conftest import Place, by_hand
from tests.shop.archive.made_jobs import content_of, made_delivery, made_record, made_sender


def test_a_job_comes_back_as_it_was_given(place: Place) -> None:
    with place.open() as archive:
        given = made_delivery(4)
        receipt = archive.put(given)
        assert receipt.answer is Acknowledgement.STORED
        assert abs(receipt.clock_off_s) < 60.0
        assert archive.record(receipt.job) == given.record
        assert archive.content(given.record.job.sha256) == content_of(4)


def test_a_delivery_arrives_once_however_often_it_is_sent(place: Place) -> None:
    with place.open() as archive:
        first = archive.put(made_delivery(1))
        again = archive.put(made_delivery(1))
        # A restored outbox gives the same job another number.
        renumbered = archive.put(made_delivery(1, sequence=77))
        assert (again.answer, renumbered.answer) == (Acknowledgement.KNOWN, Acknowledgement.KNOWN)
        assert first.job == again.job == renumbered.job
        assert archive.query("SELECT count(*) FROM job").rows == ((1,),)
        assert archive.last_sequence(made_sender().outbox) == 77
        assert archive.arrived(made_sender().outbox, [1, 2, 77]) == {2, 77}


def test_two_jobs_under_one_number_are_told(place: Place) -> None:
    with place.open() as archive:
        archive.put(made_delivery(1, sequence=5))
        with pytest.raises(StorageError, match="share this outbox"):
            archive.put(made_delivery(2, sequence=5))
        assert archive.query("SELECT count(*) FROM job").rows == ((1,),)


def test_two_stations_of_one_name_are_told_and_one_may_replace_the_other(place: Place) -> None:
    other = made_sender("Station 1", 2)
    with place.open() as archive:
        archive.put(made_delivery(1))
        with pytest.raises(StorageError, match="another computer as station 'Station 1'"):
            archive.put(made_delivery(2, other))
        archive.replace_computer("Station 1", other)
        assert archive.put(made_delivery(2, other)).answer is Acknowledgement.STORED


def test_only_the_newest_version_of_a_job_is_seen(place: Place) -> None:
    with place.open() as archive:
        archive.put(made_delivery(1))
        archive.put(made_delivery(1, sequence=9, steps=20, head="c" * 64, state="paused"))
        assert archive.query("SELECT steps, state FROM archived_job").rows == ((20, "paused"),)
        assert set(archive.heads(made_record(1).job.job_uuid, "Station 1")) == {10, 20}
        assert archive.query("SELECT count(*) FROM archived_result").rows == ((3,),)


def test_a_mark_takes_a_job_out_of_statistics_until_one_of_its_kind_lifts_it(place: Place) -> None:
    job = made_record(1).job.job_uuid
    utc = datetime.now(UTC).isoformat()
    counted = "SELECT sum(counted) FROM archived_result"
    with place.open() as archive:
        archive.put(made_delivery(1))

        def mark(kind: str, *, holds: bool) -> int:
            row = MarkRow(
                job_uuid=job, kind=kind, holds=holds, why="Bar B-17.", who="Anna", utc=utc
            )
            return archive.add_finding("recall", "B-17", "{}", "Anna", utc, [row])

        assert archive.query(counted).rows == ((3,),)
        first = mark("recall", holds=True)
        assert archive.query(counted).rows == ((0,),)
        mark("quality", holds=False)
        assert archive.query(counted).rows == ((0,),)
        mark("recall", holds=False)
        assert archive.query(counted).rows == ((3,),)
        assert [one.id for one in archive.findings(first)] == [first + 1, first + 2]
        assert [row.holds for _, row in archive.marks()] == [True, False, False]
        assert archive.marks()[0][1].finding == first


def test_a_fault_of_the_file_takes_it_out_of_statistics_and_is_named(place: Place) -> None:
    with place.open() as archive:
        archive.put(made_delivery(1, fault="Altered after it was archived: step 3."))
        rows = archive.query("SELECT counted, why_not FROM archived_result").rows
        assert set(rows) == {(0, "Altered after it was archived: step 3.")}


def test_a_clock_that_is_wrong_is_seen(place: Place) -> None:
    with place.open() as archive:
        late = msgspec.structs.replace(
            made_delivery(1), sent_utc=(datetime.now(UTC) + timedelta(days=400)).isoformat()
        )
        assert archive.put(late).clock_off_s == pytest.approx(400 * 86400, abs=60)


def test_many_are_kept_all_or_none(place: Place) -> None:
    with place.open() as archive:
        wrong = msgspec.structs.replace(made_delivery(3), content=b"something else")
        with pytest.raises(InputError):
            archive.put_all([made_delivery(1), made_delivery(2), wrong])
        with pytest.raises(StorageError):
            archive.put_all([made_delivery(1, sequence=5), made_delivery(2, sequence=5)])
        assert archive.query("SELECT count(*) FROM job").rows == ((0,),)
        archive.put_all([made_delivery(seed) for seed in range(5)])
        assert archive.query("SELECT count(*) FROM file").rows == ((5,),)


def test_a_question_changes_nothing(place: Place) -> None:
    with place.open() as archive:
        archive.put(made_delivery(1))
        for sql in ("DELETE FROM result", "UPDATE job SET part = 'X'", "DROP TABLE mark"):
            with pytest.raises(OcmmError):
                archive.query(sql)
        assert archive.query("SELECT part FROM job").rows == (("FLANGE",),)
        archive.put(made_delivery(2))


def test_a_file_that_was_changed_in_the_archive_is_not_given_out(place: Place) -> None:
    with place.open() as archive:
        archive.put(made_delivery(1))
        sha256 = made_record(1).job.sha256
        with pytest.raises(StorageError, match="no job file"):
            archive.content(hashlib.sha256(b"other").hexdigest())
        if place.store == "sqlite":
            by_hand(archive, "UPDATE file SET content = :c", b"job file 9")
            with pytest.raises(StorageError, match="not as it was stored"):
                archive.content(sha256)
        else:
            # The server compares it itself.
            with pytest.raises(OcmmError):
                by_hand(archive, "UPDATE file SET content = :c", b"job file 9")


def test_an_archive_of_a_later_version_is_refused_with_a_sentence(place: Place) -> None:
    with place.open() as archive:
        if place.store == "sqlite":
            by_hand(archive, "PRAGMA user_version = 99")
        else:
            by_hand(archive, "INSERT INTO migration (version, program) VALUES (99, 'later')")
    with pytest.raises(StorageError, match=f"has version 99, this program knows {VERSION}"):
        place.open()


def test_a_month_has_the_scatter_of_the_batch_page(place: Place) -> None:
    from ocmm_core.tolerances.decisions import capability

    with place.open() as archive:
        archive.put_all([made_delivery(seed) for seed in range(30)])
        row = archive.query(
            "SELECT parts, mean, sigma_within, low, high FROM archive_month"
            " WHERE characteristic = 'D0'"
        ).rows
        values = archive.query(
            "SELECT value FROM archived_result WHERE characteristic = 'D0' ORDER BY created_utc"
        ).rows
    able = capability([float(str(v[0])) for v in values], 19.9, 20.1, 0.004)  # type: ignore[arg-type]
    assert len(row) == 1
    assert list(row[0]) == [
        30, pytest.approx(able.mean), pytest.approx(able.sigma_within, rel=1e-8), 19.9, 20.1,
    ]  # fmt: skip
