"""The limits of a session and its method of poses are in the job file, and a job goes by them."""

from __future__ import annotations

import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation import FOR_COMPARISON, LIMITS_EVENT, SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import PointOptions, TouchCollector
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tracking import TrackingOptions, TrackingPipeline
from ocmm_sim.scene import VirtualRig, load_part
from tests.core.inspection.conftest import FRAME_RATE_HZ, Bench

STRICT = SessionOptions(max_form=1e-4, point=PointOptions(max_uncertainty=0.14))


def session_of(bench: Bench, job: JobFile, options: SessionOptions) -> InspectionSession:
    return InspectionSession(bench.plan, bench.rig, bench.body, job, options)


def test_a_job_is_computed_anew_with_its_own_limits(bench: Bench) -> None:
    with bench.job() as job:
        session = session_of(bench, job, STRICT)
        session.conditions.note_limits()
        session.conditions.note_limits()
        for touch in bench.touches:
            session.touches.record_touch(touch)
        view = session.view
        assert [event.kind for event in job.events()].count(LIMITS_EVENT) == 1
    again = reopen_job(job.path)
    assert (again.options.max_form, again.options.point) == (STRICT.max_form, STRICT.point)
    # No feature is as good as a tenth of a micrometre: by these limits none has a result.
    assert [item.fit for item in again.view.features] == [item.fit for item in view.features]
    assert all(item.fit is None for item in again.view.features)
    # A file without the record is of an older program: its limits were the default.
    older = bench.folder / "older.ocmm"
    with JobFile.create(older, again.head) as job:
        for point in again.points:
            job.append_point(point)
    assert reopen_job(older).options.max_form == SessionOptions().max_form
    assert all(item.fit is not None for item in reopen_job(older).view.features)


def test_other_limits_of_a_job_that_is_gone_on_with_are_stored_too(bench: Bench) -> None:
    with bench.job() as job:
        session_of(bench, job, STRICT).conditions.note_limits()
    with JobFile.open(job.path) as job:
        same, other = (session_of(bench, job, o) for o in (STRICT, SessionOptions()))
        same.conditions.note_limits()
        assert [event.kind for event in job.events()] == [LIMITS_EVENT]
        other.conditions.note_limits()
    assert reopen_job(job.path).options == SessionOptions()


def test_limits_that_cannot_be_read_are_refused(bench: Bench, job: JobFile) -> None:
    job.append_event(LIMITS_EVENT, '{"max_form": "wide"}')
    with pytest.raises(InputError, match="limits"):
        reopen_job(job.path)


def test_the_method_of_the_thesis_proves_nothing_and_is_no_doubt(bench: Bench) -> None:
    bed = [(feature.name, feature.points) for feature in bench.plan.features[:2]]
    part = load_part(resource("parts", "demo.toml"))
    virtual = VirtualRig(bench.rig, bench.body, part, bed, seed=1, frame_rate_hz=FRAME_RATE_HZ)
    pipeline = TrackingPipeline(bench.rig, bench.body, TrackingOptions(method="thesis"))
    options = SessionOptions(method="thesis")
    collector = TouchCollector(1.0 / FRAME_RATE_HZ, options.point)
    touches = collector.push(pipeline.process(virtual.frames(0, virtual.n_frames)))
    with bench.job() as job:
        session = session_of(bench, job, options)
        session.conditions.note_limits()
        for touch in touches:
            session.touches.record_touch(touch)
        view = session.view
    assert view.unproven == FOR_COMPARISON
    assert view.characteristics[1].verdict is Verdict.NOT_PROVEN
    again = reopen_job(job.path)
    assert again.doubts == ()
    assert again.view.characteristics == view.characteristics
    # It persists if a person continues with the other method.
    with JobFile.open(job.path) as job:
        assert session_of(bench, job, SessionOptions()).view.unproven == FOR_COMPARISON
    # The same points as if computed by the usual method: the file is suspect.
    forged = bench.folder / "forged.ocmm"
    with JobFile.create(forged, again.head) as job:
        for point in again.points:
            job.append_point(point)
    assert reopen_job(forged).differences != ()
