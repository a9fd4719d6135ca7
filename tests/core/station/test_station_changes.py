"""A camera pushed during a job: the suspicion, the sentences, the held-back points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.calibration.records import EventKind, State, record_hash
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import SessionOptions, StatusWord
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import Verdict
from ocmm_sim.scene import ScriptedBump, WorldOptions
from tests.core.calibration.made_records import make_verification
from tests.core.station.test_station_calibration import calibrate, fresh_record
from tests.waiting import wait_until

Build = Callable[..., BuiltStation]

RATE_HZ = 500
PUSH_S = 12.0
PUSH = WorldOptions(bumps=(ScriptedBump(0, int(PUSH_S * RATE_HZ), (40e-6, 0.0, 0.0)),))


@pytest.fixture
def build(tmp_path: Path) -> Iterator[Build]:
    built: list[BuiltStation] = []

    def make(**changes: object) -> BuiltStation:
        request = StationRequest(
            plan=resource("plans", "quick.toml"),
            out=tmp_path / "out",
            frame_rate_hz=RATE_HZ,
            world=PUSH,
            **changes,  # type: ignore[arg-type] # fields of the request by name
        )
        built.append(build_station(request))
        return built[-1]

    yield make
    for item in built:
        item.station.close()


def test_a_pushed_camera_puts_the_calibration_in_doubt_and_points_are_held_back(
    build: Build, tmp_path: Path
) -> None:
    record = fresh_record()
    store = calibrate(tmp_path, record)
    built = build(calibrations=tmp_path, stay=True, speed=20.0)
    station = built.station
    station.start()

    def doubted() -> bool:
        store.refresh()
        return store.events[-1].kind is EventKind.SUSPECTED

    wait_until(doubted)
    status = store.status(datetime.now(UTC))
    assert status.state is State.SUSPECT
    assert store.events[-1].who == "monitor"
    assert "pitch" in status.reason
    # Two cameras and a probe cannot say who of them it was.
    assert "camera left" in status.reason.lower()
    assert "camera right" in status.reason.lower()
    assert datetime.fromisoformat(status.since_utc) < datetime.now(UTC)
    wait_until(lambda: station.looks.live().reason.startswith(status.reason))
    live = station.looks.live()
    assert live.status is StatusWord.NOT_READY
    assert live.tip_world is None
    job = station.job.view()
    points = [point for feature in job.features for point in feature.points]
    held = [point for point in points if point.number in job.held]
    # All points after the push are held back, and none that is older than the checks before it.
    assert {point.number for point in points if point.time_s > PUSH_S} <= set(job.held)
    assert min(point.time_s for point in held) > PUSH_S - 5.0
    assert len(held) < len(points)
    touched = {point.feature for point in held}
    resting = [item for item in job.characteristics if touched & set(item.features)]
    assert resting
    # An unfinished feature has no verdict yet, independent of held-back points.
    undecided = (Verdict.NOT_PROVEN, Verdict.NOT_MEASURED, Verdict.PROVISIONAL)
    assert all(item.verdict in undecided for item in resting)
    for feature in job.features:
        noted = feature.name in touched and feature.fit is not None
        assert ("held back" in feature.note) == noted

    store.verify(make_verification(record), datetime.now(UTC))
    # The camera was verified at its present place: the points count again.
    wait_until(lambda: station.job.view().held == ())
    station.close()
    with JobFile.open(built.job_path, read_only=True) as job_file:
        assert "points released" in [event.kind for event in job_file.events()]


def test_points_stay_held_back_when_the_job_is_opened_again(build: Build) -> None:
    built = build()
    station = built.station
    assert station.instruments.calibration().record is None
    station.start()
    wait_until(lambda: station.job.view().held != ())
    assert "Fasten the cameras and verify the calibration" in station.looks.live().reason
    station.close()
    before = station.job.view()
    with JobFile.open(built.job_path) as job:
        again = InspectionSession(
            station.job.plan,
            station.instruments.rig,
            station.instruments.body,
            job,
            SessionOptions(),
        )
        assert again.view.held == before.held
        assert again.view.characteristics == before.characteristics
        assert job.verify() == []


def test_the_record_is_named_by_the_doubt(build: Build, tmp_path: Path) -> None:
    record = fresh_record()
    store = calibrate(tmp_path, record)
    station = build(calibrations=tmp_path).station
    station.start()
    wait_until(lambda: station.job.view().held != ())
    station.close()
    store.refresh()
    assert store.events[-1].calibration == record_hash(record)
    assert [event.kind for event in store.events].count(EventKind.SUSPECTED) == 1
