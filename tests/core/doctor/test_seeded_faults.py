"""Every seeded fault of a computer is named with its remedy, and a good computer has none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ocmm_core.doctor import CHECKS, Computer, DoctorReport, Light, examine
from tests.core.doctor.fake_computer import LIMITS, good_computer, put
from tests.core.doctor.seeded_faults import FAULTS, slow_fsync

_ALSO = {
    # Without a reserved processor for the bus no interrupt can be on it.
    "too few processors": {"interrupts"},
    # A missing adapter cannot be queried.
    "adapter not there": {"interrupts", "coalescing", "offloads"},
    # Nobody in a group, and no rights: two remedies.
    "no group": {"rights"},
}


def not_green(report: DoctorReport) -> dict[str, str]:
    """Return the codes of all that is not GREEN, by the name of the check."""
    return {one.name: one.code for one in report.results if one.light is not Light.GREEN}


def test_a_good_computer_is_green_in_every_line(tmp_path: Path) -> None:
    report, changes = examine(good_computer(tmp_path))
    assert not_green(report) == {}
    assert report.light is Light.GREEN
    assert changes == ()
    assert [one.name for one in report.results] == [one.name for one in CHECKS]


@pytest.mark.parametrize("name", FAULTS)
def test_a_seeded_fault_is_named_with_its_remedy(name: str, tmp_path: Path) -> None:
    code, light, fault = FAULTS[name]
    computer = good_computer(tmp_path)
    computer = fault(computer) or computer
    report, _ = examine(computer)
    check = code.partition(".")[0]
    (line,) = (one for one in report.results if one.name == check)
    assert (line.code, line.light) == (code, light)
    assert line.what
    assert line.remedy
    assert report.light is light
    # Nothing else is accused.
    assert set(not_green(report)) == {check} | _ALSO.get(name, set())


def test_every_check_is_seen_to_fail() -> None:
    """A check without a seeded fault might be one that never finds anything."""
    seeded = {code.partition(".")[0] for code, _, _ in FAULTS.values()}
    assert {one.name for one in CHECKS} - seeded == {"program"}


def test_a_very_slow_disk_is_red(tmp_path: Path) -> None:
    computer = slow_fsync(0.101)(good_computer(tmp_path))
    assert computer is not None
    (spec,) = (one for one in CHECKS if one.name == "sync")
    assert spec.check(computer).code == "sync.very_slow"


def test_files_of_two_versions_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ocmm_core.doctor._disk_checks.version", lambda name: "0.0.1")
    report, _ = examine(good_computer(tmp_path))
    assert not_green(report) == {"program": "program.mixed"}


def typed_with_sudo(computer: Computer) -> Computer:
    """Return the same station, examined by a process of root that anna started with sudo."""
    status, limits = computer.text("/proc/self/status"), computer.text("/proc/self/limits")
    put(computer, "/proc/self/status", "Name:\tocmm\nPPid:\t78\nUid:\t0\t0\t0\t0\nGroups:\t0\n")
    put(computer, "/proc/self/limits", LIMITS.format("8388608"))
    put(computer, "/proc/78/status", "Name:\tsudo\nPPid:\t77\nUid:\t0\t0\t0\t0\nGroups:\t0\n")
    put(computer, "/proc/77/status", f"{status}\nPPid:\t1\nUid:\t1000\t1000\t1000\t1000\n")
    put(computer, "/proc/77/limits", limits)
    return replace(computer, by_sudo=True)


def test_with_sudo_the_groups_and_limits_are_those_of_who_typed_it(tmp_path: Path) -> None:
    computer = typed_with_sudo(good_computer(tmp_path))
    assert not_green(examine(computer)[0]) == {}
    put(computer, "/proc/77/limits", LIMITS.format("8388608"))
    put(computer, "/proc/77/status", "PPid:\t1\nUid:\t1000\t1000\t1000\t1000\nGroups:\t1000\n")
    assert not_green(examine(computer)[0]) == {"group": "group.not_yet", "memory": "memory.limited"}


def test_with_sudo_from_nowhere_they_are_not_checked(tmp_path: Path) -> None:
    computer = typed_with_sudo(good_computer(tmp_path))
    # A circle of parents, and a process that is gone.
    for parent in ("78", "9999", "0"):
        put(computer, "/proc/78/status", f"PPid:\t{parent}\nUid:\t0\t0\t0\t0\nGroups:\t0\n")
        found = {one.name: one.light for one in examine(computer)[0].results}
        assert found["group"] is found["memory"] is Light.NOT_CHECKED


@pytest.mark.parametrize(
    ("rights", "code"), [("1ffffffffff", ""), ("1fffeffffff", "memory.limited")]
)
def test_root_is_not_taken_for_almighty(rights: str, code: str, tmp_path: Path) -> None:
    computer = replace(good_computer(tmp_path), uid=0, user="root")
    put(computer, "/proc/self/status", f"Groups:\t0\nCapEff:\t00000{rights}\n")
    put(computer, "/proc/self/limits", LIMITS.format("8388608"))
    (line,) = (one for one in examine(computer)[0].results if one.name == "memory")
    assert line.code == code
