"""Ambient readings: on the report, stored with the job, and refused if invalid."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from ocmm_core.acceptance import RoomAir
from ocmm_core.errors import InputError
from ocmm_core.export.report import NOT_STATED, ReportData, paper_facts
from ocmm_core.export.template import (
    Particulars,
    ambient_conditions,
    given_with,
    keep_given,
    load_paper,
    standard_template,
)
from tests.core.export.sample_report import sample_report


def _environment(data: ReportData) -> str:
    return {fact.name: fact.value for fact in paper_facts(data)}["Environment"]


def _with(given: Particulars) -> ReportData:
    data = sample_report()
    return replace(data, paper=load_paper(standard_template(), given))


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("20.1", "20.1 °C"),
        ("20,1 °C", "20.1 °C"),
        ("19.8 to 20.4", "19.8 … 20.4 °C"),
        ("19,8…20,4 °C", "19.8 … 20.4 °C"),
        ("20.1 ± 0.3", "20.1 ± 0.3 °C"),
        ("-3 to 4", "-3 … 4 °C"),
    ],
)
def test_a_reading_is_printed_with_its_unit(typed: str, told: str) -> None:
    assert ambient_conditions(Particulars(room=typed)) == (f"Room {told}.",)


@pytest.mark.parametrize(
    ("field", "typed", "fault"),
    [
        ("room", "warm", "is no number"),
        ("room", "68 °F", "is not in °C"),
        ("room", "200", "is not between -20 and 60 °C"),
        ("room", "20.4 to 19.8", "smaller number last"),
        ("room", "1e3", "is no number"),
        ("room", "20.1\n5", "is no number"),
        ("room", "9" * 5000, "is no number"),
        ("humidity", "140", "is not between 0 and 100 %"),
        ("humidity", "٤٥ %", ""),
        ("pressure", "1.013", "is not between 500 and 1100 hPa"),
        ("pressure", "nan", "is no number"),
    ],
)
def test_what_is_no_reading_is_refused_with_its_field(field: str, typed: str, fault: str) -> None:
    with pytest.raises(InputError, match=f"'{field}'") as caught:
        ambient_conditions(msgspec.convert({field: typed}, Particulars))
    assert fault in caught.value.what
    assert caught.value.remedy
    assert len(caught.value.what) < 200


def test_readings_close_the_clause_of_the_environment() -> None:
    assert _environment(_with(Particulars())) == NOT_STATED
    assert not _is_stated(_with(Particulars()))
    data = _with(Particulars(room="20.1", humidity="45", pressure="1013"))
    assert _environment(data) == "Room 20.1 °C. Humidity 45 %. Air pressure 1013 hPa."
    assert _is_stated(data)


def _is_stated(data: ReportData) -> bool:
    return any(fact.stated for fact in paper_facts(data) if fact.clause == "7.8.3.1 a")


def test_readings_are_typed_once_for_a_job(tmp_path: Path) -> None:
    job = tmp_path / "A-1.ocmm"
    given = Particulars(room="20.1 to 20.3", humidity="45")
    keep_given(job, given)
    assert given_with(job) == given
    with pytest.raises(InputError, match="'humidity'"):
        keep_given(job, replace(given, humidity="dry"))
    assert given_with(job) == given


def test_a_test_of_the_machine_and_a_report_refuse_the_same() -> None:
    for typed in ("140", "dry", "nan", "45 hPa"):
        with pytest.raises(InputError, match="'humidity'"):
            RoomAir.read(typed, "")
        with pytest.raises(InputError, match="'humidity'"):
            ambient_conditions(Particulars(humidity=typed))
    # A certificate states one number, with which a DCC can go.
    with pytest.raises(InputError, match="more than one number"):
        RoomAir.read("40 to 50", "")
    assert RoomAir.read("45,5 %", "1013 hPa") == RoomAir(humidity_percent=45.5, pressure_hpa=1013.0)
