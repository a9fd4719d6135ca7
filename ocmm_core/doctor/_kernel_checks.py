"""Checks of kernel and processors for timeliness within a millisecond."""

from __future__ import annotations

from collections.abc import Iterable

from ocmm_core.doctor._changes import kernel_file
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._cores import (
    CPU,
    SERVICE,
    SPARE_PROCESSORS,
    isolated,
    processors,
    setting,
    unit,
)
from ocmm_core.doctor._result import Answer, amber, green

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
