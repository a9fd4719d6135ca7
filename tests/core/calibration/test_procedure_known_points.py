"""Guided calibration from known points: gates, recording, resumption, decision."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.cameras import KnownPoints, KnownPointsProcedure
from ocmm_core.calibration.guided import (
    Decided,
    ProcedureDecision,
    ProcedureKind,
    SessionLine,
    StaticSpotAverager,
    is_ended,
    sessions,
    utc_text,
)
from ocmm_core.calibration.records import State, record_hash
from ocmm_core.camera import project
from ocmm_core.errors import CalibrationError, StorageError
from ocmm_sim.calibration_scenes import CalibrationScenesRig, TargetScene
from ocmm_sim.scene import WorldOptions
from tests.core.calibration.procedure_site import Bench, show
from tests.other_station import forget_histories


def target(points: KnownPoints) -> TargetScene:
    return TargetScene(positions=tuple((x, y, z) for x, y, z in points.positions_world.tolist()))


def hash_of(procedure: KnownPointsProcedure) -> str:
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    return record_hash(outcome.record)


@pytest.mark.parametrize("rate_hz", [8000, 2000, 500])
def test_a_target_shown_at_every_point_is_taken_once_at_each(tmp_path: Path, rate_hz: int) -> None:
    bench = Bench.at(tmp_path)
    # The display rests for the required frames at any frame rate of the cameras.
    bench.rig = replace(bench.rig, frame_rate_hz=rate_hz)
    points = bench.points(40)
    procedure = bench.known_points(40)
    procedure.advance(bench.now())
    rig = bench.virtual(target(points))
    assert show(procedure, rig, bench.now) == 40
    table = procedure.table()
    truth = np.stack([project(camera, points.positions_world) for camera in rig.world.cameras])
    off = table.uv - truth
    # White noise of 0.030 px over 100 frames and a pattern of 0.010 px: 0.0104 px; of 160 numbers
    # the standard deviation scatters by 6 %.
    assert np.std(off) == pytest.approx(0.0104, rel=0.18)
    assert procedure.base.step.name == "result"


def test_the_end_of_a_motion_is_no_part_of_an_average(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    points = bench.points(12)
    perfect = WorldOptions.ideal()
    rig = CalibrationScenesRig(bench.rig, bench.body, (target(points),), 1, perfect)
    collector = StaticSpotAverager(bench.rig, 1)
    truth = np.stack([project(camera, points.positions_world) for camera in rig.world.cameras])
    taken = []
    # Few frames at a time: each is taken as early as it can be.
    for first in range(0, rig.n_frames, 4):
        collector.push(rig.frames(first, min(4, rig.n_frames - first)))
        if collector.live().ready:
            average = collector.average()
            collector.taken(average)
            taken.append(average.uv[:, 0])
    off = np.stack(taken, axis=1) - truth
    # Without noise a resting window contains no motion beyond its last 1e-4 px.
    assert np.abs(off).max() < 1e-3


def test_a_session_goes_on_where_it_was_and_gives_the_same_record(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    points = bench.points()
    table = bench.spots(points)
    whole = bench.known_points()
    whole.take_table(table, bench.now())

    path = sessions(bench.sessions, ProcedureKind.KNOWN_POINTS)[0]
    content = path.read_bytes()
    lines = content.splitlines(keepends=True)
    # Killed in the middle of the line of point 57.
    path.write_bytes(b"".join(lines[:58]) + lines[58][:40])
    # The program of that day was killed there; this station has seen it go on since.
    forget_histories()
    resumed = KnownPointsProcedure.resume(bench.site(), path)
    view = resumed.view
    assert sum(point.views is not None for point in view.points) == 57
    assert view.next_point == 57
    assert "43 of 100 points are missing" in view.base.steps[1].gate.reason
    resumed.advance(bench.now())
    with pytest.raises(CalibrationError, match="43 of 100"):
        resumed.advance(bench.now())
    resumed.take_table(table, bench.now())
    resumed.advance(bench.now())
    first, again = (hash_of(resumed), hash_of(KnownPointsProcedure.resume(bench.site(), path)))
    assert first == again
    assert resumed.base.step.name == "result"


def test_a_changed_byte_of_a_session_is_noticed(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    procedure = bench.known_points(40)
    procedure.take_table(bench.spots(bench.points(40)), bench.now())
    path = procedure.base.session
    content = bytearray(path.read_bytes())
    place = content.index(b"PointTaken") + 200
    digit = next(i for i in range(place, len(content)) if chr(content[i]).isdigit())
    content[digit] = ord("1") if content[digit] != ord("1") else ord("2")
    path.write_bytes(content)
    with pytest.raises(StorageError) as caught:
        KnownPointsProcedure.resume(bench.site(), path)
    assert caught.value.code == "chain.broken"


def test_a_session_does_not_go_on_with_another_rig(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    path = bench.known_points(40).base.session
    with pytest.raises(CalibrationError) as caught:
        KnownPointsProcedure.resume(bench.site(bench.calibrated()), path)
    assert caught.value.code == "session.rig"


def test_two_programs_do_not_write_over_each_other(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    first = bench.known_points(40)
    second = KnownPointsProcedure.resume(bench.site(), first.base.session)
    second.skip(bench.now())
    with pytest.raises(CalibrationError) as caught:
        first.skip(bench.now())
    assert caught.value.code == "session.elsewhere"
    second.skip(bench.now())
    again = KnownPointsProcedure.resume(bench.site(), first.base.session)
    assert again.view.next_point == 2


def test_points_are_dropped_skipped_and_taken_again(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    points = bench.points(40)
    procedure = bench.known_points(40)
    procedure.advance(bench.now())
    rig = bench.virtual(target(points))
    assert show(procedure, rig, bench.now, at_most=3) == 3
    procedure.drop(bench.now())
    assert procedure.view.next_point == 2
    procedure.skip(bench.now())
    assert procedure.view.points[2].views == 0
    procedure.aim("P002")
    assert procedure.view.next_point == 2
    with pytest.raises(CalibrationError, match="P999"):
        procedure.aim("P999")
    resumed = KnownPointsProcedure.resume(bench.site(), procedure.base.session)
    assert [point.views for point in resumed.view.points][:4] == [2, 2, 0, None]


def test_nothing_is_taken_from_a_moving_target_or_with_a_second_light(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    points = bench.points(2)
    procedure = bench.known_points(40)
    procedure.advance(bench.now())
    rig = bench.virtual(target(points))
    seen: set[str] = set()
    # On the way from the first point to the second one.
    rest = round(0.105 * bench.rig.frame_rate_hz)
    for first in range(rest, rest + 480, 80):
        procedure.watch(rig.frames(first, 80))
        live = procedure.base.live
        assert not live.ready
        seen.add(live.hint.split(" ")[0])
    with pytest.raises(CalibrationError):
        procedure.record(bench.now())
    block = rig.frames(100, 400)
    block.uv[:, 0, 7] = 100.0
    procedure.watch(block)
    assert "more than the target" in procedure.base.live.hint


def test_an_accepted_calibration_is_suspect_and_a_kept_one_changes_nothing(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    table = bench.spots(bench.points())
    first = bench.known_points()
    first.take_table(table, bench.now())
    with pytest.raises(CalibrationError, match="No result"):
        first.accept(bench.now(), "new")
    first.compute()
    first.keep(bench.now(), "not now")
    assert bench.store().active_hash is None
    assert first.base.decision is ProcedureDecision.KEPT
    with pytest.raises(CalibrationError, match="ended"):
        first.accept(bench.now(), "after all")

    second = bench.known_points()
    second.take_table(table, bench.now())
    digest = hash_of(second)
    second.accept(bench.now(), "new")
    second.accept(bench.now(), "twice")
    store = bench.store()
    assert store.active_hash == digest
    assert len(store.events) == 1
    assert store.status(bench.now()).state is State.SUSPECT
    assert second.base.stored


def test_an_acceptance_that_was_interrupted_is_made_up_for(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    procedure = bench.known_points()
    procedure.take_table(bench.spots(bench.points()), bench.now())
    digest = hash_of(procedure)
    # The power went after the decision was on the disk and before the record was.
    chain, _ = KnownPointsProcedure.sessions.resume(procedure.base.session)
    decided = Decided(utc=utc_text(bench.now()), decision=ProcedureDecision.ACCEPTED, reason="new")
    chain.append(SessionLine(decided))
    resumed = KnownPointsProcedure.resume(bench.site(), procedure.base.session)
    assert resumed.base.decision is ProcedureDecision.ACCEPTED
    assert not resumed.base.stored
    resumed.compute()
    resumed.accept(bench.now(), "new")
    assert bench.store().active_hash == digest
    assert resumed.base.stored


def test_a_session_that_another_calibration_overtook_is_not_accepted(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    slow = bench.known_points()
    slow.take_table(bench.spots(bench.points()), bench.now())
    slow.compute()
    bench.calibrated()
    late = KnownPointsProcedure.resume(bench.site(), slow.base.session)
    late.compute()
    with pytest.raises(CalibrationError) as caught:
        late.accept(bench.now(), "late")
    assert caught.value.code == "session.overtaken"


def test_the_comparison_shows_what_changed(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    bench.calibrated()
    again = bench.known_points()
    # The whole list is displaced by 5 mm in X, as by a moved frame.
    again.take_table(bench.spots(bench.points(), shift_mm=5.0), bench.now())
    again.compute()
    outcome = again.view.outcome
    assert outcome is not None
    assert outcome.comparison is not None
    # Two calibrations from 250 and 75 points agree to some micrometres in the volume.
    assert outcome.comparison.moved_mm == pytest.approx(5.0, abs=0.02)
    assert max(camera.shift_mm for camera in outcome.comparison.cameras) < 0.2
    assert np.abs(outcome.comparison.differences_world).max() < 0.05
    assert len(outcome.errors_world) == 25


def test_wrong_observations_are_refused_with_the_reason_in_the_snapshot(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    points = bench.points()
    table = bench.spots(points)
    table.uv[0] = table.uv[0, ::-1]
    procedure = bench.known_points()
    procedure.take_table(table, bench.now())
    with pytest.raises(CalibrationError):
        procedure.compute()
    error = procedure.base.error
    assert error is not None
    assert error.remedy
    assert procedure.view.outcome is None


def test_a_session_is_ended_where_its_last_whole_line_says_so(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    procedure = bench.known_points(40)
    path = procedure.base.session
    assert not is_ended(path)
    procedure.keep(bench.now(), "not now")
    assert is_ended(path)
    # A line that a crash cut off does not count, and neither does what cannot be read.
    whole = path.read_bytes()
    path.write_bytes(whole[:-10])
    assert not is_ended(path)
    path.write_bytes(whole + b'{"number"')
    assert is_ended(path)
    assert not is_ended(tmp_path / "missing.jsonl")
