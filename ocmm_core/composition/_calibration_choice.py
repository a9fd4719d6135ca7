"""Which calibration and which records of a probe belong to a source of frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ocmm_core.calibration.records import (
    PRACTICE,
    Blocker,
    CalibrationInUse,
    CalibrationStatus,
    ProbeInUse,
    default_folder,
    default_probe_folder,
    is_practice,
    open_calibration,
    open_design,
    open_probe,
    open_probe_design,
)
from ocmm_core.composition._sources import VIRTUAL_NAMES, Origin, origin_of
from ocmm_core.errors import InputError


def choose_calibration(
    source: str, rig: Path, folder: Path | None, *, uncalibrated: bool
) -> CalibrationInUse:
    """Return what a source is measured with: the rig document, or a record of its store.

    Parameters
    ----------
    folder
        Of calibrations; None is that of this user for real cameras, and the rig document itself
        for virtual ones.
    uncalibrated
        Points are taken whatever is the matter with the calibration.

    Raises
    ------
    InputError
        There is no such source, or the rig document cannot be used.
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
    """Return the probe that a source is measured with: its document, or records of its tip.

    Parameters
    ----------
    folder
        Of records of probes; None is that of this user for real cameras, and the document itself
        for virtual ones.
    tip
        Name of the tip that is on the probe; None for the one that its records say.
    uncalibrated
        Points are taken whatever is the matter with the tip.

    Raises
    ------
    InputError
        There is no such source, the probe document cannot be used, or a tip is named without
        records.
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
    """Return whether frames come from real cameras; raise InputError for no source."""
    return origin_of(source) is Origin.CAMERAS


def checked_for_replay(calibration: CalibrationInUse, recorded: str) -> CalibrationInUse:
    """Return the calibration, at fault where a rig document stands for recorded real cameras.

    Parameters
    ----------
    calibration
        What the replay would be measured with.
    recorded
        Name of the source that was recorded; empty where nothing is replayed.
    """
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
    """Return the probe, at fault where a document stands for a real probe that was recorded."""
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
    """Return the calibration, at fault where it was made in practice: for real cameras."""
    record = in_use.record
    if record is None or not is_practice(record.made_by):
        return in_use
    why = Blocker(
        f"The calibration of rig '{record.rig}' was made in {PRACTICE}, with a virtual hand.",
        "Choose the folder of real camera records (Settings, Instrument), or calibrate.",
    )
    return replace(in_use, fault=(CalibrationStatus.UNUSABLE, why))


def probe_without_practice(in_use: ProbeInUse) -> ProbeInUse:
    """Return the probe, at fault where a record of its tip was made in practice."""
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
    return bool(recorded) and not recorded.startswith(VIRTUAL_NAMES)
