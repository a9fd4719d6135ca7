"""Status of cameras and tip before a job, in words."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from ocmm_core.calibration.records import CalibrationView, ProbeView, judge
from ocmm_core.composition._calibration_choice import choose_calibration, choose_probe
from ocmm_core.composition._sources import Origin, origin_of
from ocmm_core.errors import OcmmError
from ocmm_core.settings import Settings

_SOON = timedelta(days=7)


@dataclass(frozen=True, slots=True)
class StateLine:
    """Status of cameras or tip."""

    what: str
    word: str
    sentence: str
    due_utc: str
    """Expiry, ISO 8601; empty if it does not expire."""
    usable: bool
    soon: bool = False
    """`usable`, `soon`: points can be recorded; expires within a week."""


@dataclass(frozen=True, slots=True)
class StationState:
    """Status lines, and whether the cameras are simulated."""

    simulated: bool
    lines: tuple[StateLine, ...]


def station_state(settings: Settings, now: datetime | None = None) -> StationState:
    """Return status of cameras and tip from records, without cameras; errors become lines."""
    now = now or datetime.now(UTC)
    source = settings.instrument_source
    try:
        simulated = origin_of(source) is Origin.VIRTUAL
    except OcmmError as error:
        return StationState(False, (_fault("Cameras", error),))
    lines = []
    try:
        cameras = judge(
            choose_calibration(
                source,
                settings.instrument_rig,
                settings.instrument_calibrations,
                uncalibrated=False,
            ),
            now,
        )
        lines.append(_cameras(cameras, now))
    except OcmmError as error:
        lines.append(_fault("Cameras", error))
    try:
        tip = judge(
            choose_probe(
                source,
                settings.instrument_probe,
                settings.instrument_probes,
                settings.instrument_tip,
                uncalibrated=False,
            ),
            now,
        )
        lines.append(_line("Tip", f"Probe {tip.title}.", tip, tip.due_utc, now))
    except OcmmError as error:
        lines.append(_fault("Tip", error))
    return StationState(simulated, tuple(lines))


def _cameras(view: CalibrationView, now: datetime) -> StateLine:
    due = "" if view.record is None else view.record.valid_until_utc
    return _line("Cameras", f"Camera rig {view.rig}.", view, due, now)


def _line(
    what: str, name: str, view: CalibrationView | ProbeView, due: str, now: datetime
) -> StateLine:
    told = [name]
    if view.blocker is not None:
        told.append(str(view.blocker))
    told += view.warnings
    soon = bool(due) and datetime.fromisoformat(due) - now < _SOON
    return StateLine(what, view.word.value, " ".join(told), due, view.blocker is None, soon)


def _fault(what: str, error: OcmmError) -> StateLine:
    return StateLine(what, "UNUSABLE", f"{error.what} {error.remedy}", "", False)
