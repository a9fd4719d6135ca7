"""Every alarm provides all fields required by supervisor, journal, screen and page."""

from __future__ import annotations

import dataclasses
import re
from collections import Counter
from pathlib import Path

import pytest

from ocmm_core.fieldbus.cycle import CycleFault, Next, Supervisor, Trouble
from ocmm_core.fieldbus.cycle._supervisor import LIFT_PATIENCE_NS, PATIENCE_NS
from ocmm_core.fieldbus.report import Alarm, AlarmResponse, AlarmSpec, alarm_of_code, alarm_of_error

_CORE = Path(__file__).resolve().parents[3] / "ocmm_core"
_MS = 1_000_000
_CYCLES_MAX = 1000
"""So many good cycles of a millisecond would have been missed long before."""


@pytest.mark.parametrize("alarm", Alarm)
def test_an_entry_lacks_nothing(alarm: Alarm) -> None:
    spec = alarm.spec
    assert re.fullmatch(r"bus\.[a-z_]+", spec.code)
    assert spec.title[0].isupper()
    assert not spec.title.endswith(".")
    assert spec.remedy[0].isupper()
    assert spec.remedy.endswith(".")
    assert (spec.confirmed > 0) is (spec.answer is AlarmResponse.BRING_UP)
    assert {field.name for field in dataclasses.fields(AlarmSpec)} == {
        "code", "title", "remedy", "answer", "confirmed", "errors",
    }, "a new field of an entry needs a check here"  # fmt: skip


@pytest.mark.parametrize("alarm", Alarm)
def test_the_supervisor_does_what_the_entry_says(alarm: Alarm) -> None:
    supervisor = Supervisor(0)
    supervisor.brought_up(0)
    supervisor.good(0)
    cycles = 0
    while supervisor.next(cycles * _MS) is Next.CYCLE and cycles < _CYCLES_MAX:
        cycles += 1
        supervisor.bad(CycleFault(Trouble.BAD, alarm, "words", ""), cycles * _MS)
    patience_ns = LIFT_PATIENCE_NS if alarm.spec.answer is AlarmResponse.LIFT else PATIENCE_NS
    assert cycles == (alarm.spec.confirmed or patience_ns // _MS + 1)


def test_a_cable_that_was_pulled_is_certain_at_once() -> None:
    """The interface reports it; all other symptoms could be a single disturbed frame."""
    confirmed = {alarm: alarm.spec.confirmed for alarm in Alarm if alarm.spec.confirmed}
    assert confirmed.pop(Alarm.LINK_DOWN) == 1
    assert confirmed
    assert all(cycles > 1 for cycles in confirmed.values()), confirmed


def test_a_code_means_one_alarm() -> None:
    codes = Counter(code for alarm in Alarm for code in (alarm.spec.code, *alarm.spec.errors))
    assert {code for code, count in codes.items() if count > 1} == set()
    for alarm in Alarm:
        assert alarm == alarm.spec.code
        assert alarm_of_code(alarm.spec.code) is alarm
        assert alarm_of_error(alarm.spec.code) is alarm
        assert all(alarm_of_error(code) is alarm for code in alarm.spec.errors)


def test_the_errors_of_a_bring_up_that_an_entry_names_exist() -> None:
    source = "".join(
        path.read_text(encoding="utf-8")
        for path in _CORE.rglob("*.py")
        if path.name != "_alarms.py"
    )
    named = [code for alarm in Alarm for code in alarm.spec.errors]
    assert [code for code in named if f'"{code}"' not in source] == []


def test_what_is_no_alarm_is_none() -> None:
    assert alarm_of_code("bus.operation") is None
    assert alarm_of_error("bus.rights") is None
