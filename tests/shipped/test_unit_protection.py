"""Every service that is shipped for a station or server is protected as the bus service is."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from tests.host import HANG_S, needs_tools

_INSTALLER = Path(__file__).resolve().parents[2] / "installer"
_LINUX = _INSTALLER / "linux"
_WORST_SCORE = 2.0
_OTHER_SCORES = {"ocmm-window.service": 7.5}
"""Of units that need a login session with the graphics card; their comments say why."""
_BUS = _LINUX / "ocmm-acq@.service"
_EXCEPTIONS = {
    "ocmm-archive.service": {"ProcSubset", "MemoryDenyWriteExecute", "IPAddressDeny", "RemoveIPC"},
    "ocmm-scheduler.service": {"ProcSubset", "MemoryDenyWriteExecute", "IPAddressDeny"},
    "ocmm-workers.service": {"ProcSubset", "MemoryDenyWriteExecute", "IPAddressDeny"},
    "ocmm-key.service": {"ProcSubset", "MemoryDenyWriteExecute", "RemoveIPC"},
}
"""Protections of the bus unit that the unit cannot have; its comment gives the reason."""
_MORE = {"RestrictRealtime": "yes", "PrivateUsers": "yes"}
"""Protections that the bus needs to do without."""
_OWN = {
    "AmbientCapabilities", "CapabilityBoundingSet", "ProtectHome", "RestrictAddressFamilies",
    "SystemCallFilter", "LimitRTPRIO", "LimitMEMLOCK", "TasksMax", "EnvironmentFile", "ExecStart",
    "StandardInput", "StandardOutput", "StandardError", "TimeoutStopSec", "User", "Group",
}  # fmt: skip
"""Settings of the bus unit that are no protection, or have another value in each unit."""
_UNITS = [
    *(_LINUX / name for name in _EXCEPTIONS if name != "ocmm-key.service"),
    next(_INSTALLER.rglob("ocmm-key.service")),
]


def settings(text: str) -> dict[str, list[str]]:
    """Return the settings of the section of the service, in their order."""
    section = text.partition("[Service]\n")[2].partition("\n[")[0].replace("\\\n", " ")
    found: dict[str, list[str]] = {}
    for line in section.splitlines():
        if "=" in line and not line.startswith("#"):
            name, _, value = line.partition("=")
            found.setdefault(name, []).append(value)
    return found


def faults(name: str, text: str) -> list[str]:
    """Return how the service is less protected than the bus service."""
    wanted = settings(_BUS.read_text("utf-8"))
    needed = {key: value for key, value in wanted.items() if key not in _OWN | _EXCEPTIONS[name]}
    needed |= {key: [value] for key, value in _MORE.items()}
    found = settings(text)
    wrong = [key for key, value in needed.items() if found.get(key) != value]
    if found.get("CapabilityBoundingSet") != [""]:
        wrong.append("CapabilityBoundingSet")
    if found.get("ProtectHome", ["no"])[-1] not in ("yes", "read-only", "tmpfs"):
        wrong.append("ProtectHome")
    if found.get("SystemCallFilter", [])[:2] != ["@system-service", "~@privileged @keyring"]:
        wrong.append("SystemCallFilter")
    if not set(found.get("RestrictAddressFamilies", ["all"])[-1].split()) <= {
        "AF_INET", "AF_INET6", "AF_UNIX", "AF_NETLINK"
    }:  # fmt: skip
        wrong.append("RestrictAddressFamilies")
    if found.get("User", ["root"]) == ["root"]:
        wrong.append("User")
    return wrong


@pytest.mark.parametrize("path", _UNITS, ids=lambda path: path.name)
def test_a_service_has_the_protections_of_the_bus_service(path: Path) -> None:
    text = path.read_text("utf-8")
    assert faults(path.name, text) == []
    # Each setting is required: a unit without one is named.
    for name in settings(text):
        lines = [line for line in text.splitlines() if not line.startswith(f"{name}=")]
        if name in settings(_BUS.read_text("utf-8")) and name not in _OWN:
            assert faults(path.name, "\n".join(lines)) == [name]


_ALL = sorted((*_LINUX.glob("*.service"), *(_INSTALLER / "station" / "root").rglob("*.service")))


@pytest.mark.parametrize("path", _ALL, ids=lambda path: path.name)
def test_systemd_finds_a_service_well_protected(path: Path) -> None:
    needs_tools("systemd-analyze")
    done = subprocess.run(
        ["systemd-analyze", "security", "--no-pager", "--offline=true", str(path)],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    found = re.search(r"Overall exposure level for [^:]+: ([\d.]+)", done.stdout)
    assert found is not None, done.stderr
    assert float(found[1]) <= _OTHER_SCORES.get(path.name, _WORST_SCORE), done.stdout
