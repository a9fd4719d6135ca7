"""The ambient conditions of a job: stored in its file, required by a plan, reported if doubtful."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.acceptance import LoggedTemperature, TemperatureSource, ThermometerLog
from ocmm_core.ambient import TypedRoom
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.report import paper_facts, report_of_job
from ocmm_core.export.template import Particulars, load_paper, standard_template
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import (
    EnvironmentLimits,
    NotedRoom,
    Plan,
    check_plan,
    environment_doubt,
    environment_words,
    load_plan,
    save_plan,
)
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import Verdict
from tests.core.inspection.conftest import Bench

LIMITS = EnvironmentLimits(temperature_c=(18.0, 22.0))
BEGIN, END = NotedRoom(0, 1, room="20.1"), NotedRoom(5, 6, room="20,4 °C")


SOURCE = TemperatureSource(kind="file", address="x", unit="°C", scale=1.0)


def demanding(plan: Plan) -> Plan:
    return msgspec.structs.replace(plan, environment=LIMITS)


def session_of(bench: Bench, job: JobFile) -> InspectionSession:
    return InspectionSession(demanding(bench.plan), bench.rig, bench.body, job, SessionOptions())


def measure(bench: Bench, session: InspectionSession) -> None:
    for touch in bench.touches:
        session.touches.record_touch(touch)


def decided(session: InspectionSession) -> set[Verdict]:
    return {one.verdict for one in session.view.characteristics} & {
        Verdict.CONFORM,
        Verdict.NOT_CONFORM,
    }


def test_a_plan_that_demands_gets_no_verdict_without_begin_and_end(
    bench: Bench, job: JobFile
) -> None:
    session = session_of(bench, job)
    assert "none was noted yet" in session.view.unproven
    session.conditions.note_room(TypedRoom(room="20.1", humidity="45"), "Ada")
    assert session.view.unproven == ""
    measure(bench, session)
    assert "after the last point" in session.view.unproven
    assert not decided(session)
    session.conditions.note_room(TypedRoom(room="20.4"))
    assert session.view.unproven == session.view.room_doubt == ""
    assert decided(session)
    # Read again from the file, by a session independent of the first.
    again = session_of(bench, job)
    assert again.view.room == session.view.room
    told = [sentence for field, sentence in again.view.room if field == "room"]
    assert told == ["Room 20.1 °C at the begin.", "Room 20.4 °C at the end."]


def test_a_room_that_is_too_warm_lets_nothing_be_proven(bench: Bench, job: JobFile) -> None:
    session = session_of(bench, job)
    session.conditions.note_room(TypedRoom(room="21.8 ± 0.5"))
    measure(bench, session)
    session.conditions.note_room(TypedRoom(room="20"))
    assert "21.8 ± 0.5 °C was noted" in session.view.unproven
    assert not decided(session)


def test_what_was_noted_too_late_is_no_begin(bench: Bench, job: JobFile) -> None:
    session = session_of(bench, job)
    measure(bench, session)
    session.conditions.note_room(TypedRoom(room="20"))
    assert "before the first point" in session.view.unproven


@pytest.mark.parametrize(
    ("noted", "last", "complete", "told"),
    [
        ((BEGIN, END), 5, True, ""),
        ((BEGIN,), 5, False, ""),
        ((BEGIN,), 0, True, ""),
        # A point was taken after the end: that was not the end.
        ((BEGIN, END), 6, True, "after the last point"),
        ((END,), 5, True, "before the first point"),
        ((BEGIN, NotedRoom(2, 3, room="23"), END), 5, True, "23 °C was noted"),
        ((BEGIN, NotedRoom(0, 1, room="22.01")), 0, False, "22.01 °C"),
        ((NotedRoom(0, 1, room="25"), BEGIN, END), 5, True, ""),
        ((NotedRoom(0, 1, humidity="45"),), 0, False, "none was noted yet"),
        ((NotedRoom(0, 1, room="18 to 22"),), 0, False, ""),
        ((NotedRoom(0, 1, room="17.9 to 20"),), 0, False, "17.9 … 20 °C"),
    ],
)
def test_what_a_plan_demands(
    noted: tuple[NotedRoom, ...], last: int, complete: bool, told: str
) -> None:
    doubt = environment_doubt(LIMITS, noted, last, complete=complete)
    assert told in doubt
    assert bool(told) == bool(doubt)
    assert environment_doubt(None, noted, last, complete=complete) == ""


def test_what_was_typed_before_is_told() -> None:
    words = environment_words((NotedRoom(0, 1, room="25"), BEGIN, END), 5)
    assert [sentence for _, sentence in words] == [
        "Room 20.1 °C at the begin.",
        "25 °C was typed before.",
        "Room 20.4 °C at the end.",
    ]
    later = environment_words((NotedRoom(2, 3, room="20"),), 5)
    assert later == (("room", "Room 20 °C after point 2."),)


@pytest.mark.parametrize(
    ("limits", "field"),
    [
        (EnvironmentLimits(), "environment"),
        (EnvironmentLimits(temperature_c=(22.0, 18.0)), "environment.temperature_c"),
        (EnvironmentLimits(temperature_c=(68.0, 72.0)), "environment.temperature_c"),
        (EnvironmentLimits(humidity_percent=(30.0, 130.0)), "environment.humidity_percent"),
        (EnvironmentLimits(pressure_hpa=(float("nan"), 1000.0)), "environment.pressure_hpa"),
    ],
)
def test_a_plan_cannot_demand_what_no_room_has(
    bench: Bench, limits: EnvironmentLimits, field: str
) -> None:
    plan = msgspec.structs.replace(bench.plan, environment=limits)
    with pytest.raises(InputError, match=f"field '{field}'"):
        check_plan(Path("plan.toml"), plan)


def test_the_demand_is_written_and_read(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    save_plan(demanding(bench.plan), path)
    assert "[environment]\ntemperature_c = [18.0, 22.0]" in path.read_text("utf-8")
    assert load_plan(path).environment == LIMITS
    save_plan(bench.plan, path)
    assert "environment" not in path.read_text("utf-8")


def test_the_report_says_what_the_job_keeps_and_not_what_is_given_later(
    bench: Bench, job: JobFile
) -> None:
    session = bench.session(job)
    session.conditions.note_room(TypedRoom(room="20.1", humidity="45"))
    measure(bench, session)
    job.close()
    paper = load_paper(standard_template(), Particulars(room="23", pressure="1013"))
    data = replace(report_of_job(reopen_job(job.path)), paper=paper)
    told = {fact.name: fact.value for fact in paper_facts(data)}["Environment"]
    assert told.startswith(
        "Room 20.1 °C at the begin. Humidity 45 % at the begin. Air pressure 1013 hPa."
    )
    assert "23" not in told


def test_a_job_in_doubt_for_its_room_is_not_called_uncalibrated(bench: Bench, job: JobFile) -> None:
    session = session_of(bench, job)
    measure(bench, session)
    states = session.view.unproven, session.view.room_doubt
    assert states[0] == states[1] != ""


def test_the_command_keeps_what_was_read_off(bench: Bench, job: JobFile) -> None:
    measure(bench, bench.session(job))
    path = job.path
    job.close()
    runner = CliRunner()
    done = runner.invoke(app, ["environment", str(path), "--room", "20,4", "--who", "Ada"])
    assert (done.exit_code, "20.4 °C at the end" in done.output) == (0, True), done.output
    told = runner.invoke(app, ["environment", str(path)])
    assert "20.4 °C at the end" in told.output
    wrong = runner.invoke(app, ["environment", str(path), "--room", "68 °F"])
    assert isinstance(wrong.exception, OcmmError)
    # Nothing but the reading was added, and the chain holds.
    with JobFile.open(path, read_only=True) as opened:
        assert opened.verify() == []
        assert [one.kind for one in opened.events()].count("environment") == 1


def test_a_job_whose_reading_is_none_is_refused_with_a_sentence(bench: Bench, job: JobFile) -> None:
    job.append_event("environment", '{"points":0,"next_point":1,"room":"warm"}')
    with pytest.raises(InputError, match="'room' is 'warm'"):
        bench.session(job)


def test_logged_readings_and_doubts_are_kept_once_per_feature(bench: Bench, job: JobFile) -> None:
    session = session_of(bench, job)
    now = datetime(2026, 11, 28, 12, 0, tzinfo=UTC)
    bad = LoggedTemperature(
        "T-1", "hall, serial 4711", 0.2, None, "Thermometer hall, serial 4711: no answer."
    )
    numbers = iter((20.42, 20.43))
    log = ThermometerLog(
        [("T-1", "hall, serial 4711", 0.2, SOURCE)], lambda _source: (next(numbers), now)
    )
    (good,), (same,) = log.sample(lambda: now), log.sample(lambda: now)
    session.conditions.note_logged(good)
    session.conditions.note_logged(same)
    assert [one.room for one in session.conditions.rooms] == ["20.42 ± 0.20"]
    session.conditions.note_logged(bad)
    # A reservation whose text changes with each reading is stored once.
    session.conditions.note_logged(bad)
    session.conditions.note_logged(replace(bad, doubt="Thermometer hall: 31 s old."))
    assert len(session.conditions.rooms) == 2
    for touch in bench.touches:
        session.touches.record_touch(touch)
        session.conditions.note_logged(good)
    rooms = session.conditions.rooms
    assert {one.who for one in rooms} == {"hall, serial 4711"}
    features = sum(bool(one) for one in session.view.features)
    assert len(rooms) == 2 + 1 + features
    told = [sentence for field, sentence in session.view.room if field == "room"]
    assert told[0] == "Room 20.42 ± 0.20 °C at the begin."
    assert "Room 20.42 ± 0.20 °C at the end." in told
    assert told[-1] == bad.doubt
    assert session.view.unproven == ""
