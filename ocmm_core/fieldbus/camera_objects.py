"""The object dictionary of the smart camera, made from the device model."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ocmm_core.fieldbus.camera_slave import (
    DEVICE_NAME,
    INPUT_PDOS,
    N_SLOTS,
    OUTPUT_PDO,
    PRODUCT_CODE,
    REVISION,
    SM_INPUTS,
    SM_OUTPUTS,
    VENDOR_ID,
    CameraConfig,
    DataType,
    Pdo,
)

DEVICE_TYPE = 0x1389
"""Modular device profile, ETG.5001."""
IDENTITY = 0x1018
IDENTITY_SERIAL = 4
SM_TYPES = 0x1C00
SM_ASSIGNMENT = 0x1C10
"""Index of the assignment of sync manager 0."""
CONFIGURATION = 0x8000
WINDOWS = 0x8001
CALIBRATION = 0x8010
COUNTERS = 0xA000

_CALIBRATION_BYTES = 1200


@dataclass(frozen=True, slots=True)
class ObjectEntry:
    """One value of the dictionary.

    Attributes
    ----------
    name
        For people.
    kind
        Its type.
    value
        What it holds at power-on, as on the wire.
    writable
        The master may change it.
    """

    name: str
    kind: DataType
    value: bytes
    writable: bool = False


@dataclass(frozen=True, slots=True)
class DictionaryObject:
    """One object: a single value (entry 0) or a record (entry 0 counts the others)."""

    name: str
    entries: dict[int, ObjectEntry]
    record: bool


def object_dictionary(serial: int) -> dict[int, DictionaryObject]:
    """Return the object dictionary of the camera with this serial number, by index."""
    config = CameraConfig()
    objects = {
        0x1000: _variable("Device type", DataType.UDINT, _u32(DEVICE_TYPE)),
        0x1001: _variable("Error register", DataType.USINT, b"\x00"),
        0x1008: _variable("Device name", DataType.VISIBLE_STRING, DEVICE_NAME.encode("ascii")),
        0x1009: _variable("Hardware version", DataType.VISIBLE_STRING, b"software"),
        0x100A: _variable("Software version", DataType.VISIBLE_STRING, b"1.0"),
        IDENTITY: _record(
            "Identity",
            [
                ObjectEntry("Vendor ID", DataType.UDINT, _u32(VENDOR_ID)),
                ObjectEntry("Product code", DataType.UDINT, _u32(PRODUCT_CODE)),
                ObjectEntry("Revision", DataType.UDINT, _u32(REVISION)),
                ObjectEntry("Serial number", DataType.UDINT, _u32(serial)),
            ],
        ),
        SM_TYPES: _record(
            "Sync manager types",
            [
                ObjectEntry(f"Sync manager {sm}", DataType.USINT, bytes([sm + 1]))
                for sm in range(SM_INPUTS + 1)
            ],
        ),
        SM_ASSIGNMENT + SM_OUTPUTS: _assignment("RxPDO assignment", (OUTPUT_PDO,)),
        SM_ASSIGNMENT + SM_INPUTS: _assignment("TxPDO assignment", INPUT_PDOS),
        CONFIGURATION: _record(
            "Configuration",
            [
                ObjectEntry("Frame period ns", DataType.UDINT, _u32(config.frame_period_ns), True),
                ObjectEntry("Exposure ns", DataType.UDINT, _u32(config.exposure_ns), True),
                ObjectEntry("Threshold", DataType.UINT, struct.pack("<H", config.threshold), True),
                ObjectEntry("Mode", DataType.USINT, bytes([config.mode]), True),
                ObjectEntry("LED strobe", DataType.UINT, struct.pack("<H", config.strobe), True),
            ],
        ),
        WINDOWS: _record(
            "Windows",
            [
                ObjectEntry(f"Window {slot} {name}", DataType.UINT, bytes(2), True)
                for slot in range(N_SLOTS)
                for name in ("left", "top", "width", "height")
            ],
        ),
        CALIBRATION: _variable(
            "Calibration data", DataType.OCTET_STRING, bytes(_CALIBRATION_BYTES), writable=True
        ),
        COUNTERS: _record(
            "Counters",
            [
                ObjectEntry("Frames lost", DataType.UDINT, _u32(0)),
                ObjectEntry("Watchdog events", DataType.UDINT, _u32(0)),
            ],
        ),
    }
    for pdo in (OUTPUT_PDO, *INPUT_PDOS):
        objects[pdo.index] = _record(
            pdo.name,
            [ObjectEntry(entry.name, DataType.UDINT, _u32(entry.mapping)) for entry in pdo.entries],
        )
    return objects


def configuration_values(config: CameraConfig) -> tuple[tuple[int, int, bytes], ...]:
    """Return index, entry and value of everything that makes up the configuration."""
    numbers = (number for window in config.all_windows for number in window)
    return (
        (CONFIGURATION, 1, _u32(config.frame_period_ns)),
        (CONFIGURATION, 2, _u32(config.exposure_ns)),
        (CONFIGURATION, 3, struct.pack("<H", config.threshold)),
        (CONFIGURATION, 4, bytes([config.mode])),
        (CONFIGURATION, 5, struct.pack("<H", config.strobe)),
        *(
            (WINDOWS, sub, struct.pack("<H", number))
            for sub, number in enumerate(numbers, start=1)
        ),
    )


def _u32(value: int) -> bytes:
    return struct.pack("<I", value)


def _variable(
    name: str, kind: DataType, value: bytes, *, writable: bool = False
) -> DictionaryObject:
    return DictionaryObject(name, {0: ObjectEntry(name, kind, value, writable)}, record=False)


def _record(name: str, entries: list[ObjectEntry]) -> DictionaryObject:
    count = ObjectEntry("Number of entries", DataType.USINT, bytes([len(entries)]))
    return DictionaryObject(name, dict(enumerate([count, *entries])), record=True)


def _assignment(name: str, pdos: tuple[Pdo, ...]) -> DictionaryObject:
    return _record(
        name,
        [ObjectEntry(pdo.name, DataType.UINT, struct.pack("<H", pdo.index)) for pdo in pdos],
    )
