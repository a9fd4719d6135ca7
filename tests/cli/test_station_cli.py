"""``ocmm station doctor``: output as text and as JSON, and the exit codes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from subprocess import CompletedProcess

import msgspec
import pytest

from ocmm_core.doctor import CHECKS, Computer, DoctorReport, Light, examine
from tests.cli.test_doctor_mend import everything_in, spoiled_computer
from tests.core.doctor.fake_computer import CPU, calls, good_computer, put, room
from tests.core.doctor.seeded_faults import FAULTS
from tests.host import needs_package

Ocmm = Callable[..., CompletedProcess[str]]

SCHEMA_FILE = Path(__file__).resolve().parents[2] / "docs" / "doctor.schema.json"


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Computer], None]:
    """Return a function that lets the command examine a computer in a folder."""

    def look_at(computer: Computer) -> None:
        def stand_in(*, interface: str = "", jobs: Path | None = None) -> Computer:
            return replace(computer, interface=interface)

        monkeypatch.setattr("ocmm_core.doctor.this_computer", stand_in, raising=False)

    return look_at


def test_the_stored_schema_is_that_of_the_report() -> None:
    stored = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    del stored["$schema"]
    assert stored == msgspec.json.schema(DoctorReport), "run python docs/make_tables.py"


@pytest.mark.parametrize("name", ["no fault", *FAULTS])
def test_the_json_of_every_fault_keeps_to_the_schema(name: str, tmp_path: Path) -> None:
    needs_package("jsonschema", "it comes with what checks the bill of materials")
    # It has no stubs.
    jsonschema = import_module("jsonschema")
    computer = good_computer(tmp_path)
    if name in FAULTS:
        computer = FAULTS[name][2](computer) or computer
    content = msgspec.json.encode(examine(computer)[0])
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(json.loads(content))
    # And no field is lost on the way back.
    again = msgspec.json.decode(content, type=DoctorReport)
    assert msgspec.json.encode(again) == content


def test_a_good_computer_ends_with_0_and_a_line_for_each_check(
    ocmm_here: Ocmm, station: Callable[[Computer], None], tmp_path: Path
) -> None:
    station(good_computer(tmp_path))
    done = ocmm_here("station", "doctor", "--seconds", "0")
    assert done.returncode == 0
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    for spec in CHECKS:
        assert len([1 for line in lines if re.match(rf"GREEN +{spec.title}  ", line)]) == 1


def test_amber_ends_with_0_and_red_with_1(
    ocmm_here: Ocmm, station: Callable[[Computer], None], tmp_path: Path
) -> None:
    computer = good_computer(tmp_path)
    station(computer)
    put(computer, f"{CPU}/isolated", "\n")
    done = ocmm_here("station", "doctor", "--seconds", "0", "--json")
    assert done.returncode == 0
    assert json.loads(done.stdout)["light"] == "AMBER"
    station(calls(computer, statvfs=lambda path: room(0)))
    done = ocmm_here("station", "doctor", "--seconds", "0", "--json")
    assert done.returncode == 1
    report = msgspec.json.decode(done.stdout, type=DoctorReport)
    assert report.light is Light.RED
    (line,) = report.having(Light.RED)
    assert line.code == "disk.full"


def test_the_command_runs_on_this_computer(ocmm: Ocmm) -> None:
    done = ocmm("station", "doctor", "--json", "--seconds", "0.2")
    assert done.returncode in (0, 1), done.stderr
    report = msgspec.json.decode(done.stdout, type=DoctorReport)
    assert [one.code for one in report.results if one.code.startswith("internal")] == []


def test_fix_shows_asks_changes_and_undo_takes_it_back(
    ocmm_here: Ocmm, station: Callable[[Computer], None], tmp_path: Path
) -> None:
    computer = spoiled_computer(tmp_path)
    station(computer)
    before = everything_in(tmp_path)
    done = ocmm_here("station", "doctor", "--seconds", "0", "--fix")
    assert done.returncode == 2
    assert "cpuN/cpufreq/scaling_governor: powersave -> performance (4 times)" in done.stderr
    assert "Nobody can be asked here" in done.stderr
    assert everything_in(tmp_path) == before
    done = ocmm_here("station", "doctor", "--seconds", "0", "--fix", "--yes", "--json")
    assert done.returncode == 0
    assert "15 of 15 changed." in done.stderr
    report = msgspec.json.decode(done.stdout, type=DoctorReport)
    # The new limit counts from the next log-in on.
    assert [one.code for one in report.having(Light.AMBER)] == ["memory.not_yet"]
    done = ocmm_here("station", "doctor", "--seconds", "0", "--undo")
    assert done.returncode == 0
    assert "15 of 15 taken back." in done.stdout
    assert everything_in(tmp_path) == before


def test_who_says_no_or_may_not_changes_nothing(
    ocmm_here: Ocmm,
    station: Callable[[Computer], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station(spoiled_computer(tmp_path))
    before = everything_in(tmp_path)
    assert (
        "contradict" in ocmm_here("station", "doctor", "--seconds", "0", "--fix", "--undo").stderr
    )
    assert "nothing to undo" in ocmm_here("station", "doctor", "--seconds", "0", "--undo").stderr
    monkeypatch.setattr("ocmm_cli.station._doctor.may_mend", lambda computer: False, raising=False)
    done = ocmm_here("station", "doctor", "--seconds", "0", "--fix", "--yes")
    assert done.returncode == 2
    assert "Type: sudo " in done.stderr
    assert everything_in(tmp_path) == before
