"""A station that logs a registered thermometer in its job."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.acceptance import ARTEFACT_SCHEMA, ArtefactEntry, ArtefactRegister, TemperatureSource
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.plan import noted_rooms
from ocmm_core.storage import JobFile
from tests.host import HANG_S


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
    end = time.monotonic() + HANG_S
    try:
        built.station.start()
        sensor.write_text("85000")
        while not any("power-on" in words for _, words in built.station.job.view().room):
            assert time.monotonic() < end
            time.sleep(0.05)
    finally:
        built.station.close()
    with JobFile.read(built.job_path) as job:
        noted = noted_rooms(job.events())
    assert (noted[0].points, noted[0].room, noted[0].who) == (
        0,
        "20.44 ± 0.20",
        "hall, serial 4711",
    )
    assert any(one.doubt and not one.room for one in noted)
