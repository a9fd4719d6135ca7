from __future__ import annotations

from datetime import UTC, datetime, timedelta

import msgspec

from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.seals import KnownEnd

SET_BACK = timedelta(seconds=60)
"""As in the records: a clock set back further is not trusted."""
_OFF_S = 60
"""Difference to the hardware clock, which runs while the system is off; a drift of 20 ppm is 12 s a
week."""
_RTC = "/sys/class/rtc/rtc0/since_epoch"
_MOST_MEMORIES = 1000


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
    for name in names[:_MOST_MEMORIES]:
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
