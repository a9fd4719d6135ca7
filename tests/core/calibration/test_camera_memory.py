"""Intrinsics in the cameras: written on accepting, compared at every start; and their warmth."""

from __future__ import annotations

import msgspec
import pytest

from ocmm_core.calibration.records import (
    check_camera_temperature,
    compare_with_cameras,
    record_hash,
    write_to_cameras,
)
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import CALIBRATION
from tests.core.calibration.made_records import make_record
from tests.core.fieldbus.direct_camera import DirectCamera

RECORD = make_record()


@pytest.fixture
def cameras() -> dict[str, DirectCamera]:
    """Return the cameras of the record by name, as they come from the factory."""
    return {entry.name: DirectCamera(serial=entry.serial) for entry in RECORD.cameras}


def test_what_was_written_is_found_at_the_next_start(cameras: dict[str, DirectCamera]) -> None:
    missing = compare_with_cameras(RECORD, cameras.__getitem__)
    assert missing is not None
    assert missing.what.startswith("Camera 'left' stores no intrinsics")
    write_to_cameras(RECORD, cameras.__getitem__)
    assert compare_with_cameras(RECORD, cameras.__getitem__) is None
    for camera in cameras.values():
        assert camera.read(CALIBRATION, 5).decode() == f"calibration {record_hash(RECORD)}"


def test_a_relocation_that_kept_the_lenses_needs_no_writing(
    cameras: dict[str, DirectCamera],
) -> None:
    write_to_cameras(RECORD, cameras.__getitem__)
    later = make_record(method="relocation", made_utc="2026-04-01T08:00:00+00:00")
    assert compare_with_cameras(later, cameras.__getitem__) is None


def test_other_intrinsics_are_named(cameras: dict[str, DirectCamera]) -> None:
    write_to_cameras(RECORD, cameras.__getitem__)
    left, right = RECORD.cameras
    # One unit in the last place of one number is another calibration.
    other = msgspec.structs.replace(right, v0_px=right.v0_px * (1.0 + 2.3e-16))
    found = compare_with_cameras(make_record(cameras=(left, other)), cameras.__getitem__)
    assert found is not None
    assert "The intrinsics stored in camera 'right' differ" in found.what
    assert f"v0 is {right.v0_px!r} instead of {other.v0_px!r}" in found.what
    assert "Verify" in found.remedy


def test_a_camera_refuses_the_intrinsics_of_another_one(cameras: dict[str, DirectCamera]) -> None:
    swapped = {"left": cameras["right"], "right": cameras["left"]}
    with pytest.raises(BusError):
        write_to_cameras(RECORD, swapped.__getitem__)
    assert compare_with_cameras(RECORD, cameras.__getitem__) is not None


def test_warmth_warns_from_2_and_stops_from_5_kelvin() -> None:
    record = make_record(sensor_temperatures_c=(36.0, 37.0))
    assert check_camera_temperature(record, (38.0, 35.0)) == (None, ())
    blocker, warnings = check_camera_temperature(record, (36.0, 34.9))
    assert blocker is None
    assert warnings == (
        "Camera 'right' is 2.1 K colder than at its calibration (34.9 against 37.0 °C).",
    )
    blocker, warnings = check_camera_temperature(record, (41.1, 42.1))
    assert blocker is not None
    assert blocker.what.startswith("Camera 'left' is 5.1 K warmer")
    assert len(warnings) == 1


def test_where_temperatures_are_not_known_nothing_is_said() -> None:
    assert check_camera_temperature(make_record(), (90.0, 90.0)) == (None, ())
    record = make_record(sensor_temperatures_c=(36.0, 37.0))
    assert check_camera_temperature(record, (None, None)) == (None, ())
