"""Which calibration belongs to a source of frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ocmm_core.calibration.in_use import (
    CalibrationInUse,
    Obstacle,
    Word,
    default_folder,
    open_calibration,
    open_design,
)
from ocmm_core.cli.source_names import VIRTUAL_BUSES, VIRTUAL_NAMES


def choose_calibration(
    source: str, rig: Path, folder: Path | None, *, uncalibrated: bool
) -> CalibrationInUse:
    """Return what a source is measured with: the rig document, or a record of its store.

    Parameters
    ----------
    source
        As the commands take it.
    rig
        The rig document.
    folder
        Of calibrations; None is that of this user for real cameras, and the rig document itself
        for virtual ones.
    uncalibrated
        Points are taken whatever is the matter with the calibration.

    Raises
    ------
    InputError
        The rig document cannot be used.
    """
    if folder is None and source.startswith("ethercat:") and source not in VIRTUAL_BUSES:
        folder = default_folder()
    if folder is None:
        return open_design(rig, uncalibrated=uncalibrated)
    return open_calibration(rig, folder, uncalibrated=uncalibrated)


def checked_for_replay(calibration: CalibrationInUse, recorded: str) -> CalibrationInUse:
    """Return the calibration, at fault where a rig document stands for recorded real cameras.

    Parameters
    ----------
    calibration
        What the replay would be measured with.
    recorded
        Name of the source that was recorded; empty where nothing is replayed.
    """
    is_design = calibration.record is None and calibration.fault is None
    if not recorded or not is_design or recorded.startswith(VIRTUAL_NAMES):
        return calibration
    why = Obstacle(
        f"The recording is of real cameras ({recorded}), and a rig document is no calibration.",
        "Give the folder of their calibrations: --calibrations.",
    )
    return replace(calibration, fault=(Word.NONE, why))
