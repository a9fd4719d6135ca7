"""Which device on the wire is which camera of the rig: decided by serial number and alias.

Two cameras that were exchanged while they were off answer exactly as before; only their serial
numbers tell. A calibration belongs to one serial number, so nothing but a complete and unique
match is accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device._camera_slave import DEVICE_NAME, PRODUCT_CODE, VENDOR_ID
from ocmm_core.fieldbus.device._input_layout import INPUT_LAYOUTS


@dataclass(frozen=True, slots=True)
class CameraIdentity:
    """A camera of the rig: its name, serial number and EtherCAT station alias."""

    name: str
    serial: int
    alias: int


@dataclass(frozen=True, slots=True)
class FoundDevice:
    """What a device on the wire says it is; serial is None where it does not tell."""

    vendor: int
    product: int
    revision: int
    serial: int | None
    alias: int


def assign(found: Sequence[FoundDevice], expected: Sequence[CameraIdentity]) -> tuple[int, ...]:
    """Return, for each expected camera, the position on the wire (0 first) where it is.

    Raises
    ------
    BusError
        A device is no camera of this kind, a serial number or alias is there twice, a camera is
        missing or not of the rig, or it carries the alias of another one.
    """
    for position, device in enumerate(found, start=1):
        _check_kind(position, device)
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
            else "Have newer firmware installed in the camera by its maker.",
        )
    if device.serial is None:
        raise BusError(
            "bus.no_serial",
            f"The camera at position {position} does not report its serial number.",
            "Power-cycle the camera; if that does not help, have it repaired.",
        )
