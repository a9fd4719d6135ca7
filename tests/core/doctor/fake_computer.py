"""A computer in a folder: files of the kernel, tools and user's folders of a good station.

Functions give only those answers of the kernel that are in no file. Tools are programs in the
folder that read and write its files, so that their effect is visible.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process import NEEDED
from ocmm_core.calibration.records import ArtefactUse, save
from ocmm_core.doctor import Computer, HostCalls
from ocmm_core.seals import KnownEnd
from tests.core.calibration.made_records import RIG, make_record

NOW = datetime(2026, 6, 1, 8, 0, tzinfo=UTC)
CPU = "/sys/devices/system/cpu"
ADAPTER = "/sys/class/net/enp3s0"
SETTINGS = "/run/ethtool/enp3s0"
HOME = Path("/home/anna")
STATE = HOME / ".local/state/ocmm"
DATA = HOME / ".local/share/ocmm"
PROGRAM = Path("/opt/ocmm/.venv/bin/python")
GIB = 1 << 30
BLOCK = 4096

_ETHTOOL = """#!/bin/sh
# ethtool of a computer in a folder: a setting is a file.
case $0 in */usr/sbin/ethtool) root=${0%/usr/sbin/ethtool} ;; *) exit 9 ;; esac
asked=$1; folder=$root/run/ethtool/$2
[ -d "$folder" ] || { echo 'netlink error: No such device'; exit 1; }
shift 2
get() { cat "$folder/$1"; }
case $asked in
-c) echo "Coalesce parameters for enp3s0:"
    echo "Adaptive RX: $(get adaptive-rx)  TX: $(get adaptive-tx)"
    echo "stats-block-usecs: n/a"; echo
    echo "rx-usecs: $(get rx-usecs)"; echo "rx-frames: n/a"; echo
    echo "tx-usecs: $(get tx-usecs)" ;;
-k) echo "Features for enp3s0:"; echo "rx-checksumming: on"
    echo "generic-receive-offload: $(get gro)"
    echo "large-receive-offload: off [fixed]" ;;
