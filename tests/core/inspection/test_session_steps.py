"""Decisions of an inspector while measuring: delete, restore, skip, repeat, undo, pause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import FeatureState, HoldReason, JobView
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import PartWord, Verdict
from tests.core.inspection.conftest import Bench


def take(session: InspectionSession, bench: Bench, first: int, last: int) -> None:
    for touch in bench.touches[first:last]:
        assert isinstance(session.touches.record_touch(touch), MeasuredPoint)


def numbers(view: JobView, name: str) -> list[int]:
    return [point.number for point in view.feature(name).points]


def test_any_point_can_be_deleted_with_a_reason_and_put_back(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    take(session, bench, 0, 14)
    whole = session.view
    session.points.delete_point(2, "chip on the surface")
    view = session.view
    assert numbers(view, "BED") == [1, 3, 4]
    assert [(d.point.number, d.reason) for d in view.feature("BED").deleted] == [
        (2, "chip on the surface")
    ]
    # The job was complete: the feature with the missing point takes points again.
    assert view.active == "BED"
    assert view.feature("BED").state is FeatureState.ACTIVE
    assert (view.characteristics[1].name, view.characteristics[1].verdict) == (
        "Block step", Verdict.PROVISIONAL,
    )  # fmt: skip
    assert view.part_verdict.word is PartWord.NOT_COMPLETE
    assert view.part_verdict.missing == ("BED", "Block step")
    # A result of other features stays as it was; its covariance is summed in another order.
    before, after = whole.characteristics[0], view.characteristics[0]
    assert (before.measured, before.verdict) == (after.measured, after.verdict)
    assert after.uncertainty == pytest.approx(before.uncertainty, rel=1e-12)
    session.points.restore_point(2)
    again = session.view
    assert numbers(again, "BED") == [1, 3, 4, 15]
    assert again.complete
    assert not again.feature("BED").deleted
    # The same observation under another number, and last in the job instead of second.
    before, after = whole.characteristics[1], again.characteristics[1]
    assert before.measured is not None
    assert after.measured == pytest.approx(before.measured, abs=1e-9)
    assert after.uncertainty == pytest.approx(before.uncertainty, abs=1e-6)
    assert job.verify() == []
    np.testing.assert_array_equal(
        whole.feature("BED").points[1].tip_world, again.feature("BED").points[-1].tip_world
    )


@pytest.mark.parametrize("reason", ["", "  \n", "bell\x07"])
def test_no_point_is_deleted_without_a_reason(bench: Bench, job: JobFile, reason: str) -> None:
    session = bench.session(job)
    take(session, bench, 0, 1)
    with pytest.raises(MeasuringError, match="reason"):
        session.points.delete_point(1, reason)
    assert len(job.points()) == 1


def test_what_is_not_there_is_neither_deleted_nor_put_back_twice(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    take(session, bench, 0, 3)
    with pytest.raises(MeasuringError, match="point 9"):
        session.points.delete_point(9, "why not")
    session.points.delete_point(2, "slipped")
    with pytest.raises(MeasuringError, match="point 2"):
        session.points.delete_point(2, "slipped")
    session.points.restore_point(2)
    with pytest.raises(MeasuringError, match="already restored"):
        session.points.restore_point(2)
    assert [point.number for point in job.points()] == [1, 3, 4]


def test_steps_are_undone_and_done_again_in_turn(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    take(session, bench, 0, 4)
    session.points.delete_point(1, "slipped")
    session.steps.skip("BLOCK_TOP")
    assert session.view.undo == "skip of BLOCK_TOP"
    session.steps.undo()
    assert session.view.feature("BLOCK_TOP").state is not FeatureState.SKIPPED
    session.steps.undo()
    assert len(numbers(session.view, "BED")) == 4
    session.steps.undo()
    # The last point was taken away; the one that was deleted and is back stays.
    assert numbers(session.view, "BED") == [2, 3, 5]
    session.steps.redo()
    session.steps.redo()
    session.steps.redo()
    view = session.view
    assert view.redo == ""
    assert view.feature("BLOCK_TOP").skipped
    kept = {tuple(point.tip_world) for point in view.feature("BED").points}
    first = {tuple(point.tip_world) for point in bench_points(job, [2, 3, 4])}
    assert kept == first
    with pytest.raises(MeasuringError, match="Nothing was undone"):
        session.steps.redo()
    assert job.verify() == []


def bench_points(job: JobFile, wanted: list[int]) -> list[MeasuredPoint]:
    everything = [*job.points(), *(point for point, _ in job.annulled())]
    return [point for point in everything if point.number in wanted]


def test_a_flip_that_is_undone_does_not_leave_the_flipped_point_to_be_put_back(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    take(session, bench, 0, 4)
    session.points.flip(2)
    assert session.view.feature("BED").points[-1].approach == "flipped"
    session.steps.undo()
    view = session.view.feature("BED")
    assert [point.approach for point in view.points] == ["trail"] * 4
    assert view.deleted == ()


def test_a_skipped_feature_is_left_out_and_comes_back_when_it_is_reopened(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    session.steps.skip()
    assert session.view.active == "BLOCK_TOP"
    assert ("BED", 4) not in session.steps.missing()
    take(session, bench, 4, 14)
    view = session.view
    assert view.complete
    assert view.feature("BED").skipped
    assert view.characteristics[1].verdict is Verdict.NOT_MEASURED
    assert view.characteristics[0].verdict is Verdict.CONFORM
    assert view.characteristics[1].note == "BED was skipped."
    session.steps.reopen("BED")
    take(session, bench, 0, 4)
    assert session.view.characteristics[1].verdict is Verdict.CONFORM


def test_a_skipped_feature_stays_skipped_when_one_of_its_points_is_deleted(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    take(session, bench, 0, 14)
    session.steps.skip("SPHERE")
    session.points.delete_point(12, "a chip")
    view, again = session.view, bench.session(job).view
    assert view.feature("SPHERE").skipped
    assert again.feature("SPHERE").skipped
    assert (view.active, again.active) == ("", "")
    session.steps.reopen("SPHERE")
    assert session.view.active == bench.session(job).view.active == "SPHERE"


def test_a_repeated_feature_begins_anew_and_its_points_are_annulled_with_a_reason(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    take(session, bench, 0, 14)
    session.steps.repeat("BLOCK_TOP")
    assert session.view.active == "BLOCK_TOP"
    assert numbers(session.view, "BLOCK_TOP") == []
    assert {reason for _, reason in job.annulled()} == {"BLOCK_TOP is repeated"}
    take(session, bench, 4, 8)
    assert session.view.complete
    session.steps.repeat("BLOCK_TOP")
    session.steps.undo()
    assert session.view.complete
    assert len(numbers(session.view, "BLOCK_TOP")) == 4


def test_a_paused_job_takes_no_points_also_after_it_is_opened_again(bench: Bench) -> None:
    with bench.job() as job:
        session = bench.session(job)
        take(session, bench, 0, 3)
        session.steps.skip("SPHERE")
        session.steps.finish()
        session.steps.set_order("any")
        session.steps.set_compensation("shank", "BLOCK_TOP")
        session.pausing.pause()
        refused = session.touches.record_touch(bench.touches[4])
        assert isinstance(refused, Refusal)
        assert refused.code is RefusalCode.PAUSED
        before = session.view
    with JobFile.open(job.path) as again:
        session = bench.session(again)
        after = session.view
        assert after.paused
        assert after.active == "BLOCK_TOP"
        assert after.probing == "any"
        assert [f.state for f in after.features] == [f.state for f in before.features]
        assert after.feature("BLOCK_TOP").compensation == "shank"
        session.pausing.go_on("anna")
        take(session, bench, 4, 8)
        assert session.view.complete
        assert any(e.kind == "gone on" and "anna" in e.text for e in again.events())


def test_points_of_an_earlier_run_can_be_undone(bench: Bench) -> None:
    with bench.job() as job:
        take(bench.session(job), bench, 0, 5)
    with JobFile.open(job.path) as again:
        session = bench.session(again)
        assert session.view.undo == "point 5 of BLOCK_TOP"
        session.steps.undo()
        session.steps.undo()
        assert session.view.active == "BED"
        assert numbers(session.view, "BED") == [1, 2, 3]


def stands(view: JobView) -> tuple[object, ...]:
    """Return the state of a job and the counted observations, without their numbers."""
    return (
        view.active,
        [feature.state for feature in view.features],
        sorted((tuple(p.tip_world), p.approach) for f in view.features for p in f.points),
    )


def test_every_step_of_an_earlier_run_is_undone_and_done_again(bench: Bench) -> None:
    with bench.job() as job:
        session = bench.session(job)
        seen = [stands(session.view)]

        def do(step: Callable[[], object]) -> None:
            step()
            seen.append(stands(session.view))

        for touch in bench.touches[:3]:
            do(partial(session.touches.record_touch, touch))
        do(lambda: session.points.delete_point(2, "slipped"))
        do(lambda: session.points.restore_point(2))
        do(session.points.flip)
        do(lambda: session.steps.repeat("BED"))
        do(lambda: session.steps.skip("SPHERE"))
        do(lambda: session.touches.record_touch(bench.touches[0]))
        # A step undone before a new one is gone for good, also for later readers.
        session.steps.undo()
        do(lambda: session.touches.record_touch(bench.touches[1]))
        del seen[-2]
        words = session.view.undo
    # Each of them by another run of the program.
    for before in reversed(seen[:-1]):
        with JobFile.open(job.path) as again:
            session = bench.session(again)
            session.steps.undo()
            assert stands(session.view) == before
    with JobFile.open(job.path) as again:
        assert bench.session(again).view.undo == ""
        with pytest.raises(MeasuringError, match="No point"):
            bench.session(again).steps.undo()
    for after in seen[1:]:
        with JobFile.open(job.path) as again:
            session = bench.session(again)
            session.steps.redo()
            assert stands(session.view) == after
    with JobFile.open(job.path) as again:
        assert (bench.session(again).view.undo, bench.session(again).view.redo) == (words, "")
        assert again.verify() == []


def test_steps_behind_those_of_an_older_program_are_not_taken_back(bench: Bench) -> None:
    with bench.job() as job:
        session = bench.session(job)
        take(session, bench, 0, 4)
        session.points.delete_point(1, "slipped")
        session.steps.skip("SPHERE")
        last = session.view.feature("BED").points[-1]
        # An older program writes the point and no step.
        job.append_point(replace(last, number=job.next_number()))
        again = bench.session(job)
        assert again.view.undo == "point 5 of BED"
        again.steps.undo()
        assert numbers(again.view, "BED") == [2, 3, 4]
        assert again.view.feature("SPHERE").skipped


def test_no_verdict_is_shown_while_a_feature_is_probed(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    take(session, bench, 0, 13)
    view = session.view
    ball = view.characteristics[0]
    # Five points fit a sphere; the sixth is still to come.
    assert ball.measured is not None
    assert ball.uncertainty is not None
    assert (ball.name, ball.verdict) == ("Ball diameter", Verdict.PROVISIONAL)
    assert ball.stated is None
    assert "Provisional" in ball.note
    assert view.verdict_of("SPHERE").verdict is Verdict.PROVISIONAL
    session.steps.finish()
    assert session.view.characteristics[0].verdict is Verdict.CONFORM


def test_a_point_that_was_held_back_stays_so_when_it_is_put_back(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    take(session, bench, 0, 14)
    session.points.delete_point(3, "slipped")
    # Held back while it is out: it must not come back as if nothing had been.
    session.held.hold_back(None, "The cameras moved.")
    session.points.restore_point(3)
    assert 15 in session.view.held
    session.held.release("Verified.", HoldReason.CAMERAS)
    assert session.view.held == ()


def test_a_touch_beside_the_feature_is_flagged_and_kept(bench: Bench, job: JobFile) -> None:
    session = bench.session(job)
    take(session, bench, 0, 14)
    assert all(feature.outliers == () for feature in session.view.features)
    # The third point of the sphere, as if it were taken 0.3 mm off.
    points = session._ledger.points.counting  # noqa: SLF001 - nothing public moves a point
    sphere = [index for index, point in enumerate(points) if point.feature == "SPHERE"]
    moved = points[sphere[2]]
    points[sphere[2]] = replace(moved, tip_world=moved.tip_world + 0.3 * moved.direction)
    session.refit()
    view = session.view.feature("SPHERE")
    assert view.outliers == (moved.number,)
    assert len(view.points) == 6
