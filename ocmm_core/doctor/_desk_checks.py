from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.seals import KnownEnd
from ocmm_core.settings import SETTINGS_NAME, SettingsFile

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
        if not computer.has(f"{folder}/status") or not computer.has(f"{folder}/modes"):
            continue
        if computer.text(f"{folder}/status") != "connected":
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


def settings(computer: Computer) -> Answer:
    """Return whether root, as whom commands with sudo run, has the settings of the station."""
    root = Path("~root/.config/ocmm").expanduser()
    found = computer.environment.get("XDG_CONFIG_DIRS") or "/etc/xdg"
    station = Path(found.partition(":")[0], "ocmm")
    config = computer.environment.get("XDG_CONFIG_HOME") or computer.home / ".config"
    own = root if computer.uid == 0 else Path(config, "ocmm")
    if not computer.has(root / SETTINGS_NAME):
        return green("Root has no settings of its own.")
    # NotAskedError if this user cannot read it.
    computer.text(root / SETTINGS_NAME)
    below, mine, of_root = (
        SettingsFile(computer.place(folder / SETTINGS_NAME)).read().values
        for folder in (station, own, root)
    )
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
