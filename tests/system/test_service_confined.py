"""The unit of the bus service is tight, and allows the actions of the bus process.

Without systemd here, the process of the unit's own command works on a virtual cable: once under
strace, with every system call compared with the unit; and once confined by other means as by the
unit.
"""

from __future__ import annotations

import ctypes.util
import json
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.host import HANG_S, needs_tools, not_run, on_linux_only, private_network
from tests.system.other_user import environment as environment

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = [on_linux_only, pytest.mark.slow, pytest.mark.timing]

_ROOT = Path(__file__).resolve().parents[2]
_UNIT = _ROOT / "installer" / "linux" / "ocmm-acq@.service"
_SCENARIO = Path(__file__).with_name("confined_scenario.py")
_CONFINE = _SCENARIO.with_name("confine.py")
_WORST_SCORE = 1.5
_SETTINGS = [
    line.split("=", 1)
    for line in _UNIT.read_text(encoding="utf-8").splitlines()
    if "=" in line and not line.startswith("#")
]


def setting(name: str) -> str:
    """Return a setting that occurs once in the unit."""
    [value] = [value for key, value in _SETTINGS if key == name]
    return value


def test_the_unit_scores_well(tmp_path: Path) -> None:
    needs_tools("systemd-analyze")
    done = subprocess.run(
        ["systemd-analyze", "security", "--no-pager", "--offline=true", str(_UNIT)],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    found = re.search(r"Overall exposure level for [^:]+: ([\d.]+)", done.stdout)
    assert found is not None, done.stderr
    assert float(found[1]) <= _WORST_SCORE, done.stdout
    # A unit with one protection less is detected.
    loose = tmp_path / _UNIT.name
    text = _UNIT.read_text(encoding="utf-8").replace("IPAddressDeny=any\n", "")
    loose.write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["systemd-analyze", "security", "--no-pager", "--offline=true", str(loose)],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    worse = re.search(r"Overall exposure level for [^:]+: ([\d.]+)", done.stdout)
    assert worse is not None
    assert float(worse[1]) > float(found[1])


@dataclass(frozen=True, slots=True)
class _Traced:
    """Actions of the bus process: its system calls with their arguments, and its end."""

    calls: tuple[tuple[str, str], ...]
    seen: dict[str, Any]

    def of(self, *names: str) -> list[str]:
        return [rest for name, rest in self.calls if name in names]


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> _Traced:
    """Return the trace of the measuring bus process."""
    needs_tools("strace", "ip")
    log = tmp_path_factory.mktemp("traced") / "log"
    done = subprocess.run(
        [*private_network(), sys.executable, str(_SCENARIO), sys.executable, "",
         "strace", "-f", "-qq", "-s", "200", "-o", str(log)],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    calls = [found.groups() for line in lines if (found := re.match(r"\d+ +(\w+)\((.*)", line))]
    return _Traced(tuple((name, rest) for name, rest in calls), json.loads(done.stdout))


@cache
def _members(name: str) -> frozenset[str]:
    """Return the system calls of a set of systemd's, or the one that is named."""
    if not name.startswith("@"):
        return frozenset({name})
    program = shutil.which("systemd-analyze")
    assert program is not None
    done = subprocess.run(
        [program, "syscall-filter", "--no-pager", name],
        capture_output=True, text=True, timeout=HANG_S, check=True,
    )  # fmt: skip
    lines = [line.strip() for line in done.stdout.splitlines()[1:]]
    return frozenset().union(*(_members(one) for one in lines if one and one[0] != "#"))


def _allowed() -> frozenset[str]:
    """Return the system calls that the unit allows."""
    needs_tools("systemd-analyze")
    allowed: frozenset[str] = frozenset()
    for value in (value for key, value in _SETTINGS if key == "SystemCallFilter"):
        named = frozenset[str]().union(*(_members(one) for one in value.lstrip("~").split()))
        allowed = allowed - named if value.startswith("~") else allowed | named
    return allowed


def test_it_measures_and_ends(traced: _Traced) -> None:
    assert traced.seen["frames"] >= 200, traced.seen
    assert traced.seen["ended"] == 0


def test_every_system_call_is_allowed(traced: _Traced) -> None:
    allowed = _allowed()
    assert "recvfrom" in allowed
    assert "mount" not in allowed
    refused = {name for name, _ in traced.calls} - allowed
    # It drops rights that the unit did not grant: nothing to drop, and no error.
    assert refused <= {"capset"}


def test_it_makes_no_other_sockets(traced: _Traced) -> None:
    families = {rest.split(",")[0] for rest in traced.of("socket")}
    assert families == set(setting("RestrictAddressFamilies").split())


def test_no_memory_is_written_and_run(traced: _Traced) -> None:
    assert setting("MemoryDenyWriteExecute") == "yes"
    asked = traced.of("mmap", "mprotect", "pkey_mprotect")
    assert any("PROT_EXEC" in rest for rest in asked)
    assert not [rest for rest in asked if "PROT_EXEC" in rest and "PROT_WRITE" in rest]
    # Nor made executable afterwards.
    assert not [rest for rest in traced.of("mprotect", "pkey_mprotect") if "PROT_EXEC" in rest]
    assert not traced.of("memfd_create")


def test_it_writes_to_the_ring_alone(traced: _Traced) -> None:
    assert setting("ProtectSystem") == "strict"
    opened = [
        rest.split('"')[1]
        for rest in traced.of("openat", "open", "creat")
        if re.search(r"O_WRONLY|O_RDWR|O_CREAT", rest)
    ]
    # Python writes bytecode next to writable sources; those of the service are not writable.
    assert {path for path in opened if "__pycache__" not in path} == {traced.seen["ring"]}
    assert not traced.of("unlink", "unlinkat", "mkdir", "mkdirat", "chmod", "fchmod", "chown")


def test_of_processes_it_sees_itself(traced: _Traced) -> None:
    assert setting("ProcSubset") == "pid"
    asked = {
        path
        for _, rest in traced.calls
        for path in re.findall(r'"(/proc/[^"]*)"', rest)
    }  # fmt: skip
    assert asked
    assert not [path for path in asked if not path.startswith("/proc/self/")]


def test_it_starts_no_program_and_enters_no_namespace(traced: _Traced) -> None:
    assert setting("RestrictNamespaces") == "yes"
    assert len(traced.of("execve", "execveat")) == 1
    assert not [rest for rest in traced.of("clone", "clone3") if "CLONE_NEW" in rest]
    assert not traced.of("unshare", "setns", "ptrace")


def _needs_filters() -> None:
    if ctypes.util.find_library("seccomp") is None:
        not_run("the library 'libseccomp' is not installed")


_MOUNTS = """
set -e
mount --make-rprivate /
mount -t proc -o subset=pid,hidepid=invisible proc /proc
mount -o remount,bind,ro /
! test -e /proc/sys
! touch "$1" 2>/dev/null
shift
exec "$@"
"""
"""ProtectSystem=strict (and no /tmp), ProcSubset and ProtectProc, and that they are in force."""
_CAPABILITIES = {"net_admin": 12, "net_raw": 13}
_SERVICE_USER, _GROUP_NUMBER, _GROUP = "65533", "65534", "nogroup"


def test_it_works_confined_as_the_unit_confines_it(environment: Path) -> None:
    """User, rights, file system, /proc, system calls, sockets and memory: as the unit has them."""
    needs_tools("setpriv", "unshare", "mount", "ip")
    _needs_filters()
    python = str(environment / "bin" / "python")
    names = setting("AmbientCapabilities").lower().replace("cap_", "").split()
    assert set(names) == set(_CAPABILITIES)
    rights = ",".join(f"+{name}" for name in names)
    done = subprocess.run(
        [*private_network(), sys.executable, str(_SCENARIO), python, _GROUP,
         "unshare", "-m", "sh", "-c", _MOUNTS, "sh", str(_ROOT / "written"),
         "setpriv", f"--reuid={_SERVICE_USER}", f"--regid={_GROUP_NUMBER}", "--clear-groups",
         "--no-new-privs", f"--inh-caps={rights}", f"--ambient-caps={rights}",
         f"--bounding-set=-all,{rights}", "--",
         python, str(_CONFINE), ",".join(sorted(_allowed())), setting("RestrictAddressFamilies")],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert seen["frames"] >= 200, (seen, done.stderr)
    assert seen["ended"] == 0
    assert seen["rights"] == sorted(_CAPABILITIES.values())
    assert seen["status"]["Uid"].split() == [_SERVICE_USER] * 4
    assert seen["status"]["NoNewPrivs"] == "1"
    assert seen["status"]["Seccomp"] == "2"  # by a filter


@pytest.mark.parametrize(
    ("what", "refused"),
    [
        ("import socket; socket.socket(socket.AF_INET)", "Address family not supported"),
        ("import socket; socket.if_nameindex()", "Address family not supported"),
        ("import os; os.chown('.', 0, 0)", "Operation not permitted"),
        ("import mmap; mmap.mmap(-1, 4096, prot=7)", "Operation not permitted"),
    ],
)
def test_the_confinement_refuses(what: str, refused: str) -> None:
    """Else the test above would show nothing."""
    _needs_filters()
    done = subprocess.run(
        [sys.executable, str(_CONFINE), ",".join(sorted(_allowed())),
         setting("RestrictAddressFamilies"), sys.executable, "-I", "-c", what],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert refused in done.stderr
