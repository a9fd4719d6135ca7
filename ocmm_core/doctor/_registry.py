"""All checks of the computer in order, one entry each; those of the desk itself."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from ocmm_core.build import build_version
from ocmm_core.doctor import _adapter_checks as on_adapter
from ocmm_core.doctor import _disk_checks as on_disk
from ocmm_core.doctor import _kernel_checks as in_kernel
from ocmm_core.doctor import _result as result
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.failure import contained
from ocmm_core.seals import KnownEnd
from ocmm_core.settings import SETTINGS_NAME, SettingsFile, Value

SET_BACK = timedelta(seconds=60)
"""As in the records: a clock set back further is not trusted."""
_OFF_S = 60
"""Difference to the hardware clock, which runs while the system is off; a drift of 20 ppm is 12 s a
week."""
_RTC = "/sys/class/rtc/rtc0/since_epoch"


def clock(computer: Computer) -> Answer:
    """Return whether the clock is right, as far as can be determined."""
    now = computer.calls.now()
    seen = _last_seen(computer)
    if seen is not None and now < seen - SET_BACK:
        return red(
            "clock.set_back",
            f"The clock was set back: it is {_minute(now)} UTC, and this station has records of "
            f"{_minute(seen)} UTC.",
            "Set the clock: timedatectl set-ntp true, or timedatectl set-time.",
        )
    synchronised = computer.calls.synchronised()
    if synchronised:
        return green(f"{_minute(now)} UTC, synchronised.")
    off = _off_board_s(computer, now)
    if off is not None and abs(off) > _OFF_S:
        return red(
            "clock.off",
            f"The clock is not synchronised, and {abs(off):.0f} s "
            f"{'ahead of' if off > 0 else 'behind'} the one on the board.",
            "Set the clock, then synchronise it: timedatectl set-ntp true",
        )
    if synchronised is None:
        raise NotAskedError("The kernel does not say whether the clock is synchronised.")
    return amber(
        "clock.not_synchronised",
        f"The clock ({_minute(now)} UTC) is not synchronised; due dates rest on it.",
        "Synchronise it: timedatectl set-ntp true, with a time server that the station reaches.",
    )


def time_zone(computer: Computer) -> Answer:
    """Return whether times are shown in a local time zone."""
    variable = computer.environment.get("TZ", "").lstrip(":")
    if variable:
        return green(f"{variable} (variable TZ).")
    if not computer.has("/etc/localtime"):
        return amber(
            "time_zone.missing",
            "No time zone is set: times are shown in UTC.",
            "Set it: timedatectl set-timezone Europe/Berlin",
        )
    target = computer.link("/etc/localtime")
    if not target:
        return green("Set, without a name.")
    return green(f"{target.partition('zoneinfo/')[2] or target}.")


def _last_seen(computer: Computer) -> datetime | None:
    """Return the latest time in the seals' memory, or None."""
    folder = computer.state / "histories"
    if not computer.has(folder):
        return None
    latest = None
    names = [one for one in computer.names(folder) if one.endswith(".json")]
    for name in names:
        # The seals also ignore damaged ones and trust the others.
        try:
            seen = msgspec.json.decode(computer.text(folder / name), type=KnownEnd)
            when = datetime.fromisoformat(seen.utc) if seen.utc else None
        except (NotAskedError, msgspec.DecodeError, ValueError, RecursionError):
            continue
        if when is not None:
            when = when if when.tzinfo else when.replace(tzinfo=UTC)
            latest = when if latest is None else max(latest, when)
    return latest


def _off_board_s(computer: Computer, now: datetime) -> float | None:
    """Return the lead over the hardware clock, s; None if unknown."""
    if not computer.has(_RTC):
        return None
    # A hardware clock in local time differs by the time zone.
    if computer.has("/etc/adjtime") and "LOCAL" in computer.text("/etc/adjtime"):
        return None
    return now.timestamp() - computer.number(_RTC)


def _minute(when: datetime) -> str:
    return f"{when.astimezone(UTC):%Y-%m-%d %H:%M}"


SMALLEST = (1024, 640)
"""Minimum size of the window (`ocmm_gui.window`), px."""
ROOMY = (1280, 720)
"""From this size digits readable from three metres fit next to the plan."""
_DRM = "/sys/class/drm"
_PLAYERS = ("paplay", "pw-play", "aplay")
"""Sound players used by the window (`ocmm_gui.kit`)."""
_LARGEST_SCALE = 8.0


