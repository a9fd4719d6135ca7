"""A running station goes on with the next part, and with a job that was left open."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ocmm_core.cli.compose import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.inspection.reopen import reopen_job
from ocmm_core.inspection.view import JobHeader
from ocmm_core.storage.job_file import JobFile

PATIENCE_S = 60.0


@pytest.fixture
def built(tmp_path: Path) -> Iterator[BuiltStation]:
    """Return a station on the short job, not started."""
    made = build_station(
        StationRequest(
            plan=resource("plans", "quick.toml"), out=tmp_path, stay=True, frame_rate_hz=800
        )
    )
    yield made
    made.station.close()


def _until(state: Callable[[], bool]) -> None:
    until = time.monotonic() + PATIENCE_S
    while not state():
        assert time.monotonic() < until
        time.sleep(0.01)


def _header(serial: str) -> JobHeader:
    return JobHeader("Ada", "DEMO_PART", serial, "12", "first")


def test_parts_of_a_batch_follow_each_other_and_an_open_job_goes_on(built: BuiltStation) -> None:
    station = built.station
    unused = station.job_path
    station.next_part(_header("A-1"))
    first = station.job_path
    # A job in which nothing was measured leaves no file behind.
    assert first != unused
    assert not unused.exists()
    station.start()
    _until(lambda: len(station.stored_job()[1]) >= 2)
    station.next_part(_header("A-2"))
    second = station.job_path
    kept = len(reopen_job(first).points)
    assert kept >= 2
    assert station.job().header == _header("A-2")
    _until(lambda: len(station.stored_job()[1]) >= 1)

    with pytest.raises(InputError, match="A-1"):
        station.next_part(_header("A-1"))
    assert station.job_path == second

    station.go_on(first)
    assert station.job().header.serial == "A-1"
    _until(lambda: len(station.stored_job()[1]) > kept)
    assert reopen_job(second).doubts == ()


def test_a_job_by_another_plan_is_refused_and_the_running_one_goes_on(
    built: BuiltStation, tmp_path: Path
) -> None:
    other = build_station(
        StationRequest(
            plan=resource("plans", "demo.toml"), out=tmp_path / "other", frame_rate_hz=800
        )
    )
    path = other.station.job_path
    other.station.close()
    running = built.station.job_path
    with pytest.raises(MeasuringError, match="another plan"):
        built.station.go_on(path)
    assert built.station.job_path == running
    # The refused file is let go of.
    JobFile.open(path).close()
