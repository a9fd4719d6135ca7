"""Any order of probing and other ways of compensation, with real touches of the virtual rig."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.alignment import DatumAlignment
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobHeader, SessionOptions
from ocmm_core.inspection.finished import next_serial, parts_of_batch
from ocmm_core.inspection.plan import Plan, load_plan, save_plan
from ocmm_core.inspection.session import HEADER_EVENT, InspectionSession, check_header, header_text
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import Verdict
from ocmm_sim.scene import load_part
from tests.core.inspection.conftest import Bench
from tests.host import HANG_S


def touched_part(bench: Bench, index: int, up: Float) -> tuple[float, float, float]:
    """Return the contact of a bench touch with the part, part frame."""
    pose = load_part(resource("parts", "demo.toml")).T_world_from_part
    tip = bench.touches[index].window.tip_world.mean(axis=0)
    x, y, z = pose.inverse().apply(tip) - bench.body.tip_radius * up
    return (float(x), float(y), float(z))


@pytest.fixture
def aligned(bench: Bench) -> Plan:
    """Return the quick plan with an alignment, and a pole of the ball without touches."""
    up = np.array([0.0, 0.0, 1.0])
    bed, block, ball = bench.plan.features
    block = msgspec.structs.replace(block, points=3, length=54.0, width=34.0)
    corner = NominalFeature(
        name="CORNER", shape=Shape.POINT, points=1, point=touched_part(bench, 4, up)
    )
    pole = NominalFeature(
        name="POLE", shape=Shape.POINT, points=1, point=(-140.0, 0.0, 59.99), text="Touch the pole"
    )
    alignment = DatumAlignment(primary="BED", secondary=("SPHERE", "CORNER"), origin="SPHERE")
    features = [bed, ball, corner, pole, block]
    return msgspec.structs.replace(bench.plan, features=features, alignment=alignment)


@pytest.fixture
def session(bench: Bench, job: JobFile, aligned: Plan) -> InspectionSession:
    session = InspectionSession(aligned, bench.rig, bench.body, job, SessionOptions())
    session.steps.set_order("any")
    # Before the part frame is determined the order of the plan holds.
    for touch in (*bench.touches[:4], *bench.touches[8:14], bench.touches[4]):
        assert isinstance(session.touches.record_touch(touch), MeasuredPoint)
    assert session.view.active == "POLE"
    return session


def test_the_feature_that_was_touched_gets_the_point(
    bench: Bench, session: InspectionSession
) -> None:
    taken = session.touches.record_touch(bench.touches[5])
    assert isinstance(taken, MeasuredPoint)
    assert taken.feature == "BLOCK_TOP"
    assert session.view.active == "BLOCK_TOP"
    session.touches.record_touch(bench.touches[6])
    session.touches.record_touch(bench.touches[7])
    # The block is complete: the feature left before it is next.
    assert session.view.active == "POLE"
    assert session.view.characteristics[1].verdict is Verdict.CONFORM


def test_a_feature_that_is_done_takes_no_more_by_itself(
    bench: Bench, session: InspectionSession
) -> None:
    refused = session.touches.record_touch(bench.touches[1])
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.NO_FEATURE
    assert "BED has all its points" in refused.what
    session.steps.reopen("BED")
    assert isinstance(session.touches.record_touch(bench.touches[1]), MeasuredPoint)


def test_a_touch_of_a_point_and_its_surface_goes_to_the_one_that_is_open_or_selected(
    bench: Bench, session: InspectionSession
) -> None:
    # Near the corner the ball also touches the top of the block; the corner is complete.
    taken = session.touches.record_touch(bench.touches[4])
    assert isinstance(taken, MeasuredPoint)
    assert taken.feature == "BLOCK_TOP"
    session.steps.reopen("CORNER")
    again = session.touches.record_touch(bench.touches[4])
    assert isinstance(again, MeasuredPoint)
    assert again.feature == "CORNER"
    # The choice was for that one.
    after = session.touches.record_touch(bench.touches[4])
    assert isinstance(after, MeasuredPoint)
    assert after.feature == "BLOCK_TOP"


def test_the_way_the_ball_is_pulled_off_tells_faces_apart_as_well(
    bench: Bench, session: InspectionSession
) -> None:
    touch = bench.touches[5]
    tip, up = touch.window.tip_world.mean(axis=0), touch.trail_world[0] - touch.trail_world[-1]
    away = np.linspace(0.0, 10.0, 50)[:, None] * up / np.linalg.norm(up)
    blind = replace(touch, trail_world=np.empty((0, 3)), pull_world=tip - away)
    refused = session.touches.record_touch(blind)
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.AMBIGUOUS
    session.steps.set_compensation("pulled", "BLOCK_TOP")
    taken = session.touches.record_touch(replace(blind, pull_world=tip + away))
    assert isinstance(taken, MeasuredPoint)
    assert (taken.feature, taken.approach) == ("BLOCK_TOP", "pulled")


def test_targets_are_where_the_features_are(bench: Bench, session: InspectionSession) -> None:
    session.steps.select("BLOCK_TOP")
    view = session.view
    targets = view.feature("BLOCK_TOP").targets
    assert len(targets) == 3
    assert view.target == targets[0]
    assert not view.target.approximate
    # All balls are on the true top of the block: part and alignment differ by hundredths.
    pose = load_part(resource("parts", "demo.toml")).T_world_from_part
    heights = [pose.inverse().apply(target.surface_world)[2] for target in targets]
    np.testing.assert_allclose(heights, 20.342, atol=0.15)
    session.touches.record_touch(bench.touches[5])
    assert len(session.view.feature("BLOCK_TOP").targets) == 2
    coverage = session.view.feature("BED").coverage
    assert coverage is not None
    assert coverage.fraction == 1.0


def test_the_nominal_normal_compensates_once_the_part_is_aligned(
    bench: Bench, session: InspectionSession, aligned: Plan, tmp_path: Path
) -> None:
    session.steps.set_compensation("nominal", "BLOCK_TOP")
    blind = replace(bench.touches[5], trail_world=np.empty((0, 3)))
    taken = session.touches.record_touch(blind)
    assert isinstance(taken, MeasuredPoint)
    assert taken.approach == "nominal"
    up = load_part(resource("parts", "demo.toml")).T_world_from_part.rotation[:, 2]
    # The bed of 330 mm fixes the tilt to some hundredths of a milliradian.
    assert taken.direction @ up > 1.0 - 1e-6
    with bench.job_at(tmp_path / "other.ocmm") as other:
        early = InspectionSession(aligned, bench.rig, bench.body, other, SessionOptions())
        early.steps.set_compensation("nominal", "BED")
        refused = early.touches.record_touch(bench.touches[0])
    assert isinstance(refused, Refusal)
    assert refused.code is RefusalCode.NO_APPROACH


def test_a_way_of_compensation_that_says_nothing_is_refused(session: InspectionSession) -> None:
    with pytest.raises(MeasuringError, match="shank"):
        session.steps.set_compensation("shank", "SPHERE")
    with pytest.raises(MeasuringError, match="guess"):
        session.steps.set_compensation("guess")
    session.steps.set_compensation("shank")
    ways = {feature.name: feature.compensation for feature in session.view.features}
    assert ways["BLOCK_TOP"] == "shank"
    assert ways["SPHERE"] == "approach"


@pytest.mark.slow
def test_pulled_touches_conform_and_lead_to_the_next_part_of_the_batch(tmp_path: Path) -> None:
    quick = load_plan(resource("plans", "quick.toml"))
    plan = tmp_path / "pulled.toml"
    bed, block, ball = quick.features
    block = msgspec.structs.replace(block, length=54.0, width=34.0)
    corner = NominalFeature(name="CORNER", shape=Shape.POINT, points=1, point=(-46.0, 15.0, 20.34))
    alignment = DatumAlignment(primary="BED", secondary=("SPHERE", "CORNER"), origin="SPHERE")
    changed = msgspec.structs.replace(
        quick, compensation="pulled", features=[block, bed, ball, corner], alignment=alignment
    )
    save_plan(changed, plan)
    request = StationRequest(plan=plan, out=tmp_path, frame_rate_hz=500, batch="B", serial="SN-1")
    built = build_station(request)
    try:
        built.station.start()
        assert built.station.wait_finished(HANG_S)
        view = built.station.job.view()
    finally:
        built.station.close()
    assert view.complete
    assert {p.approach for feature in view.features for p in feature.points} == {"pulled"}
    assert [result.verdict for result in view.characteristics] == [Verdict.CONFORM] * 2
    assert (view.header.batch, view.header.serial) == ("B", "SN-1")
    (part,) = parts_of_batch(tmp_path, "B")
    assert (part.serial, part.points) == ("SN-1", 15)
    with pytest.raises(InputError, match="already measured"):
        build_station(request)
    # The place of this part guides the next one until its own place is determined.
    following = build_station(replace(request, serial="SN-2"))
    try:
        target = following.station.job.view().target
    finally:
        following.station.close()
    assert target is not None
    assert target.approximate
    assert target.feature == "BLOCK_TOP"
    pose = load_part(resource("parts", "demo.toml")).T_world_from_part
    assert pose.inverse().apply(target.surface_world)[2] == pytest.approx(20.34, abs=0.2)


def test_a_job_goes_on_with_its_own_plan_until_nothing_is_missing(
    bench: Bench, tmp_path: Path
) -> None:
    with bench.job() as job:
        session = bench.session(job)
        for touch in bench.touches[:6]:
            session.touches.record_touch(touch)
        session.steps.skip("SPHERE")
        session.pausing.pause()
    request = StationRequest(
        plan=tmp_path / "is-not-looked-at.toml", out=tmp_path, frame_rate_hz=500, seed=1,
        resume=job.path, operator="anna",
    )  # fmt: skip
    built = build_station(request)
    try:
        assert built.job_path == job.path
        built.station.start()
        assert built.station.wait_finished(HANG_S)
        view = built.station.job.view()
    finally:
        built.station.close()
    assert view.complete
    assert not view.paused
    assert [len(feature.points) for feature in view.features] == [4, 4, 0]
    assert view.features[2].skipped
    assert view.characteristics[1].verdict is Verdict.CONFORM


def test_a_part_that_is_being_measured_is_in_the_list_of_its_batch(
    bench: Bench, tmp_path: Path
) -> None:
    (tmp_path / "no-job.ocmm").write_bytes(b"something else")
    with bench.job_at(tmp_path / "a.ocmm") as job:
        job.append_event(HEADER_EVENT, header_text(JobHeader("me", "P", "1", "O-7", "B")))
        bench.session(job).touches.record_touch(bench.touches[0])
        (part,) = parts_of_batch(tmp_path, "B")
        assert (part.serial, part.points, part.operator) == ("1", 1, "me")
        assert parts_of_batch(tmp_path, "C") == ()
        assert bench.session(job).view.header.order == "O-7"
    # A long closed job is read in place, with the same result.
    os.utime(job.path, (1e9, 1e9))
    assert parts_of_batch(tmp_path, "B") == (part,)


@pytest.mark.parametrize(
    ("serial", "following"),
    [("SN-009", "SN-010"), ("99", "100"), ("A7-B", "A8-B"), ("1.2.3", "1.2.4")],
)
def test_serial_numbers_are_counted_on(serial: str, following: str) -> None:
    assert next_serial(serial) == following


def test_a_serial_number_without_a_number_is_not_counted_on() -> None:
    with pytest.raises(InputError, match="no number"):
        next_serial("PROTO")


@pytest.mark.parametrize("name", ["=1+1", "-x", "x" * 61, "a\nb", "a\u202eb", " a", ""])
@pytest.mark.parametrize("field", ["operator", "serial", "order", "batch"])
def test_refuses_unusable_names_of_the_header(name: str, field: str) -> None:
    header = JobHeader("anna", "PART", "SN-1", "O 1", "B.2")
    check_header(header)
    if name == "" and field in ("order", "batch"):
        return
    with pytest.raises(InputError):
        check_header(replace(header, **{field: name}))
