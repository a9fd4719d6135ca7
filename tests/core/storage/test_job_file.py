"""A job file returns its content bit for bit, and cannot be changed unnoticed."""

from __future__ import annotations

import dataclasses
import hashlib
import sqlite3
import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, tzinfo
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import InputError, StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import CLOCK, JobFile, JobHead, make_head
from tests.host import HANG_S

MakePoint = Callable[[int], MeasuredPoint]


def same(first: MeasuredPoint, second: MeasuredPoint) -> bool:
    """Return whether two points are equal in every bit, NaN included."""
    for field in dataclasses.fields(first):
        a, b = getattr(first, field.name), getattr(second, field.name)
        if isinstance(a, np.ndarray):
            if a.dtype != b.dtype or a.shape != b.shape or a.tobytes() != b.tobytes():
                return False
        elif type(a) is not type(b) or a != b:
            return False
    return True


def stored(path: Path, head: JobHead, points: list[MeasuredPoint]) -> None:
    with JobFile.create(path, head) as job:
        for point in points:
            job.append_point(point)


def tamper(path: Path, *statements: str) -> None:
    """Change a closed job file as an expert in SQLite could."""
    db = sqlite3.connect(path)
    for statement in statements:
        db.execute(statement)
    db.commit()
    db.close()


def test_points_come_back_bit_for_bit(tmp_path: Path, head: JobHead, make_point: MakePoint) -> None:
    taken = [make_point(number) for number in range(1, 30)]
    stored(tmp_path / "a.ocmm", head, taken)
    for read_only in (False, True):
        with JobFile.open(tmp_path / "a.ocmm", read_only=read_only) as job:
            found = job.points()
            assert len(found) == 29
            assert all(same(a, b) for a, b in zip(taken, found, strict=True))
            assert job.verify() == []


