"""Object dictionary of the smart camera, for camera, host, ESI file and page."""

from __future__ import annotations

import struct
from enum import IntEnum, IntFlag

from ocmm_core.fieldbus.device._camera_slave import (
    DEVICE_NAME,
    OUTPUT_PDO,
    PRODUCT_CODE,
    SM_INPUTS,
    SM_OUTPUTS,
    VENDOR_ID,
    CameraConfig,
    DataType,
    Pdo,
)
from ocmm_core.fieldbus.device._input_layout import NEWEST_LAYOUT, InputLayout
from ocmm_core.fieldbus.device._object_entries import (
    Access,
    number,
    octets,
    record,
    text_entry,
    variable,
)
from ocmm_core.fieldbus.device._object_entries import DictionaryObject as DictionaryObject
from ocmm_core.fieldbus.device._object_entries import ObjectEntry as ObjectEntry
from ocmm_core.fieldbus.device._profile_objects import CONFIGURATION as CONFIGURATION
from ocmm_core.fieldbus.device._profile_objects import WINDOWS as WINDOWS
from ocmm_core.fieldbus.device._profile_objects import profile_objects

DEVICE_TYPE = 0x1389
"""Modular device profile, ETG.5001."""
ERROR_REGISTER = 0x1001
IDENTITY = 0x1018
IDENTITY_SERIAL = 4
ERROR_SETTINGS = 0x10F1
HISTORY = 0x10F3
TIMESTAMP = 0x10F8
SM_TYPES = 0x1C00
SM_ASSIGNMENT = 0x1C10
OUTPUT_SYNC, INPUT_SYNC = 0x1C32, 0x1C33
SYNC_MODE, SYNC_CYCLE = 1, 2
SYNC_MISSED, SYNC_EXCEEDED, SYNC_ERROR = 0x0B, 0x0C, 0x20

HISTORY_FIRST = 6
"""First message of the diagnosis history (ETG.1020)."""
HISTORY_MESSAGES = 16
_PDO_MAPPING_TYPE, _IDENTITY_TYPE = 0x0021, 0x0023


class ErrorCode(IntEnum):
    """Emergency messages of the camera, kept in object 0x10F3."""

    RESET = 0x0000
    OVER_TEMPERATURE = 0x4210
    SENSOR = 0x5030
    STORED_DATA = 0x6310
    WATCHDOG = 0x8130


ERROR_TEXTS = {
    ErrorCode.RESET: "The error before is over.",
    ErrorCode.OVER_TEMPERATURE: "The sensor is too hot.",
    ErrorCode.SENSOR: "The sensor does not work.",
    ErrorCode.STORED_DATA: "Stored data (intrinsics or black image) is damaged.",
    ErrorCode.WATCHDOG: "The master's outputs stayed away; the camera went to SAFEOP.",
}


class ErrorRegister(IntFlag):
    """Bits of object 0x1001."""

    GENERIC = 0x01
    TEMPERATURE = 0x08
    COMMUNICATION = 0x10
    PROFILE = 0x20
    MANUFACTURER = 0x80


def object_dictionary(
    serial: int, layout: InputLayout = NEWEST_LAYOUT
) -> dict[int, DictionaryObject]:
    """Return the object dictionary of the camera with this serial number, by index."""
    objects = {
        0x1000: variable(
            number("Device type", DataType.UDINT, DEVICE_TYPE, "Modular device profile, ETG.5001.")
        ),
        ERROR_REGISTER: variable(
            number("Error register", DataType.USINT, text="Bits, see below.", live=True)
        ),
        0x1008: variable(text_entry("Device name", DEVICE_NAME)),
        0x1009: variable(text_entry("Hardware version", "software")),
        0x100A: variable(text_entry("Software version", f"{layout.revision >> 16}.0.0")),
        IDENTITY: record(
            "Identity",
            [
                number("Vendor ID", DataType.UDINT, VENDOR_ID, "Not assigned by the ETG."),
                number("Product code", DataType.UDINT, PRODUCT_CODE),
                number("Revision", DataType.UDINT, layout.revision),
                number("Serial number", DataType.UDINT, serial, "No two cameras have the same."),
            ],
            "Which device this is.",
            kind=_IDENTITY_TYPE,
        ),
        ERROR_SETTINGS: record(
            "Error settings",
            [
                number("Local error reaction", DataType.UDINT,
                       text="0: the camera leaves reactions to the master."),
                number("Sync error limit", DataType.UINT, 4, access=Access.WRITE,
                       text="Cycles without the clock signal before a sync error is shown."),
            ],
        ),
        HISTORY: _history(),
        TIMESTAMP: variable(
            number("Timestamp", DataType.ULINT, text="Bus time.", unit="ns", live=True)
        ),
        SM_TYPES: record(
            "Sync manager types",
            [
                number(f"Sync manager {sm}", DataType.USINT, sm + 1)
                for sm in range(SM_INPUTS + 1)
            ],
            "1 mailbox out, 2 mailbox in, 3 outputs, 4 inputs.",
        ),
        SM_ASSIGNMENT + SM_OUTPUTS: _assignment("RxPDO assignment", (OUTPUT_PDO,)),
        SM_ASSIGNMENT + SM_INPUTS: _assignment("TxPDO assignment", layout.input_pdos),
        OUTPUT_SYNC: _sync("Outputs synchronisation"),
        INPUT_SYNC: _sync("Inputs synchronisation"),
    }  # fmt: skip
    for pdo in (OUTPUT_PDO, *layout.input_pdos):
        objects[pdo.index] = record(
            f"{pdo.name} mapping",
            [number(entry.name, DataType.UDINT, entry.mapping) for entry in pdo.entries],
            "Index, entry and bits of each variable.",
            kind=_PDO_MAPPING_TYPE,
        )
    objects.update(profile_objects(serial, layout))
    return dict(sorted(objects.items()))


