"""A station that logs a registered thermometer in its job."""

from __future__ import annotations

import threading
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.acceptance import (
    ARTEFACT_SCHEMA,
    ArtefactEntry,
    ArtefactRegister,
    TemperatureSource,
    ThermometerLog,
)
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import noted_rooms
from ocmm_core.station._faults import StationFaults
from ocmm_core.station._name_watch import RoomWatch
from ocmm_core.storage import JobFile
from tests.host import HANG_S
from tests.waiting import wait_until


def test_station_logs_readings_and_their_loss(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    sensor = tmp_path / "temp1_input"
    sensor.write_text("20437")
    source = TemperatureSource(kind="file", address=str(sensor), unit="°C", scale=0.001)
    entry = ArtefactEntry(
        schema=ARTEFACT_SCHEMA, unit="mm", id="hall", kind="thermometer", name="hall",
        serial="4711", laboratory="lab", certificate="C-9", due_utc="2040-01-01T00:00:00+00:00",
        sizes=(), expanded=0.2, expansion=0.0, expansion_sigma=0.0, reads=source,
    )  # fmt: skip
    ArtefactRegister().add(entry, "Ann", datetime.now(UTC))
    monkeypatch.setattr("ocmm_core.station._name_watch._READ_S", 0.0)
    plan = resource("plans", "quick.toml")
    built = build_station(
        StationRequest(plan=plan, out=tmp_path / "jobs", seed=4, thermometers="hall", speed=1.0)
    )
    reported: list[int] = []

    def count() -> None:
        if threading.current_thread().name == "ocmm-room":
            reported.append(1)

    def is_noted(words: str) -> bool:
        return any(words in text for _, text in built.station.job.view().room)

    built.station.events.changed.connect(count)
    try:
        built.station.start()
        wait_until(lambda: is_noted("20.44"))
        sensor.write_text("85000")
        wait_until(lambda: is_noted("power-on"))
    finally:
        built.station.close()
    with JobFile.read(built.job_path) as job:
        noted = noted_rooms(job.events())
    assert (noted[0].room, noted[0].who) == ("20.44 ± 0.20", "hall, serial 4711")
    assert any(one.doubt and not one.room for one in noted)
    # It samples at each interval, and reports only stored samples.
    assert len(reported) == len(noted)


class _NoJob:
    def has_points(self) -> bool:
        return True

    def what_is_safe(self) -> str:
        return ""


def test_a_silent_thermometer_delays_neither_start_nor_end() -> None:
    asked, answer = threading.Event(), threading.Event()

    def read(_source: TemperatureSource) -> tuple[float, datetime]:
        asked.set()
        assert answer.wait(HANG_S)
        raise InputError("thermometer.dead", "It is silent.", "")

    def never(*_: object) -> None:
        raise AssertionError

    source = TemperatureSource(kind="file", address="x", unit="°C", scale=1.0)
    log = ThermometerLog([("hall", "hall", 0.2, source)], read)
    faults = StationFaults(threading.Event(), _NoJob())
    watch = RoomWatch(log, never, never, faults)  # type: ignore[arg-type] # no job is open
    watch.start()
    assert asked.wait(HANG_S)
    watch.close()
    assert not answer.is_set()
    answer.set()
    wait_until(lambda: "ocmm-room" not in {one.name for one in threading.enumerate()})
    assert faults.beside == ()
