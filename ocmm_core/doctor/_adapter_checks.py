"""Checks of the camera network adapter: cable, use, and interrupt coalescing."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping, Sequence

from ocmm_core.doctor import _result as result
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._kernel_checks import bus_core, processors

COALESCING, FEATURES = "-C", "-K"
PAUSE, EEE = "-a", "--show-eee"
_PACKAGE = "ethtool"
_TITLES = {"generic-receive-offload": "gro", "large-receive-offload": "lro"}


def adapter_settings(computer: Computer, name: str, kind: str) -> dict[str, str]:
    """Return the changeable settings of a kind, by option; NotAskedError if unknown.

    ``kind`` is `COALESCING` or `FEATURES`: the option that sets them; lower case queries.
    """
    said = computer.run("ethtool", kind.lower(), name, package=_PACKAGE)
    if kind == FEATURES:
        found = re.findall(r"^([a-z-]+): (on|off)$", said, re.MULTILINE)
        return {_TITLES[title]: state for title, state in found if title in _TITLES}
    times = dict(re.findall(r"^(rx-usecs|tx-usecs):\s*(\d{1,7})$", said, re.MULTILINE))
    adaptive = re.search(r"^Adaptive RX: (on|off)\s+TX: (on|off)$", said, re.MULTILINE)
    if adaptive is None:
        return times
    # First off, then zero: some drivers refuse times in adaptive mode.
    return {"adaptive-rx": adaptive[1], "adaptive-tx": adaptive[2], **times}


def fixed_features(computer: Computer, name: str) -> dict[str, str]:
    """Return the features fixed by the driver, by option."""
    said = computer.run("ethtool", FEATURES.lower(), name, package=_PACKAGE)
    found = re.findall(r"^([a-z-]+): (on|off) \[fixed\]$", said, re.MULTILINE)
    return {_TITLES[title]: state for title, state in found if title in _TITLES}


def is_on(computer: Computer, name: str, kind: str) -> bool:
    """Return whether `PAUSE` frames or `EEE` are on; False if unknown."""
    with contextlib.suppress(NotAskedError):
        said = computer.run("ethtool", kind, name, package=_PACKAGE)
        return re.search(r"^(?:RX|TX):\s*on$|EEE status: enabled", said, re.MULTILINE) is not None
    return False


def change_setting(computer: Computer, name: str, kind: str, option: str, value: str) -> None:
    """Set one option; raise NotAskedError if the driver refuses."""
    computer.run("ethtool", kind, name, option, value, package=_PACKAGE)


NETWORK = "/sys/class/net"
_SETTINGS = "/etc/ocmm/bus.env"
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,15}")
_LEAST_MBIT, _MOST_MBIT = 100, 1000
"""EtherCAT is 100 Mbit/s (IEC 61158-2 type 12); a lower rate indicates a bad cable."""

_BUFFERS = "/proc/sys/net/core/rmem_max"
_LEAST_BUFFER, _BUFFER = 4 << 20, 16 << 20
"""Requested for each camera, and recommended."""
_JUMBO = 8000

_LINK_LOCAL = "20"
"""Scope of IPv6 addresses that every adapter has."""


def interface_of(computer: Computer) -> str:
    """Return the camera adapter; raise NotAskedError if unknown or absent."""
    try:
        name = _named(computer)
    except NotAskedError as error:
        raise NotAskedError("It is not known which adapter is that of the cameras.") from error
    if not computer.has(f"{NETWORK}/{name}"):
        raise NotAskedError(f"This computer has no network adapter {name}.")
    return name


def _named(computer: Computer) -> str:
    """Return the configured adapter; raise NotAskedError if none is configured."""
    name = computer.interface
    if not name and computer.has(_SETTINGS):
        found = re.findall(
            r'^OCMM_INTERFACE="?([^"\n]*)"?$', computer.text(_SETTINGS), re.MULTILINE
        )
        name = found[-1].strip() if found else ""
    if "+" in name:
        raise NotAskedError(
            f"A ring has two adapters ({name}), and one is checked at a time.",
            "Run this for each of them: --interface",
        )
    if not name:
        raise NotAskedError(
            "Nobody said which network adapter the cameras are connected to.",
            f"Name it: --interface enp3s0, or OCMM_INTERFACE=enp3s0 in {_SETTINGS}.",
        )
    if not _NAME.fullmatch(name) or name in (".", ".."):
        raise NotAskedError("The network adapter has no name of one.", "Use a name of 'ip link'.")
    return name


def adapter(computer: Computer) -> result.Answer:
    """Return whether the adapter is present, connected, and used for cameras only."""
    name = _named(computer)
    folder = f"{NETWORK}/{name}"
    if not computer.has(folder):
        known = ", ".join(one for one in computer.names(NETWORK) if one != "lo")
        return result.red(
            "adapter.missing",
            f"This computer has no network adapter {name} (it has: {known or 'none'}).",
            "Plug it in, or name the right one with --interface.",
        )
    if _carries_default_route(computer, name):
        return result.red(
            "adapter.in_use",
            f"{name} carries the network of this computer; the camera bus would cut it off.",
            "Give the cameras an adapter of their own.",
        )
    # The kernel reports no carrier for an adapter that is down.
    if computer.text(f"{folder}/operstate") == "down":
        return result.red(
            "adapter.down",
            f"{name} is switched off, or no cable is connected.",
            f"Connect the cable of the cameras, and type: ip link set {name} up",
        )
    speed = computer.number(f"{folder}/speed")
    if 0 < speed < _LEAST_MBIT:
        return result.red(
            "adapter.slow",
            f"{name} is connected with {speed} Mbit/s; the cameras need {_LEAST_MBIT}.",
            "Replace the cable.",
        )
    if computer.has(f"{folder}/duplex") and computer.text(f"{folder}/duplex") == "half":
        return result.red(
            "adapter.half_duplex",
            f"{name} is connected half duplex; frames of the cameras collide.",
            f"Replace the cable, and type: ethtool -s {name} autoneg on",
        )
    faults = _against(computer, name, speed)
    if faults:
        return result.amber(
            "adapter.unsuited",
            " ".join(what for what, _ in faults),
            " ".join(remedy for _, remedy in faults),
        )
    shown = f", {speed} Mbit/s" if speed > 0 else ""
    return result.green(f"{name} is connected{shown}, and is not used by the network.")


def _against(computer: Computer, name: str, speed: int) -> list[tuple[str, str]]:
    """Return what makes an adapter unsuited for the cameras, each with its remedy."""
    connection = "/".join((NETWORK, name, "device/subsystem"))
    faults = (
        (
            speed > _MOST_MBIT,
            f"{name} is connected with {speed} Mbit/s: no camera is at the other end.",
            "Connect the cameras directly, without a switch.",
        ),
        (
            _has_address(computer, name),
            f"{name} has an IP address: other programs send on the camera bus.",
            f"Type: ip addr flush dev {name}; switch off DHCP for it.",
        ),
        (
            computer.link(connection).endswith("/usb"),
            f"{name} is a USB adapter, which delivers frames late.",
            "Use an adapter on PCI Express.",
        ),
        (
            is_on(computer, name, PAUSE),
            f"{name} uses pause frames.",
            f"Type: ethtool -A {name} rx off tx off",
        ),
        (
            is_on(computer, name, EEE),
            f"{name} uses energy-efficient Ethernet.",
            f"Type: ethtool --set-eee {name} eee off",
        ),
    )
    return [(what, remedy) for is_so, what, remedy in faults if is_so]


def _has_address(computer: Computer, name: str) -> bool:
    """Return whether the adapter has an IPv4 route, or an IPv6 address beyond its link."""
    routes = computer.text("/proc/net/route").splitlines()[1:]
    if any(line.split()[:1] == [name] for line in routes):
        return True
    place = "/proc/net/if_inet6"
    lines = computer.text(place).splitlines() if computer.has(place) else []
    fields = [line.split() for line in lines]
    return any(len(one) > 5 and one[5] == name and one[3] != _LINK_LOCAL for one in fields)


def interrupts(computer: Computer) -> result.Answer:
    """Return whether the camera adapter's interrupts avoid the bus processor."""
    core = bus_core(computer)
    if core is None:
        raise NotAskedError(
            "No processor is kept free for the bus, so no interrupt can disturb it."
        )
    name = interface_of(computer)
    lines = f"{NETWORK}/{name}/device/msi_irqs"
    if not computer.has(lines):
        raise NotAskedError(f"The kernel does not say which interrupts {name} has.")
    numbers = [one for one in computer.names(lines) if one.isdigit()]
    if not numbers:
        raise NotAskedError(f"The kernel does not say which interrupts {name} has.")
    others = [one for one in processors(computer) if one != core]
    if not others:
        raise NotAskedError("There is one processor.")
    wrong = []
    for number in numbers:
        place = f"/proc/irq/{number}/smp_affinity_list"
        if core in computer.cpus(place):
            wrong.append(result.kernel_file(place, computer.text(place), _ranges(others)))
    if not wrong:
        return result.green(f"The {len(numbers)} interrupts of {name} stay off processor {core}.")
    return result.amber(
        "interrupts.on_bus_core",
        f"{len(wrong)} of {len(numbers)} interrupts of {name} may interrupt processor {core}, "
        "which is that of the bus.",
        f"Write {_ranges(others)} to {wrong[0].place}{' and so on' if len(wrong) > 1 else ''}.",
        tuple(wrong),
    )


