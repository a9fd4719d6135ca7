"""A calibration keeps what its cameras are and which sensors they have."""

from __future__ import annotations

from pathlib import Path

import msgspec

from ocmm_core.calibration.records import (
    CalibrationStore,
    open_calibration,
    rig_from_record,
    rig_in_force,
    store_folder,
)
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from tests.core.calibration.made_records import MADE, make_record
from tests.core.calibration.procedure_site import Bench

SENSORS = (4711, 4712)


def described(folder: Path) -> Path:
    """Return the recommended rig with described cameras and learnt sensors."""
    text = resource("rigs", "recommended.toml").read_text()
    for sensor in SENSORS:
        text = text.replace(
            "\nheight_px = 2048\n",
            f'\nheight_px  = 2048\ndevice = "thesis-camera"\nsensor_serial = {sensor}\n',
            1,
        )
    path = folder / "described.toml"
    # They prove no order; the person responsible for the rig allows that.
    path.write_text(f"calibrate_unproven = true\n{text}")
    return path


def test_calibrated_cameras_start_as_what_they_are(tmp_path: Path) -> None:
    document = described(tmp_path)
    bench = Bench.at(tmp_path)
    bench.rig = load_rig(document)
    assert (bench.rig.device, bench.rig.sensors) == ("thesis-camera", SENSORS)
    after = bench.calibrated()
    assert (after.device, after.sensors) == ("thesis-camera", SENSORS)
    record = bench.store().active()
    assert record is not None
    assert [(one.device, one.sensor_serial) for one in record.cameras] == [
        ("thesis-camera", sensor) for sensor in SENSORS
    ]
    # The next start: from the store alone, as a job and its copies are opened.
    again = rig_from_record(record)
    assert (again.device, again.sensors) == ("thesis-camera", SENSORS)


def test_a_record_that_does_not_say_it_is_read_as_the_document_says(tmp_path: Path) -> None:
    document = described(tmp_path)
    store = CalibrationStore(store_folder(tmp_path, "recommended"))
    record = make_record(points=123)
    assert {one.device for one in record.cameras} == {""}
    store.accept(record, "technician", "of an older version", MADE)
    in_use = open_calibration(document, tmp_path)
    assert in_use.record == record
    assert (in_use.rig.device, in_use.rig.sensors) == ("thesis-camera", SENSORS)
    assert in_use.device is not None
    assert rig_in_force(record, load_rig(document)).device == "thesis-camera"
    assert in_use.as_opened.warnings


def test_sensors_are_those_that_were_calibrated_not_those_of_a_later_document(
    tmp_path: Path,
) -> None:
    store = CalibrationStore(store_folder(tmp_path, "recommended"))
    record = make_record(points=123)
    cameras = tuple(
        msgspec.structs.replace(entry, sensor_serial=number)
        for entry, number in zip(record.cameras, (1, 2), strict=True)
    )
    store.accept(msgspec.structs.replace(record, cameras=cameras), "technician", "new", MADE)
    assert open_calibration(described(tmp_path), tmp_path).rig.sensors == (1, 2)
