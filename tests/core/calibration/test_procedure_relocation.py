"""Guided relocation after the frame was moved; labels, coverage and gates on the way."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_cli.calibrate import take_relocation_shots
from ocmm_core.calibration.cameras import KnownPoints
from ocmm_core.calibration.guided import STILL_FRAMES, ProbeSpotAverager, coverage, to_spots
from ocmm_core.calibration.guided._shot_table import label_roughly
from ocmm_core.calibration.records import State, load_bar
from ocmm_core.calibration.relocation import RelocationProcedure, RelocationRequest, RelocationSetup
from ocmm_core.calibration.relocation._state import SeatTaken
from ocmm_core.calibration.relocation._steps import bar_ends
from ocmm_core.calibration.verification import VerificationProcedure, VerificationSetup
from ocmm_core.camera import USUAL_SLOTS, Rig, on_sensor, project
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_sim.calibration_scenes import FreeMotionScene
from ocmm_sim.sources import VirtualSite, relocation_by_step
from tests.core.calibration.procedure_site import (
    PROBE_DOCUMENT,
    RIG_DOCUMENT,
    SEED,
    Bench,
    recorded,
    show,
    without_field,
)

MOVE = 7
CONTROL = KnownPoints(
    ("N1", "N2", "N3", "N4"),
    np.array([[-150.0, -60, -150], [150, -60, -150], [150, 60, -120], [-150, 60, 50]]),
    0.002,
    "nests",
)


def begin(bench: Bench, rig: Rig, poses: int = 120) -> RelocationProcedure:
    return RelocationProcedure.start(
        bench.site(rig),
        RelocationSetup(
            who="technician",
            control=CONTROL,
            request=RelocationRequest(world="points", poses=poses),
            bar=bench.bar,
        ),
        bench.now(),
    )


@pytest.mark.slow
def test_a_moved_frame_is_found_again_and_verified(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    before = bench.calibrated()
    procedure = begin(bench, before)
    site = VirtualSite(RIG_DOCUMENT, PROBE_DOCUMENT, SEED, MOVE)
    scenes = tuple(relocation_by_step(site, bench.rig, procedure.view, bench.bar, CONTROL).values())
    virtual = bench.virtual(*scenes, move=MOVE)
    # Half of the waving, then the program is killed and goes on.
    show(procedure, virtual, bench.now, at_most=62)
    procedure = RelocationProcedure.resume(bench.site(before), procedure.base.session)
    assert procedure.view.poses == 60
    assert len(procedure.view.seats_world) == 2
    assert "Missing probe poses" in procedure.base.steps[2].gate.reason
    show(procedure, virtual, bench.now)
    assert procedure.base.step.name == "result"
    assert procedure.view.bar_placements == 10
    assert procedure.view.world_points == CONTROL.names
    procedure.predict()
    predicted = procedure.view.length_sigma_mm
    assert predicted is not None
    # Facts of the field procedure: 2 to 4 um for 400 mm with some hundred poses and ten placements.
    assert 0.001 < predicted < 0.005
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    comparison = outcome.comparison
    assert comparison is not None
    assert comparison.moved_mm > 5.0
    true = virtual.world.cameras
    for found, camera in zip(outcome.rig.cameras, true, strict=True):
        # Cameras at a distance of a metre see 0.01 px as 5 um; nests constrain them to 2 um each.
        assert np.abs(found.centre_world - camera.centre_world).max() < 0.15
    procedure.accept(bench.now(), "moved")
    assert bench.store().status(bench.now()).state is State.SUSPECT
    # Another length than the one that gave the calibration its scale.
    bench.bar = load_bar(resource("artefacts", "verification_bar.toml"))
    check = VerificationProcedure.start(
        bench.site(outcome.rig), VerificationSetup(who="engineer", bar=bench.bar), bench.now()
    )
    lines = bench.verified_scenes(check, move=MOVE)
    show(check, bench.virtual(*lines, move=MOVE), bench.now)
    check.compute()
    verdict = check.view.outcome
    assert verdict is not None
    assert verdict.record.passed
    assert not verdict.warnings
    check.accept(bench.now(), "verified")
    assert bench.store().status(bench.now()).state is State.VALID


@pytest.mark.slow
def test_a_touched_bar_gives_the_scale_and_three_points_the_world(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    bench.bar = replace(bench.bar, leds=())
    procedure = RelocationProcedure.start(
        bench.site(),
        RelocationSetup(
            who="technician", request=RelocationRequest(world="set", poses=120), bar=bench.bar
        ),
        bench.now(),
    )
    site = VirtualSite(RIG_DOCUMENT, PROBE_DOCUMENT, SEED, MOVE)
    scenes = tuple(relocation_by_step(site, bench.rig, procedure.view, bench.bar, None).values())
    show(procedure, bench.virtual(*scenes, move=MOVE), bench.now)
    view = procedure.view
    assert view.bar_placements == 10
    assert view.world_points == ("origin", "on X", "in XY")
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    # The baseline in any world: 600 mm to about 0.1 mm after the frame was moved, and its length to
    # better than 50 um by the bar.
    true = bench.virtual(move=MOVE).world.cameras
    baselines = [
        np.linalg.norm(two[1].centre_world - two[0].centre_world)
        for two in (outcome.rig.cameras, true)
    ]
    assert abs(baselines[0] - baselines[1]) < 0.05


def test_the_second_end_of_a_bar_is_a_bar_away(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    bench.bar = replace(bench.bar, leds=())
    state = begin(bench, bench.rig)._state  # noqa: SLF001 - the rule alone
    first, right, wrong = (
        np.stack([project(camera, bench.body.leds_probe + place) for camera in bench.rig.cameras])
        for place in ([-190.0, 0.0, -100.0], [210.0, 0.0, -100.0], [120.0, 0.0, -100.0])
    )
    assert state.judge_end(first, 0.01) == ""
    state.add(SeatTaken(utc="", seat="", uv=to_spots(first), sigma_px=0.01))
    assert state.judge_end(right, 0.01) == ""
    assert "310 mm from the first end" in state.judge_end(wrong, 0.01)


def test_a_hand_that_turns_back_is_not_taken_for_one_that_rests(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    waving = bench.virtual(FreeMotionScene(ways=6, seed=2))
    collector = ProbeSpotAverager(
        bench.rig, bench.body, STILL_FRAMES, resting=True, distance_mm=5.0
    )
    hints = set()
    for first in range(0, waving.n_frames - 80, 80):
        collector.push(waving.frames(first, 80))
        live = collector.live()
        assert not live.ready
        hints.add(live.hint.split(" ")[0])
    # It was seen and judged, not merely overlooked.
    assert "The" in hints


def seated(bench: Bench, seat_shift_mm: float) -> RelocationProcedure:
    """Return a relocation from recorded shots, with two seats that were visited first and last."""
    procedure = RelocationProcedure.start(
        bench.site(),
        RelocationSetup(
            who="technician", request=RelocationRequest(poses=200, placements=6), bar=bench.bar
        ),
        bench.now(),
    )
    take_relocation_shots(procedure, recorded(bench, 260, 6, seat_shift_mm))
    return procedure


def test_seats_that_stayed_let_a_relocation_pass(tmp_path: Path) -> None:
    procedure = seated(Bench.at(tmp_path), 0.0)
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    assert not [one for one in outcome.warnings if one.code.startswith("repeat.")]


def test_a_seat_that_moved_meanwhile_refuses_and_cannot_be_forced(tmp_path: Path) -> None:
    # A tenth of a millimetre: some ten standard deviations of the shift between two visits.
    procedure = seated(Bench.at(tmp_path), 0.1)
    procedure.force(Bench.at(tmp_path).now(), "in a hurry")
    with pytest.raises(CalibrationError) as caught:
        procedure.compute()
    assert caught.value.code == "repeat.moved"
    assert "seat 1 by" in caught.value.what
    assert "seat 2" not in caught.value.what
    assert "It happened between" in caught.value.what
    assert "relocate again" in caught.value.remedy


def test_what_is_taken_after_the_seats_asks_for_them_once_more(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    procedure = begin(bench, bench.rig, poses=1)
    first, second, pose, *_, again, last = recorded(bench, 1, 0)
    for shot in (first, second):
        procedure.take_visit(shot.uv, shot.sigma_px, bench.now())
    assert "was not visited again" in procedure.base.steps[5].gate.reason
    procedure.take_pose(pose.uv, pose.sigma_px, bench.now())
    for shot in (again, last):
        procedure.take_visit(shot.uv, shot.sigma_px, bench.now())
    assert procedure.base.steps[5].gate.open
    with pytest.raises(CalibrationError, match="at the start and at the end"):
        procedure.take_visit(again.uv, again.sigma_px, bench.now())
    procedure.take_pose(pose.uv, pose.sigma_px, bench.now())
    assert "Seat 1 of 2 was not visited again" in procedure.base.steps[5].gate.reason
    # The ball in another seat than the one that is wanted is not taken for it.
    state = procedure._state  # noqa: SLF001 - the rule alone
    assert "the ball is in seat 2" in state.judge_visit(second.uv, 0.01, again=True)
    assert state.judge_visit(first.uv, 0.01, again=True) == ""


def test_a_session_of_an_earlier_version_is_left_out_with_a_sentence(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    session = begin(bench, bench.rig).base.session
    without_field(session, "seats")
    with pytest.raises(CalibrationError, match="started by an earlier version"):
        RelocationProcedure.resume(bench.site(), session)


def test_gates_say_what_is_missing_and_observations_are_taken_back(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    procedure = begin(bench, bench.rig, poses=4)
    procedure.advance(bench.now())
    with pytest.raises(CalibrationError, match="Seat 1 of 2 was not visited"):
        procedure.advance(bench.now())
    # Nobody forces a relocation that lacks its seats.
    procedure.force(bench.now(), "in a hurry")
    with pytest.raises(CalibrationError, match="Seat 1 of 2 was not visited"):
        procedure.compute()
    procedure = begin(bench, bench.rig, poses=4)
    for shot in recorded(bench, 0, 0)[:2]:
        procedure.take_visit(shot.uv, shot.sigma_px, bench.now())
    for _ in range(2):
        procedure.advance(bench.now())
    with pytest.raises(CalibrationError, match="Missing probe poses"):
        procedure.advance(bench.now())
    with pytest.raises(CalibrationError, match="Missing probe poses"):
        procedure.compute()
    uv = np.full((2, 6, 2), 1000.0) + np.arange(12.0).reshape(6, 2)
    procedure.take_pose(uv, 0.01, bench.now())
    assert procedure.view.poses == 1
    procedure.drop(bench.now())
    procedure.drop(bench.now())
    assert procedure.view.poses == 0
    procedure.predict()
    assert procedure.view.length_sigma_mm is None
    with pytest.raises(CalibrationError, match="at least three"):
        RelocationProcedure.start(
            bench.site(),
            RelocationSetup(
                who="technician", request=RelocationRequest(world="points"), bar=bench.bar
            ),
            bench.now(),
        )


def test_labels_are_right_where_cameras_stand_elsewhere(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    rng = np.random.default_rng(11)
    found = 0
    for trial in range(40):
        start = replace(
            bench.rig, cameras=tuple(camera.perturbed(_off(rng)) for camera in bench.rig.cameras)
        )
        spots, slots = _pose(bench, rng, hidden=trial % 6 if trial % 3 == 0 else None)
        labels = label_roughly(start, bench.body, spots)
        if labels is not None:
            found += 1
            known = labels >= 0
            assert np.array_equal(labels[known], slots[known])
    # An ambiguous spot stays unlabelled; that must be rare.
    assert found >= 36


def test_a_spot_of_something_else_gives_no_labels(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    rng = np.random.default_rng(12)
    wrong = 0
    for _ in range(20):
        spots, slots = _pose(bench, rng, hidden=None)
        # A reflection about 30 px from the LED: rigid bodies and lenses cause no such offset.
        spots[0, slots[0, 2]] += rng.uniform(25.0, 60.0, 2)
        labels = label_roughly(bench.rig, bench.body, spots)
        wrong += labels is not None
    assert wrong == 0


def test_a_body_that_looks_alike_both_ways_round_gets_no_labels(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    rng = np.random.default_rng(13)
    half = np.array([[40.0, -30.0, 30.0], [20.0, 30.0, 60.0], [55.0, 10.0, -10.0]])
    leds = np.concatenate([half, half * [-1.0, 1.0, -1.0]])
    light = np.tile([0.0, -1.0, 0.0], (6, 1))
    bench.body = replace(bench.body, leds_probe=leds, led_directions_probe=light)
    for _ in range(8):
        spots, _slots = _pose(bench, rng, hidden=None)
        assert label_roughly(bench.rig, bench.body, spots) is None


def test_coverage_names_what_is_missing(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    nothing = coverage(bench.rig, bench.body, np.empty((0, 3, 3)), np.empty((0, 3)))
    assert len(nothing.cells) == 18
    assert nothing.fraction == 0.0
    assert "near low left" in nothing.missing
    assert "leaning left" in nothing.missing
    # Every pose in one corner, upright: towards the cameras is -y, their left is -x.
    tips = np.tile([-180.0, -90.0, -180.0], (40, 1))
    one = coverage(bench.rig, bench.body, np.tile(np.eye(3), (40, 1, 1)), tips)
    assert "near low left" not in one.missing
    assert "far high right" in one.missing
    assert "upright" not in one.missing
    left = rotation_from_vector(np.array([0.0, -0.5, 0.0]))
    tilted = coverage(bench.rig, bench.body, np.tile(left, (40, 1, 1)), tips)
    assert "leaning left" not in tilted.missing


def test_the_ends_of_a_bar_are_paired_by_its_length(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    # Horizontal: the rays of wrong pairs meet as well.
    ends = np.array([[-150.0, 20.0, 30.0], [250.0, 20.0, 30.0]])
    uv = np.stack([project(camera, ends) for camera in bench.rig.cameras])
    swapped = uv.copy()
    swapped[1] = uv[1, ::-1]
    assert np.array_equal(bar_ends(bench.rig, swapped, 400.0), uv)
    with pytest.raises(CalibrationError, match="not the ends"):
        bar_ends(bench.rig, uv, 250.0)


def _off(rng: np.random.Generator) -> Float:
    """Return a change of one camera by some 10 mm, 0.6 degrees and 2 %."""
    change = np.zeros(14)
    change[:3] = np.radians(0.6) / np.sqrt(3.0) * rng.standard_normal(3)
    change[3:6] = 10.0 / np.sqrt(3.0) * rng.standard_normal(3)
    change[6] = 0.5 * rng.choice([-1.0, 1.0])
    return change


def _pose(
    bench: Bench, rng: np.random.Generator, hidden: int | None
) -> tuple[Float, np.ndarray[tuple[int, int], np.dtype[np.int64]]]:
    """Return spots (C, 8, 2) of the probe somewhere, and the true slots (C, L)."""
    low, high = bench.rig.volume_world
    leds, light = bench.body.leds_probe, bench.body.led_directions_probe
    while True:
        rotation = rotation_from_vector(rng.uniform(-0.6, 0.6, 3))
        at = leds @ rotation.T + rng.uniform(low, high)
        uv = np.stack([project(camera, at) for camera in bench.rig.cameras])
        seen = [
            on_sensor(camera, spots).all()
            and _cosines(camera.centre_world - at, light @ rotation.T).min() > 0.5
            for camera, spots in zip(bench.rig.cameras, uv, strict=True)
        ]
        if all(seen):
            break
    slots = np.stack([rng.permutation(USUAL_SLOTS)[: len(leds)] for _ in uv]).astype(np.int64)
    spots = np.full((len(uv), USUAL_SLOTS, 2), np.nan)
    for camera in range(len(uv)):
        spots[camera, slots[camera]] = uv[camera] + 0.03 * rng.standard_normal(uv[camera].shape)
        if hidden is not None:
            spots[camera, slots[camera, hidden]] = np.nan
    return spots, slots


def _cosines(towards: Float, light: Float) -> Float:
    cosines: Float = np.sum(towards * light, axis=1) / np.linalg.norm(towards, axis=1)
    return cosines