def coalescing(computer: Computer) -> result.Answer:
    """Return whether the adapter reports every frame at once.

    Waiting for more frames makes every cycle longer (SOEM issues 184, 531 and 795: ``ethtool -C IF
    rx-usecs 0 tx-usecs 0``).
    """
    name = interface_of(computer)
    found = adapter_settings(computer, name, COALESCING)
    wanted = {option: "0" if "usecs" in option else "off" for option in found}
    if not {"rx-usecs", "tx-usecs"} & set(found):
        raise NotAskedError(f"The driver of {name} does not say whether it collects frames.")
    wrong = _wrong(name, COALESCING, found, wanted)
    if not wrong:
        return result.green(f"{name} tells every frame at once.")
    shown = ", ".join(f"{one.place.split()[-1]} {one.before}" for one in wrong)
    return result.amber(
        "coalescing.on",
        f"{name} collects frames before it tells them ({shown}; usecs are microseconds).",
        f"Turn it off: ethtool -C {name} {_ethtool_text(wrong)}",
        wrong,
    )


def offloads(computer: Computer) -> result.Answer:
    """Return whether the kernel delivers every frame unmodified."""
    name = interface_of(computer)
    found = adapter_settings(computer, name, FEATURES)
    fixed = fixed_features(computer, name)
    if not found and not fixed:
        raise NotAskedError(f"The driver of {name} does not say whether it joins frames.")
    wrong = _wrong(name, FEATURES, found, dict.fromkeys(found, "off"))
    if "on" in fixed.values():
        return result.amber(
            "offloads.fixed",
            f"{name} joins received frames, and its driver does not let it be turned off.",
            "Use another adapter for the cameras.",
            wrong,
        )
    if not wrong:
        return result.green(f"{name} hands on every frame as it came.")
    return result.amber(
        "offloads.on",
        f"{name} joins received frames ({', '.join(one.place.split()[-1] for one in wrong)}).",
        f"Turn it off: ethtool -K {name} {_ethtool_text(wrong)}",
        wrong,
    )