-a) echo "Pause parameters for enp3s0:"; echo "RX: $(get pause)"; echo "TX: off" ;;
--show-eee) echo "EEE settings for enp3s0:"; echo "	EEE status: $(get eee)" ;;
-C | -K) while [ $# -gt 1 ]; do
        [ -f "$folder/$1" ] || { echo "bad parameter: $1"; exit 1; }
        printf '%s\\n' "$2" >"$folder/$1"; shift 2
    done ;;
*) exit 2 ;;
esac
"""
_ROUTE = "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n"
DEFAULT_ROUTE = "\t00000000\t0101A8C0\t0003\t0\t0\t100\t00000000\t0\t0\t0\n"
LIMITS = (
    "Limit                     Soft Limit           Hard Limit           Units     \n"
    "Max processes             127000               127000               processes \n"
    "Max locked memory         {0:<20} {0:<20} bytes     \n"
)


def room(free: int = 50 * GIB, flags: int = 0, files: int = 1000) -> os.statvfs_result:
    """Return the answer of statvfs for a disk with the given free bytes and files."""
    blocks = free // BLOCK
    return os.statvfs_result(
        (BLOCK, BLOCK, 1 << 30, blocks, blocks, 10_000, files, files, flags, 255)
    )


def put(computer: Computer, path: Path | str, content: str | bytes) -> Path:
    """Write a file of the computer."""
    place = computer.place(path)
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_bytes(content.encode() if isinstance(content, str) else content)
    return place


def calls(computer: Computer, **changes: Callable[..., object]) -> Computer:
    """Return the computer with other answers of its kernel."""
    return replace(computer, calls=replace(computer.calls, **changes))  # type: ignore[arg-type]


def put_record(computer: Computer, until: timedelta, certificate: timedelta) -> None:
    """Store a calibration of the cameras that ends so long after now, as its certificate does."""
    artefact = ArtefactUse(
        name="bar 500", serial="B-17", certificate="DKD-1", certificate_sha256="c" * 64,
        due_utc=(NOW + certificate).isoformat(),
    )  # fmt: skip
    record = make_record(
        made_utc=(NOW - timedelta(days=30)).isoformat(),
        valid_until_utc=(NOW + until).isoformat(),
        artefacts=(artefact,),
    )
    folder = computer.place(DATA / "calibrations" / RIG.name)
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    save(folder, record)


def good_computer(root: Path) -> Computer:
    """Make a station that lacks nothing."""
    computer = Computer(
        root=root, user="anna", uid=1000, by_sudo=False, home=HOME, data=DATA, state=STATE,
        jobs=HOME / "jobs", program=PROGRAM,
        calls=HostCalls(
            now=lambda: NOW, statvfs=lambda path: room(), fsync=lambda descriptor: None,
            owner=lambda path: 0, synchronised=lambda: True,
            granted=lambda path: NEEDED if path.name == "ocmm-acq-python" else frozenset(),
        ),
    )  # fmt: skip
    put(computer, "/proc/sys/kernel/random/boot_id", "0b0e1cde-0000-4000-8000-000000000001\n")
    put(computer, "/proc/version", "Linux version 6.1.0-30-rt-amd64 (x) #1 SMP PREEMPT_RT Debian\n")
    put(computer, f"{CPU}/online", "0-3\n")
    put(computer, f"{CPU}/isolated", "3\n")
    put(computer, f"{CPU}/nohz_full", "3\n")
    for cpu in range(4):
        put(computer, f"{CPU}/cpu{cpu}/cpufreq/scaling_governor", "performance\n")
        for state, (name, latency) in enumerate((("POLL", 0), ("C1", 2), ("C6", 133))):
            folder = f"{CPU}/cpu{cpu}/cpuidle/state{state}"
            put(computer, f"{folder}/name", f"{name}\n")
            put(computer, f"{folder}/latency", f"{latency}\n")
            put(computer, f"{folder}/disable", f"{int(latency > 50)}\n")
    put(computer, "/etc/ocmm/bus.env", "OCMM_INTERFACE=enp3s0\n")
    put(computer, f"{ADAPTER}/operstate", "up\n")
    put(computer, f"{ADAPTER}/speed", "100\n")
    put(computer, f"{ADAPTER}/mtu", "9000\n")
    put(computer, "/proc/sys/net/core/rmem_max", "16777216\n")
    put(
        computer, HOME / ".config/ocmm/settings.toml",
        'schema = "ocmm.settings/1"\n\n[instrument]\nsource = "genicam:1,2"\n',
    )  # fmt: skip
    put(computer, "/proc/net/route", f"{_ROUTE}eno1{DEFAULT_ROUTE}")
    for irq in (40, 41):
        put(computer, f"{ADAPTER}/device/msi_irqs/{irq}", "msix\n")
        put(computer, f"/proc/irq/{irq}/smp_affinity_list", "0-2\n")
    for name, value in (("rx-usecs", "0"), ("tx-usecs", "0"), ("gro", "off")):
        put(computer, f"{SETTINGS}/{name}", f"{value}\n")
    put(computer, f"{SETTINGS}/pause", "off\n")
    put(computer, f"{SETTINGS}/eee", "disabled\n")
    put(computer, f"{ADAPTER}/duplex", "full\n")
    for name in ("adaptive-rx", "adaptive-tx"):
        put(computer, f"{SETTINGS}/{name}", "off\n")
    put(computer, "/usr/sbin/ethtool", _ETHTOOL).chmod(0o755)
    put(computer, "/usr/bin/paplay", "#!/bin/sh\n").chmod(0o755)
    put(computer, "/etc/group", "root:x:0:\nocmm:x:990:anna,berta\nanna:x:1000:\n")
    put(computer, "/proc/self/status", "Name:\tocmm\nGroups:\t990 1000 \nSeccomp:\t0\n")
    put(computer, "/proc/self/limits", LIMITS.format("unlimited"))
    put(computer, PROGRAM.with_name("ocmm-acq-python"), "").chmod(0o750)
    zone = put(computer, "/usr/share/zoneinfo/Europe/Berlin", b"TZif2")
    computer.place("/etc/localtime").symlink_to(zone)
    put(computer, "/sys/class/rtc/rtc0/since_epoch", f"{int(NOW.timestamp())}\n")
    put(computer, "/proc/self/mounts", "/dev/sda1 / ext4 rw 0 0\ntmpfs /tmp tmpfs rw 0 0\n")
    computer.place(HOME / "jobs").mkdir(parents=True)
    put(computer, "/sys/class/drm/card0-HDMI-A-1/status", "connected\n")
    put(computer, "/sys/class/drm/card0-HDMI-A-1/modes", "1920x1080\n1280x720\n")
    put(computer, "/sys/class/drm/card0-DP-1/status", "disconnected\n")
    put(computer, "/sys/class/drm/version", "drm 1.1.0 20060810\n")
    put(computer, "/proc/asound/cards", " 0 [PCH    ]: HDA-Intel - HDA Intel PCH\n")
    put_record(computer, timedelta(days=300), timedelta(days=200))
    put(computer, DATA / "keys/station.key", "-----BEGIN PRIVATE KEY-----\n").chmod(0o600)
    computer.place(DATA / "keys").chmod(0o700)
    seen = KnownEnd(
        name="folder x", count=3, link="a" * 64, utc=(NOW - timedelta(days=1)).isoformat()
    )
    put(computer, STATE / "histories" / "0.json", msgspec.json.encode(seen))
    return computer
