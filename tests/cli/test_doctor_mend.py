"""What --fix changes, --undo takes back to the last byte; also after a crash, or a refusal."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from ocmm_cli.station._doctor import can_undo, mend, undo
from ocmm_core.doctor import (
    UNDO_FILE,
    ChangeKind,
    Computer,
    Light,
    SystemChange,
    examine,
    is_allowed,
)
from ocmm_core.errors import InputError, InternalError, StorageError
from tests.core.doctor.fake_computer import CPU, LIMITS, SETTINGS, good_computer, put
from tests.host import HANG_S, on_linux_only, private_mounts

_REPOSITORY = Path(__file__).resolve().parents[3]
_MAY = """
import sys
from pathlib import Path
from ocmm_cli.station._doctor import may_mend
from ocmm_core.doctor import Computer, this_computer
import dataclasses
print(may_mend(dataclasses.replace(this_computer(), root=Path(sys.argv[1]))))
"""
MENDED = ("governor", "idle", "interrupts", "coalescing", "offloads", "memory")


def spoiled_computer(root: Path) -> Computer:
    """Return a computer with every fault that can be put right without any risk."""
    computer = good_computer(root)
    for cpu in range(4):
        put(computer, f"{CPU}/cpu{cpu}/cpufreq/scaling_governor", "powersave\n")
        put(computer, f"{CPU}/cpu{cpu}/cpuidle/state2/disable", "0\n")
    for irq in (40, 41):
        put(computer, f"/proc/irq/{irq}/smp_affinity_list", "0-3\n")
    for name, value in (("rx-usecs", "50"), ("tx-usecs", "125"), ("gro", "on")):
        put(computer, f"{SETTINGS}/{name}", f"{value}\n")
    put(computer, f"{SETTINGS}/adaptive-rx", "on\n")
    put(computer, "/proc/self/limits", LIMITS.format("8388608"))
    return computer


@on_linux_only
def test_a_station_with_a_read_only_system_is_put_right_too(tmp_path: Path) -> None:
    """The right of a user depends on the folder for undo records, not on root."""
    (tmp_path / "var/lib").mkdir(parents=True)
    spread = f"mount --bind {tmp_path} {tmp_path} && mount -o remount,bind,ro {tmp_path}"
    layer = f"mount -t tmpfs tmpfs {tmp_path}/var/lib"

    def may(mounts: str) -> str:
        return subprocess.run(
            [*private_mounts(), "sh", "-c", f'{mounts} && exec "$@"', "sh",
             sys.executable, "-c", _MAY, str(tmp_path)],
            capture_output=True, text=True, timeout=HANG_S, cwd=_REPOSITORY, check=True,
        ).stdout  # fmt: skip

    assert may("true") == "True\n"
    assert may(spread) == "False\n"
    assert may(f"{spread} && {layer}") == "True\n"


def everything_in(root: Path) -> dict[str, tuple[int, bytes]]:
    """Return mode and content of all files, links and folders."""
    found = {}
    for path in sorted(root.rglob("*")):
        mode = path.lstat().st_mode
        if path.is_symlink():
            content = os.fsencode(path.readlink())
        else:
            content = path.read_bytes() if path.is_file() else b""
        found[str(path.relative_to(root))] = mode, content
    return found


def faulty(computer: Computer) -> set[str]:
    """Return the checks that are not GREEN."""
    return {one.name for one in examine(computer)[0].results if one.light is not Light.GREEN}


def test_what_is_mended_is_green_and_taken_back_to_the_last_byte(tmp_path: Path) -> None:
    computer = spoiled_computer(tmp_path)
    before = everything_in(tmp_path)
    report, changes = examine(computer)
    assert {one.name for one in report.results if one.fixable} == set(MENDED)
    assert faulty(computer) == set(MENDED)
    # 4 governors, 4 idle states, 2 interrupts, 3 of coalescing, 1 offload, 1 file of limits.
    assert len(changes) == 15
    assert [one.complaint for one in mend(computer, changes)] == [""] * 15
    # The new limit applies from the next log-in, and the output mentions that.
    assert faulty(computer) == {"memory"}
    assert everything_in(tmp_path) != before
    assert [one.complaint for one in undo(computer)] == [""] * 15
    assert everything_in(tmp_path) == before
    assert not can_undo(computer)
    with pytest.raises(InputError, match="Nothing was changed"):
        undo(computer)


def test_mending_twice_keeps_what_was_before_the_first_time(tmp_path: Path) -> None:
    computer = spoiled_computer(tmp_path)
    before = everything_in(tmp_path)
    mend(computer, examine(computer)[1])
    put(computer, f"{SETTINGS}/rx-usecs", "50\n")
    mend(computer, examine(computer)[1])
    undo(computer)
    assert everything_in(tmp_path) == before


def test_of_two_changes_of_a_value_the_last_is_taken_back_first(tmp_path: Path) -> None:
    """A value set by a person between two changes is not the doctor's, and stays."""
    computer = spoiled_computer(tmp_path)
    mend(computer, examine(computer)[1])
    put(computer, f"{SETTINGS}/rx-usecs", "30\n")
    mend(computer, examine(computer)[1])
    complaints = [one.complaint for one in undo(computer) if one.complaint]
    assert computer.text(f"{SETTINGS}/rx-usecs") == "30"
    assert complaints == ["it is 30 now; somebody else changed it"]


