"""A station with a reference body: its words, its durable first place, and no false alarm."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation import JobHeader, StatusWord
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.measuring import Refusal, RefusalCode
from ocmm_core.storage import JobFile
from ocmm_sim.scene import ScriptedBump, ScriptedNudge, ScriptedOcclusion, WorldOptions
from tests.waiting import wait_until

Build = Callable[..., BuiltStation]

RATE_HZ = 500
NUDGE = ScriptedNudge(8 * RATE_HZ, 0, (0.6e-3, -0.6e-3, 0.6e-3), (0.6, -0.6, 0.6))


@pytest.fixture
def build(tmp_path: Path) -> Iterator[Build]:
    built: list[BuiltStation] = []

    def make(**changes: object) -> BuiltStation:
        request: dict[str, object] = {
            "plan": resource("plans", "quick.toml"),
            "out": tmp_path / "out",
            "probe": resource("probes", "standard4.toml"),
            "reference": resource("references", "plate.toml"),
            "frame_rate_hz": RATE_HZ,
        }
        built.append(build_station(StationRequest(**(request | changes))))  # type: ignore[arg-type] # fields of the request by name
        return built[-1]

    yield make
    for item in built:
        item.station.close()


def test_a_nudge_of_part_against_cameras_changes_no_result_and_raises_no_alarm(
    build: Build,
) -> None:
    built = build(world=WorldOptions(nudges=(NUDGE,)))
    station = built.station
    station.start()
    seen = set()
    while not station.wait_finished(0.02):
        now = station.looks.live().reference
        seen.add(now.seen if now is not None else 0)
    assert max(seen) == 4
    job = station.job.view()
    assert job.complete
    assert job.held == ()
    assert built.virtual is not None
    true_step = 20.342
    step = next(item for item in job.characteristics if item.name == "Block step")
    assert step.measured is not None
    assert step.uncertainty is not None
    # Twice U: 1 in 16,000 seeds would fail, and a step without reference body is 0.5 mm off. At 500
    # Hz a part of U is the undetectable drift of the ball.
    assert abs(step.measured - true_step) < 2.0 * step.uncertainty < 0.025
    live = station.looks.live()
    assert live.reference is not None
    assert live.reference.name == "plate"
    # Without frames nothing is visible.
    assert live.reference.seen == 0
    # 1.04 mm of the origin, and 1 mrad at the 100 mm or so of the reference body.
    assert live.reference.moved_mm == pytest.approx(1.04, abs=0.25)
    assert live.reference.turned_rad == pytest.approx(1.04e-3, abs=0.1e-3)
    path = built.job_path
    station.close()
    with JobFile.open(path, read_only=True) as stored:
        reference = stored.reference()
        assert reference is not None
        assert reference.n_frames == 126
        assert all(point.reference_spots is not None for point in stored.points())


def test_a_job_goes_on_relative_to_where_its_own_reference_body_stood(build: Build) -> None:
    first = build(stay=True)
    first.station.start()
    wait_until(lambda: len(first.station.job.stored()[1]) >= 5)
    first.station.close()
    # Since then part and reference body were carried on: the program takes another first place.
    moved = ScriptedNudge(0, 0, NUDGE.turn, (40.0, -25.0, 5.0))
    station = build(world=WorldOptions(nudges=(moved,)), stay=True).station
    station.start()
    wait_until(lambda: station.looks.live().status is StatusWord.READY)
    station.jobs.go_on(first.job_path)
    wait_until(lambda: station.job.view().complete)
    view = station.job.view()
    step = next(item for item in view.characteristics if item.name == "Block step")
    assert step.measured is not None
    assert step.uncertainty is not None
    assert abs(step.measured - 20.342) < 2.0 * step.uncertainty < 0.025
    reference = station.looks.live().reference
    assert reference is not None
    assert reference.moved_mm == pytest.approx(47.4, abs=1.0)
    # The next part is measured in the same world.
    station.jobs.next_part(JobHeader("Ada", "DEMO_PART", "2", "", ""))
    wait_until(lambda: len(station.job.stored()[1]) >= 1)
    second = station.job.path
    station.close()
    opened = [reopen_job(path) for path in (first.job_path, second)]
    assert [job.doubts for job in opened] == [(), ()]
    assert opened[0].view.characteristics == view.characteristics
    assert all(job.options.reference is not None for job in opened)
    with JobFile.open(first.job_path) as one, JobFile.open(second) as other:
        places = [job.reference() for job in (one, other)]
    assert places[0] is not None
    assert places[1] is not None
    np.testing.assert_array_equal(places[0].spots, places[1].spots)


def test_one_pushed_camera_is_noticed_as_without_a_reference_body(build: Build) -> None:
    push = ScriptedBump(0, 10 * RATE_HZ, (40e-6, 0.0, 0.0))
    built = build(world=WorldOptions(nudges=(NUDGE,), bumps=(push,)))
    station = built.station
    refusals: list[Refusal] = []
    station.events.point_refused.connect(refusals.append)
    station.start()
    # The operator goes on touching: the first touch after the alarm gives the reason in place of a
    # point.
    wait_until(lambda: len(refusals) > 0)
    assert station.job.view().held != ()
    assert {refusal.code for refusal in refusals} == {RefusalCode.CALIBRATION}
    assert "has changed since the calibration" in refusals[0].what


def test_a_lost_reference_body_blocks_the_readout_and_the_points(build: Build) -> None:
    hidden = ScriptedOcclusion(1, (4, 6), 6 * RATE_HZ, 10**9)
    built = build(world=WorldOptions(occlusions=(hidden,)), speed=20.0, stay=True)
    station = built.station
    refusals: list[Refusal] = []
    station.events.point_refused.connect(refusals.append)
    station.start()
    wait_until(lambda: station.looks.live().frame_counter > 6 * RATE_HZ + 50)
    wait_until(lambda: len(refusals) > 0)
    live = station.looks.live()
    assert live.status is StatusWord.LOST
    assert live.reason == "Reference body not visible. Camera right does not see R1, R3."
    assert live.tip_world is None
    assert live.tip_uncertainty is None
    assert live.reference is not None
    assert live.reference.seen == 2
    assert live.reference.moved_mm is None
    assert refusals[0].code is RefusalCode.REFERENCE
    assert all(
        point.last_frame < 6 * RATE_HZ
        for feature in station.job.view().features
        for point in feature.points
    )


def test_while_the_table_moves_the_first_place_is_not_taken(build: Build) -> None:
    moving = ScriptedNudge(0, 4 * RATE_HZ, shift=(100.0, 0.0, 0.0))
    built = build(world=WorldOptions(nudges=(moving,)), speed=1.0, stay=True)
    station = built.station
    station.start()
    words = "The reference body: it is not at rest, so its position cannot be taken."
    wait_until(lambda: station.looks.live().reason == words)
    assert station.looks.live().status is StatusWord.NOT_READY
    assert station.looks.live().tip_world is None
    wait_until(lambda: station.looks.live().status is StatusWord.READY)
    reference = station.looks.live().reference
    assert reference is not None
    assert reference.moved_mm is not None
    # Nothing of the motion before the first place is left in the job.
    assert reference.moved_mm < 1.0


def test_slots_say_which_led_of_which_body_they_follow(build: Build) -> None:
    built = build(speed=20.0, stay=True)
    station = built.station
    station.start()
    wait_until(lambda: station.looks.live().status is StatusWord.READY)
    live = station.looks.live()
    assert built.virtual is not None
    truth = built.virtual.truth
    assert live.slot_references is not None
    for camera in range(2):
        for led, slot in enumerate(truth.reference_slots[camera]):
            assert live.slot_references[camera, slot] == led
            assert live.slot_leds[camera, slot] == -1
        for led, slot in enumerate(truth.slots[camera]):
            assert live.slot_leds[camera, slot] == led
    assert truth.T_world_from_reference is not None
    assert live.reference is not None
    assert live.reference.leds_world is not None
    leds = truth.T_world_from_reference.apply(truth.leds_reference)
    assert np.abs(live.reference.leds_world - leds).max() < 0.1


def test_probe_and_reference_body_that_are_too_many_for_a_camera_are_refused(
    build: Build, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"have 10 LEDs together, but a camera .* of 8 windows"):
        build(probe=resource("probes", "standard.toml"), source="ethercat:virtual")
    assert not (tmp_path / "out").exists()
