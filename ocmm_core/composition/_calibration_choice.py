"""Calibration and probe records of a frame source, and their status before a job."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from ocmm_core.calibration.records import (
    PRACTICE,
    Blocker,
    CalibrationInUse,
    CalibrationStatus,
    CalibrationView,
    ProbeInUse,
    ProbeView,
    default_folder,
    default_probe_folder,
    is_practice,
    judge,
    open_calibration,
    open_design,
    open_probe,
    open_probe_design,
)
from ocmm_core.composition._sources import Origin, origin_of, virtual_names
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.settings import Settings


def choose_calibration(
    source: str, rig: Path, folder: Path | None, *, uncalibrated: bool
) -> CalibrationInUse:
    """Return the calibration of a source: the rig document or a stored record.

    `folder`: calibration store; None is this user's store for real cameras and the rig document for
    virtual ones. `uncalibrated`: accept points whatever the state of the calibration. InputError:
    the source is unknown or the rig document is invalid.
    """
    if folder is None and is_real(source):
        folder = default_folder()
    if folder is None:
        return open_design(rig, uncalibrated=uncalibrated)
    opened = open_calibration(rig, folder, uncalibrated=uncalibrated)
    return without_practice(opened) if is_real(source) else opened


def choose_probe(
    source: str, probe: Path, folder: Path | None, tip: str | None, *, uncalibrated: bool
) -> ProbeInUse:
    """Return the probe of a source: its document or the records of its tip.

    `folder`: records; None: this user's for real cameras, else the document. `tip`: mounted; None:
    by the records. `uncalibrated`: whatever the state of the tip. InputError: unknown source,
    invalid document, or a tip without records.
    """
    if folder is None and is_real(source):
        folder = default_probe_folder()
    if folder is not None:
        opened = open_probe(probe, folder, tip, uncalibrated=uncalibrated)
        return probe_without_practice(opened) if is_real(source) else opened
    if tip is not None:
        raise InputError(
            "probe.tip",
            f"Tip {tip!r} is requested, but a virtual probe uses its document.",
            "Choose a folder of tip records, or no tip (Settings, Instrument).",
        )
    return open_probe_design(probe, uncalibrated=uncalibrated)


def is_real(source: str) -> bool:
    """Return whether frames come from real cameras; InputError for unknown sources."""
    return origin_of(source) is Origin.CAMERAS


def checked_for_replay(calibration: CalibrationInUse, recorded: str) -> CalibrationInUse:
    """Return the calibration, faulty if a document for recorded real cameras."""
    if not _is_recorded_real(recorded):
        return calibration
    calibration = without_practice(calibration)
    if calibration.record is not None or calibration.fault is not None:
        return calibration
    why = Blocker(
        (
            f"The recording is from real cameras ({recorded}), and a rig document is not a "
            "calibration."
        ),
        "Choose the folder of their camera records (Settings, Instrument).",
    )
    return replace(calibration, fault=(CalibrationStatus.NONE, why))


def checked_probe_for_replay(probe: ProbeInUse, recorded: str) -> ProbeInUse:
    """Return the probe, faulty if a real probe was recorded and it is a document."""
    if not _is_recorded_real(recorded):
        return probe
    probe = probe_without_practice(probe)
    if probe.records is not None or probe.fault is not None:
        return probe
    why = Blocker(
        (
            f"The recording is from a real probe ({recorded}), and a probe document is not a "
            "calibration."
        ),
        "Choose the folder of its tip records (Settings, Instrument).",
    )
    return replace(probe, fault=(CalibrationStatus.NONE, why))


def without_practice(in_use: CalibrationInUse) -> CalibrationInUse:
    """Return the calibration, faulty if it was made in practice."""
    record = in_use.record
    if record is None or not is_practice(record.made_by):
        return in_use
    why = Blocker(
        f"The calibration of rig '{record.rig}' was made in {PRACTICE}, with a virtual hand.",
        "Choose the folder of real camera records (Settings, Instrument), or calibrate.",
    )
    return replace(in_use, fault=(CalibrationStatus.UNUSABLE, why))


def probe_without_practice(in_use: ProbeInUse) -> ProbeInUse:
    """Return the probe, faulty if a record of its tip was made in practice."""
    records = in_use.records
    if records is None:
        return in_use
    signed = [records.calibration.made_by]
    if records.qualification is not None:
        signed.append(records.qualification.made_by)
    if not any(map(is_practice, signed)):
        return in_use
    why = Blocker(
        f"Tip '{in_use.tip}' was calibrated or qualified in {PRACTICE}, with a virtual hand.",
        "Choose the folder of real tip records (Settings, Instrument), or calibrate the probe.",
    )
    return replace(in_use, fault=(CalibrationStatus.UNUSABLE, why))


def _is_recorded_real(recorded: str) -> bool:
    return bool(recorded) and not recorded.startswith(virtual_names())


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


def station_state(settings: Settings) -> StationState:
    """Return status of cameras and tip from records, without cameras; errors become lines."""
    now = datetime.now(UTC)
    source = settings.instrument_source
    try:
        simulated = origin_of(source) is Origin.VIRTUAL
    except OcmmError as error:
        return StationState(False, (_fault("Cameras", error),))
    lines = []
    try:
        chosen = choose_calibration(
            source, settings.instrument_rig, settings.instrument_calibrations, uncalibrated=False
        )
        cameras = judge(chosen, now)
        due = "" if cameras.record is None else cameras.record.valid_until_utc
        if chosen.rig.markers is None:
            lines.append(_line("Cameras", f"Camera rig {cameras.rig}.", cameras, due, now))
        else:
            lines.append(_line("Tracker", f"Tracker {cameras.rig}.", cameras, due, now))
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
