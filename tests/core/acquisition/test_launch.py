"""Which interpreter runs the bus process, and what rights it keeps."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_core.acquisition.bus_process import NEEDED, Capability, bus_command, rights_of
from ocmm_core.acquisition.bus_process._launch import why_not
from ocmm_core.acquisition.bus_process._rights import give_up_all_but, granted_by
from ocmm_core.host import HOST
from tests.host import forbids_file_rights, needs_root, not_run, on_linux_only

pytestmark = on_linux_only

_NAME = "ocmm-acq-python"


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path]:
    """Return an interpreter and a copy of it as `grant-rights.sh` names it, without rights."""
    ordinary, copy = tmp_path / "python", tmp_path / _NAME
    for path in (ordinary, copy):
        path.write_bytes(b"#!/bin/false\n")
        path.chmod(0o755)
        os.utime(path, (1e9, 1e9))
    return copy, ordinary


def grant(path: Path, capabilities: frozenset[int], *, effective: bool = True) -> None:
    """Attach rights as setcap does (linux/capability.h, revision 2)."""
    mask = sum(1 << number for number in capabilities)
    content = struct.pack("<5I", 0x02000000 | effective, mask & 0xFFFFFFFF, 0, mask >> 32, 0)
    try:
        os.setxattr(path, "security.capability", content)
    except OSError as error:
        if not forbids_file_rights(error):
            raise
        not_run(f"rights cannot be attached to a file here ({error.strerror})")


def owned_by_root(path: Path) -> None:
    if path.stat().st_uid != 0:
        needs_root("make a file of root's")


def test_without_a_copy_the_bus_process_runs_with_the_ordinary_interpreter(tmp_path: Path) -> None:
    ordinary = tmp_path / "python"
    ordinary.touch()
    assert bus_command(ordinary)[0] == str(ordinary)
    assert bus_command()[0] == sys.executable


def test_the_bus_process_takes_no_code_from_folder_or_environment(tmp_path: Path) -> None:
    """A module of the same name in the present folder would otherwise run with its rights."""
    planted = tmp_path / "ocmm_core"
    planted.mkdir()
    (planted / "__init__.py").write_text("raise SystemExit(99)\n", encoding="utf-8")
    done = subprocess.run(
        bus_command(),
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        input=b"{}\n",
        capture_output=True,
        check=False,
    )
    # Its own complaint about a configuration without an interface.
    assert done.returncode == 2
    assert b"configuration of the bus process" in done.stderr


def test_a_copy_without_rights_is_named_and_not_used(pair: tuple[Path, Path]) -> None:
    copy, ordinary = pair
    owned_by_root(copy)
    assert "lacks 3 of 3 rights" in why_not(copy, ordinary)
    assert bus_command(ordinary)[0] == str(ordinary)


def test_a_copy_with_rights_is_used_by_others_than_root(
    pair: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    copy, ordinary = pair
    owned_by_root(copy)
    grant(copy, NEEDED)
    assert granted_by(copy) == NEEDED
    assert why_not(copy, ordinary) == ""
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert bus_command(ordinary)[:2] == [str(copy), "-I"]
    # Root has them anyway, and the copy may be for a group that root is not in.
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert bus_command(ordinary)[0] == str(ordinary)


@pytest.mark.parametrize("mode", [0o775, 0o757])
def test_a_copy_that_others_may_write_is_not_used(pair: tuple[Path, Path], mode: int) -> None:
    copy, ordinary = pair
    owned_by_root(copy)
    copy.chmod(mode)
    grant(copy, NEEDED)
    assert "users other than root" in why_not(copy, ordinary)


def test_a_copy_that_belongs_to_an_ordinary_user_is_not_used(pair: tuple[Path, Path]) -> None:
    copy, ordinary = pair
    owned_by_root(copy)
    os.chown(copy, 65534, 65534)
    grant(copy, NEEDED)
    assert "users other than root" in why_not(copy, ordinary)


def test_a_copy_of_another_python_is_not_used(pair: tuple[Path, Path]) -> None:
    copy, ordinary = pair
    owned_by_root(copy)
    grant(copy, NEEDED)
    ordinary.write_bytes(b"#!/bin/false # updated\n")
    assert "a different Python" in why_not(copy, ordinary)


def test_rights_that_are_incomplete_or_not_effective_do_not_count(pair: tuple[Path, Path]) -> None:
    copy, ordinary = pair
    owned_by_root(copy)
    grant(copy, NEEDED - {Capability.NET_ADMIN})
    assert "lacks 1 of 3 rights" in why_not(copy, ordinary)
    grant(copy, NEEDED, effective=False)
    assert "lacks 3 of 3 rights" in why_not(copy, ordinary)


def test_own_rights_are_those_the_kernel_tells() -> None:
    own = rights_of()
    assert own == rights_of(os.getpid())
    assert own.effective <= own.permitted
    status = Path("/proc/self/status").read_text(encoding="ascii")
    mask = next(line for line in status.splitlines() if line.startswith("CapEff:")).split()[1]
    assert sum(1 << number for number in own.effective) == int(mask, 16)


def test_giving_up_leaves_what_was_asked_to_this_process_and_what_it_starts() -> None:
    """In a child process: rights given up are gone for good."""
    program = (
        "import subprocess, sys\n"
        "from ocmm_core.acquisition.bus_process import Capability, give_up_all_but, rights_of\n"
        "had = rights_of().permitted\n"
        "give_up_all_but({Capability.NET_RAW})\n"
        "kept = had & {Capability.NET_RAW}\n"
        "own = rights_of()\n"
        "assert own.effective == own.permitted == kept, own\n"
        "assert not own.inheritable and not own.ambient and own.no_new_privileges\n"
        "look = 'from ocmm_core.acquisition.bus_process import *; print(*rights_of().permitted)'\n"
        "below = subprocess.run([sys.executable, '-c', look], stdout=subprocess.PIPE)\n"
        "assert set(map(int, below.stdout.split())) <= kept, below.stdout\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_giving_up_never_adds_a_right() -> None:
    program = (
        "from ocmm_core.acquisition.bus_process._rights import give_up_all_but, rights_of, NEEDED\n"
        "give_up_all_but(())\n"
        "give_up_all_but(NEEDED)\n"
        "assert not rights_of().permitted\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_another_system_has_nothing_to_give_up(monkeypatch: pytest.MonkeyPatch) -> None:
    before = rights_of()
    monkeypatch.setattr(type(HOST), "is_linux_like", False)
    give_up_all_but(())
    assert rights_of() == before