def configuration_values(config: CameraConfig) -> tuple[tuple[int, int, bytes], ...]:
    """Return index, entry and value of all configuration entries."""
    numbers = (number for window in config.all_windows for number in window)
    return (
        (CONFIGURATION, 1, struct.pack("<I", config.frame_period_ns)),
        (CONFIGURATION, 2, struct.pack("<I", config.exposure_ns)),
        (CONFIGURATION, 3, struct.pack("<H", config.threshold)),
        (CONFIGURATION, 4, bytes([config.mode])),
        (CONFIGURATION, 5, struct.pack("<H", config.strobe)),
        *((WINDOWS, sub, struct.pack("<H", number)) for sub, number in enumerate(numbers, start=1)),
    )


def _history() -> DictionaryObject:
    fixed = [
        number("Maximum messages", DataType.USINT, HISTORY_MESSAGES),
        number("Newest message", DataType.USINT, live=True, text="Its entry; 0: there is none."),
        number("Newest acknowledged message", DataType.USINT, access=Access.WRITE, live=True,
               text="Write the entry of a message to acknowledge up to it, 0 to clear all."),
        number("New messages available", DataType.BOOLEAN, live=True,
               text="1: the newest message is not acknowledged."),
        number("Flags", DataType.UINT, 1, access=Access.WRITE, low=0, high=1,
               text="Bit 0: send emergency messages. The oldest message gives way."),
    ]  # fmt: skip
    messages = [
        octets(f"Message {place + 1}", 32, "ETG.1020: code, flags, text, bus time, parameters.")
        for place in range(HISTORY_MESSAGES)
    ]
    return record("Diagnosis history", [*fixed, *messages], "Errors of the camera since power-on.")


def _sync(name: str) -> DictionaryObject:
    return record(
        name,
        {
            SYNC_MODE: number("Mode", DataType.UINT, live=True, text="0 free running, 2 SYNC0."),
            SYNC_CYCLE: number("Cycle time", DataType.UDINT, unit="ns", live=True),
            3: number("Shift time", DataType.UDINT, unit="ns"),
            4: number("Modes supported", DataType.UINT, 0x0005,
                      "Bit 0: free running; bit 2: SYNC0."),
            5: number("Minimum cycle time", DataType.UDINT, 50_000, unit="ns"),
            6: number("Calculate and copy time", DataType.UDINT, 20_000, unit="ns"),
            SYNC_MISSED: number("SM event missed", DataType.UINT, live=True,
                                text="Bus cycles in OP without outputs."),
            SYNC_EXCEEDED: number("Cycle exceeded", DataType.UINT, live=True,
                                  text="Frames that were not ready in time."),
            SYNC_ERROR: number("Sync error", DataType.BOOLEAN, live=True,
                               text="The last fall out of OP came from the clock signal."),
        },
        "How process data and exposures go together (ETG.1020).",
    )  # fmt: skip


def _assignment(name: str, pdos: tuple[Pdo, ...]) -> DictionaryObject:
    return record(name, [number(pdo.name, DataType.UINT, pdo.index) for pdo in pdos])
