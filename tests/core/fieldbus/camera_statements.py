"""Statements of a camera about itself, read object by object."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.fieldbus.device import COUNTERS, IDENTITY, INFORMATION, VERSIONS
from ocmm_core.fieldbus.objects._camera_client import (
    STRING_BYTES,
    ObjectAccess,
    read_exactly,
    read_number,
    unfit,
)


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


def read_text(access: ObjectAccess, index: int, sub: int) -> str:
    try:
        return access.read(index, sub, room=STRING_BYTES).rstrip(b"\x00").decode("ascii")
    except UnicodeDecodeError as error:
        raise unfit(index, sub, "not text") from error


def read_identity_text(access: ObjectAccess) -> CameraTexts:
    """Return names, versions and sizes of the camera."""
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
    """Return the version of the camera's firmware."""
    return read_text(access, VERSIONS, 1)


def read_temperature(access: ObjectAccess) -> float:
    """Return the temperature of the sensor, degrees Celsius."""
    return int.from_bytes(read_exactly(access, INFORMATION, 4, 2), "little", signed=True) / 10.0


def read_counters(access: ObjectAccess) -> CameraCounters:
    """Return the camera's counters since power-on."""
    return CameraCounters(*(read_number(access, COUNTERS, sub, 4) for sub in range(1, 7)))
