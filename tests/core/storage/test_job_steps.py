"""Points and annulments in the order in which they became durable, page by page."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import StorageError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobHead

MakePoint = Callable[[int], MeasuredPoint]


def test_whoever_reads_on_gets_every_step_once_and_in_order(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    with JobFile.create(tmp_path / "j.ocmm", head) as job:
        assert job.steps() == []
        job.append_point(make_point(1))
        job.append_event("tip", "mounted")
        job.append_point(make_point(2))
        job.change(annul={1: "undo"})
        job.append_point(make_point(5))
        job.change(annul={5: "undo"})
        wanted = [(1, True), (2, True), (1, False), (5, True), (5, False)]
        for most in (1, 2, 3, 256):
            found, after = [], 0
            while steps := job.steps(after, most):
                assert len(steps) <= most
                found += steps
                after = steps[-1].sequence
            assert [(step.number, step.point is not None) for step in found] == wanted
        second = found[1].point
        assert second is not None
        np.testing.assert_array_equal(second.tip_world, make_point(2).tip_world)


def test_a_point_that_was_changed_is_not_given_out(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = tmp_path / "j.ocmm"
    with JobFile.create(path, head) as job:
        job.append_point(make_point(1))
    with closing(sqlite3.connect(path)) as db:
        db.execute("DROP TRIGGER observation_no_update")
        db.execute("UPDATE observation SET tip_radius = 1.4")
        db.commit()
    with JobFile.open(path) as job, pytest.raises(StorageError) as caught:
        job.steps()
    assert "point 1 was changed after it was stored" in caught.value.what


def test_reads_a_job_with_thousands_of_annulled_points(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    """5,000 points: a reading of quadratic cost exceeds the time of a job of its size."""
    first, count = make_point(1), 5000
    with JobFile.create(tmp_path / "j.ocmm", head) as job:
        job.change(append=[replace(first, number=number) for number in range(1, count + 1)])
        job.change(annul=dict.fromkeys(range(1, count + 1), "undo"))
        assert len(job.annulled()) == count
        assert job.points() == []
