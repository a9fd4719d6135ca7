"""The faults that are seeded into a good computer, each with the code and the light it must get."""

from __future__ import annotations

import os
import pwd
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import msgspec

from ocmm_core.doctor import Computer, Light
from ocmm_core.seals import KEY_IN_FORCE, KnownEnd, memory_file
from tests.core.doctor.fake_computer import (
    ADAPTER,
    CPU,
    DATA,
    DEFAULT_ROUTE,
    GIB,
    HOME,
    LIMITS,
    NOW,
    PROGRAM,
    SETTINGS,
    STATE,
    calls,
    put,
    put_record,
    room,
)
from tests.waiting import let_pass

Fault = Callable[[Computer], Computer | None]
_LONG = timedelta(days=400)


def written(path: Path | str, content: str) -> Fault:
    """Return the fault that a file holds something else."""

    def fault(computer: Computer) -> None:
        put(computer, path, content)

    return fault


def removed(path: Path | str) -> Fault:
    """Return the fault that a file is missing."""

    def fault(computer: Computer) -> None:
        computer.place(path).unlink()

    return fault


def lost_key(computer: Computer) -> None:
    """Remove the key of a station that has signed with it."""
    put(computer, STATE / "histories" / memory_file(KEY_IN_FORCE).name, "{}")
    removed(DATA / "keys/station.key")(computer)


def mode(path: Path, bits: int) -> Fault:
    """Return the fault that a file has other rights."""

    def fault(computer: Computer) -> None:
        computer.place(path).chmod(bits)

    return fault


def answers(**changes: Callable[..., object]) -> Fault:
    """Return the fault that the kernel answers something else."""
    return lambda computer: calls(computer, **changes)


def records(until: timedelta, certificate: timedelta) -> Fault:
    """Return the fault that something ends so long after now."""
    return lambda computer: put_record(computer, until, certificate)


def slow_fsync(seconds: float) -> Fault:
    """Return the fault that the disk takes so long."""
    return answers(fsync=lambda descriptor: let_pass(seconds))


def set_back(computer: Computer) -> None:
    """Let the station remember a later moment than now."""
    seen = KnownEnd(name="x", count=3, link="b" * 64, utc=(NOW + timedelta(hours=2)).isoformat())
    put(computer, STATE / "histories" / "1.json", msgspec.json.encode(seen))


def clock_off(computer: Computer) -> Computer:
    """Let the clock be an hour off that of the board, and not synchronised."""
    put(computer, "/sys/class/rtc/rtc0/since_epoch", f"{int(NOW.timestamp()) - 3600}\n")
    return calls(computer, synchronised=lambda: False)


def no_group(computer: Computer) -> Computer:
    """Simulate a station without the group and without rights for a program."""
    put(computer, "/etc/group", "root:x:0:\nanna:x:1000:\n")
    return calls(computer, granted=lambda path: frozenset())


def service(text: str) -> Fault:
    """Return the fault of an installed bus service with these lines."""

    def fault(computer: Computer) -> None:
        put(computer, "/run/ocmm/acq.sock", "")
        put(computer, "/etc/systemd/system/ocmm-acq.socket", "[Socket]\n")
        put(computer, "/etc/systemd/system/ocmm-acq@.service", f"[Service]\n{text}\n")

    return fault


def without_listener(computer: Computer) -> None:
    """Let the bus service be installed but not started."""
    put(computer, "/usr/lib/systemd/system/ocmm-acq.socket", "[Socket]\n")


def scaled(computer: Computer) -> Computer:
    """Let the window be drawn three times as large."""
    return replace(computer, environment={"QT_SCALE_FACTOR": "3"})


def two_processors(computer: Computer) -> None:
    """Let the computer have two processors, none of which can be spared."""
    put(computer, f"{CPU}/online", "0-1\n")
    put(computer, f"{CPU}/isolated", "\n")


def no_adapter(computer: Computer) -> Computer:
    """Let the cameras be named on an adapter that is not there."""
    return replace(computer, interface="enp9s0")


