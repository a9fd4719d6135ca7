"""Intrinsics in the cameras' own memory, and their sensor temperatures.

Written when a calibration is accepted, and read back at every start: differing values mean another
camera, or a calibration by another program.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime

from ocmm_core.calibration.records._records import CameraRecord
from ocmm_core.calibration.records._sealed import record_hash
from ocmm_core.calibration.records._usable import Blocker
from ocmm_core.camera import CameraEntry, camera_of
from ocmm_core.fieldbus.device import Intrinsics
from ocmm_core.fieldbus.objects import ObjectAccess, read_intrinsics, write_intrinsics

WARNS_K = 2.0
BLOCKS_K = 5.0
"""Sensor temperature differences above which the lens may have moved, K; to be tuned."""

_WRITE = "Maintain, Calibration, Write to cameras; or ocmm calibrate write-cameras"


def write_to_cameras(record: CameraRecord, objects: Callable[[str], ObjectAccess]) -> None:
    """Write the intrinsics of a calibration to all its cameras and read them back.

    The record's hash is in the note stored with them. ``objects``: object access by camera name.
    BusError if a camera refuses, does not answer, or reads back other values; earlier cameras then
    hold the new intrinsics: repeat the call.
    """
    for entry in record.cameras:
        write_intrinsics(
            objects(entry.name), _intrinsics(record, entry), f"calibration {record_hash(record)}"
        )


def compare_with_cameras(
    record: CameraRecord, objects: Callable[[str], ObjectAccess]
) -> Blocker | None:
    """Return why cameras are not the calibrated ones; BusError if silent or damaged."""
    for entry in record.cameras:
        found = read_intrinsics(objects(entry.name))
        expected = _intrinsics(record, entry)
        if found is None:
            return Blocker(
                f"Camera '{entry.name}' stores no intrinsics, so it cannot be identified as the "
                "calibrated one.",
                f"If it is, write them to it ({_WRITE}); if not, calibrate.",
            )
        if replace(found, date_s=expected.date_s) != expected:
            return Blocker(
                f"The intrinsics stored in camera '{entry.name}' differ from the active "
                f"calibration ({_difference(found, expected)}).",
                f"Verify the calibration, then write its intrinsics ({_WRITE}).",
            )
    return None


def check_camera_temperature(
    record: CameraRecord, temperatures_c: Sequence[float | None]
) -> tuple[Blocker | None, tuple[str, ...]]:
    """Return the blocker (or None) and warnings for the cameras' temperature difference.

    Sensor temperatures camera by camera, None if unknown. No judgement without any in the record.
    """
    blocker: Blocker | None = None
    warnings = []
    pairs = zip(record.cameras, record.sensor_temperatures_c, temperatures_c, strict=False)
    for entry, then_c, now_c in pairs:
        if now_c is None or abs(now_c - then_c) <= WARNS_K:
            continue
        side = "warmer" if now_c > then_c else "colder"
        words = (
            f"Camera '{entry.name}' is {abs(now_c - then_c):.1f} K {side} than at its "
            f"calibration ({now_c:.1f} against {then_c:.1f} °C)."
        )
        if abs(now_c - then_c) > BLOCKS_K and blocker is None:
            blocker = Blocker(
                words,
                ("Wait until the cameras reach that temperature, or calibrate at the present one."),
            )
        else:
            warnings.append(words)
    return blocker, tuple(warnings)


def _intrinsics(record: CameraRecord, entry: CameraEntry) -> Intrinsics:
    made = int(datetime.fromisoformat(record.made_utc).timestamp())
    return Intrinsics.of(camera_of(entry), made)


def _difference(found: Intrinsics, expected: Intrinsics) -> str:
    for name in Intrinsics.__slots__:
        ours, theirs = getattr(expected, name), getattr(found, name)
        if name != "date_s" and ours != theirs:
            return f"{name} is {theirs!r} instead of {ours!r}"
    return "nothing"
