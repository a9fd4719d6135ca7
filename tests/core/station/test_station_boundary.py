"""What fails inside a station: changing the job is all or nothing, and FAILED stays."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from ocmm_core.calibration.records import Blocker
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InternalError, OcmmError, StorageError
from ocmm_core.inspection.evaluation import JobHeader, StatusWord, withdrawn
from ocmm_core.measuring import Refusal, RefusalCode
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import Verdict
from tests.waiting import wait_until

HEADER = JobHeader("Ada", "DEMO_PART", "A-2", "12", "first")


@pytest.fixture
def built(tmp_path: Path) -> Iterator[BuiltStation]:
    made = build_station(
        StationRequest(
            plan=resource("plans", "quick.toml"), out=tmp_path, stay=True, frame_rate_hz=500
        )
    )
    yield made
    made.station.close()


@pytest.fixture(scope="module")
def empty_job(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return a job file in which nothing was measured yet."""
    made = build_station(
        StationRequest(
            plan=resource("plans", "quick.toml"),
            out=tmp_path_factory.mktemp("older"),
            frame_rate_hz=500,
            serial="A-0",
        )
    )
    made.station.close()
    return made.job_path.read_bytes()


def _raising(*_: Any, **__: Any) -> Any:
    msg = "injected"
    raise RuntimeError(msg)


STEPS = (
    "ocmm_core.station._open_job.InspectionSession",
    "ocmm_core.station._open_job.ChangeWatch",
    "ocmm_core.station._open_job.ProbeWatch",
    "ocmm_core.station._calibration_watch.ProbeWatch.start",
    "ocmm_core.inspection.session._header.Conditions.note_calibration",
    "ocmm_core.inspection.session._header.Conditions.note_limits",
    "ocmm_core.station._job_change.drop_if_empty",
    "ocmm_core.station._frame_loop.FrameLoop.exclusive",
    "ocmm_core.station._job.header_text",
)


@pytest.mark.parametrize(
    ("where", "verb"),
    [
        (where, verb)
        for where in STEPS
        for verb in ("next_part", "change_plan", "go_on")
        # A job that is gone on with gets no header.
        if (verb, where) != ("go_on", STEPS[-1])
    ],
)
def test_a_change_that_fails_changes_nothing(
    built: BuiltStation,
    empty_job: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    where: str,
    verb: str,
) -> None:
    station = built.station
    # It has no point either, but was not made by this change: it is never removed.
    older = tmp_path / "older.ocmm"
    older.write_bytes(empty_job)
    path, view, files = station.job.path, station.job.view(), sorted(tmp_path.glob("*.ocmm"))
    other = tmp_path / "other.toml"
    other.write_text(
        resource("plans", "quick.toml").read_text("utf-8").replace("QUICK", "OTHER"), "utf-8"
    )
    verbs: dict[str, Callable[[], object]] = {
        "next_part": lambda: station.jobs.next_part(
            JobHeader("Ada", "DEMO_PART", "A-3", "12", "first")
        ),
        "change_plan": lambda: station.jobs.change_plan(
            other, JobHeader("Ada", "DEMO_PART", "A-3", "12", "first")
        ),
        "go_on": lambda: station.jobs.go_on(older),
    }
    with monkeypatch.context() as patch:
        patch.setattr(where, _raising)
        with pytest.raises((InternalError, RuntimeError), match="injected"):
            verbs[verb]()
    assert (station.job.path, station.job.view()) == (path, view)
    assert sorted(tmp_path.glob("*.ocmm")) == files
    with JobFile.open(older):
        # No reference remains.
        pass
    assert station.faults.measuring is None
    if verb == "next_part":
        station.start()
        wait_until(lambda: len(station.job.stored()[1]) >= 1)
    verbs[verb]()
    assert station.job.path != path