def screen(computer: Computer) -> Answer:
    """Return whether the window fits on the scaled screen."""
    modes = _modes(computer) if computer.has(_DRM) else []
    if not modes:
        raise NotAskedError(
            "The kernel shows no connected screen.", "Run this at the station with its screen on."
        )
    scale, source = _scale(computer)
    width, height = max(modes)
    wide, high = int(width / scale), int(height / scale)
    shown = f"{width} x {height}, scale {scale:g}{source}"
    if wide < SMALLEST[0] or high < SMALLEST[1]:
        return red(
            "screen.small",
            f"The screen is too small for the window: {shown}; {SMALLEST[0]} x {SMALLEST[1]} "
            "are needed.",
            "Use a larger screen, or a smaller scale.",
        )
    if wide < ROOMY[0] or high < ROOMY[1]:
        return amber(
            "screen.narrow",
            f"The screen is small: {shown}.",
            f"Use {ROOMY[0]} x {ROOMY[1]} or more, so that digits can be read from afar.",
        )
    return green(f"{shown}.")


def sound(computer: Computer) -> Answer:
    """Return whether the tones of touches can be played."""
    players = [one for one in _PLAYERS if computer.tool(one)]
    if not players:
        return amber(
            "sound.no_player",
            "No program that plays sounds: touches are shown, not heard.",
            "Install one: apt install pulseaudio-utils",
        )
    if not computer.has("/proc/asound/cards"):
        cards = "no soundcards"
    else:
        cards = computer.text("/proc/asound/cards")
    if "no soundcards" in cards:
        return amber(
            "sound.no_card",
            "The computer has no sound card: touches are shown, not heard.",
            "Connect a loudspeaker, e.g. by USB or in the screen.",
        )
    return green(f"{players[0]}, with a sound card.")


def _modes(computer: Computer) -> list[tuple[int, int]]:
    """Return width and height of the preferred mode of each connected screen, px."""
    found = []
    for name in computer.names(_DRM):
        folder = f"{_DRM}/{name}"
        named = computer.has(f"{folder}/status") and computer.has(f"{folder}/modes")
        if not named or computer.text(f"{folder}/status") != "connected":
            continue
        # The kernel lists the preferred mode first.
        mode = re.match(r"(\d{2,5})x(\d{2,5})", computer.text(f"{folder}/modes"))
        if mode is None:
            raise NotAskedError(f"The screen at {name} does not say how many points it has.")
        found.append((int(mode[1]), int(mode[2])))
    return found


def _scale(computer: Computer) -> tuple[float, str]:
    """Return the screen scale factor and its source."""
    variable = computer.environment.get("QT_SCALE_FACTOR", "")
    if variable:
        return _factor(variable, "the variable QT_SCALE_FACTOR"), " (QT_SCALE_FACTOR)"
    settings = computer.home / ".config/monitors.xml"
    if computer.has(settings):
        found = re.findall(r"<scale>([^<]*)</scale>", computer.text(settings))
        if found:
            return max(_factor(one, str(settings)) for one in found), " (desktop)"
    return 1.0, ""


def _factor(text: str, where: str) -> float:
    if not re.fullmatch(r"\d{1,2}(?:\.\d{1,20})?", text) or not 0 < float(text) <= _LARGEST_SCALE:
        raise NotAskedError(f"{where} holds no scale.")
    return float(text)


def _settings_folders(computer: Computer) -> tuple[Path, Path, Path]:
    """Return the folders of the settings of the station, of this user, and of root."""
    root = Path("~root/.config/ocmm").expanduser()
    found = computer.environment.get("XDG_CONFIG_DIRS") or "/etc/xdg"
    config = computer.environment.get("XDG_CONFIG_HOME") or computer.home / ".config"
    own = root if computer.uid == 0 else Path(config, "ocmm")
    return Path(found.partition(":")[0], "ocmm"), own, root


def _values(computer: Computer, folder: Path) -> dict[str, Value]:
    return dict(SettingsFile(computer.place(folder / SETTINGS_NAME)).read().values)


def images(computer: Computer) -> Answer:
    """Return whether the computer takes the images of the industrial cameras of its settings."""
    station, own, _ = _settings_folders(computer)
    source = {**_values(computer, station), **_values(computer, own)}.get("instrument.source", "")
    if not str(source).startswith("genicam:"):
        return green("The settings name no industrial cameras.")
    return on_adapter.image_network(computer)


def settings(computer: Computer) -> Answer:
    """Return whether root, as whom commands with sudo run, has the settings of the station."""
    station, own, root = _settings_folders(computer)
    if not computer.has(root / SETTINGS_NAME):
        return green("Root has no settings of its own.")
    # NotAskedError if this user cannot read it.
    computer.text(root / SETTINGS_NAME)
    below, mine, of_root = (_values(computer, folder) for folder in (station, own, root))
    mine = {**below, **({} if own == root else mine)}
    different = sorted(key for key, value in of_root.items() if mine.get(key) != value)
    if not different:
        return green("Those of root are the same.")
    return amber(
        "settings.of_root",
        f"Root has other settings than this station: {', '.join(different)}. Commands with sudo "
        "use them.",
        f"Set them with ocmm settings set --station, then remove {root / SETTINGS_NAME}.",
    )


Check = Callable[[Computer], result.Answer]


