"""Resting of the ball in a cone, the frames used, and the messages meanwhile."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.pivot import PivotSweep, attitude_between, load_sweeps
from ocmm_core.calibration.sweeping import BATCH, CELL_RAD, PivotProcedure, SweepPhase
from ocmm_core.calibration.sweeping._progress import sphere_map, where_missing
from ocmm_core.calibration.sweeping._watch import POSE_TURN, SweepWatch
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.tracking import IdentifyOptions, identify, load_probe
from ocmm_sim.calibration_scenes import (
    CalibrationScenesRig,
    FreeMotionScene,
    ScriptedJump,
    SweepProbe,
)
from tests.core.calibration.pivot_site import CONE, OTHER_CONE, SIGMA_PX, PivotBench, show_sweeps
from tests.core.calibration.table_writers import write_sweeps

TAKING = 6.0


@pytest.fixture
def bench(tmp_path: Path) -> PivotBench:
    return PivotBench(tmp_path)


def begun(bench: PivotBench, *, tip_unknown: bool = False) -> PivotProcedure:
    procedure = bench.begin(tip_unknown=tip_unknown)
    procedure.advance(bench.now())
    return procedure


def test_a_waved_or_resting_probe_is_not_taken_for_one_in_a_cone(bench: PivotBench) -> None:
    still = SweepProbe(cone=CONE, seconds=2.5, seed=1, reach_deg=(0.0, 0.0, 0.0))
    for scene in (FreeMotionScene(ways=8, seed=1), still):
        virtual = CalibrationScenesRig(bench.rig, bench.body, (scene,), 3)
        for unknown in (False, True):
            procedure = begun(bench, tip_unknown=unknown)
            _, views = show_sweeps(procedure, virtual, bench.now)
            assert procedure.view.first.poses == 0
            assert {view.first.phase for view in views} == {SweepPhase.WAITING}
            assert "sweep the probe" in procedure.base.live.hint


@pytest.mark.parametrize("unknown", [False, True])
def test_the_tip_may_be_elsewhere_than_the_document_says(bench: PivotBench, unknown: bool) -> None:
    scene = SweepProbe(cone=CONE, seconds=TAKING, seed=5, tip_shift_mm=(5.0, 3.0, -30.0))
    procedure = begun(bench, tip_unknown=unknown)
    show_sweeps(procedure, bench.virtual(scene), bench.now)
    view = procedure.view
    assert view.first.poses >= 4 * BATCH
    assert np.linalg.norm(view.first.centre_world - np.array(CONE)) < 0.1
    codes = [one.code for one in view.warnings]
    assert codes == ([] if unknown else ["pivot.tip_changed"])


def test_slow_cameras_get_a_pose_from_every_other_frame(bench: PivotBench) -> None:
    """Six seconds at 100 Hz; a look every 80 frames would see some eight of them."""
    bench.rig = replace(bench.rig, frame_rate_hz=100)
    procedure = begun(bench)
    virtual = bench.virtual(SweepProbe(cone=CONE, seconds=TAKING, seed=5))
    for first in range(0, virtual.n_frames, 8):
        procedure.watch(virtual.frames(first, min(8, virtual.n_frames - first)))
        if procedure.base.live.ready:
            procedure.record(bench.now())
    assert procedure.view.first.poses >= 5 * BATCH


def test_labels_do_not_need_the_tip(bench: PivotBench) -> None:
    virtual = bench.virtual(SweepProbe(cone=CONE, seconds=2.0, seed=5))
    wrong = replace(bench.body, tip_probe=np.array([30.0, -20.0, 60.0]))
    for frame in range(4000, 16000, 1500):
        spots = virtual.frames(frame, 1).uv[0]
        known, other = (
            identify(bench.rig, body, spots, IdentifyOptions(0.03)).slot_of_led
            for body in (bench.body, wrong)
        )
        assert known is not None
        assert other is not None
        assert np.array_equal(known, other)
        assert np.array_equal(known, virtual.world.slots)


def test_poses_are_thinned_and_wait_in_a_bounded_batch(bench: PivotBench) -> None:
    virtual = bench.virtual(SweepProbe(cone=CONE, seconds=TAKING, seed=5))
    watch = SweepWatch(bench.rig, bench.body, tip_known=True)
    for frame in range(0, virtual.n_frames - 80, 80):
        watch.push(virtual.frames(frame, 80))
        assert len(watch.batch) <= BATCH, "nobody took them, and they pile up"
    assert watch.live().ready
    turned = [look.rotation for look in watch._pending]  # noqa: SLF001 - the rule alone
    for a, b in pairwise(turned):
        assert np.arccos(0.5 * (np.trace(a.T @ b) - 1.0)) >= POSE_TURN


def test_a_ball_that_leaves_comes_back_or_stands_elsewhere(bench: PivotBench) -> None:
    same = bench.virtual(
        SweepProbe(cone=CONE, seconds=4.0, seed=5), SweepProbe(cone=CONE, seconds=4.0, seed=6)
    )
    procedure = begun(bench)
    _, views = show_sweeps(procedure, same, bench.now)
    phases = [view.first.phase for view in views]
    left = phases.index(SweepPhase.LEFT)
    assert SweepPhase.TAKING in phases[left:], "it was put back and goes on"
    assert views[left].base.live.hint.startswith("The ball left the cone")
    assert not any(view.warnings for view in views)
    moved = bench.virtual(
        SweepProbe(cone=CONE, seconds=4.0, seed=5), SweepProbe(cone=OTHER_CONE, seconds=4.0, seed=6)
    )
    procedure = begun(bench)
    _, views = show_sweeps(procedure, moved, bench.now)
    warned = [view for view in views if view.warnings]
    assert [one.code for one in warned[0].warnings] == ["pivot.moved"]
    assert "73." in warned[0].warnings[0].what
    assert "repeat this sweep" in warned[0].base.live.hint
    assert procedure.view.first.centre_world == pytest.approx(np.array(CONE), abs=0.05)


def test_a_pushed_cone_and_covered_leds_are_said_at_once(bench: PivotBench) -> None:
    jump = ScriptedJump(at_s=5.0, shift_mm=(0.15, 0.0, 0.1))
    reach = (30.0, 30.0, 14.0)
    procedure = begun(bench)
    scene = SweepProbe(cone=CONE, seconds=10.0, seed=1, reach_deg=reach, jumps=(jump,))
    _, views = show_sweeps(procedure, bench.virtual(scene), bench.now)
    codes = [one.code for view in views for one in view.warnings]
    assert "pivot.moved" in codes
    assert "the cone or the ball in it moved" in procedure.base.step.gate.reason
    procedure = begun(bench)
    scene = SweepProbe(cone=CONE, seconds=TAKING, seed=1, reach_deg=reach, hidden=(1,))
    _, views = show_sweeps(procedure, bench.virtual(scene), bench.now)
    said = [one.what for view in views for one in view.warnings]
    assert any("LED 2 is hidden from camera" in what for what in said)


def test_another_probe_is_named(bench: PivotBench) -> None:
    other = load_probe(resource("probes", "thesis.toml"))
    procedure = begun(bench)
    scene = SweepProbe(cone=CONE, seconds=3.0, seed=5)
    _, views = show_sweeps(procedure, bench.virtual(scene, body=other), bench.now)
    assert procedure.view.first.poses == 0
    assert "pivot.strange_lights" in [one.code for view in views for one in view.warnings]
    assert "not those of the probe" in procedure.base.live.hint


def test_the_map_stands_still_and_says_what_is_missing(bench: PivotBench) -> None:
    rng = np.random.default_rng(1)
    up = np.array([0.0, 0.0, 1.0])
    directions = up + 0.35 * rng.uniform(-1.0, 1.0, (400, 3)) * [1.0, 1.0, 0.0]
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    middle, cells = sphere_map(directions, np.radians(20.0))
    assert middle @ up > np.cos(np.radians(4.0))
    assert sum(cell.poses for cell in cells) == 400
    assert where_missing(bench.rig, middle, cells) == ""
    half = directions[directions[:, 0] > 0.0]
    _, fewer = sphere_map(half, np.radians(20.0))
    known = {tuple(cell.direction_world) for cell in cells}
    assert all(tuple(cell.direction_world) in known for cell in fewer if cell.poses)
    apart = np.array([cell.direction_world for cell in cells]) @ cells[0].direction_world
    assert np.sort(np.arccos(np.clip(apart, -1.0, 1.0)))[1] > 0.5 * CELL_RAD
    nothing, none = sphere_map(np.empty((0, 3)), 0.3)
    assert np.isnan(nothing).all()
    assert none == ()
    # Leaning to the right only, the left lacks (the cameras look along +y, x is to their right).
    empty = tuple(
        replace(cell, poses=0) if cell.direction_world[0] < -0.1 else cell for cell in cells
    )
    assert where_missing(bench.rig, middle, empty) == "to the left"


def test_where_a_hand_is_slow_makes_no_other_attitude() -> None:
    tilts = np.radians(np.stack(np.meshgrid(np.arange(-25, 26, 5), np.arange(-25, 26, 5)), -1))
    even = np.dstack([np.sin(tilts), np.ones(tilts.shape[:2])]).reshape(-1, 3)
    even /= np.linalg.norm(even, axis=1)[:, None]
    slow = np.concatenate([even, np.repeat(even[:11], 50, axis=0)])
    assert attitude_between(even, slow) < np.radians(1.0)
    lean = np.radians(20.0)
    turn = np.array([[1, 0, 0], [0, np.cos(lean), -np.sin(lean)], [0, np.sin(lean), np.cos(lean)]])
    assert attitude_between(even, slow @ turn.T) == pytest.approx(lean, abs=np.radians(3.0))


def test_recorded_sweeps_are_read_as_they_were_written(bench: PivotBench, tmp_path: Path) -> None:
    first, second = bench.swept(1, n=40), bench.swept(2, OTHER_CONE, n=40)
    first[3, 1, 2] = np.nan
    sweeps = [PivotSweep.even(uv, SIGMA_PX) for uv in (first, second)]
    path = tmp_path / "sweeps.csv"
    content = write_sweeps(sweeps, bench.rig).decode()
    path.write_text(content)
    for found, wanted in zip(load_sweeps(path, bench.rig, 6).sweeps, sweeps, strict=True):
        assert np.array_equal(found.uv, wanted.uv, equal_nan=True)
        assert np.array_equal(found.sigma_px, wanted.sigma_px)
    serial = str(bench.rig.cameras[0].serial)
    row = f"1,1,{serial},1,5.0,5.0\n"
    for text, words in (
        (content + row, "occurs already"),
        (content + row.replace("1,1,", "3,1,", 1), "no sweep '3'"),
        (content + row.replace(serial, "77"), "no camera '77'"),
        (content + f"1,1,{serial},7,5.0,5.0\n", "no led '7'"),
        ("".join(line for line in content.splitlines(True) if line[0] != "2"), "no sweep 2"),
        (content.replace(f"# sigma: {SIGMA_PX}", "# sigma: 0"), "'sigma' is 0"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            load_sweeps(path, bench.rig, 6)
