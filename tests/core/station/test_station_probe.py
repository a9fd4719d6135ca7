"""The station with records of the tip: gates, reasons for a check, content of the job file."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.calibration.records import (
    CalibrationStatus,
    TipEventKind,
    open_probe,
    open_probe_design,
)
from ocmm_core.camera import load_rig
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError, InputError, MeasuringError
from ocmm_core.inspection.evaluation import SessionOptions, StatusWord
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.station._calibration_watch import ProbeWatch
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tolerances.decisions import Verdict
from ocmm_sim.scene import WorldOptions
from tests.core.calibration.fresh_tips import TIP, Tips
from tests.core.calibration.made_probe_records import make_probe_record
from tests.host import HANG_S
from tests.waiting import wait_until

DOCUMENT = resource("probes", "standard.toml")
PLAN = resource("plans", "quick.toml")
RATE_HZ = 500

Build = Callable[..., BuiltStation]


@pytest.fixture
def build(tmp_path: Path) -> Iterator[Build]:
    built: list[BuiltStation] = []

    def make(**changes: object) -> BuiltStation:
        request = StationRequest(
            plan=PLAN,
            out=tmp_path / "out",
            frame_rate_hz=RATE_HZ,
            **({"probes": tmp_path} | changes),  # type: ignore[arg-type] # fields of the request by name
        )
        built.append(build_station(request))
        return built[-1]

    yield make
    for item in built:
        item.station.close()


def test_a_job_keeps_tip_record_and_due_date(build: Build, tmp_path: Path) -> None:
    tips = Tips(tmp_path)
    built = build()
    station = built.station
    station.start()
    assert station.wait_finished(HANG_S)
    view = station.job.view()
    assert view.complete
    assert {result.verdict for result in view.characteristics} == {Verdict.CONFORM}
    due = min(tips.record.valid_until_utc, tips.qualified.valid_until_utc)[:10]
    with station.reports.export(tmp_path / "report")[3].open(newline="") as stream:
        assert {row["Probe"] for row in csv.DictReader(stream)} == {
            f"VALID standard/{TIP} {station.instruments.body.identity[:12]} due {due}"
        }
    station.close()
    with JobFile.open(built.job_path) as job:
        assert job.head.probe_identity == station.instruments.body.identity
        (note,) = [event.text for event in job.events() if event.kind == "probe"]
        assert note.startswith(
            f"VALID standard, tip {TIP}: {station.instruments.body.identity} calibration "
        )
        assert str(tips.store.active_hash(TIP)) in note
        # Opened with another geometry its points would be compensated with the wrong ball.
        other = open_probe_design(DOCUMENT).body
        with pytest.raises(MeasuringError, match="another tip"):
            InspectionSession(
                station.job.plan, station.instruments.rig, other, job, SessionOptions()
            )
        again = InspectionSession(
            station.job.plan,
            station.instruments.rig,
            station.instruments.body,
            job,
            SessionOptions(),
        )
        assert again.view.characteristics == view.characteristics


def test_a_tip_that_is_not_good_takes_no_points(build: Build, tmp_path: Path) -> None:
    tips = Tips(tmp_path)
    tips.check(passed=False)
    station = build().station
    refused: list[Refusal] = []
    station.events.point_refused.connect(refused.append)
    station.start()
    wait_until(lambda: len(refused) >= 2)
    assert {item.code.value for item in refused} == {"tip"}
    assert refused[0].what == f"The last check of tip '{TIP}' failed."
    assert "Run the quick tip check (one minute)." in refused[0].remedy
    live = station.looks.live()
    assert "quick tip check" in live.reason
    assert live.tip_world is None
    assert all(not feature.points for feature in station.job.view().features)


def test_who_insists_gets_points_that_prove_nothing(build: Build) -> None:
    built = build(uncalibrated=True)
    station = built.station
    station.start()
    assert station.wait_finished(HANG_S)
    view = station.job.view()
    assert "Probe 'standard' was never calibrated." in view.unproven
    assert {result.verdict for result in view.characteristics} == {Verdict.NOT_PROVEN}
    assert station.instruments.probe().label.startswith("UNCALIBRATED standard ")


def test_a_blow_stops_points_until_the_tip_is_checked(build: Build, tmp_path: Path) -> None:
    tips = Tips(tmp_path)
    touches = build().virtual
    assert touches is not None
    fifth = touches.truth.touches[4]
    world = WorldOptions(drops=(fifth.first_frame - RATE_HZ // 5,))
    station = build(world=world, speed=8.0, stay=True).station
    taken: list[MeasuredPoint] = []
    station.events.point_taken.connect(taken.append)
    station.start()
    wait_until(lambda: station.instruments.probe().word is CalibrationStatus.SUSPECT)
    wait_until(lambda: station.job.view().refusal is not None)
    live = station.looks.live()
    assert live.status is StatusWord.NOT_READY
    assert live.reason.startswith("Probe shock detected at 20")
    assert len(taken) == 4
    # Points before the blow were touched with a good tip.
    assert station.job.view().held == ()
    tips.store.refresh()
    last = tips.store.events[-1]
    assert (last.kind, last.who, last.tip) == (TipEventKind.DOUBTED, "monitor", TIP)
    # A restart does not remove the suspicion.
    assert build().station.instruments.probe().word is CalibrationStatus.SUSPECT
    tips.check()
    station.maintenance.probe_records_changed()
    wait_until(lambda: len(taken) > 4)
    assert station.instruments.probe().word is CalibrationStatus.VALID


def test_a_probe_without_records_that_felt_a_blow_is_not_trusted_again(build: Build) -> None:
    station = build(probes=None, world=WorldOptions(drops=(RATE_HZ,))).station
    refused: list[Refusal] = []
    station.events.point_refused.connect(refused.append)
    station.start()
    wait_until(lambda: len(refused) >= 2)
    assert "shock detected" in refused[-1].what
    assert "start a new job" in refused[-1].remedy
    assert station.instruments.probe().word is CalibrationStatus.SUSPECT
    with pytest.raises(CalibrationError, match="one tip only"):
        station.maintenance.mount_tip(TIP)


def test_a_failed_check_holds_the_points_back_for_good(build: Build, tmp_path: Path) -> None:
    tips = Tips(tmp_path)
    built = build()
    station = built.station
    station.start()
    assert station.wait_finished(HANG_S)
    count = len(station.job.view().held) + sum(
        len(one.points) for one in station.job.view().features
    )
    tips.check(passed=False)
    station.maintenance.probe_records_changed()
    view = station.job.view()
    assert len(view.held) == count
    assert {result.verdict for result in view.characteristics} == {Verdict.NOT_PROVEN}
    assert f"The check of tip '{TIP}' failed" in view.characteristics[0].note
    assert "Re-probe them." in view.characteristics[0].note
    tips.check()
    station.maintenance.probe_records_changed()
    assert station.instruments.probe().word is CalibrationStatus.VALID
    assert station.job.view().held == view.held
    station.close()
    with JobFile.open(built.job_path) as job:
        again = InspectionSession(
            station.job.plan,
            station.instruments.rig,
            station.instruments.body,
            job,
            SessionOptions(),
        )
        assert again.view.held == view.held


def test_another_tip_in_the_menu_ends_the_job(build: Build, tmp_path: Path) -> None:
    tips = Tips(tmp_path)
    other = make_probe_record(tip="long")
    station = build().station
    station.start()
    assert station.wait_finished(HANG_S)
    points = sum(len(one.points) for one in station.job.view().features)
    station.maintenance.mount_tip(TIP)
    assert station.instruments.probe().word is CalibrationStatus.SUSPECT
    # The time of the unscrewing is unknown: the points count again after a check.
    assert len(station.job.view().held) == points
    tips.check()
    station.maintenance.probe_records_changed()
    assert station.job.view().held == ()
    with pytest.raises(CalibrationError, match="never calibrated with tip 'short'"):
        station.maintenance.mount_tip("short")
    tips.store.calibrate(other, "technician", "new", datetime.now(UTC))
    station.maintenance.probe_records_changed()
    assert station.instruments.probe().word is CalibrationStatus.UNUSABLE
    assert "Tip 'long' is mounted" in str(station.instruments.probe().blocking_reason)


def test_a_tip_that_is_named_at_the_start_is_mounted(build: Build, tmp_path: Path) -> None:
    tips = Tips(tmp_path)
    other = make_probe_record(tip="long")
    tips.store.calibrate(other, "technician", "new", datetime.now(UTC))
    station = build(tip=TIP, operator="Ada").station
    station.start()
    assert station.instruments.probe().word is CalibrationStatus.SUSPECT
    tips.store.refresh()
    assert tips.store.mounted == TIP
    assert tips.store.events[-1].who == "Ada"
    tips.check()
    wait_until(lambda: station.instruments.probe().word is CalibrationStatus.VALID)
    with pytest.raises(InputError, match="uses its document"):
        build(probes=None, tip=TIP)


def test_a_tip_that_rested_over_night_is_checked(build: Build, tmp_path: Path) -> None:
    tips = Tips(tmp_path, ago=timedelta(hours=9))
    station = build(check_after_h=10.0).station
    station.start()
    assert station.instruments.probe().word is CalibrationStatus.VALID
    station.close()
    station = build().station
    station.start()
    assert "not used for more than 8 hours" in str(station.instruments.probe().blocking_reason)
    tips.check()
    station.maintenance.probe_records_changed()
    assert station.instruments.probe().word is CalibrationStatus.VALID


def no_frames(*flags: int) -> FrameBlock:
    """Return frames in which nothing is seen."""
    count = len(flags)
    counter = np.arange(count, dtype=np.int64)
    return FrameBlock(
        counter=counter,
        time_ns=counter * 125_000,
        flags=np.array(flags, dtype=np.uint32),
        valid=np.zeros((count, 2), dtype=np.uint64),
        uv=np.full((count, 2, 8, 2), np.nan),
    )


def test_a_pause_within_a_job_and_blows_one_after_the_other(tmp_path: Path) -> None:
    tips = Tips(tmp_path)
    now = [datetime.now(UTC)]
    in_use = open_probe(DOCUMENT, tmp_path)
    rig = load_rig(resource("rigs", "recommended.toml"))
    head = make_head(
        plan=PLAN, rig=resource("rigs", "recommended.toml"), probe=DOCUMENT, operator="me",
        part="P", serial="1",
    )  # fmt: skip
    with JobFile.create(tmp_path / "job.ocmm", head) as job:
        session = InspectionSession(load_plan(PLAN), rig, in_use.body, job, SessionOptions())
        watch = ProbeWatch(in_use, session, job, timedelta(hours=8), clock=lambda: now[0])
        watch.start()
        assert not watch.push(no_frames(0, 0))
        now[0] += timedelta(hours=7)
        watch.used()
        now[0] += timedelta(hours=7)
        assert not watch.push(no_frames(0, 0))
        now[0] += timedelta(hours=2)
        assert watch.push(no_frames(0, 0))
        assert not watch.push(no_frames(0, 0))
        since = datetime.fromisoformat(watch.view().since_utc)
        assert now[0] - since == timedelta(hours=9)
        # One blow is reported for a second; two blows count as two.
        shock = int(FrameFlag.DROPPED)
        before = len(tips.store.events)
        assert watch.push(no_frames(0, shock, shock))
        assert not watch.push(no_frames(shock, shock, 0))
        assert watch.push(no_frames(0, shock | int(FrameFlag.BUTTON)))
        tips.store.refresh()
        kinds = [one.kind for one in tips.store.events[before:]]
        assert kinds == [TipEventKind.DOUBTED] * 3
