"""EEPROM and object dictionary of a slave that a description makes (ETG.2010, ETG.1000.6)."""

from __future__ import annotations

import struct

from ocmm_core.fieldbus.described import DeviceDescription, ProcessImage
from ocmm_core.fieldbus.device import (
    IDENTITY,
    SII_BYTES,
    SII_CONFIGURATION,
    SM_ASSIGNMENT,
    SM_INPUTS,
    SM_OUTPUTS,
    DataType,
    DictionaryObject,
    ObjectEntry,
)
from ocmm_core.simulation.slave import checksum_of_configuration

_PROTOCOL_COE = 0x0004
_STRINGS, _GENERAL, _FMMU, _SYNC_MANAGERS, _TX_PDO, _RX_PDO = 10, 30, 40, 41, 50, 51
_COE_SDO = 0x01
_PORTS = 0x0011
_MANDATORY, _FIXED = 0x0001, 0x0010
_DEVICE_TYPE, _NAME, _SM_TYPES = 0x1000, 0x1008, 0x1C00
_BY_SIZE = {1: DataType.USINT, 2: DataType.UINT, 4: DataType.UDINT, 8: DataType.ULINT}

SyncManagers = tuple[tuple[int, ...], ...]


def sync_managers(device: DeviceDescription, image: ProcessImage) -> SyncManagers:
    """Return start, length, control, status, activation and type of each sync manager."""
    out, out_bytes, into, in_bytes = device.mailbox
    outputs, inputs = device.memory
    return (
        (out, out_bytes, 0x26, 0, 1, 1),
        (into, in_bytes, 0x22, 0, 1, 2),
        (outputs, image.output_bytes, 0x64, 0, 1, 3),
        (inputs, image.input_bytes, 0x20, 0, 1, 4),
    )


def described_eeprom(
    device: DeviceDescription, image: ProcessImage, serial: int, alias: int
) -> bytes:
    """Return the content of the EEPROM."""
    head = bytearray(SII_CONFIGURATION)
    struct.pack_into("<H", head, 8, alias)
    head += struct.pack("<H", checksum_of_configuration(head))
    revision = device.revisions[1]
    head += struct.pack("<IIII", device.vendor, device.product, revision, serial)
    head += bytes(16) + struct.pack("<HHHHH", *device.mailbox, _PROTOCOL_COE)
    head = head.ljust(0x7C, b"\x00") + struct.pack("<HH", SII_BYTES * 8 // 1024 - 1, 1)
    name = device.name.encode("ascii", errors="replace")[:64]
    managers = b"".join(struct.pack("<HHBBBB", *each) for each in sync_managers(device, image))
    general = struct.pack("<BBBBBB8xBBH", 1, 0, 1, 1, 0, _COE_SDO, 1, 0, _PORTS).ljust(32, b"\x00")
    body = _category(_STRINGS, bytes([1, len(name)]) + name)
    body += _category(_GENERAL, general)
    body += _category(_FMMU, bytes([1, 2]))
    body += _category(_SYNC_MANAGERS, managers)
    for category, manager, objects in (
        (_TX_PDO, SM_INPUTS, image.inputs),
        (_RX_PDO, SM_OUTPUTS, image.outputs),
    ):
        for index, entries in objects:
            flags = _MANDATORY | _FIXED
            content = struct.pack("<HBBBBH", index, len(entries), manager, 0, 0, flags)
            content += b"".join(
                struct.pack("<HBBBBH", one.index, one.sub, 0, one.code, 8 * one.size, 0)
                for one in entries
            )
            body += _category(category, content)
    return (bytes(head) + body + b"\xff\xff").ljust(SII_BYTES, b"\xff")


def described_dictionary(
    device: DeviceDescription, image: ProcessImage, serial: int
) -> dict[int, DictionaryObject]:
    """Return the object dictionary."""
    name = device.name.encode("ascii", errors="replace")
    identity = (device.vendor, device.product, device.revisions[1], serial)
    objects = {
        _DEVICE_TYPE: _single("Device type", _number(4, 0)),
        _NAME: _single("Name", ObjectEntry("Name", DataType.VISIBLE_STRING, name)),
        IDENTITY: _record("Identity", [_number(4, each) for each in identity]),
        _SM_TYPES: _record("Sync managers", [_number(1, kind) for kind in (1, 2, 3, 4)]),
    }
    for manager, pdos in ((SM_OUTPUTS, image.outputs), (SM_INPUTS, image.inputs)):
        objects[SM_ASSIGNMENT + manager] = _record(
            "Assignment", [_number(2, index) for index, _entries in pdos]
        )
        for index, entries in pdos:
            objects[index] = _record("Mapping", [_number(4, one.mapping) for one in entries])
    for each in device.start_up:
        known = objects.get(each.index)
        settings = dict(known.entries) if known is not None else {}
        settings[each.sub] = ObjectEntry(
            "Setting", _BY_SIZE[len(each.content)], bytes(len(each.content)), writable=True
        )
        settings[0] = _number(1, max(settings))
        objects[each.index] = DictionaryObject("Settings", dict(sorted(settings.items())), True)
    return dict(sorted(objects.items()))


def _number(size: int, value: int) -> ObjectEntry:
    return ObjectEntry("", _BY_SIZE[size], value.to_bytes(size, "little"))


def _single(name: str, entry: ObjectEntry) -> DictionaryObject:
    return DictionaryObject(name, {0: entry}, record=False, kind=entry.kind)


def _record(name: str, entries: list[ObjectEntry]) -> DictionaryObject:
    numbered = dict(enumerate(entries, start=1))
    return DictionaryObject(name, {0: _number(1, len(entries)), **numbered}, record=True)


def _category(kind: int, content: bytes) -> bytes:
    content += bytes(len(content) % 2)
    return struct.pack("<HH", kind, len(content) // 2) + content
