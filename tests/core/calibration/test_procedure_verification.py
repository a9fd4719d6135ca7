"""Guided verification, its arithmetic, and who may pass."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import (
    ArtefactUse,
    CameraRecord,
    Check,
    State,
    entry_of,
    rig_from_record,
)
from ocmm_core.calibration.verification import (
    Limits,
    VerificationProcedure,
    VerificationSetup,
    fit_sphere,
)
from ocmm_core.calibration.verification._line_planning import MIN_ANGLE, plan_lines
from ocmm_core.calibration.verification._verification import judge_nest, judge_placement
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import RigidTransform
from ocmm_sim.calibration_scenes import TouchSeats
from tests.core.calibration.procedure_site import FULL_HZ, Bench, show

VOLUME = np.array([[-200.0, -100.0, -200.0], [200.0, 100.0, 200.0]])


def begin(bench: Bench, rig: Rig, limits: Limits | None = None) -> VerificationProcedure:
    return VerificationProcedure.start(
        bench.site(rig),
        VerificationSetup(who="engineer", spheres=(bench.sphere,), limits=limits, bar=bench.bar),
        bench.now(),
    )


def taken(bench: Bench, rig: Rig) -> VerificationProcedure:
    procedure = begin(bench, rig)
    scenes = bench.verified_scenes(procedure, (bench.sphere,))
    show(procedure, bench.virtual(*scenes), bench.now)
    return procedure


def smaller(record: CameraRecord, rig: Rig) -> CameraRecord:
    """Return a calibration whose cameras are 0.05 % closer together than in truth."""
    entries = []
    for camera, entry in zip(rig.cameras, record.cameras, strict=True):
        pose = camera.T_camera_from_world
        near = RigidTransform(pose.rotation, pose.translation * (1.0 - 5e-4))
        entries.append(entry_of(replace(camera, T_camera_from_world=near), entry.alias))
    return msgspec.structs.replace(record, cameras=tuple(entries))


def test_a_good_calibration_becomes_valid_only_by_passing(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    rig = bench.calibrated()
    assert bench.store().status(bench.now()).state is State.SUSPECT
    procedure = taken(bench, rig)
    assert procedure.base.step.name == "result"
    assert [line.hint for line in procedure.view.lines] == [""] * 7
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    record = outcome.record
    assert len(record.checks) == 37
    assert [corner.reached for corner in record.corners] == [True] * 8
    assert len(record.repeats) == 2
    assert record.objections == ()
    # The form is not an error with a sign: the largest of 25 is 3.7 sigma of a point on average.
    errors = [abs(check.error_mm) for check in record.checks[:-1]]
    # Pattern noise of 0.010 px moves the ball by about 10 um; all drawn errors stay within 25 um.
    assert max(errors) < 0.025
    assert record.passed
    procedure.accept(bench.now(), "verified")
    assert bench.store().status(bench.now()).state is State.VALID


def test_a_wrong_scale_fails_and_stays_suspect(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    good = bench.calibrated()
    store = bench.store()
    active = store.active()
    assert active is not None
    wrong = smaller(active, good)
    store.accept(wrong, "technician", "bad", bench.now())
    procedure = taken(bench, rig_from_record(wrong))
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    assert not outcome.record.passed
    # 0.05 % of 400 mm are 200 um; the calibrated size of the probe counteracts most of it.
    longest = [check for check in outcome.record.checks if check.name.endswith("400 mm")]
    assert np.mean([check.error_mm for check in longest]) < -0.03
    # More than one line failed: none may be repeated (VDI/VDE 2634-1).
    with pytest.raises(CalibrationError, match="only one line may be repeated"):
        procedure.repeat_line(0, bench.now())
    procedure.accept(bench.now(), "failed")
    status = bench.store().status(bench.now())
    assert (status.state, status.reason) == (State.SUSPECT, "The last verification failed.")


def test_cameras_that_stand_elsewhere_are_named_as_a_reason(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path, FULL_HZ)
    procedure = begin(bench, bench.calibrated())
    procedure.advance(bench.now())
    seats = TouchSeats(tips=((0.0, 0.0, 0.0),), seed=1)
    procedure.watch(bench.virtual(seats, move=7).frames(600, 800))
    live = procedure.base.live
    assert not live.ready
    assert "relocate the cameras" in live.hint


def test_a_verification_goes_on_nest_by_nest(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    rig = bench.calibrated()
    procedure = begin(bench, rig)
    with pytest.raises(CalibrationError, match="Seat 1 of 2 was not visited"):
        procedure.compute()
    scenes = bench.verified_scenes(procedure, (bench.sphere,))
    show(procedure, bench.virtual(*scenes[:2]), bench.now, at_most=10)
    resumed = VerificationProcedure.resume(bench.site(rig), procedure.base.session)
    assert [line.taken for line in resumed.view.lines] == [6, 2, 0, 0, 0, 0, 0]
    assert resumed.view.current_line == 1
    assert "nest 3 of 6" in resumed.base.step.instruction
    resumed.drop(bench.now())
    assert [line.taken for line in resumed.view.lines][:2] == [6, 1]
    resumed.drop(bench.now())
    # A complete line counts and is not dropped.
    resumed.drop(bench.now())
    assert [line.taken for line in resumed.view.lines][:2] == [6, 0]
    with pytest.raises(CalibrationError, match="did not fail"):
        resumed.repeat_line(0, bench.now())


def test_a_nest_that_was_left_out_is_not_taken_for_the_next_one(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    procedure = begin(bench, bench.calibrated())
    first, seats = bench.verified_scenes(procedure, (bench.sphere,))[:2]
    assert isinstance(seats, TouchSeats)
    tips = seats.tips[:2] + seats.tips[3:6]
    skipped = msgspec.structs.replace(seats, tips=tips)
    show(procedure, bench.virtual(first, skipped), bench.now)
    # The fourth nest, 240 mm from the first, must not become the third.
    assert procedure.view.lines[0].taken == 2
    assert not procedure.base.live.ready
    assert "but nest 3 is 160 mm" in procedure.base.live.hint
    # A line begins at either end.
    plan = procedure.view.lines[0]
    lone = np.empty((0, 3))
    planned = plan_lines(bench.rig.volume_world, 400.0).lines[0]
    assert judge_nest(planned, plan.ends_world[1], lone, bench.bar) == ""
    middle = plan.ends_world.mean(axis=0)
    assert "start with the first nest" in judge_nest(planned, middle, lone, bench.bar)


def test_only_the_calibration_in_force_is_verified_and_not_with_old_artefacts(
    tmp_path: Path,
) -> None:
    bench = Bench.at(tmp_path)
    with pytest.raises(CalibrationError, match="does not use the active calibration"):
        begin(bench, bench.rig)
    rig = bench.calibrated()
    use = replace_due(bench.bar.artefact.use, "2026-03-01T00:00:00+00:00")
    bench.bar = replace(bench.bar, artefact=replace(bench.bar.artefact, use=use))
    with pytest.raises(CalibrationError, match="expired on 2026-03-01"):
        begin(bench, rig)
    bench = Bench.at(tmp_path)
    # 2 um of the bar against a limit of 5 um: more than a third.
    with pytest.raises(CalibrationError, match=r"certified to 2\.0 um"):
        begin(bench, rig, Limits(constant=0.005, per_length=0.0))


def replace_due(use: ArtefactUse, due: str) -> ArtefactUse:
    return msgspec.structs.replace(use, due_utc=due)


def test_uncertainty_is_taken_off_the_limit() -> None:
    check = Check(
        name="L", measured_mm=100.048, certified_mm=100.0, expanded_mm=0.004, limit_mm=0.050
    )
    assert not Limits(rule="guarded").passes(check)
    assert Limits(rule="simple").passes(check)
    better = msgspec.structs.replace(check, measured_mm=100.0459)
    assert Limits(rule="guarded").passes(better)


def test_planned_lines_fill_the_volume_in_different_directions() -> None:
    plans = plan_lines(VOLUME, 400.0).lines
    assert len(plans) == 7
    directions = []
    for plan in plans:
        begin_, end = plan.ends_world
        assert np.linalg.norm(end - begin_) == pytest.approx(400.0)
        assert (plan.ends_world >= VOLUME[0]).all()
        assert (plan.ends_world <= VOLUME[1]).all()
        directions.append((end - begin_) / 400.0)
    cosines = np.abs(np.array(directions) @ np.array(directions).T) - np.eye(7)
    assert np.arccos(cosines.max()) > MIN_ANGLE
    with pytest.raises(CalibrationError, match="does not suit"):
        plan_lines(VOLUME, 300.0)
    with pytest.raises(CalibrationError, match="does not suit"):
        plan_lines(VOLUME, 700.0)


def test_a_bar_in_another_place_is_noticed() -> None:
    plan, other = plan_lines(VOLUME, 400.0).lines[:2]
    assert judge_placement(plan, plan.ends_world, [other.ends_world], VOLUME) == ""
    assert judge_placement(plan, plan.ends_world[::-1], [], VOLUME) == ""
    shifted = plan.ends_world + np.array([0.0, 90.0, 0.0])
    assert "90 mm from its planned place" in judge_placement(plan, shifted, [], VOLUME)
    assert "nearly parallel to another" in judge_placement(
        plan, plan.ends_world, [plan.ends_world[::-1] + 3.0], VOLUME
    )
    outside = plan.ends_world + np.array([-15.0, 0.0, 0.0])
    assert "beyond the calibrated volume" in judge_placement(plan, outside, [], VOLUME)


def test_a_sphere_is_found_and_its_gain_stated() -> None:
    rng = np.random.default_rng(4)
    normals = rng.standard_normal((25, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = np.array([10.0, -20.0, 400.0]) + 18.0 * normals
    centre, radius, gain = fit_sphere(points)
    assert centre == pytest.approx([10.0, -20.0, 400.0], abs=1e-9)
    assert radius == pytest.approx(18.0, abs=1e-9)
    found = [
        2.0 * fit_sphere(points + 0.01 * rng.standard_normal(points.shape))[1] for _ in range(400)
    ]
    # 400 runs know a standard deviation to 3.5 %; three of them.
    assert np.std(found) == pytest.approx(0.01 * gain, rel=0.11)
    pole = points[normals[:, 2] > 0.9]
    assert fit_sphere(np.concatenate([pole, pole + 0.01]))[2] > 1.0
    with pytest.raises(CalibrationError, match="do not determine"):
        fit_sphere(points[:3])


def test_lengths_are_certified_at_the_temperature_of_the_test(tmp_path: Path) -> None:
    steel = replace(Bench.at(tmp_path).sphere.artefact, expanded=0.002)
    length, expanded = steel.at(400.0, Temperature(24.0, 0.3, ""))
    assert length == pytest.approx(400.0 * (1.0 + 4.0 * 11.5e-6))
    # Half of 2 um; 4 K times 0.5e-6/K and 0.3 K times 11.5e-6/K of 400 mm.
    parts = [1.0, 0.8, 1.38]
    assert expanded == pytest.approx(2e-3 * float(np.linalg.norm(parts)))
    assert steel.at(400.0, None)[1] > 0.018
    now = datetime(2026, 1, 1, tzinfo=UTC)
    assert steel.judge(400.0, 0.1, now, None) == []
