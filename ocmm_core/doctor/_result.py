"""What a check of the computer says: a light, a sentence, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from ocmm_core.doctor._changes import SystemChange

SCHEMA = "ocmm.station-doctor/1"


class Light(StrEnum):
    """How something stands."""

    GREEN = "GREEN"
    """As it should be."""
    AMBER = "AMBER"
    """The station measures, but cycles can come late, or something ends soon."""
    RED = "RED"
    """The station cannot measure, or what it measures is not kept, proven or protected."""
    NOT_CHECKED = "NOT CHECKED"
    """This computer did not tell; never taken for GREEN."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What a check found."""

    light: Light
    what: str
    """One sentence: what was found, with its number."""
    code: str = ""
    """Stable identifier of the fault, e.g. ``"governor.slow"``; empty where there is none."""
    remedy: str = ""
    """One sentence: what to do; empty where nothing is to be done."""
    changes: tuple[SystemChange, ...] = ()
    """What would put it right without any risk; may be empty."""
    figures: Mapping[str, float] = field(default_factory=dict)
    """What was measured, by name with its unit."""


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One line of the report; see `Answer`."""

    name: str
    title: str
    """`name`, `title`: Of the check: for programs, and for people."""
    light: Light
    code: str
    what: str
    remedy: str
    fixable: bool
    """``ocmm station doctor --fix`` can put it right."""
    figures: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class DoctorReport:
    """All lines, as they are written with ``--json``."""

    schema: str
    """`SCHEMA`."""
    utc: str
    """When it was asked, ISO 8601 text."""
    software: str
    """Version of OCMM."""
    light: Light
    """The worst of all; NOT CHECKED counts as AMBER, because nobody knows."""
    results: tuple[CheckResult, ...]
    """In the order of the registry."""

    def having(self, light: Light) -> tuple[CheckResult, ...]:
        """Return the lines with a light."""
        return tuple(one for one in self.results if one.light is light)


def green(what: str, /, **figures: float) -> Answer:
    """Return that something is as it should be."""
    return Answer(Light.GREEN, what, figures=figures)


def amber(
    code: str, what: str, remedy: str, changes: tuple[SystemChange, ...] = (), /, **figures: float
) -> Answer:
    """Return that the station measures, but not as well as it could."""
    return Answer(Light.AMBER, what, code, remedy, changes, figures)


def red(code: str, what: str, remedy: str, /, **figures: float) -> Answer:
    """Return that the station cannot measure, or what it measures is not safe."""
    return Answer(Light.RED, what, code, remedy, (), figures)


def worst_of(results: tuple[CheckResult, ...]) -> Light:
    """Return the light of a whole computer."""
    lights = {one.light for one in results}
    if Light.RED in lights:
        return Light.RED
    return Light.AMBER if lights & {Light.AMBER, Light.NOT_CHECKED} else Light.GREEN
