"""A job file stores the reference body of its points, and older files are migrated."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobHead, JobReference
from ocmm_core.storage._audit import MIGRATIONS, bring_up_to_date, insert_audited
from ocmm_core.storage._rows import row_from_head, row_from_point

MakePoint = Callable[[int], MeasuredPoint]


def reference() -> JobReference:
    spots = np.random.default_rng(1).normal(1000.0, 300.0, (2, 4, 2))
    spots[1, 2] = np.nan
    return JobReference('schema = "ocmm.reference/1"\n', spots, 2000)


def with_reference(point: MeasuredPoint) -> MeasuredPoint:
    spots = np.random.default_rng(point.number + 100).normal(1000.0, 300.0, (2, 4, 2))
    spots[0, 1] = np.nan
    return replace(point, reference_spots=spots)


def test_reference_and_its_spots_come_back_bit_for_bit(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    taken = [make_point(1), with_reference(make_point(2)), with_reference(make_point(3))]
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        assert job.reference() is None
        job.store_reference(reference())
        for point in taken:
            job.append_point(point)
    with JobFile.open(tmp_path / "a.ocmm", read_only=True) as job:
        found = job.reference()
        assert found is not None
        assert found.spots.tobytes() == reference().spots.tobytes()
        assert (found.text, found.n_frames) == (reference().text, 2000)
        first, *others = job.points()
        assert first.reference_spots is None
        for point, before in zip(others, taken[1:], strict=True):
            assert point.reference_spots is not None
            assert before.reference_spots is not None
            assert point.reference_spots.tobytes() == before.reference_spots.tobytes()
        assert job.verify() == []


def test_a_job_keeps_its_first_reference(tmp_path: Path, head: JobHead) -> None:
    with JobFile.create(tmp_path / "a.ocmm", head) as job:
        job.store_reference(reference())
        with pytest.raises(StorageError, match="already has a reference body"):
            job.store_reference(reference())


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("UPDATE reference SET n_frames = 5", "reference body was changed after it was stored"),
        (
            "UPDATE reference_observation SET spots_shape = '2,2,4'",
            "point 1 was changed after it was stored",
        ),
    ],
)
def test_a_changed_reference_is_not_given_out(
    tmp_path: Path, head: JobHead, make_point: MakePoint, statement: str, message: str
) -> None:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        job.store_reference(reference())
        job.append_point(with_reference(make_point(1)))
    db = sqlite3.connect(path)
    with pytest.raises(sqlite3.IntegrityError):
        db.execute(statement)
    table = statement.split()[1]
    db.execute(f"DROP TRIGGER {table}_no_update")
    db.execute(statement)
    db.commit()
    db.close()
    with JobFile.open(path) as job:
        with pytest.raises(StorageError, match=message):
            _ = job.reference(), job.points()
        assert len(job.verify()) == 1


def test_a_job_of_version_1_goes_on(tmp_path: Path, head: JobHead, make_point: MakePoint) -> None:
    path = tmp_path / "old.ocmm"
    db = sqlite3.connect(path, isolation_level=None)
    bring_up_to_date(db, path, MIGRATIONS[:1])
    db.execute("BEGIN")
    insert_audited(db, "head", row_from_head(head))
    insert_audited(db, "observation", row_from_point(make_point(1)))
    db.execute("COMMIT")
    db.close()
    with JobFile.open(path) as job:
        assert (tmp_path / "old.ocmm.v1.bak").exists()
        assert job.reference() is None
        with pytest.raises(StorageError, match="is not signed"):
            job.append_point(with_reference(make_point(2)))
        job.adopt("Ada", "made before jobs were signed")
        job.append_point(with_reference(make_point(2)))
        assert [point.number for point in job.points()] == [1, 2]
        assert job.verify() == []
