"""Assignment of wire devices to rig cameras, by serial number and alias.

Cameras swapped while off answer exactly as before; only serial numbers distinguish them. A
calibration belongs to one serial number, so only a complete and unique match is accepted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device._camera_slave import DEVICE_NAME, PRODUCT_CODE, VENDOR_ID
from ocmm_core.fieldbus.device._input_layout import INPUT_LAYOUTS


@dataclass(frozen=True, slots=True)
class CameraIdentity:
    """A camera of the rig, from its calibration."""

    name: str
    serial: int
    alias: int
    """`name`, `serial`, `alias`: rig name, serial number and EtherCAT station alias."""
    sensor: int = 0
    width: int = 0
    height: int = 0
    """`sensor`, `width`, `height`: serial number and size, px, as calibrated; 0: unknown."""


@dataclass(frozen=True, slots=True)
class FoundDevice:
    """Identity reported by a wire device."""

    vendor: int
    product: int
    revision: int
    serial: int | None
    """Serial number from object 0x1018; None if it cannot be read."""
    alias: int
    stored_serial: int | None = None
    """Serial number in its EEPROM (SII word 0x0E); 0: none; None: not read."""


IsKind = Callable[[int, int, int], bool]
"""Returns whether vendor, product and revision match a camera kind."""


def assign(
    found: Sequence[FoundDevice],
    expected: Sequence[CameraIdentity],
    described: tuple[str, IsKind] | None = None,
) -> tuple[int, ...]:
    """Return the wire position (0 first) of each expected camera.

    ``described``: name and kind of cameras described by a file; None: our own. BusError if a device
    is of another kind, a serial number or alias is duplicated, a camera is missing or foreign, or
    it carries the alias of another one.
    """
    for position, device in enumerate(found, start=1):
        if described is None:
            _check_kind(position, device)
        else:
            _check_described(position, device, *described)
        _check_serial(position, device)
    for field in ("serial", "alias"):
        values = [getattr(device, field) for device in found]
        for value in values:
            if values.count(value) > 1 and not (field == "alias" and value == 0):
                places = [str(p) for p, other in enumerate(values, start=1) if other == value]
                raise BusError(
                    "bus.duplicate",
                    f"The cameras at positions {' and '.join(places)} of the bus "
                    f"both have the {field} {value}.",
                    f"Give each camera its own {field}.",
                )
    serials = [device.serial for device in found]
    missing = [camera for camera in expected if camera.serial not in serials]
    extra = [
        f"serial {device.serial} at position {position}"
        for position, device in enumerate(found, start=1)
        if device.serial not in [camera.serial for camera in expected]
    ]
    if missing or extra:
        parts = []
        if missing:
            names = ", ".join(f"'{camera.name}' (serial {camera.serial})" for camera in missing)
            parts.append(f"{names} of the rig not found")
        if extra:
            parts.append(f"not in the rig: {', '.join(extra)}")
        raise BusError(
            "bus.cameras",
            f"The cameras on the bus do not match the rig: {'; '.join(parts)}.",
            "Connect and switch on the cameras of the rig, or load the matching rig.",
        )
    places_by_serial = {serial: place for place, serial in enumerate(serials)}
    order = tuple(places_by_serial[camera.serial] for camera in expected)
    for camera, place in zip(expected, order, strict=True):
        alias = found[place].alias
        if alias != camera.alias:
            owner = next((other.name for other in expected if other.alias == alias), None)
            whose = f", the alias of '{owner}'" if owner else ""
            raise BusError(
                "bus.alias",
                f"Camera '{camera.name}' (serial {camera.serial}) carries the station alias "
                f"{alias}{whose}, but the rig says {camera.alias}.",
                "Check whether cameras were swapped; then correct the alias or the rig.",
            )
    return order


def check_sensor(camera: CameraIdentity, serial: int, width: int, height: int) -> None:
    """Raise BusError unless the sensor (object 0x9000) is the calibrated one."""
    if camera.width and (camera.width, camera.height) != (width, height):
        raise BusError(
            "bus.sensor",
            f"Camera '{camera.name}' has a sensor of {width} x {height} px, but its calibration is "
            f"that of a sensor of {camera.width} x {camera.height} px.",
            "Load the rig of this camera, or calibrate it.",
        )
    if camera.sensor and camera.sensor != serial:
        raise BusError(
            "bus.sensor",
            f"Camera '{camera.name}' has the sensor with serial number {serial}, but its "
            f"calibration is that of sensor {camera.sensor}.",
            "The sensor was exchanged: calibrate the camera.",
        )


def _check_kind(position: int, device: FoundDevice) -> None:
    if (device.vendor, device.product) != (VENDOR_ID, PRODUCT_CODE):
        raise BusError(
            "bus.foreign_device",
            f"The device at position {position} of the bus (vendor {device.vendor:#010x}, "
            f"product {device.product:#010x}) is not an {DEVICE_NAME}.",
            "Connect only the cameras to this bus.",
        )
    if device.revision not in INPUT_LAYOUTS:
        known = " and ".join(f"{revision:#010x}" for revision in INPUT_LAYOUTS)
        newer = device.revision > max(INPUT_LAYOUTS)
        raise BusError(
            "bus.revision",
            f"The camera at position {position} has revision {device.revision:#010x}; this "
            f"program reads {known}.",
            "Install a newer version of this program."
            if newer
            else "Get newer firmware from the maker of the camera and install it: ocmm camera "
            "firmware CAMERA FILE",
        )


def _check_described(position: int, device: FoundDevice, name: str, is_kind: IsKind) -> None:
    if not is_kind(device.vendor, device.product, device.revision):
        raise BusError(
            "bus.foreign_device",
            f"The device at position {position} of the bus (vendor {device.vendor:#010x}, "
            f"product {device.product:#010x}, revision {device.revision:#010x}) is no '{name}' as "
            "its description says.",
            "Connect the cameras of the rig, or give the description of this device.",
        )


def _check_serial(position: int, device: FoundDevice) -> None:
    if device.serial is None:
        raise BusError(
            "bus.no_serial",
            f"The camera at position {position} does not report its serial number.",
            "Power-cycle the camera; if that does not help, have it repaired.",
        )
    if device.stored_serial not in (None, 0, device.serial):
        # A scan reads the EEPROM and a bring-up the object; they must agree.
        raise BusError(
            "bus.two_serials",
            f"The camera at position {position} has two serial numbers: {device.serial} in its "
            f"object 0x1018 and {device.stored_serial} in its EEPROM.",
            "Have the camera checked by its maker: its EEPROM or its firmware is that of another.",
        )