def usb_adapter(computer: Computer) -> None:
    """Let the adapter be plugged into USB."""
    place = computer.place(f"{ADAPTER}/device/subsystem")
    place.parent.mkdir(parents=True, exist_ok=True)
    place.symlink_to("../../../../bus/usb")


FAULTS: dict[str, tuple[str, Light, Fault]] = {
    "no RT kernel": (
        "kernel.not_real_time", Light.AMBER,
        written("/proc/version", "Linux version 6.1.0-30-amd64 (x) #1 SMP PREEMPT_DYNAMIC\n"),
    ),
    "no isolcpus": ("cores.not_isolated", Light.AMBER, written(f"{CPU}/isolated", "\n")),
    "no nohz_full": ("cores.tick", Light.AMBER, written(f"{CPU}/nohz_full", "(null)\n")),
    "too few processors": ("cores.few", Light.AMBER, two_processors),
    "service on any core": (
        "cores.service", Light.AMBER, service("LimitMEMLOCK=infinity\n#CPUAffinity=3"),
    ),
    "wrong governor": (
        "governor.slow", Light.AMBER,
        written(f"{CPU}/cpu2/cpufreq/scaling_governor", "powersave\n"),
    ),
    "deep C-states": (
        "idle.deep", Light.AMBER, written(f"{CPU}/cpu3/cpuidle/state2/disable", "0\n"),
    ),
    "adapter not there": ("adapter.missing", Light.RED, no_adapter),
    "cameras on the network": (
        "adapter.in_use", Light.RED, written("/proc/net/route", f"Iface\nenp3s0{DEFAULT_ROUTE}"),
    ),
    "no cable": ("adapter.down", Light.RED, written(f"{ADAPTER}/operstate", "down\n")),
    "bad cable": ("adapter.slow", Light.RED, written(f"{ADAPTER}/speed", "10\n")),
    "half duplex": ("adapter.half_duplex", Light.RED, written(f"{ADAPTER}/duplex", "half\n")),
    "ten gigabit": ("adapter.unsuited", Light.AMBER, written(f"{ADAPTER}/speed", "10000\n")),
    "adapter with an address": (
        "adapter.unsuited", Light.AMBER,
        written(
            "/proc/net/route",
            f"Iface\neno1{DEFAULT_ROUTE}enp3s0\t0001A8C0\t0\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n",
        ),
    ),
    "adapter with an IPv6 address": (
        "adapter.unsuited", Light.AMBER,
        written("/proc/net/if_inet6", "20010db8000000000000000000000001 03 40 00 80   enp3s0\n"),
    ),
    "pause frames": ("adapter.unsuited", Light.AMBER, written(f"{SETTINGS}/pause", "on\n")),
    "EEE": (
        "adapter.unsuited", Light.AMBER, written(f"{SETTINGS}/eee", "enabled - active\n"),
    ),
    "USB adapter": ("adapter.unsuited", Light.AMBER, usb_adapter),
    "IRQ on the bus's core": (
        "interrupts.on_bus_core", Light.AMBER,
        written("/proc/irq/41/smp_affinity_list", "0-3\n"),
    ),
    "coalescing on": ("coalescing.on", Light.AMBER, written(f"{SETTINGS}/rx-usecs", "50\n")),
    "adaptive coalescing": (
        "coalescing.on", Light.AMBER, written(f"{SETTINGS}/adaptive-rx", "on\n"),
    ),
    "offloads on": ("offloads.on", Light.AMBER, written(f"{SETTINGS}/gro", "on\n")),
    "no group": ("group.missing", Light.RED, no_group),
    "not in the group": (
        "group.not_member", Light.RED,
        lambda computer: (
            put(computer, "/etc/group", "ocmm:x:990:berta\n"),
            put(computer, "/proc/self/status", "Groups:\t1000\n"),
            None,
        )[-1],
    ),
    "not logged in again": (
        "group.not_yet", Light.RED, written("/proc/self/status", "Groups:\t1000 \n"),
    ),
    "missing rights": ("rights.missing", Light.RED, answers(granted=lambda path: frozenset())),
    "rights that a user can change": (
        "rights.changeable", Light.RED, mode(PROGRAM.with_name("ocmm-acq-python"), 0o770),
    ),
    "service not started": ("rights.service_off", Light.RED, without_listener),
    "memory lock small": (
        "memory.limited", Light.AMBER, written("/proc/self/limits", LIMITS.format("8388608")),
    ),
    "memory lock of the service": ("memory.service", Light.AMBER, service("CPUAffinity=3")),
    "clock set back": ("clock.set_back", Light.RED, set_back),
    "clock off": ("clock.off", Light.RED, clock_off),
    "clock not synchronised": (
        "clock.not_synchronised", Light.AMBER, answers(synchronised=lambda: False),
    ),
    "no time zone": ("time_zone.missing", Light.AMBER, removed("/etc/localtime")),
    "full disk": ("disk.full", Light.RED, answers(statvfs=lambda path: room(GIB // 10))),
    "disk nearly full": ("disk.low", Light.AMBER, answers(statvfs=lambda path: room(2 * GIB))),
    "disk without files": ("disk.no_files", Light.RED, answers(statvfs=lambda path: room(files=0))),
    "disk read-only": (
        "disk.read_only", Light.RED, answers(statvfs=lambda path: room(flags=os.ST_RDONLY)),
    ),
    # Sleeping makes it longer, never shorter: the limits are 25 and 100 ms.
    "slow fsync": ("sync.slow", Light.AMBER, slow_fsync(0.030)),
    "jobs in memory": (
        "sync.in_memory", Light.RED,
        written("/proc/self/mounts", f"/dev/sda1 / ext4 rw 0 0\ntmpfs {HOME} tmpfs rw 0 0\n"),
    ),
    "screen too small": (
        "screen.small", Light.RED, written("/sys/class/drm/card0-HDMI-A-1/modes", "800x600\n"),
    ),
    "receive buffers too small": (
        "images.buffer", Light.AMBER, written("/proc/sys/net/core/rmem_max", "212992\n"),
    ),
    "small packets of images": ("images.packets", Light.AMBER, written(f"{ADAPTER}/mtu", "1500\n")),
    "screen scaled too large": ("screen.small", Light.RED, scaled),
    "screen narrow": (
        "screen.narrow", Light.AMBER,
        written("/sys/class/drm/card0-HDMI-A-1/modes", "1024x768\n"),
    ),
    "no player": ("sound.no_player", Light.AMBER, removed("/usr/bin/paplay")),
    "no sound card": (
        "sound.no_card", Light.AMBER, written("/proc/asound/cards", "--- no soundcards ---\n"),
    ),
    "calibration expired": ("calibrations.expired", Light.RED, records(-timedelta(days=1), _LONG)),
    "calibration due": ("calibrations.due", Light.AMBER, records(timedelta(days=3), _LONG)),
    "expired certificate": ("certificates.expired", Light.RED, records(_LONG, -timedelta(days=1))),
    "certificate due": ("certificates.due", Light.AMBER, records(_LONG, timedelta(days=3))),
    "other settings of root": (
        "settings.of_root", Light.AMBER,
        written(f"{pwd.getpwuid(0).pw_dir}/.config/ocmm/settings.toml",
                'schema = "ocmm.settings/1"\n\n[window]\nlanguage = "de"\n'),
    ),
    "lost key": ("key.lost", Light.RED, lost_key),
    "no key": ("key.missing", Light.AMBER, removed(DATA / "keys/station.key")),
    "PIN of the token readable by others": (
        "key.readable", Light.RED, written(DATA / "keys/token.json", "{}"),
    ),
    "key readable by others": ("key.readable", Light.RED, mode(DATA / "keys/station.key", 0o644)),
    "folder of the key open": ("key.folder", Light.RED, mode(DATA / "keys", 0o777)),
}  # fmt: skip