def test_a_paused_job_is_measured_on_where_the_other_plan_cannot_be(
    built: BuiltStation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = built.station
    station.start()
    wait_until(lambda: len(station.job.stored()[1]) >= 1)
    other = tmp_path / "other.toml"
    other.write_text(
        resource("plans", "quick.toml").read_text("utf-8").replace("QUICK", "OTHER"), "utf-8"
    )
    with monkeypatch.context() as patch:
        patch.setattr("ocmm_core.station._job_change.drop_if_empty", _raising)
        with pytest.raises(InternalError, match="The previous job remains active"):
            station.jobs.change_plan(other, HEADER)
    assert not station.job.view().paused
    taken = len(station.job.stored()[1])
    wait_until(lambda: len(station.job.stored()[1]) > taken)


def test_failed_stays_until_a_new_start_and_takes_no_point(
    built: BuiltStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = built.station
    told: list[OcmmError] = []
    refused: list[Refusal] = []
    station.faults.failed.connect(told.append)
    station.events.point_refused.connect(refused.append)
    station.start()
    wait_until(lambda: station.looks.live().tip_world is not None)
    with monkeypatch.context() as patch:
        patch.setattr("ocmm_core.tracking._pipeline.TrackingPipeline.process", _raising)
        wait_until(lambda: station.looks.live().status is StatusWord.FAILED)
    # What failed works again, and still nothing comes back.
    time.sleep(0.1)
    live = station.looks.live()
    assert (live.status, live.tip_world, live.tip_uncertainty) == (StatusWord.FAILED, None, None)
    station.job.record_point()
    assert "RuntimeError: injected" in refused[-1].what
    station.jobs.next_part(HEADER)
    assert station.looks.live().status is StatusWord.FAILED
    wait_until(lambda: bool(told))
    assert len(told) == 1


def test_a_start_that_fails_is_failed_and_not_waiting(
    built: BuiltStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = built.station
    monkeypatch.setattr("ocmm_core.inspection.session._header.Conditions.note_climate", _raising)
    with pytest.raises(InternalError, match="The start failed: RuntimeError: injected"):
        station.start()
    assert station.looks.live().status is StatusWord.FAILED


def test_a_step_that_nobody_foresaw_to_fail_stops_the_measuring(
    built: BuiltStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = built.station
    monkeypatch.setattr("ocmm_core.inspection.session._step_log.StepLog.undo", _raising)
    with pytest.raises(InternalError, match="The change of the job failed"):
        station.job.change(lambda session: session.steps.undo())
    assert station.looks.live().status is StatusWord.FAILED


def test_a_touch_that_cannot_be_stored_is_no_fault_of_the_station(
    built: BuiltStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = built.station
    told: list[OcmmError] = []
    station.faults.failed.connect(told.append)

    def full(*_: Any) -> None:
        raise StorageError("job.full", "The disk is full.", "Make room.")

    with monkeypatch.context() as patch:
        patch.setattr("ocmm_core.storage._tables.insert_point", full)
        station.start()
        wait_until(lambda: len(told) >= 1)
    wait_until(lambda: len(station.job.stored()[1]) >= 1)
    assert station.faults.measuring is None


def test_withdrawn_results_hold_no_number_and_say_why(built: BuiltStation) -> None:
    station = built.station
    station.start()
    wait_until(lambda: len(station.job.stored()[1]) >= 14)
    job = station.job.view()
    assert any(result.measured is not None for result in job.characteristics)
    void = withdrawn(job, "The evaluation failed.")
    assert [feature.points for feature in void.features] == [f.points for f in job.features]
    for result in void.characteristics:
        assert (result.measured, result.deviation, result.uncertainty) == (None, None, None)
        assert result.verdict is Verdict.NOT_MEASURED
        assert result.note == "Result withdrawn."
    for feature in void.features:
        assert (feature.fit, feature.coverage, feature.targets) == (None, None, ())
    assert void.unproven == "The evaluation failed."
    assert void.part_verdict.word != job.part_verdict.word


def test_a_touch_that_is_refused_while_the_disk_is_full_ends_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = StationRequest(
        plan=resource("plans", "quick.toml"), out=tmp_path, stay=True, frame_rate_hz=500
    )
    full = StorageError("job.disk_full", "The disk is full.", "Free disk space.")

    append = JobFile.append_event

    def refuse_to_note(job: JobFile, kind: str, text: str) -> None:
        if kind == "refused":
            raise full
        append(job, kind, text)

    station = build_station(request).station
    told: list[OcmmError] = []
    station.faults.failed.connect(told.append)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(JobFile, "append_event", refuse_to_note)
            blocker = Blocker("The cameras are not calibrated.", "Calibrate.")
            patch.setattr(
                type(station.instruments),
                "blocking_reason",
                lambda _self: (RefusalCode.NOT_READY, blocker),
            )
            station.start()
            wait_until(lambda: len(told) >= 2)
        assert set(told) == {full}
        assert station.faults.measuring is None
        assert station.job.stored()[1] == []
        wait_until(lambda: len(station.job.stored()[1]) >= 1)
        assert station.faults.measuring is None
    finally:
        station.close()


def test_a_job_whose_disk_failed_says_not_stored_and_takes_nothing(
    built: BuiltStation, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = built.station
    taken: list[object] = []
    told: list[OcmmError] = []
    station.events.point_taken.connect(taken.append)
    station.faults.failed.connect(told.append)
    lost = StorageError("job.disk", "The last point could not be written.", "Copy the job.")

    def failed(_job: JobFile, _kind: str, _text: str) -> None:
        raise lost

    station.start()
    wait_until(lambda: len(taken) >= 1)
    with monkeypatch.context() as patch:
        patch.setattr(JobFile, "given_up", lost)
        patch.setattr(JobFile, "append_event", failed)
        live = station.looks.live()
        assert live.status is StatusWord.NOT_READY
        assert live.reason == "NOT STORED. The last point could not be written. Copy the job."
        wait_until(lambda: len(told) >= 1)
        before = len(taken)
        count = len(told)
        wait_until(lambda: len(told) > count)
        assert len(taken) == before
    assert set(told) == {lost}
    assert station.faults.measuring is None
