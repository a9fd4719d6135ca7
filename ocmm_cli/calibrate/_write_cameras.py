"""``ocmm calibrate write-cameras``: store the calibration in force in the cameras."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.terminal import PlainConsole, error_text, make_console, tr
from ocmm_core.errors import OcmmError

if TYPE_CHECKING:
    from ocmm_core.calibration.records import CameraRecord


def write_cameras(
    *, source: str, check: bool, rig: Path, calibrations: Path | None, force: bool
) -> None:
    """Store the intrinsics of the calibration in force in all cameras, and read them back.

    They are compared at every start; cameras that store others are not measured with.
    """
    from ocmm_cli.bus import open_bus
    from ocmm_core.calibration.records import (
        compare_with_cameras,
        default_folder,
        open_calibration,
        require_record,
        write_to_cameras,
    )

    record = require_record(open_calibration(rig, calibrations or default_folder()))
    console = make_console()
    with open_bus(source, rig, force=force) as bus:
        if not check:
            write_to_cameras(record, bus.objects)
        blocker = compare_with_cameras(record, bus.objects)
    if blocker is not None:
        console.print(error_text(blocker))
        raise typer.Exit(1)
    _print_stored(record, console)


def write_accepted(
    record: CameraRecord, source: str, rig: Path, console: PlainConsole, *, force: bool
) -> None:
    """Store the intrinsics of a just accepted calibration; print failures.

    It is in force in any case; the cameras are unusable until they store it.
    """
    from ocmm_cli.bus import open_bus
    from ocmm_core.calibration.records import write_to_cameras

    try:
        with open_bus(source, rig, force=force) as bus:
            write_to_cameras(record, bus.objects)
    except OcmmError as error:
        console.print(
            f"{tr('The cameras could not store its intrinsics:')} {error_text(error)} "
            + tr(f"Then: ocmm calibrate write-cameras --source {source}"),
            style="yellow",
        )
    else:
        _print_stored(record, console)


def _print_stored(record: CameraRecord, console: PlainConsole) -> None:
    from ocmm_core.calibration.records import record_hash

    names = ", ".join(f"'{entry.name}' ({entry.serial})" for entry in record.cameras)
    console.show(f"{names} now store calibration {record_hash(record)}.")