@pytest.mark.parametrize("made", range(0, 16, 3))
def test_a_power_cut_in_the_middle_is_taken_back(made: int, tmp_path: Path) -> None:
    computer = spoiled_computer(tmp_path)
    before = everything_in(tmp_path)
    changes = examine(computer)[1]
    mend(computer, changes)
    kept = computer.place(UNDO_FILE).read_bytes()
    undo(computer)
    # As after that number of changes: the original values are on the disk since the first one.
    if made:
        mend(computer, changes[:made])
    put(computer, UNDO_FILE, kept)
    undo(computer)
    assert everything_in(tmp_path) == before


def test_what_somebody_else_changed_since_is_left(tmp_path: Path) -> None:
    computer = spoiled_computer(tmp_path)
    mend(computer, examine(computer)[1])
    place = f"{CPU}/cpu1/cpufreq/scaling_governor"
    put(computer, place, "schedutil\n")
    told = {one.change.place: one.complaint for one in undo(computer)}
    assert [where for where, complaint in told.items() if complaint] == [place]
    assert "schedutil" in told[place]
    assert computer.text(place) == "schedutil"
    assert not can_undo(computer)


def test_after_a_restart_only_what_lasts_is_taken_back(tmp_path: Path) -> None:
    """The number of an interrupt means another device then."""
    computer = spoiled_computer(tmp_path)
    mend(computer, examine(computer)[1])
    put(computer, "/proc/sys/kernel/random/boot_id", "another\n")
    (only,) = undo(computer)
    assert only.change.kind is ChangeKind.NEW_FILE
    assert computer.text("/proc/irq/40/smp_affinity_list") == "0-2"


def test_a_change_that_the_system_refuses_is_told_and_kept_for_later(tmp_path: Path) -> None:
    computer = spoiled_computer(tmp_path)
    before = everything_in(tmp_path)
    mend(computer, examine(computer)[1])
    tool = computer.place("/usr/sbin/ethtool")
    content = tool.read_bytes()
    tool.write_bytes(b"#!/bin/sh\necho 'netlink error: Operation not supported'; exit 1\n")
    refused = [one for one in undo(computer) if one.failed]
    assert len(refused) == 4
    assert all("Operation not supported" in one.complaint for one in refused)
    tool.write_bytes(content)
    assert len(undo(computer)) == 4
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize(
    ("kind", "place", "after"),
    [
        (ChangeKind.KERNEL_FILE, "/etc/passwd", "0"),
        (ChangeKind.KERNEL_FILE, "/sys/devices/system/cpu/cpu0/../../../../../etc/passwd", "0"),
        (ChangeKind.KERNEL_FILE, "/proc/irq/40/smp_affinity_list", "0\n1"),
        (ChangeKind.NEW_FILE, "/etc/sudoers.d/90-ocmm", "anna"),
        (ChangeKind.ADAPTER, "enp3s0 -C rx-usecs 0 --flash", "0"),
        (ChangeKind.ADAPTER, "enp3s0 -E magic", "0"),
    ],
)
def test_nothing_else_can_be_written(
    kind: ChangeKind, place: str, after: str, tmp_path: Path
) -> None:
    computer = spoiled_computer(tmp_path)
    change = SystemChange(kind=kind, place=place, before="0", after=after)
    assert not is_allowed(change)
    before = everything_in(tmp_path)
    with pytest.raises(InternalError):
        mend(computer, (change,))
    assert everything_in(tmp_path) == before
    mend(computer, examine(computer)[1])
    kept = msgspec.json.decode(computer.place(UNDO_FILE).read_bytes())
    kept["changes"].append(msgspec.to_builtins(change))
    put(computer, UNDO_FILE, msgspec.json.encode(kept))
    there = everything_in(tmp_path)
    with pytest.raises(InputError, match="does not say what was before"):
        undo(computer)
    assert everything_in(tmp_path) == there


def test_without_a_place_for_what_was_before_nothing_is_changed(tmp_path: Path) -> None:
    if os.geteuid() == 0:
        # root may write into every folder; a file in its place stops root as well.
        computer = spoiled_computer(tmp_path)
        put(computer, "/var/lib", "no folder")
    else:
        computer = spoiled_computer(tmp_path)
        computer.place("/var/lib").mkdir(parents=True)
        computer.place("/var/lib").chmod(0o500)
    before = everything_in(tmp_path)
    with pytest.raises(StorageError, match="nothing was changed"):
        mend(computer, examine(computer)[1])
    assert everything_in(tmp_path) == before
    if os.geteuid() != 0:
        computer.place("/var/lib").chmod(0o700)