def test_an_unusual_nan_and_a_negative_zero_survive(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    spots = np.array([0x7FF8_0000_0000_1234, 0xFFF8_0000_0000_0000], dtype="<u8").view("<f8")
    point = dataclasses.replace(
        make_point(1),
        spots=spots.reshape(1, 1, 2),
        tip_world=np.array([-0.0, 5e-324, np.nextafter(1e7, 0.0)]),
    )
    stored(tmp_path / "a.ocmm", head, [point])
    with JobFile.open(tmp_path / "a.ocmm") as job:
        assert same(job.points()[0], point)


def test_points_given_back_may_be_changed_by_the_caller(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        job.append_point(make_point(1))
        job.points()[0].tip_world[:] = 0.0
        assert same(job.points()[0], make_point(1))


def test_arrays_in_other_memory_layouts_are_stored_by_value(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    point = make_point(1)
    turned = np.asfortranarray(point.rotation_world_from_probe)
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        job.append_point(dataclasses.replace(point, rotation_world_from_probe=turned))
        assert same(job.points()[0], point)


def test_a_negative_zero_time_is_no_fault_of_the_audit(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        job.append_point(dataclasses.replace(make_point(1), time_s=-0.0))
        assert job.verify() == []
        assert job.points()[0].time_s == 0.0


def test_the_head_comes_back_and_names_its_documents(tmp_path: Path, head: JobHead) -> None:
    stored(tmp_path / "a.ocmm", head, [])
    with JobFile.open(tmp_path / "a.ocmm") as job:
        assert job.head == head
        assert job.head.plan_identity == hashlib.sha256(head.plan_text.encode()).hexdigest()
        assert len({head.plan_identity, head.rig_identity, head.probe_identity}) == 3


def test_a_new_head_holds_the_documents_byte_for_byte(tmp_path: Path) -> None:
    content = {"plan": b"a = 1\r\n", "rig": "µ = 2\n".encode(), "probe": b""}
    paths = {name: tmp_path / f"{name}.toml" for name in content}
    for name, path in paths.items():
        path.write_bytes(content[name])
    heads = [make_head(**paths, operator="A", part="B", serial="C") for _ in range(2)]
    assert heads[0].rig_identity == hashlib.sha256(content["rig"]).hexdigest()
    assert heads[0].plan_text.encode() == content["plan"]
    assert heads[0].job_uuid != heads[1].job_uuid
    paths["rig"].unlink()
    with pytest.raises(InputError, match=r"rig\.toml"):
        make_head(**paths, operator="A", part="B", serial="C")


def test_undo_takes_a_point_out_and_its_number_is_not_used_again(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        assert job.next_number() == 1
        for number in (1, 2, 3):
            job.append_point(make_point(number))
        job.change(annul={3: "probe slipped"})
        assert job.next_number() == 4
    with JobFile.open(path) as job:
        assert [point.number for point in job.points()] == [1, 2]
        assert job.next_number() == 4
        assert job.verify() == []
        with pytest.raises(StorageError, match="already annulled"):
            job.change(annul={3: "again"})
        with pytest.raises(StorageError, match="point 9 is not in the job"):
            job.change(annul={9: "never taken"})
        with pytest.raises(StorageError, match="needs a new number"):
            job.append_point(make_point(3))
        job.append_point(make_point(4))
        assert [point.number for point in job.points()] == [1, 2, 4]
    db = sqlite3.connect(path)
    rows = db.execute("SELECT number FROM observation").fetchall()
    reasons = db.execute("SELECT number, reason FROM annulment").fetchall()
    db.close()
    assert rows == [(1,), (2,), (3,), (4,)]
    assert reasons == [(3, "probe slipped")]


def test_a_point_without_its_scalars_is_refused(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    nan = float("nan")
    bad = {
        "time_s": dataclasses.replace(make_point(1), time_s=nan),
        "tip_radius": dataclasses.replace(make_point(1), tip_radius=nan),
        "chi2_per_dof": dataclasses.replace(make_point(1), chi2_per_dof=nan),
    }
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        for field, point in bad.items():
            with pytest.raises(StorageError, match=f"Point 1 has {field} = nan"):
                job.append_point(point)
        assert job.points() == []
        job.append_point(make_point(1))


def test_a_point_of_the_wrong_shape_is_refused_and_leaves_no_trace(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        with pytest.raises(StorageError, match="rejected"):
            job.append_point(dataclasses.replace(make_point(1), tip_world=np.zeros(2)))
        assert job.next_number() == 1
        assert job.verify() == []


def test_text_that_no_file_can_hold_is_refused(tmp_path: Path, head: JobHead) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        with pytest.raises(StorageError, match="not valid text"):
            job.append_event("note", "\udcff")
        job.append_event("note", "µ")
        assert [event.text for event in job.events()] == ["µ"]


def test_events_keep_their_order(tmp_path: Path, head: JobHead) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        job.append_event("refusal", "Moving: hold the probe still.")
        job.append_event("camera", "Camera 2 lost 3 frames.")
        events = job.events()
        assert [event.kind for event in events] == ["refusal", "camera"]
        assert events[0].time_utc <= events[1].time_utc
        assert job.verify() == []


def test_a_job_is_never_overwritten(tmp_path: Path, head: JobHead, make_point: MakePoint) -> None:
    path = tmp_path / "a.ocmm"
    stored(path, head, [make_point(1)])
    before = path.read_bytes()
    with pytest.raises(StorageError, match="already"):
        JobFile.create(path, head)
    assert path.read_bytes() == before


def test_a_job_open_for_reading_takes_nothing(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = tmp_path / "a.ocmm"
    stored(path, head, [make_point(1)])
    before = path.read_bytes()
    with JobFile.open(path, read_only=True) as job:
        with pytest.raises(StorageError, match="opened read-only"):
            job.append_point(make_point(2))
        with pytest.raises(StorageError, match="opened read-only"):
            job.change(annul={1: "no"})
    assert path.read_bytes() == before
    assert [item.name for item in tmp_path.iterdir()] == ["a.ocmm"]


def test_a_closed_job_says_so_and_leaves_one_file(tmp_path: Path, head: JobHead) -> None:
    job = JobFile.create(tmp_path / "a.ocmm", head)
    job.close()
    job.close()
    with pytest.raises(StorageError, match="the job is closed"):
        job.points()
    assert [item.name for item in tmp_path.iterdir()] == ["a.ocmm"]


def test_a_second_program_cannot_open_a_job_that_is_measured(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        with pytest.raises(StorageError, match="in use by another program"):
            JobFile.open(path)
        job.append_point(make_point(1))
        with JobFile.open(path, read_only=True) as seen:
            assert len(seen.points()) == 1
        with pytest.raises(StorageError, match="in use by another program"):
            JobFile.open(path)
    with JobFile.open(path) as job:
        assert len(job.points()) == 1


def test_the_content_of_an_open_job_is_a_complete_job(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        job.append_point(make_point(1))
        (tmp_path / "b.ocmm").write_bytes(job.content())
        job.append_point(make_point(2))
    with JobFile.open(tmp_path / "b.ocmm") as copy:
        assert same(copy.points()[0], make_point(1))
        assert len(copy.points()) == 1
        # This station has seen the job go further.
        assert [fault[:25] for fault in copy.verify()] == ["1 of 3 steps that this co"]
        with pytest.raises(StorageError, match="older copy") as caught:
            copy.append_point(make_point(2))
        assert caught.value.code == "job.not_sealed"
        copy.adopt("Ada", "the disk of the job is lost")
        copy.append_point(make_point(2))
        assert copy.verify() == []


def test_threads_take_undo_and_read_at_once(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    count = 60
    taken = threading.Semaphore(0)
    problems: list[BaseException] = []

    def run(work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as error:
            problems.append(error)

    with JobFile.create(tmp_path / "a.ocmm", head) as job:

        def take() -> None:
            for number in range(1, count + 1):
                job.append_point(make_point(number))
                taken.release()

        def undo() -> None:
            for number in range(1, count + 1):
                assert taken.acquire(timeout=HANG_S)
                if number % 3 == 0:
                    job.change(annul={number: "every third"})

        def note() -> None:
            for index in range(count):
                job.append_event("note", str(index))
                job.points()

        threads = [threading.Thread(target=run, args=(work,)) for work in (take, undo, note)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(HANG_S)
        assert problems == []
        assert [p.number for p in job.points()] == [n for n in range(1, count + 1) if n % 3]
        assert len(job.events()) == count
        assert job.verify() == []


def test_a_point_and_its_replacement_change_together_or_not_at_all(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        job.append_point(make_point(1))
        with pytest.raises(StorageError) as caught:
            job.change(annul={1: "flipped"}, append=[make_point(1)])
        assert caught.value.code == "job.number"
        assert [point.number for point in job.points()] == [1]
        job.change(annul={1: "flipped"}, append=[make_point(2)])
        assert [point.number for point in job.points()] == [2]
        assert job.verify() == []


@pytest.mark.parametrize("table", ["head", "observation", "annulment", "event", "audit"])
@pytest.mark.parametrize(
    "statement",
    [
        "DELETE FROM {0}",
        "UPDATE {0} SET rowid = 77",
        "INSERT OR REPLACE INTO {0} SELECT * FROM {0}",
    ],
)
def test_stored_rows_refuse_to_be_changed(
    tmp_path: Path, head: JobHead, make_point: MakePoint, table: str, statement: str
) -> None:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        job.append_point(make_point(1))
        job.append_point(make_point(2))
        job.change(annul={2: "test"})
        job.append_event("note", "test")
    with pytest.raises(sqlite3.IntegrityError, match=f"rows of {table} are never changed"):
        tamper(path, statement.format(table))


_TAMPERINGS = {
    "a changed value": (
        [
            "DROP TRIGGER observation_no_update",
            "UPDATE observation SET feature = 'X' WHERE number = 2",
        ],
        ["The observation 2 was changed after it was stored."],
    ),
    "a point removed": (
        ["DROP TRIGGER observation_no_delete", "DELETE FROM observation WHERE number = 2"],
        ["The observation 2 of the audit is missing."],
    ),
    "a point slipped in": (
        [
            "INSERT INTO observation SELECT 9, feature, time_s, first_frame, last_frame, n_frames,"
            " tip_world, random_covariance, direction, tip_radius, rotation_world_from_probe,"
            " spots_shape, spots, chi2_per_dof, approach FROM observation WHERE number = 1"
        ],
        ["The observation 9 is not in the audit."],
    ),
    "a point removed with its link": (
        [
            "DROP TRIGGER observation_no_delete",
            "DROP TRIGGER audit_no_delete",
            "DELETE FROM observation WHERE number = 2",
            "DELETE FROM audit WHERE subject = 'observation' AND key = 2",
        ],
        [
            "The audit jumps from row 2 to row 4.",
            "Audit row 4 does not follow from the row before it.",
        ],
    ),
    "a link changed": (
        [
            "DROP TRIGGER audit_no_update",
            "UPDATE audit SET time_utc = '2020-01-01T00:00:00' WHERE sequence = 2",
        ],
        ["Audit row 2 was changed."],
    ),
    "a link repeated": (
        ["INSERT INTO audit SELECT 9, time_utc, subject, key, content_sha256, previous, hash FROM"
         " audit WHERE sequence = 3"],
        [
            "The audit jumps from row 4 to row 9.",
            "Audit row 9 does not follow from the row before it.",
            "Audit row 9 was changed.",
            "Audit row 9 records observation 2 a second time.",
        ],
    ),
    "another operator": (
        ["DROP TRIGGER head_no_update", "UPDATE head SET operator = 'Somebody'"],
        ["The head 1 was changed after it was stored."],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", _TAMPERINGS)
def test_tampering_shows_in_the_audit(
    tmp_path: Path, head: JobHead, make_point: MakePoint, kind: str
) -> None:
    statements, expected = _TAMPERINGS[kind]
    path = tmp_path / "a.ocmm"
    stored(path, head, [make_point(number) for number in (1, 2, 3)])
    tamper(path, *statements)
    with JobFile.open(path) as job:
        # Who changes a step before the last one leaves the signature on that as it was.
        assert [fault for fault in job.verify() if "not signed" not in fault] == expected


def test_a_changed_observation_is_not_given_out(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = tmp_path / "a.ocmm"
    stored(path, head, [make_point(1), make_point(2)])
    tamper(
        path,
        "DROP TRIGGER observation_no_update",
        "UPDATE observation SET tip_world = zeroblob(24) WHERE number = 2",
    )
    with (
        JobFile.open(path) as job,
        pytest.raises(StorageError, match="point 2 was changed after it was stored"),
    ):
        job.points()


def test_a_commit_is_synced_and_the_file_is_held_alone(tmp_path: Path, head: JobHead) -> None:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        job.close()
    with JobFile.open(path) as job:
        db = job._db  # noqa: SLF001 - whether a commit waits for the disk cannot be seen from outside
        assert db is not None
        found = [
            db.execute(f"PRAGMA {name}").fetchone()[0]
            for name in ("journal_mode", "synchronous", "locking_mode", "foreign_keys")
        ]
    assert found == ["wal", 2, "exclusive", 1]


def test_times_of_a_job_never_run_backwards_and_a_clock_set_back_is_told(
    tmp_path: Path,
    head: JobHead,
    make_point: Callable[[int], MeasuredPoint],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = {"shift": timedelta()}

    class Shifted(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> datetime:  # type: ignore[override]
            return datetime.now(tz) + clock["shift"]

    monkeypatch.setattr("ocmm_core.storage._audit.datetime", Shifted)
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        # Forwards, corrected by less than a minute, back by a day, by a year, and right again.
        for number, days in enumerate((0.0, 1.0, 0.9999, 0.0, -365.0, 2.0, 1.0), start=1):
            clock["shift"] = timedelta(days=days)
            job.append_point(make_point(number))
        times = [step.time_utc for step in job.audited()]
        assert times == sorted(times)
        assert list(job.taken_utc().values()) == sorted(job.taken_utc().values())
        # A day back, a year more behind the same step, and a day back from two.
        told = [event.text for event in job.events() if event.kind == CLOCK]
        assert len(told) == 2
        assert job.verify() == []
    monkeypatch.undo()
    reopened = datetime.fromisoformat(times[-1])
    assert reopened > datetime.now(UTC) + timedelta(days=1)
