"""Checks of kernel, processors and rights for timeliness within a millisecond.

The rights are those of the user's group, and rights and memory locking of the bus process.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from ocmm_core.acquisition.bus_process import NEEDED, RECIPE
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import (
    LIMITS,
    Answer,
    ChangeKind,
    SystemChange,
    amber,
    green,
    kernel_file,
    red,
)

CPU = "/sys/devices/system/cpu"
SPARE_PROCESSORS = 4
"""Minimum number of processors for a reserved bus processor (`bus_process._rights`)."""
UNITS = ("/etc/systemd/system", "/usr/lib/systemd/system", "/lib/systemd/system")
SERVICE = "ocmm-acq@.service"


def processors(computer: Computer) -> tuple[int, ...]:
    """Return the online processors; raise NotAskedError if the kernel lists none."""
    found = computer.cpus(f"{CPU}/online")
    if not found:
        raise NotAskedError(f"{CPU}/online lists no processor.")
    return found


def isolated(computer: Computer) -> tuple[int, ...]:
    """Return the isolated processors (``isolcpus``)."""
    return computer.cpus(f"{CPU}/isolated")


def bus_core(computer: Computer) -> int | None:
    """Return the bus's processor: the last isolated one, else the last; None if too few."""
    everything = processors(computer)
    free = isolated(computer)
    if free:
        return max(free)
    return max(everything) if len(everything) >= SPARE_PROCESSORS else None


def unit(computer: Computer, name: str) -> str | None:
    """Return the text of a systemd unit with its drop-ins; None if absent."""
    texts = []
    for folder in UNITS:
        if computer.has(f"{folder}/{name}"):
            texts.append(computer.text(f"{folder}/{name}"))
            break
    else:
        return None
    for folder in UNITS:
        added = f"{folder}/{name}.d"
        if computer.has(added):
            found = [one for one in computer.names(added) if one.endswith(".conf")]
            texts += [computer.text(f"{added}/{one}") for one in found]
    return "\n".join(texts)


def setting(unit_text: str, name: str) -> str:
    """Return the last value of a unit setting; empty if not set."""
    found = re.findall(rf"^{name}[ \t]*=[ \t]*(.*)$", unit_text, re.MULTILINE)
    return str(found[-1]).strip() if found else ""


SLOW_WAKE_US = 50
"""Half of the maximum latency of a real-time kernel, 100 us in 8 hours: LinuxCNC requires 20 to 100
us (its latency test), Ubuntu's real-time kernel reaches 67 to 129 us under load."""
_FAST = "performance"


def kernel(computer: Computer) -> Answer:
    """Return whether the kernel is real-time."""
    text = computer.text("/proc/version")
    release = text.split()[2] if len(text.split()) > 2 else "unknown"
    # Since 4.13 patched and merged kernels report it here.
    real_time = "PREEMPT_RT" in text or "PREEMPT RT" in text
    if computer.has("/sys/kernel/realtime"):
        real_time = real_time or computer.number("/sys/kernel/realtime") == 1
    if real_time:
        return green(f"Kernel {release} with PREEMPT_RT.")
    return amber(
        "kernel.not_real_time",
        f"Kernel {release} is no real-time kernel: cycles can be some milliseconds late.",
        "Install one and restart: apt install linux-image-rt-amd64",
    )


def cores(computer: Computer) -> Answer:
    """Return whether a processor is reserved for the bus."""
    everything = processors(computer)
    if len(everything) < SPARE_PROCESSORS:
        return amber(
            "cores.few",
            f"{len(everything)} processors: none can be kept free for the bus.",
            f"Use a computer with at least {SPARE_PROCESSORS} processors.",
        )
    core = max(everything)
    line = f"isolcpus={core} nohz_full={core} rcu_nocbs={core}"
    permanent = f"Add {line} to GRUB_CMDLINE_LINUX in /etc/default/grub, run update-grub, restart."
    free = isolated(computer)
    if not free:
        return amber(
            "cores.not_isolated",
            f"No processor is kept free for the bus ({len(everything)} processors, no isolcpus).",
            permanent,
        )
    core = max(free)
    quiet = computer.cpus(f"{CPU}/nohz_full") if computer.has(f"{CPU}/nohz_full") else ()
    if core not in quiet:
        return amber(
            "cores.tick",
            f"Processor {core} is isolated, but the kernel's tick still interrupts it "
            "(no nohz_full).",
            f"Add nohz_full={core} rcu_nocbs={core} to GRUB_CMDLINE_LINUX in /etc/default/grub, "
            "run update-grub, restart.",
        )
    service = unit(computer, SERVICE)
    if service is not None and setting(service, "CPUAffinity") != str(core):
        return amber(
            "cores.service",
            f"Processor {core} is isolated, but the bus service does not run on it.",
            f"Type systemctl edit {SERVICE}, and write [Service] and CPUAffinity={core}.",
        )
    return green(f"Processor {core} of {len(everything)} is isolated (isolcpus, nohz_full).")


def governor(computer: Computer) -> Answer:
    """Return whether all processors run at full clock."""
    folders = [one for one in _cpu_folders(computer) if computer.has(f"{one}/cpufreq")]
    if not folders:
        raise NotAskedError(
            "The kernel shows no clock governor (a virtual machine, or a fixed clock).",
            "On a virtual machine set the host to performance.",
        )
    places = [f"{one}/cpufreq/scaling_governor" for one in folders]
    found = {place: computer.text(place) for place in places}
    slow = {place: value for place, value in found.items() if value != _FAST}
    if not slow:
        return green(f"{_FAST} on all {len(found)} processors.")
    return amber(
        "governor.slow",
        f"Governor {_listed(set(slow.values()))} on {len(slow)} of {len(found)} processors: "
        "they slow down between two cycles.",
        "Set them to performance: cpupower frequency-set -g performance",
        tuple(kernel_file(place, value, _FAST) for place, value in slow.items()),
    )


def idle(computer: Computer) -> Answer:
    """Return whether processor sleep states are shallow enough to wake up in time."""
    places = [
        f"{folder}/cpuidle/{state}"
        for folder in _cpu_folders(computer)
        if computer.has(f"{folder}/cpuidle")
        for state in computer.names(f"{folder}/cpuidle")
        if state.startswith("state")
    ]
    if not places:
        raise NotAskedError(
            "The kernel shows no idle states (a virtual machine, or idle=poll).",
            "Limit C-states in the firmware (BIOS) of the computer or of the host.",
        )
    deep = {
        place: computer.number(f"{place}/latency")
        for place in places
        if computer.number(f"{place}/disable") == 0
        and computer.number(f"{place}/latency") > SLOW_WAKE_US
    }
    if not deep:
        return green(f"No idle state that takes more than {SLOW_WAKE_US} us to wake up is on.")
    names = {computer.text(f"{place}/name") for place in deep}
    return amber(
        "idle.deep",
        f"Idle state {_listed(names)} is on: a processor takes up to {max(deep.values())} us to "
        "wake up.",
        f"Turn it off: cpupower idle-set -D {SLOW_WAKE_US + 1}",
        tuple(kernel_file(f"{place}/disable", "0", "1") for place in deep),
    )


def _cpu_folders(computer: Computer) -> list[str]:
    return [f"{CPU}/cpu{number}" for number in processors(computer)]


def _listed(names: Iterable[str]) -> str:
    return ", ".join(sorted(names))[:100]


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
