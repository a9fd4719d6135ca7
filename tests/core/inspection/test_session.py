"""A job point by point: the session on real touches of the virtual rig and a real job file."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest

from ocmm_core.alignment import DatumAlignment, SavedFrame
from ocmm_core.errors import MeasuringError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.evaluation import FeatureState, JobView, SessionOptions
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.inspection.session._job_view import view_of
from ocmm_core.measuring import MeasuredPoint, PointOptions, Refusal, RefusalCode
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import PartWord, Verdict
from ocmm_core.tolerances.zones import Characteristic
from tests.core.inspection.conftest import Bench
from tests.host import HANG_S


def take_all(session: InspectionSession, bench: Bench) -> None:
    for touch in bench.touches:
        assert isinstance(session.touches.record_touch(touch), MeasuredPoint)


def test_features_follow_each_other_and_the_job_completes(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    assert session.view.active == "BED"
    assert session.steps.missing() == [("BED", 4), ("BLOCK_TOP", 4), ("SPHERE", 6)]
    for touch in bench.touches[:4]:
        session.touches.record_touch(touch)
    assert session.view.active == "BLOCK_TOP"
    for touch in bench.touches[4:]:
        session.touches.record_touch(touch)
    view = session.view
    assert view.complete
    assert [feature.state for feature in view.features] == [FeatureState.DONE] * 3
    assert [result.verdict for result in view.characteristics] == [Verdict.CONFORM] * 2
    # 19.989 mm and 20.342 mm are the true values of the part; the seed is fixed.
    for result, true in zip(view.characteristics, (19.989, 20.342), strict=True):
        assert result.measured is not None
        assert result.uncertainty is not None
        assert abs(result.measured - true) < 1.5 * result.uncertainty < 0.05


def test_every_point_is_in_the_job_file_before_it_is_told(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    for count, touch in enumerate(bench.touches, start=1):
        told = session.touches.record_touch(touch)
        stored = job.points()
        assert isinstance(told, MeasuredPoint)
        assert len(stored) == count
        assert stored[-1].number == told.number
        np.testing.assert_array_equal(stored[-1].tip_world, told.tip_world)


def test_a_job_goes_on_where_it_was_interrupted_with_the_same_results(bench: Bench) -> None:
    with bench.job() as job:
        session = bench.session(job)
        take_all(session, bench)
        whole = session.view
        path = job.path
    with JobFile.open(path) as again:
        assert bench.session(again).view.characteristics == whole.characteristics
        assert bench.session(again).view.complete


def test_whoever_looks_never_holds_up_a_touch(
    bench: Bench, job: JobFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = bench.session(job)
    for touch in bench.touches[:4]:
        session.touches.record_touch(touch)
    looking, go_on = threading.Event(), threading.Event()

    def slow(*arguments: Any) -> JobView:
        looking.set()
        assert go_on.wait(HANG_S)
        return view_of(*arguments)

    monkeypatch.setattr("ocmm_core.inspection.session._session.view_of", slow)
    seen: list[JobView] = []
    thread = threading.Thread(target=lambda: seen.append(session.view))
    thread.start()
    assert looking.wait(HANG_S)
    # The view is being computed, and points are taken and taken back all the same.
    assert isinstance(session.touches.record_touch(bench.touches[4]), MeasuredPoint)
    session.steps.undo()
    assert isinstance(session.touches.record_touch(bench.touches[4]), MeasuredPoint)
    assert not seen
    go_on.set()
    thread.join(10.0)
    # A view shows the job at the time of the call; the next view contains later points.
    assert [len(item.points) for item in seen[0].features] == [4, 0, 0]
    assert [len(item.points) for item in session.view.features] == [4, 1, 0]
    assert session.view is session.view


def test_the_frame_of_a_virtual_rig_proves_nothing_about_a_real_part(
    bench: Bench, job: JobFile
) -> None:
    frame = SavedFrame(
        name="bed", digest="", rotation=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        translation=(0.0, 0.0, 0.0), simulated=True,
    )  # fmt: skip
    plan = msgspec.structs.replace(bench.plan, alignment=frame)
    session = InspectionSession(plan, bench.rig, bench.body, job, SessionOptions())
    take_all(session, bench)
    real = session.view
    assert "Frame bed of the plan is SIMULATED" in real.unproven
    assert real.part_verdict.word is PartWord.NOT_PROVEN
    # On a virtual rig it is as good as the part.
    session.conditions.note_origin(simulated=True)
    virtual = session.view
    assert virtual.unproven == ""
    assert virtual.part_verdict.word is PartWord.CONFORMS


def test_an_interrupted_touch_gives_no_point(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    whole = bench.touches[0]
    refused = session.touches.record_touch(replace(whole, interrupted=True))
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.GAP
    assert "interrupted" in refused.what
    assert not job.points()
    assert isinstance(session.touches.record_touch(whole), MeasuredPoint)


def test_undo_takes_the_last_point_back_and_keeps_its_observation(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    for touch in bench.touches[:5]:
        session.touches.record_touch(touch)
    assert session.view.active == "BLOCK_TOP"
    session.steps.undo()
    session.steps.undo()
    view = session.view
    assert view.active == "BED"
    assert [len(feature.points) for feature in view.features] == [3, 0, 0]
    assert [point.number for point in job.points()] == [1, 2, 3]
    assert job.verify() == []
    told = session.touches.record_touch(bench.touches[3])
    # Numbers are never used twice.
    assert isinstance(told, MeasuredPoint)
    assert told.number == 6


def test_undo_without_a_point_says_so(bench: Bench, job: JobFile) -> None:
    with pytest.raises(MeasuringError, match="No point"):
        bench.session(job).steps.undo()


def test_flip_turns_the_arrow_and_the_wrong_side_gives_no_number(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    take_all(session, bench)
    before = session.view.features[2].points[-1]
    session.points.flip()
    after = session.view.features[2].points[-1]
    np.testing.assert_array_equal(after.direction, -before.direction)
    assert (after.approach, after.number) == ("flipped", before.number + 1)
    ball = session.view.characteristics[0]
    assert ball.verdict is Verdict.NOT_MEASURED
    assert ball.measured is None
    assert f"{after.number}" in ball.note
    session.points.flip()
    assert session.view.characteristics[0].verdict is Verdict.CONFORM


def test_finish_needs_the_minimum_of_the_shape(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    for touch in bench.touches[:2]:
        session.touches.record_touch(touch)
    with pytest.raises(MeasuringError, match="BED has 2 of the 3 points"):
        session.steps.finish()
    session.touches.record_touch(bench.touches[2])
    session.steps.finish()
    assert session.view.active == "BLOCK_TOP"
    assert session.view.features[0].state is FeatureState.DONE


def test_looking_back_changes_no_verdict_and_no_count(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    take_all(session, bench)
    before, events = session.view, len(job.events())
    for name in ("BED", "SPHERE", "BLOCK_TOP"):
        session.steps.select(name)
        view = session.view
        assert (view.looked_at, view.shown) == (name, view.feature(name))
        assert replace(view, looked_at="") == before
        assert not view.shows_part
    session.steps.select("")
    assert session.view == before
    assert session.view.shows_part
    assert len(job.events()) == events


def test_a_feature_stays_in_sight_when_its_only_point_is_deleted(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    while session.view.active == "BED":
        session.touches.record_touch(bench.touches[len(session.view.features[0].points)])
    done = len(session.view.features[0].points)
    session.touches.record_touch(bench.touches[done])
    active = session.view.active
    [point] = session.view.feature(active).points
    session.points.delete_point(point.number, "a burr")
    shown = session.view.shown
    assert shown is not None
    assert (shown.name, len(shown.deleted)) == (active, 1)
    session.points.restore_point(point.number)
    assert session.view.shown == session.view.feature(active)


def test_reopening_a_feature_is_a_step_that_can_be_taken_back(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    take_all(session, bench)
    before = session.view
    session.steps.select("BED")
    session.steps.reopen()
    view = session.view
    assert (view.active, view.complete, view.undo) == ("BED", False, "reopen of BED")
    assert view.part_verdict.word is PartWord.NOT_COMPLETE
    with pytest.raises(MeasuringError, match="BED is open"):
        session.steps.reopen("BED")
    session.steps.undo()
    again = session.view
    assert again.complete
    assert again.characteristics == before.characteristics
    session.steps.redo()
    assert bench.session(job).view.active == "BED"


def test_an_unknown_feature_is_refused(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    with pytest.raises(MeasuringError, match="'HOLE'"):
        session.steps.select("HOLE")
    with pytest.raises(MeasuringError, match="'HOLE'"):
        session.steps.reopen("HOLE")


def test_a_point_that_belongs_elsewhere_takes_the_result_away(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    # Three touches of the bed, one of the block: a plane through them is 20 mm off its points.
    for touch in (*bench.touches[:3], bench.touches[4]):
        session.touches.record_touch(touch, "BED")
    bed = session.view.features[0]
    assert bed.fit is None
    assert "scatter" in bed.note
    step = session.view.characteristics[1]
    assert (step.verdict, step.measured, step.uncertainty) == (Verdict.NOT_MEASURED, None, None)


def test_after_the_last_feature_a_touch_is_refused(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    take_all(session, bench)
    refused = session.touches.record_touch(bench.touches[0])
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.NO_FEATURE
    assert session.view.refusal is refused
    assert len(job.points()) == 14


def test_a_touch_without_approach_is_refused(bench: Bench, job: JobFile) -> None:
    touch = bench.touches[0]
    refused = bench.session(job).touches.record_touch(
        replace(touch, trail_world=touch.trail_world[:0])
    )
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.NO_APPROACH
    assert job.points() == []


def test_a_touch_outside_the_calibrated_volume_is_refused(bench: Bench, job: JobFile) -> None:
    small = replace(bench.rig, volume_world=0.1 * bench.rig.volume_world)
    session = InspectionSession(bench.plan, small, bench.body, job, SessionOptions())
    refused = session.touches.record_touch(bench.touches[0])
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.OUTSIDE


def test_a_touch_that_would_be_too_uncertain_is_refused(bench: Bench, job: JobFile) -> None:
    strict = SessionOptions(point=PointOptions(max_uncertainty=0.001))
    session = InspectionSession(bench.plan, bench.rig, bench.body, job, strict)
    refused = session.touches.record_touch(bench.touches[0])
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.UNCERTAIN
    assert "0.001" in refused.what


def test_a_point_that_cannot_be_stored_is_no_point(bench: Bench) -> None:
    job = bench.job()
    session = bench.session(job)
    session.touches.record_touch(bench.touches[0])
    job.close()
    with pytest.raises(Exception, match="closed"):
        session.touches.record_touch(bench.touches[1])
    assert len(session.view.features[0].points) == 1


def test_a_point_approached_aslant_is_not_compensated(bench: Bench, job: JobFile) -> None:
    alignment = DatumAlignment(primary="BED", secondary=("SPHERE", "CORNER"), origin="SPHERE")
    corner = NominalFeature(name="CORNER", shape=Shape.POINT, points=1, point=(0.0, 0.0, 0.0))
    plan = msgspec.structs.replace(
        bench.plan, features=[*bench.plan.features, corner], alignment=alignment
    )
    session = InspectionSession(plan, bench.rig, bench.body, job, SessionOptions())
    take_all(session, bench)
    # A touch of the bed from above, and the same one as if the ball had slid in along it.
    touch = bench.touches[0]
    aslant = touch.window.tip_world[0] + np.outer(np.arange(8.0, 0.0, -0.5), [1.0, 0.0, 1.0])
    for trail, trusted in ((touch.trail_world, True), (aslant, False)):
        session.touches.record_touch(replace(touch, trail_world=trail), "CORNER")
        point = session.view.features[-1]
        assert (point.fit is not None) is trusted
        assert ("° off the planned" in point.note) is not trusted
        session.steps.undo()
    # Further off than a hand slants: the touch was on another face, and does not count.
    beside = touch.window.tip_world[0] + np.outer(np.arange(8.0, 0.0, -0.5), [1.0, 0.0, 0.2])
    refused = session.touches.record_touch(replace(touch, trail_world=beside), "CORNER")
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.WRONG_FACE


def test_form_is_judged_only_when_all_points_are_taken(bench: Bench, job: JobFile) -> None:
    flatness = Characteristic(
        name="Flatness", kind="form", features=["BED"], nominal=0.0, lower=0.0, upper=0.2
    )
    features = [msgspec.structs.replace(bench.plan.features[0], points=5), *bench.plan.features[1:]]
    plan = msgspec.structs.replace(bench.plan, features=features, characteristics=[flatness])
    session = InspectionSession(plan, bench.rig, bench.body, job, SessionOptions())
    for touch in bench.touches[:4]:
        session.touches.record_touch(touch)
    early = session.view.characteristics[0]
    assert (early.verdict, early.measured) == (Verdict.PROVISIONAL, None)
    assert "is complete" in early.note
    session.steps.finish()
    assert session.view.characteristics[0].verdict is Verdict.CONFORM
