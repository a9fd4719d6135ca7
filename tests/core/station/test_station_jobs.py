"""A running station goes on with the next part, and with a job that was left open."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from ocmm_core.calibration.probe_design import MaterialExpansion, Temperature
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import (
    Material,
    climate_for,
    load_plan,
    material_expansion,
    save_plan,
)
from ocmm_core.measuring import Climate, PartTemperature
from tests.waiting import wait_until


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


def _header(serial: str) -> JobHeader:
    return JobHeader("Ada", "DEMO_PART", serial, "12", "first")


def test_parts_of_a_batch_follow_each_other_and_an_open_job_goes_on(built: BuiltStation) -> None:
    station = built.station
    unused = station.job.path
    station.jobs.next_part(_header("A-1"))
    first = station.job.path
    # A job in which nothing was measured leaves no file behind.
    assert first != unused
    assert not unused.exists()
    station.start()
    wait_until(lambda: len(station.job.stored()[1]) >= 2)
    station.jobs.next_part(_header("A-2"))
    second = station.job.path
    kept = len(reopen_job(first).points)
    assert kept >= 2
    assert station.job.view().header == _header("A-2")
    wait_until(lambda: len(station.job.stored()[1]) >= 1)

    with pytest.raises(InputError, match="A-1"):
        station.jobs.next_part(_header("A-1"))
    assert station.job.path == second

    station.jobs.go_on(first)
    assert station.job.view().header.serial == "A-1"
    wait_until(lambda: len(station.job.stored()[1]) > kept)
    assert reopen_job(second).doubts == ()


def test_the_next_job_is_begun_by_another_plan_and_the_one_before_can_be_gone_on_with(
    built: BuiltStation, tmp_path: Path
) -> None:
    station, begun_with = built.station, built.station.job.plan_file
    station.start()
    wait_until(lambda: len(station.job.stored()[1]) >= 2)
    first = station.job.path
    other = tmp_path / "plans" / "two.toml"
    other.parent.mkdir()
    # With a feature that is touched last, and one that cannot be touched on this part: a touch
    # meant for the previous plan gives no point.
    plan = load_plan(resource("plans", "demo.toml"))
    ball = msgspec.structs.replace(plan.feature("SPHERE"), points=4)
    x, y, z = ball.point
    away = msgspec.structs.replace(ball, name="NOT_THERE", point=(x, y, z + 80.0))
    features = [ball, away]
    plan = msgspec.structs.replace(
        plan, name="TWO", part="OTHER", features=features, characteristics=[], alignment=None
    )
    save_plan(plan, other)

    words = station.jobs.change_plan(other, _header("B-1"))
    second = station.job.path
    assert f"{first.stem} is paused" in words
    assert "still to be measured" in words
    assert (station.job.plan, station.job.plan_file) == (plan, other)
    assert station.job.view().header.part == "OTHER"
    assert [feature.name for feature in station.job.view().features] == ["SPHERE", "NOT_THERE"]
    kept = len(reopen_job(first).points)
    assert kept >= 2
    wait_until(lambda: station.job.missing() == [("NOT_THERE", 4)])

    # The same plan again is the next part of it, and nothing has to be paused.
    assert station.jobs.change_plan(other, _header("B-2")) == ""
    assert station.job.plan_file == other

    station.jobs.go_on(first)
    job = station.job.view()
    assert (job.header.serial, job.paused) == ("-", True)
    assert station.job.plan.name != "TWO"
    assert station.job.plan_file == begun_with
    station.job.change(lambda session: session.pausing.resume())
    wait_until(lambda: len(station.job.stored()[1]) > kept)
    assert reopen_job(second).plan == plan
    assert reopen_job(second).doubts == ()


@pytest.mark.parametrize("fault", ["missing", "faulty", "measured"])
def test_a_plan_that_cannot_be_begun_with_changes_nothing(
    built: BuiltStation, tmp_path: Path, fault: str
) -> None:
    station, running = built.station, built.station.job.path
    path = tmp_path / "other.toml"
    if fault == "faulty":
        path.write_text('schema = "ocmm.plan/1"\n')
    elif fault == "measured":
        station.jobs.next_part(_header("A-1"))
        running = station.job.path
        path.write_bytes(resource("plans", "demo.toml").read_bytes())
        station.job.change(lambda session: session.steps.skip())
    with pytest.raises(InputError, match="A-1" if fault == "measured" else "other.toml"):
        station.jobs.change_plan(path, _header("A-1"))
    assert station.job.path == running
    assert not station.job.view().paused
    assert station.job.plan_file == resource("plans", "quick.toml")


def test_the_growth_of_the_part_is_that_of_its_plan(built: BuiltStation) -> None:
    plan = built.station.job.plan
    steel = msgspec.structs.replace(plan, material=Material(name="steel", expansion_ppm=11.5))
    warm = PartTemperature(
        Temperature(25.0, 0.5, "test"), material_expansion(plan), compensated=False
    )
    changed = climate_for(Climate(part=warm), plan, steel)
    assert changed.part.expansion == material_expansion(steel)
    given = Climate(part=replace(warm, expansion=MaterialExpansion("given", 2e-5, 1e-6)))
    assert climate_for(given, plan, steel) == given
    compensated = Climate(part=replace(changed.part, compensated=True))
    with pytest.raises(InputError, match="expansion of the part, which is unknown"):
        climate_for(compensated, steel, plan)
