"""State, results, calibrations and corrections as other programs get them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import StorageError
from ocmm_core.inspection.evaluation import StatusWord
from ocmm_core.station.stream import StreamOptions
from ocmm_machine import Machine
from ocmm_serve.published import PublishedFacts, PublishedStation, ResultEvaluation
from ocmm_serve.site import PublishedPlaces
from tests.core.inspection.conftest import Bench
from tests.host import HANG_S
from tests.serve.published_jobs import measure, record_equipment, state_offsets
from tests.waiting import wait_until


@contextmanager
def followed(places: PublishedPlaces, notes: list[str]) -> Iterator[PublishedStation]:
    station = PublishedStation(places, notes.append)
    station.start()
    try:
        yield station
    finally:
        station.close()


def places(folder: Path, **named: object) -> PublishedPlaces:
    nothing = dict.fromkeys(("stream", "probes", "calibrations", "corrections", "records"))
    return PublishedPlaces(out=folder, **{**nothing, **named})  # type: ignore[arg-type] # by name


def test_follows_a_station_from_its_start_to_the_verdict_and_its_end(tmp_path: Path) -> None:
    plan = resource("plans", "quick.toml")
    request = StationRequest(
        plan=plan, out=tmp_path, frame_rate_hz=500, stream=StreamOptions(port=0)
    )
    station = build_station(request).station
    notes: list[str] = []
    seen: list[PublishedFacts] = []

    def facts() -> PublishedFacts:
        found = published.facts
        if not seen or found is not seen[-1]:
            seen.append(found)
        return found

    try:
        station.start()
        assert station.stream is not None
        port = station.stream.address[1]
        with followed(places(tmp_path, stream=port), notes) as published:
            wait_until(lambda: facts().state.online)
            assert station.wait_finished(HANG_S)
            wait_until(lambda: facts().state.complete is True)
            view, state = station.job.view(), facts().state
            assert state.part == view.part_verdict.headline
            assert state.job == view.job
            assert state.simulated is True
            assert state.missing == ()
            assert state.not_conform == view.part_verdict.failing
            # The job is read while the station still holds it open.
            wait_until(lambda: bool(facts().results))
            (result,) = facts().results
            data = station.reports.data()
            numbers = {one.name: (one.measured, one.uncertainty) for one in result.report.results}
            assert numbers == {
                one.name: (None, None) if one.stated is None else (one.stated[0], one.stated[2])
                for one in data.results
            }
            assert result.report.state == data.states
            assert "SIMULATED" in result.verdict_text
            station.close()
            wait_until(lambda: not facts().state.online)
            assert facts().state.part is None
            assert facts().state.status is None
    finally:
        station.close()
    assert notes == []
    versions = [one.version for one in seen]
    assert versions == sorted(set(versions))
    assert {one.state.status for one in seen} <= {None, *(word.value for word in StatusWord)}


def test_without_a_station_its_state_is_unknown_and_never_good(tmp_path: Path) -> None:
    notes: list[str] = []
    with followed(places(tmp_path, stream=1), notes) as published:
        state = published.facts.state
    assert not state.online
    assert not state.in_service
    assert (state.part, state.complete, state.status, state.simulated) == (None,) * 4


def test_publishes_the_last_change_of_each_offset_and_nothing_of_an_altered_register(
    bench: Bench, tmp_path: Path
) -> None:
    document, records = state_offsets(tmp_path)
    register = Machine.open(document, records).register.path
    jobs = tmp_path / "jobs"
    jobs.mkdir()
    where = places(jobs, corrections=document, records=records)
    with followed(where, []) as published:
        wait_until(lambda: bool(published.facts.corrections))
        (one,) = published.facts.corrections
        assert (one.offset, one.before, one.after, one.what) == ("H3", 0.02, 0.031, "stated")
        assert one.expanded is None
        assert not one.practice
        assert one.by == "me"
    register.write_text(register.read_text(encoding="utf-8").replace("0.031", "0.041"), "utf-8")
    station = PublishedStation(where, print)
    with pytest.raises(StorageError):
        station.start()
    assert station.facts.corrections == ()


def test_names_equipment_without_records(bench: Bench, tmp_path: Path) -> None:
    jobs, records = tmp_path / "jobs", tmp_path / "records"
    measure(bench, jobs, "good")
    with followed(places(jobs, probes=records, calibrations=records), []) as published:
        wait_until(lambda: bool(published.facts.calibrations))
        found = published.facts.calibrations
        (result,) = published.facts.results
    assert result.evaluation is ResultEvaluation.OK
    assert {(one.of, one.status, one.usable, one.due_utc) for one in found} == {
        ("cameras", "NONE", False, ""), ("tip", "NONE", False, ""),
    }  # fmt: skip


@pytest.mark.parametrize(("age_d", "status"), [(1.0, "VALID"), (400.0, "EXPIRED")])
def test_publishes_validity_and_due_dates_of_the_records(
    bench: Bench, tmp_path: Path, age_d: float, status: str
) -> None:
    jobs, records = tmp_path / "jobs", tmp_path / "records"
    made = datetime.now(UTC) - timedelta(days=age_d)
    until = (made + timedelta(days=300)).isoformat()
    record_equipment(records, made, until)
    measure(bench, jobs, "good")
    with followed(places(jobs, probes=records, calibrations=records), []) as published:
        wait_until(lambda: bool(published.facts.calibrations))
        found = {one.of: one for one in published.facts.calibrations}
    assert [one.name for one in found.values()] == ["recommended", "standard/A"]
    for one in found.values():
        assert (one.status, one.usable) == (status, status == "VALID"), one.reason
        assert (one.made_utc, one.due_utc) == (made.isoformat(), until)
