"""Checks of the user's group, and of rights and memory locking of the bus process."""

from __future__ import annotations

import re
from pathlib import Path

from ocmm_core.acquisition.bus_process import NEEDED, RECIPE
from ocmm_core.doctor._changes import LIMITS, ChangeKind, SystemChange
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._cores import SERVICE, setting, unit
from ocmm_core.doctor._result import Answer, amber, green, red

GROUP = "ocmm"
LIMITS_TEXT = f"@{GROUP} - memlock unlimited\n@{GROUP} - rtprio 80\n"
_SOCKET_UNIT = "ocmm-acq.socket"
_SOCKET = "/run/ocmm/acq.sock"
_MOST_PARENTS = 16
_CAP_SYS_RESOURCE = 24
"""capabilities(7)."""
_PROGRAMS = ("ocmm-acq-python", "ocmm-acq")
"""Programs that can carry the rights: the interpreter copy made by `grant-rights.sh`, and the
program of an installed package."""


def group(computer: Computer) -> Answer:
    """Return whether the user is in the group that may use the cameras."""
    if computer.uid == 0:
        return green("root needs no group.")
    lines = [line.split(":") for line in computer.text("/etc/group").splitlines()]
    ours = [one for one in lines if len(one) == 4 and one[0] == GROUP]
    granted = _program(computer)
    if not ours:
        if granted is not None:
            return green(f"Not needed: {granted} has the rights, and {computer.user} may run it.")
        return red(
            "group.missing",
            f"There is no group '{GROUP}', which may use the cameras.",
            f"Make it: groupadd --system {GROUP} && usermod -aG {GROUP} {computer.user}",
        )
    number, members = ours[0][2], ours[0][3].split(",")
    current = _groups_of_process(computer)
    if number in current:
        return green(f"{computer.user} is in the group '{GROUP}'.")
    if computer.user not in members:
        return red(
            "group.not_member",
            f"{computer.user} is not in the group '{GROUP}', which may use the cameras.",
            f"Add the user, then log out and in: usermod -aG {GROUP} {computer.user}",
        )
    return red(
        "group.not_yet",
        f"{computer.user} was added to the group '{GROUP}' after logging in.",
        "Log out and in.",
    )


def rights(computer: Computer) -> Answer:
    """Return whether the bus process may use raw Ethernet and a real-time priority."""
    if unit(computer, _SOCKET_UNIT) is not None:
        if computer.has(_SOCKET):
            return green("The bus runs as a service that has the rights.")
        return red(
            "rights.service_off",
            "The bus service is installed, but it does not listen.",
            f"Start it: systemctl enable --now {_SOCKET_UNIT}",
        )
    granted = _program(computer)
    if granted is not None:
        if computer.calls.owner(computer.place(granted)) != 0 or _mode(computer, granted) & 0o022:
            return red(
                "rights.changeable",
                f"{granted} has rights, and users other than root can change it.",
                f"Give them anew: {RECIPE}",
            )
        return green(f"{granted} has the {len(NEEDED)} rights of the bus process.")
    if computer.uid == 0:
        return amber(
            "rights.root",
            "OCMM runs as root: it may everything, and so does whatever breaks it.",
            f"Work as an ordinary user, with rights for the bus process alone: {RECIPE}",
        )
    return red(
        "rights.missing",
        "The bus process may not send raw Ethernet frames.",
        f"Give it its rights once: {RECIPE}, or install the service (installer/linux).",
    )


def memory(computer: Computer) -> Answer:
    """Return whether the bus process can lock its memory: a page fault costs cycles."""
    service = unit(computer, SERVICE)
    if service is not None and unit(computer, _SOCKET_UNIT) is not None:
        if setting(service, "LimitMEMLOCK") == "infinity":
            return green("The bus service may lock all its memory.")
        return amber(
            "memory.service",
            "The bus service may not lock all its memory.",
            f"Type systemctl edit {SERVICE}, and write [Service] and LimitMEMLOCK=infinity.",
        )
    if computer.uid == 0 and _may_raise_limits(computer):
        return green("root may lock all memory.")
    found = re.search(
        r"^Max locked memory\s+(unlimited|\d+)\s",
        computer.text(f"{_process(computer)}/limits"),
        re.MULTILINE,
    )
    if found is None:
        raise NotAskedError("The kernel does not say how much memory may be locked.")
    if found[1] == "unlimited":
        return green(f"{computer.user} may lock all memory.")
    if computer.has(LIMITS):
        return amber(
            "memory.not_yet",
            f"{computer.user} may lock {int(found[1]) // 1024} KiB of memory; {LIMITS} says more.",
            f"Log out and in; {computer.user} must be in the group '{GROUP}'.",
        )
    change = SystemChange(kind=ChangeKind.NEW_FILE, place=LIMITS, before="", after=LIMITS_TEXT)
    return amber(
        "memory.limited",
        f"{computer.user} may lock {int(found[1]) // 1024} KiB of memory; the bus process needs "
        "all of its own.",
        f"Write '@{GROUP} - memlock unlimited' to {LIMITS}, then log out and in.",
        (change,),
    )


def _process(computer: Computer) -> str:
    """Return the folder of a process of the user: with sudo, its caller.

    Children of sudo have root's groups and limits.
    """
    process = "/proc/self"
    for _ in range(_MOST_PARENTS):
        if not computer.by_sudo:
            return process
        status = computer.text(f"{process}/status")
        owner = re.search(r"^Uid:\s*(\d{1,10})\s", status, re.MULTILINE)
        if owner is not None and int(owner[1]) == computer.uid:
            return process
        parent = re.search(r"^PPid:\s*(\d{1,10})$", status, re.MULTILINE)
        if parent is None or int(parent[1]) <= 1:
            break
        process = f"/proc/{parent[1]}"
    raise NotAskedError(
        f"No process of {computer.user} is seen behind sudo.", "Run this once more without sudo."
    )


def _may_raise_limits(computer: Computer) -> bool:
    """Return whether this process may; root of a container may not always."""
    found = re.search(
        r"^CapEff:\s*([0-9a-f]{1,16})$", computer.text("/proc/self/status"), re.MULTILINE
    )
    return found is not None and bool(int(found[1], 16) >> _CAP_SYS_RESOURCE & 1)


def _groups_of_process(computer: Computer) -> tuple[str, ...]:
    found = re.search(
        r"^Groups:[ \t]*([\d \t]*)$", computer.text(f"{_process(computer)}/status"), re.MULTILINE
    )
    if found is None:
        raise NotAskedError("The kernel does not say which groups this user is in.")
    return tuple(found[1].split())


def _program(computer: Computer) -> Path | None:
    """Return the bus process program that has the rights, or None."""
    for name in _PROGRAMS:
        candidate = computer.program.with_name(name)
        place = computer.place(candidate)
        if computer.has(candidate) and computer.calls.granted(place) >= NEEDED:
            return candidate
    return None


def _mode(computer: Computer, path: Path) -> int:
    try:
        return computer.place(path).stat().st_mode
    except OSError as error:
        raise NotAskedError(f"{path} cannot be looked at ({error.strerror}).") from error
