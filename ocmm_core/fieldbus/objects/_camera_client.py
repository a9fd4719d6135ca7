"""Host access to one camera's objects: intrinsics, black image, snapshot, errors."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.device import (
    BLOB_BYTES,
    CALIBRATION,
    COUNTERS,
    HISTORY,
    HISTORY_FIRST,
    HISTORY_MESSAGES,
    IDENTIFY,
    IDENTITY,
    INFORMATION,
    NOTE_BYTES,
    VERSIONS,
    DiagnosisMessage,
    Intrinsics,
)
from ocmm_core.fieldbus.objects._camera_pictures import BlackImageState as BlackImageState
from ocmm_core.fieldbus.objects._camera_pictures import clear_black_image as clear_black_image
from ocmm_core.fieldbus.objects._camera_pictures import load_black_image as load_black_image
from ocmm_core.fieldbus.objects._camera_pictures import measure_black_image as measure_black_image
from ocmm_core.fieldbus.objects._camera_pictures import read_black_image as read_black_image
from ocmm_core.fieldbus.objects._camera_pictures import store_black_image as store_black_image
from ocmm_core.fieldbus.objects._camera_pictures import take_snapshot as take_snapshot
from ocmm_core.fieldbus.objects._object_access import (
    STRING_BYTES,
    read_exactly,
    read_number,
    read_text,
    unfit,
)
from ocmm_core.fieldbus.objects._object_access import ObjectAccess as ObjectAccess

_HASH_BYTES = 32


@dataclass(frozen=True, slots=True)
class CameraTexts:
    """Names and versions reported by a camera."""

    name: str
    hardware: str
    software: str
    """`name`, `hardware`, `software`: objects 0x1008, 0x1009, 0x100A."""
    serial: int
    firmware: str
    sensor_logic: str
    boot_loader: str
    """`firmware`, `sensor_logic`, `boot_loader`: versions (0x9010)."""
    width: int
    height: int
    operating_hours: int
    """Hours powered since production."""


@dataclass(frozen=True, slots=True)
class CameraCounters:
    """Object 0xA000; see docs/integrator/camera_objects.md."""

    frames_lost: int
    watchdog_events: int
    overruns: int
    bad_mailboxes: int
    link_events: int
    emergencies: int


def read_identity_text(access: ObjectAccess) -> CameraTexts:
    """Return names, versions and sizes of the camera; for tests."""
    name, hardware, software = (read_text(access, index, 0) for index in (0x1008, 0x1009, 0x100A))
    firmware, sensor_logic, boot_loader = (read_text(access, VERSIONS, sub) for sub in (1, 2, 3))
    return CameraTexts(
        name=name,
        hardware=hardware,
        software=software,
        serial=read_number(access, IDENTITY, 4, 4),
        firmware=firmware,
        sensor_logic=sensor_logic,
        boot_loader=boot_loader,
        width=read_number(access, INFORMATION, 2, 2),
        height=read_number(access, INFORMATION, 3, 2),
        operating_hours=read_number(access, INFORMATION, 5, 4),
    )


def read_firmware(access: ObjectAccess) -> str:
    """Return the version of the camera's firmware; for tests."""
    return read_text(access, VERSIONS, 1)


def read_temperature(access: ObjectAccess) -> float:
    """Return the temperature of the sensor, degrees Celsius; for tests."""
    return int.from_bytes(read_exactly(access, INFORMATION, 4, 2), "little", signed=True) / 10.0


def read_counters(access: ObjectAccess) -> CameraCounters:
    """Return the camera's counters since power-on; for tests."""
    return CameraCounters(*(read_number(access, COUNTERS, sub, 4) for sub in range(1, 7)))


def read_error_history(access: ObjectAccess) -> tuple[DiagnosisMessage, ...]:
    """Return the camera's stored errors, oldest first."""
    newest = read_number(access, HISTORY, 2, 1)
    if newest == 0:
        return ()
    if not HISTORY_FIRST <= newest < HISTORY_FIRST + HISTORY_MESSAGES:
        raise unfit(HISTORY, 2, f"it names message {newest}")
    order = (
        HISTORY_FIRST + (newest - HISTORY_FIRST + 1 + step) % HISTORY_MESSAGES
        for step in range(HISTORY_MESSAGES)
    )
    contents = (access.read(HISTORY, place, room=STRING_BYTES) for place in order)
    return tuple(DiagnosisMessage.decode(content) for content in contents if content)


def blink(access: ObjectAccess, seconds: int) -> int:
    """Make the camera blink for 0 to 600 s; return the accepted time."""
    access.write(IDENTIFY, 1, seconds.to_bytes(2, "little"))
    return read_number(access, IDENTIFY, 2, 2)


def clear_error_history(access: ObjectAccess) -> None:
    """Clear the camera's error history."""
    access.write(HISTORY, 3, b"\x00")


def write_intrinsics(access: ObjectAccess, intrinsics: Intrinsics, note: str = "") -> None:
    """Store intrinsics in the camera and verify them.

    The camera refuses those of another serial number. ``note``: at most 1200 bytes as UTF-8.
    BusError ``bus.intrinsics`` if verification fails, ``bus.refused`` if the camera refuses them.
    """
    block, words = intrinsics.encode(), note.encode("utf-8")
    if len(words) > NOTE_BYTES:
        raise InputError(
            "bus.note",
            f"The note stored with the intrinsics has {len(words)} bytes.",
            f"Shorten it to {NOTE_BYTES} bytes.",
        )
    access.write(CALIBRATION, 1, block)
    access.write(CALIBRATION, 5, words)
    found = access.read(CALIBRATION, 1, room=BLOB_BYTES)
    sha256 = access.read(CALIBRATION, 3, room=_HASH_BYTES)
    if found != block or sha256 != hashlib.sha256(block).digest():
        raise _lost_intrinsics()
    if access.read(CALIBRATION, 5, room=NOTE_BYTES) != words:
        raise _lost_intrinsics()


def read_intrinsics(access: ObjectAccess) -> Intrinsics | None:
    """Return the stored intrinsics, or None; BusError ``bus.intrinsics`` if damaged."""
    block = access.read(CALIBRATION, 1, room=BLOB_BYTES)
    sha256 = access.read(CALIBRATION, 3, room=_HASH_BYTES)
    if not block:
        return None
    if sha256 != hashlib.sha256(block).digest():
        raise _lost_intrinsics()
    return Intrinsics.decode(block)


def _lost_intrinsics() -> BusError:
    return BusError(
        "bus.intrinsics",
        "The camera did not retain the intrinsics written to it.",
        "Write them again; if that does not help, have the camera checked.",
    )
