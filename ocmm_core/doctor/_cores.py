from __future__ import annotations

import re

from ocmm_core.doctor._computer import Computer, NotAskedError

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
