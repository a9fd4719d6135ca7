"""Reversible changes of kernel files, settings files and adapter settings.

Previous values are stored on disk before any change; undo runs from last to first. Changes are
limited to a few kinds and places, so that a tampered file of changes cannot cause other writes.
"""

from __future__ import annotations

import re
from enum import StrEnum

import msgspec

UNDO_FILE = "/var/lib/ocmm/doctor-undo.json"
LIMITS = "/etc/security/limits.d/90-ocmm.conf"
"""Login limits (pam_limits(8))."""


class ChangeKind(StrEnum):
    """Kind of a change."""

    KERNEL_FILE = "kernel file"
    """A value below /sys or /proc; lost at the next boot."""
    NEW_FILE = "new file"
    """A settings file that does not exist yet."""
    ADAPTER = "adapter"
    """A setting of ethtool(8); lost at the next boot."""


class SystemChange(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    kind: ChangeKind
    place: str
    """Path, or for an adapter ``INTERFACE OPTION NAME`` in ethtool syntax."""
    before: str
    after: str
    """`before`, `after`: current and new content; ``before`` of a new file is empty."""

    @property
    def words(self) -> str:
        if self.kind is ChangeKind.NEW_FILE:
            return f"make {self.place}: {' / '.join(self.after.splitlines())}"
        name = f"ethtool {self.place}" if self.kind is ChangeKind.ADAPTER else self.place
        return f"{name}: {self.before} -> {self.after}"


_PLACES = {
    ChangeKind.KERNEL_FILE: re.compile(
        r"/sys/devices/system/cpu/cpu\d{1,4}/"
        r"(?:cpufreq/scaling_governor|cpuidle/state\d{1,2}/disable)"
        r"|/proc/irq/\d{1,6}/smp_affinity_list"
    ),
    ChangeKind.NEW_FILE: re.compile(re.escape(LIMITS)),
    ChangeKind.ADAPTER: re.compile(
        r"[A-Za-z0-9_.-]{1,15} (?:-C (?:rx-usecs|tx-usecs|adaptive-rx|adaptive-tx)|-K (?:gro|lro))"
    ),
}
_VALUES = {
    ChangeKind.KERNEL_FILE: re.compile(r"[a-z_0-9,-]{1,200}"),
    ChangeKind.NEW_FILE: re.compile(r"[@a-z\d\s_-]{0,400}"),
    ChangeKind.ADAPTER: re.compile(r"on|off|\d{1,7}"),
}


def kernel_file(place: str, before: str, after: str) -> SystemChange:
    """Return the change of a value below /sys or /proc."""
    return SystemChange(kind=ChangeKind.KERNEL_FILE, place=place, before=before, after=after)


def is_allowed(change: SystemChange) -> bool:
    """Return whether a change is one that checks may request."""
    values = (change.after, change.before or change.after)
    return _PLACES[change.kind].fullmatch(change.place) is not None and all(
        _VALUES[change.kind].fullmatch(value) for value in values
    )