def image_network(computer: Computer) -> result.Answer:
    """Return whether images of GigE Vision cameras fit into receive buffers and large packets."""
    limit = computer.number(_BUFFERS)
    if limit < _LEAST_BUFFER:
        return result.amber(
            "images.buffer",
            f"The kernel allows receive buffers of {limit >> 10} kB; images need "
            f"{_LEAST_BUFFER >> 10} kB, or packets are lost.",
            f"Set it: sysctl -w net.core.rmem_max={_BUFFER}, and in /etc/sysctl.d for the next "
            "start.",
            (result.kernel_file(_BUFFERS, str(limit), str(_BUFFER)),),
        )
    small = [
        f"{name} {size}"
        for name in computer.names(NETWORK)
        if computer.has(f"{NETWORK}/{name}/device")
        and computer.text(f"{NETWORK}/{name}/operstate").strip() == "up"
        and not _carries_default_route(computer, name)
        and (size := computer.number(f"{NETWORK}/{name}/mtu")) < _JUMBO
    ]
    if small:
        return result.amber(
            "images.packets",
            f"Adapters with small packets (MTU): {', '.join(small)}. Cameras there send six times "
            "as many packets as with jumbo frames.",
            "For adapters of cameras: ip link set IFACE mtu 9000, also in switch and cameras.",
        )
    return result.green("Receive buffers and packets are large enough for images.")


def _carries_default_route(computer: Computer, name: str) -> bool:
    lines = [line.split() for line in computer.text("/proc/net/route").splitlines()[1:]]
    return any(
        len(one) > 7 and one[0] == name and one[1] == "00000000" and one[7] == "00000000"
        for one in lines
    )


def _wrong(
    name: str, kind: str, found: Mapping[str, str], wanted: Mapping[str, str]
) -> tuple[result.SystemChange, ...]:
    return tuple(
        result.SystemChange(
            kind=result.ChangeKind.ADAPTER, place=f"{name} {kind} {option}", before=value,
            after=wanted[option],
        )
        for option, value in found.items()
        if value != wanted[option]
    )  # fmt: skip


def _ethtool_text(changes: Sequence[result.SystemChange]) -> str:
    """Return settings in ethtool syntax."""
    return " ".join(f"{one.place.split()[-1]} {one.after}" for one in changes)


def _ranges(numbers: list[int]) -> str:
    """Return processors in kernel syntax: ``0-2,5``."""
    parts: list[tuple[int, int]] = []
    for number in numbers:
        if parts and parts[-1][1] == number - 1:
            parts[-1] = parts[-1][0], number
        else:
            parts.append((number, number))
    return ",".join(str(low) if low == high else f"{low}-{high}" for low, high in parts)
