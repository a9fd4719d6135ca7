"""The nominal part in a job: stored once, shown at its estimated place, read back."""

from __future__ import annotations

import hashlib
import sqlite3

import numpy as np
import pytest

from ocmm_core.errors import StorageError
from ocmm_core.geometry import RigidTransform, rotation_from_vector
from ocmm_core.inspection.evaluation import SessionOptions, Whereabouts
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.inspection.session._job_view import placed
from ocmm_core.storage import JobFile, digest_row
from tests.core.inspection.conftest import Bench
from tests.part_models import block_part


def measured(session: InspectionSession, bench: Bench, count: int) -> None:
    for touch in bench.touches[:count]:
        session.touches.record_touch(touch)


def test_a_part_stands_in_the_middle_until_something_tells_where_it_is(bench: Bench) -> None:
    with bench.job() as job:
        session = bench.session(job)
        assert session.view.placed_part is None
        part = block_part()
        session.part.show(part)
        placed = session.view.placed_part
        assert placed is not None
        assert placed.is_rough
        assert placed.model is part
        middle = placed.T_world_from_model.apply(part.box.mean(axis=0))
        np.testing.assert_allclose(middle, bench.rig.volume_world.mean(axis=0), atol=1e-9)
        # World z is upwards in this rig.
        np.testing.assert_allclose(placed.T_world_from_model.rotation, np.eye(3), atol=1e-12)
        # The first one counts.
        session.part.show(block_part(length=5.0))
        assert session.view.placed_part is not None
        assert session.view.placed_part.model is part


def test_a_part_is_where_the_nominals_are(bench: Bench) -> None:
    near = RigidTransform(rotation_from_vector(np.array([0.0, 0.1, 0.2])), np.array([1.0, 2, 3]))
    with bench.job() as job:
        options = SessionOptions(near=near)
        session = InspectionSession(bench.plan, bench.rig, bench.body, job, options)
        part = block_part()
        session.part.show(part)
        before = session.view.placed_part
        measured(session, bench, 2)
        after = session.view.placed_part
        assert before is not None
        assert before.is_rough
        np.testing.assert_allclose(
            near.compose(before.T_world_from_model).translation, 0.0, atol=1e-12
        )
        # Moving points never recreate the part.
        assert after is not None
        assert after.model is part
    aligned = placed(part, Whereabouts(near, approximate=False), bench.rig)
    assert aligned is not None
    assert not aligned.is_rough


def test_a_job_opens_with_its_part(bench: Bench) -> None:
    part = block_part(cells=3)
    with bench.job() as job:
        session = bench.session(job)
        measured(session, bench, 3)
        session.part.show(part)
        path = job.path
    opened = reopen_job(path)
    assert opened.faults == ()
    assert opened.view.placed_part is not None
    np.testing.assert_array_equal(opened.view.placed_part.model.vertices, part.vertices)
    with JobFile.open(path) as job:
        again = InspectionSession(bench.plan, bench.rig, bench.body, job, SessionOptions())
        assert again.part.model is not None
        with pytest.raises(StorageError, match="already has a part"):
            job.store_part(part)


@pytest.mark.parametrize("chain", [False, True])
def test_a_part_that_was_changed_is_refused(bench: Bench, chain: bool) -> None:
    with bench.job() as job:
        job.store_part(block_part())
        path = job.path
    db = sqlite3.connect(path, isolation_level=None)
    db.execute("DROP TRIGGER part_no_update")
    db.execute("DROP TRIGGER audit_no_update")
    db.execute("UPDATE part SET content = ?", (b"OCMMPART" + bytes(100),))
    if chain:
        row = db.execute("SELECT id, source_name, source_sha256, content FROM part").fetchone()
        db.execute("UPDATE audit SET content_sha256 = ? WHERE subject = 'part'", (digest_row(row),))
    db.close()
    with JobFile.read(path) as job:
        with pytest.raises(StorageError, match=r"the part"):
            job.part()
        assert job.verify()


def test_jobs_without_a_part_have_none(bench: Bench) -> None:
    with bench.job() as job:
        assert job.part() is None
        digest = hashlib.sha256(job.path.read_bytes()).hexdigest()
        assert job.part() is None
        assert hashlib.sha256(job.path.read_bytes()).hexdigest() == digest


def test_what_is_touched_first_is_shown_before_anything_is_located(bench: Bench) -> None:
    with bench.job() as job:
        session = bench.session(job)
        view = session.view
        planned, first = view.planned, bench.plan.features[0]
        assert planned is not None
        assert planned.nominal is first
        assert planned.supposed
        # It is shown without guidance: a ring and a tone need a certain place.
        assert view.target is None
        assert all(feature.targets == () for feature in view.features)
        # The plan does not state its size: its middle is shown.
        assert len(planned.targets) == 1
        assert all(target.approximate for target in planned.targets)
        low, high = bench.rig.volume_world
        places = np.array([target.surface_world for target in planned.targets])
        assert (places > low).all()
        assert (places < high).all()
        # With a model the part is shown at the model's place.
        part = block_part()
        session.part.show(part)
        view = session.view
        assert view.placed_part is not None
        assert view.planned is not None
        there = view.planned.T_world_from_nominal
        np.testing.assert_allclose(
            there.translation, view.placed_part.T_world_from_model.translation, atol=1e-12
        )
        measured(session, bench, len(bench.touches))
        assert session.view.planned is None


def test_a_feature_stands_where_the_part_is_until_it_is_measured(bench: Bench) -> None:
    near = RigidTransform(rotation_from_vector(np.array([0.0, 0.1, 0.2])), np.array([1.0, 2, 3]))
    with bench.job() as job:
        session = InspectionSession(
            bench.plan, bench.rig, bench.body, job, SessionOptions(near=near)
        )
        view = session.view
        assert view.planned is not None
        assert not view.planned.supposed
        np.testing.assert_allclose(
            near.compose(view.planned.T_world_from_nominal).translation, 0.0, atol=1e-12
        )
