"""Options of guided procedures, as parameters of commands."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Setup:
    """Options of every guided procedure: frames, records, operator and decision."""

    source: str
    rig: Path
    calibrations: Path | None
    who: str
    temperature: float | None
    temperature_u: str
    decision: bool | None
    new: bool
    seed: int
    speed: float
    record: Path | None
    force: bool


@dataclass(frozen=True, slots=True)
class ProbeChoice:
    """Options that choose a probe with its records."""

    probe: Path
    probes: Path | None
    tip: str | None


@dataclass(frozen=True, slots=True)
class CameraSetup(Setup):
    """Options of procedures about the cameras."""

    move: int | None


@dataclass(frozen=True, slots=True)
class ProbeSetup(Setup):
    """Options of procedures about a probe and its tips."""

    scene: str
    probe: Path
    probes: Path | None
    uncalibrated: bool
