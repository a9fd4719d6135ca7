"""Points taken under a suspect calibration: stored, shown, and without proof."""

from __future__ import annotations

from ocmm_core.inspection.evaluation import FeatureView, held_back
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobEvent, JobFile
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from tests.core.inspection.conftest import Bench

REASON = "Camera left or camera right has changed since the calibration: yaw about 20 µrad."


def measured(bench: Bench, job: JobFile) -> tuple[InspectionSession, list[MeasuredPoint]]:
    session = bench.session(job)
    points = [session.touches.record_touch(touch) for touch in bench.touches]
    return session, [point for point in points if isinstance(point, MeasuredPoint)]


def result(session: InspectionSession, name: str) -> CharacteristicResult:
    return next(item for item in session.view.characteristics if name in item.features)


def feature(session: InspectionSession, name: str) -> FeatureView:
    return next(item for item in session.view.features if item.name == name)


def test_points_since_the_last_good_check_prove_nothing(bench: Bench, job: JobFile) -> None:
    session, points = measured(bench, job)
    # The last two points of the ball.
    assert session.held.hold_back(points[-2].time_s, REASON) == [13, 14]
    assert session.view.held == (13, 14)
    ball, block = result(session, "SPHERE"), result(session, "BLOCK_TOP")
    assert ball.verdict is Verdict.NOT_PROVEN
    assert ball.measured is not None
    assert ball.note.startswith(f"2 points of SPHERE held back. {REASON} Verify the calibration")
    assert session.view.verdict_of("SPHERE").verdict is Verdict.NOT_PROVEN
    assert feature(session, "SPHERE").note.startswith("2 points of SPHERE held back.")
    assert block.verdict is Verdict.CONFORM
    assert feature(session, "BLOCK_TOP").note == ""
    assert len(job.points()) == 14


def test_a_distance_rests_on_both_its_features(bench: Bench, job: JobFile) -> None:
    session, points = measured(bench, job)
    session.held.hold_back(points[4].time_s, REASON)
    assert [item.verdict for item in session.view.characteristics] == [Verdict.NOT_PROVEN] * 2


def test_points_stay_held_back_when_the_job_is_opened_again(bench: Bench) -> None:
    with bench.job() as job:
        session, points = measured(bench, job)
        session.held.hold_back(points[-1].time_s, REASON)
        before = session.view.characteristics
        path = job.path
    with JobFile.open(path) as job:
        again = bench.session(job)
        assert again.view.held == (14,)
        assert again.view.characteristics == before
        # The bus clock restarted: times of the earlier run are void.
        assert again.held.hold_back(0.0, REASON) == []
        assert again.held.release("The verification passed.") == []
        assert again.view.held == (14,)
        assert job.verify() == []


def test_a_check_that_was_never_good_holds_back_the_whole_run(bench: Bench, job: JobFile) -> None:
    session, _ = measured(bench, job)
    assert session.held.hold_back(None, REASON) == list(range(1, 15))


def test_released_points_count_again(bench: Bench, job: JobFile) -> None:
    session, _ = measured(bench, job)
    session.held.hold_back(None, REASON)
    assert session.held.release("The verification passed.") == list(range(1, 15))
    assert session.view.held == ()
    assert [item.verdict for item in session.view.characteristics] == [Verdict.CONFORM] * 2
    assert bench.session(job).view.held == ()


def test_a_flipped_point_stays_held_back(bench: Bench, job: JobFile) -> None:
    session, points = measured(bench, job)
    session.held.hold_back(points[-1].time_s, REASON)
    session.points.flip()
    assert session.view.held == (15,)
    assert bench.session(job).view.held == (15,)


def test_the_events_alone_say_which_points_are_held_back() -> None:
    events = [
        JobEvent("t", "points held back", "3,4: Because: a colon."),
        JobEvent("t", "finished", "SPHERE with 6 points"),
        JobEvent("t", "points held back", "7: Later."),
        JobEvent("t", "points released", "3: The verification passed."),
    ]
    assert held_back(events) == {4: "Because: a colon.", 7: "Later."}