@dataclass(frozen=True, slots=True)
class CheckSpec:
    name: str
    title: str
    """`name`, `title`: for programs, and for people."""
    about: str
    check: Check
    """Raises `NotAskedError` if it cannot be determined."""


CHECKS = (
    CheckSpec(
        "program",
        "Version",
        "versions of the program files and of the installation agree",
        on_disk.program,
    ),
    CheckSpec("kernel", "Kernel", "PREEMPT_RT", in_kernel.kernel),
    CheckSpec(
        "cores",
        "Processor for the bus",
        "`isolcpus` and `nohz_full` of a processor, and that the service runs on it",
        in_kernel.cores,
    ),
    CheckSpec("governor", "Clock governor", "`performance` on every processor", in_kernel.governor),
    CheckSpec("idle", "Idle states", "no C-state with more than 50 us to wake up", in_kernel.idle),
    CheckSpec(
        "adapter",
        "Camera adapter",
        "there, connected, full duplex, at most 1 Gbit/s, no address, no USB, pause frames or EEE",
        on_adapter.adapter,
    ),
    CheckSpec(
        "interrupts",
        "Adapter interrupts",
        "none of its interrupts on the processor of the bus",
        on_adapter.interrupts,
    ),
    CheckSpec(
        "coalescing",
        "Adapter coalescing",
        "`rx-usecs`, `tx-usecs` and adaptive modes off (ethtool)",
        on_adapter.coalescing,
    ),
    CheckSpec("offloads", "Adapter offloads", "`gro` and `lro` off (ethtool)", on_adapter.offloads),
    CheckSpec(
        "images",
        "Images of industrial cameras",
        "receive buffers of 4 MB or more, jumbo frames (MTU 9000) on adapters in use",
        images,
    ),
    CheckSpec("group", "Group", "the user is in the group `ocmm`", in_kernel.group),
    CheckSpec(
        "rights",
        "Rights of the bus",
        "of the service or of `ocmm-acq-python`, which nobody but root can change",
        in_kernel.rights,
    ),
    CheckSpec("memory", "Memory lock", "all memory can be locked", in_kernel.memory),
    CheckSpec(
        "clock",
        "Clock",
        "synchronised; not before what the station remembers; near the clock of the board",
        clock,
    ),
    CheckSpec("time_zone", "Time zone", "set", time_zone),
    CheckSpec(
        "disk",
        "Disk",
        "5 GiB and files free (RED below 0.5 GiB), writable, of jobs and of records",
        on_disk.disk,
    ),
    CheckSpec(
        "sync",
        "Disk latency",
        "95 % of points on the disk within 25 ms (RED above 100 ms); a disk, not memory",
        on_disk.sync,
    ),
    CheckSpec("screen", "Screen", "1280 x 720 after scaling (RED below 1024 x 640)", screen),
    CheckSpec("sound", "Sound", "a player and a sound card", sound),
    CheckSpec(
        "calibrations",
        "Calibrations",
        "those made last have not expired, nor will in 14 days",
        on_disk.calibrations,
    ),
    CheckSpec(
        "certificates",
        "Certificates",
        "the same of the artefacts that they rest on",
        on_disk.certificates,
    ),
    CheckSpec(
        "key",
        "Station key",
        "present, mode 0600, in a folder that only its user can change",
        on_disk.key,
    ),
    CheckSpec("settings", "Settings", "root has no other settings than the station", settings),
)


def examine(
    computer: Computer,
    more: Iterable[CheckSpec] = (),
    told: Callable[[str, float], None] = lambda title, share: None,
) -> tuple[result.DoctorReport, tuple[result.SystemChange, ...]]:
    """Return the report of a computer, and all changes that repair faults.

    ``more`` are measured checks; ``told`` gets each title beforehand, and the share done.
    """
    results: list[result.CheckResult] = []
    changes: list[result.SystemChange] = []
    everything = (*CHECKS, *more)
    for number, spec in enumerate(everything):
        told(spec.title, number / len(everything))
        answer = _asked(spec, computer)
        changes += answer.changes
        results.append(
            result.CheckResult(
                spec.name, spec.title, answer.light, answer.code, answer.what, answer.remedy,
                bool(answer.changes), answer.figures,
            )
        )  # fmt: skip
    utc = computer.calls.now().astimezone(UTC).isoformat(timespec="seconds")
    found = tuple(results)
    return result.DoctorReport(
        result.SCHEMA, utc, build_version(), result.worst_of(found), found
    ), tuple(changes)


def _asked(spec: CheckSpec, computer: Computer) -> result.Answer:
    """Return the answer of a check; NOT CHECKED if it fails."""
    try:
        return spec.check(computer)
    except NotAskedError as error:
        return result.Answer(result.Light.NOT_CHECKED, error.what, error.code, error.remedy)
    except Exception as error:
        # An unexpected error in one check must not stop the others.
        told = contained(error, f"The check '{spec.title}'")
        return result.Answer(result.Light.NOT_CHECKED, told.what, told.code, told.remedy)
