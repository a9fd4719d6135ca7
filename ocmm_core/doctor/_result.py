"""Result of a check: a light, a sentence, and the remedy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from ocmm_core.doctor._changes import SystemChange

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
