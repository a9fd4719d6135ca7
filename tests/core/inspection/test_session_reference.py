"""A job relative to a reference body: correct after a nudge, refused if undetermined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode, Touch, TouchCollector
from ocmm_core.storage import JobFile, JobReference, make_head
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tracking import (
    ReferenceHome,
    TrackingPipeline,
    home_of,
    load_probe,
    load_reference,
    relative_sensitivity,
)
from ocmm_sim.scene import (
    ScriptedNudge,
    ScriptedOcclusion,
    TrueTouch,
    VirtualRig,
    WorldOptions,
    load_part,
)

PLAN = resource("plans", "quick.toml")
RIG = resource("rigs", "recommended.toml")
PROBE = resource("probes", "standard4.toml")
REFERENCE = resource("references", "plate.toml")
RATE_HZ = 500
HALF_WAY = 8 * RATE_HZ
NUDGE = ScriptedNudge(HALF_WAY, 0, (0.6e-3, -0.6e-3, 0.6e-3), (0.6, -0.6, 0.6))


@dataclass(frozen=True, slots=True)
class Script:
    """The touches of a job and their true values."""

    touches: tuple[Touch, ...]
    truth: tuple[TrueTouch, ...]
    home: ReferenceHome | None

    def true_touch(self, point: MeasuredPoint) -> TrueTouch:
        """Return the truth of a point."""
        (found,) = (
            touch
            for touch in self.truth
            if touch.first_frame - 60 <= point.first_frame <= touch.last_frame
        )
        return found


def play(options: WorldOptions, *, reference: bool = True, seed: int = 2) -> Script:
    rig, body, plan = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    beside = load_reference(REFERENCE)
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(
        rig, body, load_part(resource("parts", "demo.toml")), script, seed, options, RATE_HZ,
        beside,
    )  # fmt: skip
    pipeline = TrackingPipeline(rig, body, reference=beside if reference else None)
    collector = TouchCollector(1.0 / RATE_HZ, SessionOptions().point)
    touches = collector.push(pipeline.process(virtual.frames(0, virtual.n_frames)))
    return Script(tuple(touches), virtual.truth.touches, pipeline.home)


@pytest.fixture(scope="module")
def nudged() -> Script:
    return play(WorldOptions(nudges=(NUDGE,)))


@pytest.fixture
def new_job(tmp_path: Path) -> Callable[[], JobFile]:
    def make() -> JobFile:
        head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
        return JobFile.create(tmp_path / "job.ocmm", head)

    return make


def session_of(job: JobFile, reference: Path | None = REFERENCE) -> InspectionSession:
    options = SessionOptions(reference=load_reference(reference) if reference else None)
    return InspectionSession(load_plan(PLAN), load_rig(RIG), load_probe(PROBE), job, options)


def take_all(
    session: InspectionSession, script: Script, first: int = 0, last: int | None = None
) -> list[MeasuredPoint | Refusal]:
    if script.home is not None:
        session.keep_reference(script.home)
    return [session.touches.record_touch(touch) for touch in script.touches[first:last]]


def points_of(outcomes: list[MeasuredPoint | Refusal]) -> list[MeasuredPoint]:
    assert all(isinstance(outcome, MeasuredPoint) for outcome in outcomes), outcomes
    return [outcome for outcome in outcomes if isinstance(outcome, MeasuredPoint)]


def errors_of(points: list[MeasuredPoint], script: Script) -> Float:
    return np.array([point.tip_world - script.true_touch(point).tip_world for point in points])


def test_a_job_is_computed_anew_relative_to_its_own_first_place(
    nudged: Script, new_job: Callable[[], JobFile], tmp_path: Path
) -> None:
    with new_job() as job:
        session = session_of(job)
        points_of(take_all(session, nudged))
        view = session.view
    again = reopen_job(job.path)
    assert again.doubts == ()
    assert again.view.characteristics == view.characteristics
    assert again.options.reference is not None
    assert again.options.reference.identity == load_reference(REFERENCE).identity
    # With another first place the same spots put every point elsewhere.
    assert nudged.home is not None
    forged = tmp_path / "forged.ocmm"
    with JobFile.create(forged, again.head) as other:
        shifted = nudged.home.spots + 2.0
        other.store_reference(JobReference(REFERENCE.read_text("utf-8"), shifted, 100))
        for point in again.points:
            other.append_point(point)
    told = reopen_job(forged)
    assert len(told.differences) == len(again.points)
    assert {result.verdict for result in told.view.characteristics} <= {
        Verdict.NOT_PROVEN, Verdict.NOT_MEASURED,
    }  # fmt: skip


def test_points_before_and_after_a_nudge_belong_together(
    nudged: Script, new_job: Callable[[], JobFile]
) -> None:
    with new_job() as job:
        session = session_of(job)
        points = points_of(take_all(session, nudged))
        assert len(points) == 14
        frames = [point.first_frame for point in points]
        assert min(frames) < HALF_WAY < max(frames)
        # U of a point is about 0.04 mm in depth and 0.015 mm across (k = 2).
        assert np.abs(errors_of(points, nudged)).max() < 0.06
        view = session.view
        for result in view.characteristics:
            assert result.measured is not None
            assert result.uncertainty is not None
        step = next(item for item in view.characteristics if item.name == "Block step")
        assert step.measured == pytest.approx(20.342, abs=0.015)


def test_without_the_reference_body_the_same_nudge_makes_wrong_points(
    new_job: Callable[[], JobFile],
) -> None:
    script = play(WorldOptions(nudges=(NUDGE,)), reference=False)
    with new_job() as job:
        points = points_of(take_all(session_of(job, None), script))
    after = [point for point in points if point.first_frame > HALF_WAY]
    assert np.abs(errors_of(after, script)).max() > 0.4


def test_everything_can_be_computed_again_from_the_job_file(
    nudged: Script, new_job: Callable[[], JobFile]
) -> None:
    with new_job() as job:
        taken = points_of(take_all(session_of(job), nudged))
        path = job.path
    rig, body, reference = load_rig(RIG), load_probe(PROBE), load_reference(REFERENCE)
    with JobFile.open(path, read_only=True) as job:
        stored = job.reference()
        assert stored is not None
        assert stored.identity == reference.identity
        home = home_of(stored.spots, stored.n_frames, rig, reference)
        for point, before in zip(job.points(), taken, strict=True):
            assert point.reference_spots is not None
            found = relative_sensitivity(
                point.spots, point.reference_spots, home, rig, body, reference
            )
            assert np.abs(found.tip_world - before.tip_world).max() < 0.001
        assert job.verify() == []


def test_no_point_counts_before_the_first_place_is_durable(
    nudged: Script, new_job: Callable[[], JobFile]
) -> None:
    with new_job() as job:
        session = session_of(job)
        with pytest.raises(MeasuringError, match="position of the reference body at the start"):
            session.touches.record_touch(nudged.touches[0])
        assert job.points() == []


def test_a_job_goes_on_in_the_same_world(nudged: Script, new_job: Callable[[], JobFile]) -> None:
    with new_job() as job:
        points_of(take_all(session_of(job), nudged, 0, 6))
        path = job.path
    with JobFile.open(path) as job:
        session = session_of(job)
        assert session.reference_home is not None
        assert nudged.home is not None
        assert np.allclose(
            session.reference_home.T_rig_from_reference.translation,
            nudged.home.T_rig_from_reference.translation,
            atol=1e-9,
        )
        # A place that another run would take first does not replace the one of the job.
        elsewhere = replace(nudged.home, n_frames=5)
        session.keep_reference(elsewhere)
        assert session.reference_home.n_frames == nudged.home.n_frames
        points_of(take_all(session, nudged, 6))
        assert session.view.complete
        step = next(i for i in session.view.characteristics if i.name == "Block step")
        assert step.measured == pytest.approx(20.342, abs=0.015)


def test_a_job_does_not_go_on_without_its_reference_body(
    nudged: Script, new_job: Callable[[], JobFile], tmp_path: Path
) -> None:
    with new_job() as job:
        take_all(session_of(job), nudged, 0, 2)
        path = job.path
    other = tmp_path / "other.toml"
    text = REFERENCE.read_text(encoding="utf-8")
    other.write_text(text.replace('"plate"', '"other"'), encoding="utf-8")
    for reference, words in ((None, "is not given now"), (other, "is not 'other'")):
        with JobFile.open(path) as job, pytest.raises(MeasuringError, match=words) as caught:
            session_of(job, reference)
        assert caught.value.code == "session.other_reference"


def test_a_job_does_not_go_on_with_cameras_that_were_calibrated_anew(
    nudged: Script, new_job: Callable[[], JobFile]
) -> None:
    with new_job() as job:
        take_all(session_of(job), nudged, 0, 2)
        path = job.path
    anew = replace(load_rig(RIG), identity="0" * 64)
    options = SessionOptions(reference=load_reference(REFERENCE))
    with JobFile.open(path) as job, pytest.raises(MeasuringError) as caught:
        InspectionSession(load_plan(PLAN), anew, load_probe(PROBE), job, options)
    assert caught.value.code == "session.other_cameras"


def test_a_job_begun_without_a_reference_body_does_not_get_one(
    new_job: Callable[[], JobFile],
) -> None:
    script = play(WorldOptions(), reference=False)
    with new_job() as job:
        take_all(session_of(job, None), script, 0, 2)
        path = job.path
    with JobFile.open(path) as job, pytest.raises(MeasuringError) as caught:
        session_of(job)
    assert caught.value.code == "session.no_reference"


@pytest.mark.parametrize("frames", [0, 60])
def test_a_point_during_which_the_reference_body_moves_is_refused(
    nudged: Script, new_job: Callable[[], JobFile], frames: int
) -> None:
    middle = nudged.touches[2].first_frame + 60
    script = play(WorldOptions(nudges=(replace(NUDGE, first_frame=middle, frames=frames),)))
    with new_job() as job:
        outcomes = take_all(session_of(job), script, 0, 5)
    refused = outcomes[2]
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.REFERENCE
    assert "The reference body moved" in refused.what
    others = points_of([outcome for index, outcome in enumerate(outcomes) if index != 2])
    assert np.abs(errors_of(others, script)).max() < 0.06


@pytest.mark.parametrize(
    ("camera", "leds", "words"),
    [
        (0, (5, 6), "Camera left does not see R2, R3."),
        (1, (4, 5, 6, 7), "Camera right does not see the reference body."),
        (-1, (4, 5, 6, 7), "The cameras do not see the reference body."),
    ],
)
def test_a_hidden_reference_body_gives_no_point_and_says_who_does_not_see_it(
    nudged: Script, new_job: Callable[[], JobFile], camera: int, leds: tuple[int, ...], words: str
) -> None:
    first = nudged.touches[1].first_frame - 20
    script = play(WorldOptions(occlusions=(ScriptedOcclusion(camera, leds, first, first + 400),)))
    with new_job() as job:
        outcomes = take_all(session_of(job), script, 0, 4)
    refused = outcomes[1]
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.REFERENCE
    assert refused.what == f"Reference body not visible. {words}"
    assert "line of sight" in refused.remedy
    assert isinstance(outcomes[3], MeasuredPoint)


def test_the_volume_is_that_of_the_cameras_as_they_stand(new_job: Callable[[], JobFile]) -> None:
    # The bed lies at -110 mm and the volume ends at -200 mm.
    down = ScriptedNudge(HALF_WAY, 200, shift=(0.0, 0.0, -100.0))
    script = play(WorldOptions(nudges=(down,)))
    with new_job() as job:
        outcomes = take_all(session_of(job), script)
    later = [
        outcome
        for touch, outcome in zip(script.touches, outcomes, strict=True)
        if touch.first_frame > HALF_WAY + 300
    ]
    refused = [outcome for outcome in later if isinstance(outcome, Refusal)]
    assert refused
    assert {refusal.code for refusal in refused} <= {RefusalCode.OUTSIDE, RefusalCode.NO_FEATURE}
    good = [outcome for outcome in outcomes if isinstance(outcome, MeasuredPoint)]
    assert np.abs(errors_of(good, script)).max() < 0.1
