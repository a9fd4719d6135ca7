"""``ocmm calibrate write-cameras``: the calibration in force and what the cameras store of it."""

from __future__ import annotations

from typing import Annotated

import typer

from ocmm_core.calibration.camera_memory import compare_with_cameras, write_to_cameras
from ocmm_core.calibration.in_use import default_folder, open_calibration, require_record
from ocmm_core.calibration.records import CameraRecord, record_hash
from ocmm_core.cli.bus_options import BusOption
from ocmm_core.cli.bus_session import open_bus
from ocmm_core.cli.headless import make_console
from ocmm_core.cli.options import RECOMMENDED_RIG, CalibrationsOption, ForceOption, RigOption


def write_cameras(
    *,
    source: BusOption,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing, only compare; exit code 0: the same.")
    ] = False,
    rig: RigOption = RECOMMENDED_RIG,
    calibrations: CalibrationsOption = None,
    force: ForceOption = False,
) -> None:
    """Store the intrinsics of the calibration in force in all cameras, and read them back.

    They are compared at every start; cameras that store others are not measured with.
    """
    record = require_record(open_calibration(rig, calibrations or default_folder()))
    console = make_console()
    with open_bus(source, rig, force=force) as bus:
        if not check:
            write_to_cameras(record, bus.objects)
        obstacle = compare_with_cameras(record, bus.objects)
    if obstacle is not None:
        console.print(str(obstacle), highlight=False)
        raise typer.Exit(1)
    console.print(f"{_names(record)} store calibration {record_hash(record)}.", highlight=False)


def _names(record: CameraRecord) -> str:
    return ", ".join(f"'{entry.name}' ({entry.serial})" for entry in record.cameras)
