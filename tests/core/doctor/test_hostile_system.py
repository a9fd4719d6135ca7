"""Whatever the files and tools of a computer hold: no traceback, and never GREEN by a guess."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from ocmm_core.doctor import Computer, DoctorReport, Light, NotAskedError, examine
from tests.core.doctor.fake_computer import ADAPTER, CPU, good_computer, put
from tests.host import amount, on_linux_only

HOSTILE = {
    "binary": bytes(range(256)),
    "empty": b"",
    "huge": b"1" * 300_000,
    "one long line": b"0-3," * 20_000,
    "other words": b"the quick brown fox\n",
    "numbers beyond all bounds": b"99999999999999999999999\n",
    "a range beyond all bounds": b"0-99999999\n",
    "ranges that never end": b"0-9999," * 8000 + b"0",
    "a range backwards": b"3-0\n",
    "steers the terminal": b"\x1b[2J\x1b]0;owned\x07performance\n",
    "half a character": b"performance\xc3\n",
}
# Files of kernel and administrator; the checks of records cover the user's files.
SYSTEM = ("/sys", "/proc", "/etc")


def files_of(computer: Computer) -> list[Path]:
    """Return all files of the system, as paths of the computer."""
    return [
        Path("/") / path.relative_to(computer.root)
        for folder in SYSTEM
        for path in sorted(computer.place(folder).rglob("*"))
        if path.is_file() and not path.is_symlink()
    ]


def lights(report: DoctorReport) -> dict[str, Light]:
    """Return the light of each check, after a check for defects of the program."""
    assert [one.code for one in report.results if one.code.startswith("internal")] == []
    assert all(text.isprintable() for one in report.results for text in (one.what, one.remedy))
    return {one.name: one.light for one in report.results}


@pytest.mark.parametrize("kind", ["binary", "empty", "huge"])
def test_a_system_of_nothing_but_rubbish_is_not_checked(kind: str, tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    for path in files_of(computer):
        put(computer, path, HOSTILE[kind])
    found = lights(examine(computer)[0])
    elsewhere = {"program", "rights", "time_zone", "disk", "calibrations", "certificates", "key"}
    # The clock is judged by the kernel's answer, independent of the board.
    elsewhere |= {"clock", "settings"}
    assert {name for name, one in found.items() if one is Light.GREEN} == elsewhere
    assert {one for name, one in found.items() if name not in elsewhere} == {Light.NOT_CHECKED}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_file_of_rubbish_affects_its_own_lines_only(kind: str, tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    # In the short form every other file, in turn by kind: each file gets half of the kinds.
    step = amount(2, 1)
    for path in files_of(computer)[list(HOSTILE).index(kind) % step :: step]:
        place = computer.place(path)
        content = place.read_bytes()
        place.write_bytes(HOSTILE[kind])
        found = lights(examine(computer)[0])
        # The list of processors and the name of the adapter are read by several checks.
        assert sum(one is not Light.GREEN for one in found.values()) <= 5, path
        place.write_bytes(content)
    assert set(lights(examine(computer)[0]).values()) == {Light.GREEN}


@on_linux_only
@pytest.mark.parametrize("kind", ["folder", "pipe", "dangling link", "itself"])
def test_what_is_no_file_is_not_waited_for(kind: str, tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    for path in (f"{CPU}/isolated", f"{ADAPTER}/operstate", "/proc/self/limits", "/etc/group"):
        place = computer.place(path)
        place.unlink()
        if kind == "folder":
            place.mkdir()
        elif kind == "pipe":
            os.mkfifo(place)
        else:
            place.symlink_to(place if kind == "itself" else place.with_name("nowhere"))
    found = lights(examine(computer)[0])
    for name in ("cores", "adapter", "memory"):
        assert found[name] is Light.NOT_CHECKED


@pytest.mark.parametrize(
    "script",
    [
        "echo rubbish",
        "exit 3",
        "head -c 3000000 /dev/zero",
        "printf '\\377\\376rx-usecs: 0'",
        "printf 'rx-usecs: -1\\nrx-usecs: 99999999999\\n'",
        "kill -9 $$",
    ],
)
def test_a_tool_that_says_nothing_sensible_is_not_believed(script: str, tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    put(computer, "/usr/sbin/ethtool", f"#!/bin/sh\n{script}\n").chmod(0o755)
    found = lights(examine(computer)[0])
    assert found["coalescing"] is found["offloads"] is Light.NOT_CHECKED


def test_a_tool_that_is_not_there_is_named_with_its_package(tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    computer.place("/usr/sbin/ethtool").unlink()
    (line,) = (one for one in examine(computer)[0].results if one.name == "coalescing")
    assert line.light is Light.NOT_CHECKED
    assert line.remedy == "Install it: apt install ethtool"


def test_records_and_memories_of_rubbish_are_not_checked(tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    (record,) = computer.place(computer.data).rglob("*.json")
    for content in HOSTILE.values():
        record.write_bytes(content)
        put(computer, computer.state / "histories" / "9.json", content)
        found = lights(examine(computer)[0])
        assert found["calibrations"] is found["certificates"] is Light.NOT_CHECKED
        # Memories that can be read are still believed.
        assert found["clock"] is Light.GREEN


def test_a_computer_without_anything_ends_without_a_traceback(tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    shutil.rmtree(tmp_path)
    tmp_path.mkdir()
    found = lights(examine(computer)[0])
    assert {name for name, one in found.items() if one is Light.GREEN} <= {
        "program", "clock", "disk", "settings", "images",
    }  # fmt: skip


@pytest.mark.parametrize("text", ["3-0", "0,0", "2,1", "0-99999", "a", "0-", "-1", "0,,1", "0 1"])
def test_what_is_no_list_of_processors_is_not_taken_for_one(text: str, tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    put(computer, f"{CPU}/isolated", f"{text}\n")
    with pytest.raises(NotAskedError, match="holds no list of processors"):
        computer.cpus(f"{CPU}/isolated")


def test_lists_of_processors_are_read_as_the_kernel_writes_them(tmp_path: Path) -> None:
    computer = good_computer(tmp_path)
    for text, found in (("\n", ()), ("(null)\n", ()), ("0-2,5\n", (0, 1, 2, 5)), ("7", (7,))):
        put(computer, f"{CPU}/isolated", text)
        assert computer.cpus(f"{CPU}/isolated") == found
