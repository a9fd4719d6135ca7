"""Result of a check: a light, a sentence, and the remedy.

Remedies change kernel files, settings files and adapter settings reversibly. Previous values are
stored on disk before any change; undo runs from last to first. Changes are limited to a few kinds
and places, so that a tampered file of changes cannot cause other writes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import msgspec

UNDO_FILE = "/var/lib/ocmm/doctor-undo.json"
LIMITS = "/etc/security/limits.d/90-ocmm.conf"
"""Login limits (pam_limits(8))."""


class ChangeKind(StrEnum):
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
    def summary(self) -> str:
        if self.kind is ChangeKind.NEW_FILE:
            return f"make {self.place}: {' / '.join(self.after.splitlines())}"
        name = f"ethtool {self.place}" if self.kind is ChangeKind.ADAPTER else self.place
        return f"{name}: {self.before} -> {self.after}"


_PLACES = {
    ChangeKind.KERNEL_FILE: re.compile(
        r"/sys/devices/system/cpu/cpu\d{1,4}/"
        r"(?:cpufreq/scaling_governor|cpuidle/state\d{1,2}/disable)"
        r"|/proc/irq/\d{1,6}/smp_affinity_list|/proc/sys/net/core/rmem_max"
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


SCHEMA = "ocmm.station-doctor/1"


class Light(StrEnum):
    """Status of a check."""

    GREEN = "GREEN"
    AMBER = "AMBER"
    """The station measures, but cycles can be late, or something expires soon."""
    RED = "RED"
    """The station cannot measure, or results are not stored, proven or protected."""
    NOT_CHECKED = "NOT CHECKED"
    """Could not be determined. Never counts as GREEN."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of a check."""

    light: Light
    what: str
    """One sentence with the value found."""
    code: str = ""
    """Stable identifier of the fault, such as ``"governor.slow"``; empty if none."""
    remedy: str = ""
    """One sentence; empty if no action is needed."""
    changes: tuple[SystemChange, ...] = ()
    """Riskless changes that repair it; may be empty."""
    figures: Mapping[str, float] = field(default_factory=dict)
    """Measured values, by name with unit."""


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One line of the report; see `Answer`."""

    name: str
    title: str
    """`name`, `title`: of the check, for programs and for people."""
    light: Light
    code: str
    what: str
    remedy: str
    fixable: bool
    """``ocmm station doctor --fix`` can repair it."""
    figures: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class DoctorReport:
    """All lines, as written with ``--json``."""

    schema: str
    utc: str
    """Time of the check, ISO 8601 text."""
    software: str
    light: Light
    """The worst of all; NOT CHECKED counts as AMBER."""
    results: tuple[CheckResult, ...]

    def having(self, light: Light) -> tuple[CheckResult, ...]:
        """Return the lines with a light."""
        return tuple(one for one in self.results if one.light is light)


def green(what: str, /, **figures: float) -> Answer:
    return Answer(Light.GREEN, what, figures=figures)


def amber(
    code: str, what: str, remedy: str, changes: tuple[SystemChange, ...] = (), /, **figures: float
) -> Answer:
    """Return an AMBER answer: usable with limitations."""
    return Answer(Light.AMBER, what, code, remedy, changes, figures)


def red(code: str, what: str, remedy: str, /, **figures: float) -> Answer:
    """Return a RED answer: not usable or not safe."""
    return Answer(Light.RED, what, code, remedy, (), figures)


def worst_of(results: tuple[CheckResult, ...]) -> Light:
    """Return the light of a whole computer."""
    lights = {one.light for one in results}
    if Light.RED in lights:
        return Light.RED
    return Light.AMBER if lights & {Light.AMBER, Light.NOT_CHECKED} else Light.GREEN
