"""The station with a calibration from the store: gates, warnings, and content of the job file."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from ocmm_core.calibration.records import (
    CalibrationStatus,
    CalibrationStore,
    CameraRecord,
    compare_with_cameras,
    open_calibration,
    store_folder,
)
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError
from ocmm_core.inspection.evaluation import SessionOptions, StatusWord
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.station._calibration_watch import CalibrationWatch
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import PartWord, Verdict
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.fieldbus.direct_camera import DirectCamera
from tests.host import BUSY, HANG_S, private_network
from tests.waiting import wait_until

# Whole jobs through the whole station.
pytestmark = pytest.mark.slow

Build = Callable[..., BuiltStation]


def fresh_record(**changes: object) -> CameraRecord:
    """Return a calibration of an hour ago that is valid for a year."""
    made = datetime.now(UTC) - timedelta(hours=1)
    until = made + timedelta(days=365)
    return make_record(made_utc=made.isoformat(), valid_until_utc=until.isoformat(), **changes)


def calibrate(folder: Path, record: CameraRecord, *, verified: bool = True) -> CalibrationStore:
    """Put a calibration in force."""
    store = CalibrationStore(store_folder(folder, "recommended"))
    now = datetime.now(UTC)
    store.accept(record, "technician", "new", now)
    if verified:
        store.verify(make_verification(record), now)
    return store


@pytest.fixture
def build(tmp_path: Path) -> Iterator[Build]:
    built: list[BuiltStation] = []

    def make(**changes: object) -> BuiltStation:
        request = StationRequest(
            plan=resource("plans", "quick.toml"),
            out=tmp_path / "out",
            calibrations=tmp_path,
            **changes,  # type: ignore[arg-type] # fields of the request by name
        )
        built.append(build_station(request))
        return built[-1]

    yield make
    for item in built:
        item.station.close()


def test_a_job_is_measured_with_the_record_and_says_so(build: Build, tmp_path: Path) -> None:
    store = calibrate(tmp_path, fresh_record())
    built = build(frame_rate_hz=500)
    station = built.station
    assert station.instruments.rig.identity == store.active_hash
    station.start()
    assert station.wait_finished(HANG_S)
    view = station.job.view()
    assert view.complete
    assert view.unproven == ""
    assert {result.verdict for result in view.characteristics} == {Verdict.CONFORM}
    report = station.reports.export(tmp_path / "report")[3]
    with report.open(newline="") as stream:
        assert {row["Calibration"] for row in csv.DictReader(stream)} == {
            f"VALID {station.instruments.rig.identity[:12]}"
        }
    station.close()
    with JobFile.open(built.job_path, read_only=True) as job:
        assert job.head.rig_identity == store.active_hash
        events = [(event.kind, event.text) for event in job.events()]
        assert ("calibration", f"VALID {store.active_hash}") in events
        assert job.verify() == []


def test_an_unverified_calibration_takes_no_points(build: Build, tmp_path: Path) -> None:
    calibrate(tmp_path, fresh_record(), verified=False)
    station = build(frame_rate_hz=500).station
    refused: list[Refusal] = []
    station.events.point_refused.connect(refused.append)
    live = station.looks.live()
    assert live.status is StatusWord.NOT_READY
    station.start()
    # The scripted operator repeats a refused touch a few times, then gives up.
    wait_until(lambda: len(refused) >= 2)
    assert {item.code.value for item in refused} == {"calibration"}
    assert "not been verified" in refused[0].what
    assert "length bar" in refused[0].remedy
    assert "not been verified" in station.looks.live().reason
    assert station.looks.live().tip_world is None
    # The coach next to the readout shows neither a number nor a turn.
    assert station.looks.probe_now() is None
    assert all(not feature.points for feature in station.job.view().features)


def test_who_insists_gets_points_that_prove_nothing_for_good(build: Build, tmp_path: Path) -> None:
    built = build(frame_rate_hz=500, uncalibrated=True)
    station = built.station
    station.start()
    assert station.wait_finished(HANG_S)
    view = station.job.view()
    assert view.complete
    assert "never calibrated" in view.unproven
    assert {result.verdict for result in view.characteristics} == {Verdict.NOT_PROVEN}
    assert view.part_verdict.word is PartWord.NOT_PROVEN
    assert view.simulated
    assert all(view.unproven in result.note for result in view.characteristics)
    names = [path.name for path in station.reports.export(tmp_path / "report")]
    assert names[3] == "QUICK-001_SIMULATED_UNCALIBRATED_report.csv"
    station.close()
    # Reopened by an independent program, it still proves nothing.
    with JobFile.open(built.job_path) as job:
        again = InspectionSession(
            station.job.plan,
            station.instruments.rig,
            station.instruments.body,
            job,
            SessionOptions(),
        )
        assert again.view.unproven == view.unproven
        assert again.view.characteristics == view.characteristics


def test_a_doubt_stops_a_running_job_and_a_verification_lets_it_go_on(
    build: Build, tmp_path: Path
) -> None:
    record = fresh_record()
    store = calibrate(tmp_path, record)
    station = build(frame_rate_hz=500, speed=1.0, stay=True).station
    taken: list[MeasuredPoint] = []
    station.events.point_taken.connect(taken.append)
    station.start()
    wait_until(lambda: len(taken) >= 1)
    assert station.looks.probe_now() is not None
    now = datetime.now(UTC)
    store.suspect("monitor", "Camera 'left' has turned.", now, now)
    wait_until(lambda: station.looks.live().status is StatusWord.NOT_READY)
    assert "Camera 'left' has turned." in station.looks.live().reason
    assert station.looks.probe_now() is None
    before = len(taken)
    station.job.record_point()
    time.sleep(0.5)
    assert len(taken) == before
    refusal = station.job.view().refusal
    assert refusal is not None
    assert "has turned" in refusal.what
    store.verify(make_verification(record), datetime.now(UTC))
    wait_until(lambda: len(taken) > before)
    assert station.instruments.calibration().word is CalibrationStatus.VALID


def test_a_verification_that_fails_meanwhile_holds_the_points_of_the_job_back(
    build: Build, tmp_path: Path
) -> None:
    record = fresh_record()
    store = calibrate(tmp_path, record)
    station = build(frame_rate_hz=500, speed=1.0, stay=True).station
    taken: list[MeasuredPoint] = []
    station.events.point_taken.connect(taken.append)
    station.start()
    wait_until(lambda: len(taken) >= 1)
    failed = make_verification(record, passed=False)
    store.verify(msgspec.structs.replace(failed, data_sha256="c" * 64), datetime.now(UTC))
    wait_until(lambda: set(station.job.view().held) == {point.number for point in taken})
    store.verify(make_verification(record), datetime.now(UTC))
    wait_until(lambda: station.instruments.calibration().word is CalibrationStatus.VALID)
    assert {taken[0].number} <= set(station.job.view().held)


def test_without_cameras_there_is_nothing_to_write_to(build: Build, tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="never calibrated"):
        build(frame_rate_hz=500).station.maintenance.write_to_cameras()
    calibrate(tmp_path, fresh_record())
    with pytest.raises(CalibrationError, match="do not come from real cameras"):
        build(frame_rate_hz=500).station.maintenance.write_to_cameras()


def test_what_is_written_is_the_calibration_in_force(tmp_path: Path) -> None:
    record = fresh_record()
    store = calibrate(tmp_path, record)
    cameras = {entry.name: DirectCamera(serial=entry.serial) for entry in record.cameras}
    in_use = open_calibration(resource("rigs", "recommended.toml"), tmp_path)
    watch = CalibrationWatch(in_use, None, cameras.__getitem__)
    left, right = record.cameras
    later = fresh_record(cameras=(msgspec.structs.replace(left, k1=1.1 * left.k1), right))
    store.accept(later, "technician", "new", datetime.now(UTC))
    # A wizard of the same window has just accepted it.
    assert in_use.store is not None
    in_use.store.refresh()
    watch.write_to_cameras()
    assert compare_with_cameras(later, cameras.__getitem__) is None
    assert compare_with_cameras(record, cameras.__getitem__) is not None


@pytest.mark.timing
def test_cameras_that_store_nothing_are_not_measured_with_until_they_do(
    build: Build, tmp_path: Path
) -> None:
    private_network()
    calibrate(tmp_path, fresh_record(sensor_temperatures_c=(36.5, 34.0)))
    station = build(source="ethercat:virtual").station
    assert "not been read yet" in str(station.instruments.calibration().blocking_reason)
    station.start()
    wait_until(lambda: "stores no intrinsics" in station.looks.live().reason)
    assert station.looks.live().status is StatusWord.NOT_READY
    assert station.instruments.calibration().word is CalibrationStatus.UNUSABLE
    station.maintenance.write_to_cameras()
    wait_until(lambda: station.looks.live().status in (StatusWord.READY, StatusWord.MEASURING))
    assert station.instruments.calibration().word is CalibrationStatus.VALID
    # The cameras of the virtual wire have 36.5 and 37.5 degrees.
    wait_until(lambda: bool(station.instruments.calibration().warnings))
    (warning,) = station.instruments.calibration().warnings
    assert "Camera 'right' is 3.5 K warmer" in warning
    begun = time.monotonic()
    station.close()
    assert time.monotonic() - begun < BUSY * 2.0
