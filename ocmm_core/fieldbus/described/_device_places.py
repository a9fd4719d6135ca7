"""Positions of description entries, in the object dictionary and the controller."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import _device_file as device_file
from ocmm_core.fieldbus.described._process_image import MOST_BYTES, ProcessImage

_RAM, _RAM_END = 0x1000, 0x3000
_BUFFERS = 3
"""Controllers keep process data in three consecutive buffers."""
_FEWEST_BITS = 8
_SMALLEST_MAILBOX = 16
"""An SDO with headers."""
_MOST = 0xFE
"""Entries of an object, and objects of a sync manager."""
_FIRST, _LAST = 0x1000, 0xFFFF


def check_index(path: Path, field: str, index: int) -> None:
    """Refuse indices outside the dictionary ranges."""
    if not _FIRST <= index <= _LAST:
        raise InputError(
            "device.field",
            f"{path}: field '{field}' names the object {index:#06x}, which cannot be.",
            "Give an index from 0x1000 to 0xffff.",
        )


def check_objects(path: Path, field: str, device: device_file.DeviceDescription) -> None:
    """Refuse impossible process data objects before laying any out."""
    objects = device.inputs if field == "inputs" else device.outputs
    count = sum(device.exposures if pdo.exposures else 1 for pdo in objects)
    if count > _MOST:
        raise InputError(
            "device.entries",
            f"{path}: field '{field}' has {count} process data objects, but at most {_MOST} can "
            "be assigned.",
            "Put more entries into each of them.",
        )
    for pdo in objects:
        check_index(path, field, pdo.index)
        entries = sum(
            len(entry.role) * (device.slots if entry.slots else 1) for entry in pdo.entries
        )
        if entries > _MOST:
            raise InputError(
                "device.entries",
                f"{path}: the process data object {pdo.index:#06x} has {entries} entries.",
                "Spread them over several objects; one holds 254.",
            )
        check_index(
            path, field, pdo.index + ((device.exposures - 1) * pdo.step if pdo.exposures else 0)
        )


def check_places(path: Path, device: device_file.DeviceDescription, image: ProcessImage) -> None:
    """Refuse duplicate or misplaced objects and entries."""
    seen: set[tuple[int, int]] = set()
    for _index, entries in (*image.inputs, *image.outputs):
        for one in (each for each in entries if each.index):
            if one.role is not device_file.Role.IGNORED and (one.index, one.sub) in seen:
                raise InputError(
                    "device.field",
                    f"{path}: entry {one.index:#06x}:{one.sub:02x} is mapped twice.",
                    "Correct index, entry or step.",
                )
            seen.add((one.index, one.sub))
            if not (0 <= one.sub <= 0xFF and _FIRST <= one.index <= _LAST):
                raise InputError(
                    "device.field",
                    f"{path}: entry {one.index:#06x}:{one.sub} cannot be in an object dictionary.",
                    "Spread the entries over several objects.",
                )
    objects = [index for index, _entries in (*image.inputs, *image.outputs)]
    for index in objects:
        if objects.count(index) > 1:
            raise InputError(
                "device.field",
                f"{path}: the process data object {index:#06x} is there twice.",
                "Correct index or step.",
            )
    for each in device.start_up:
        check_index(path, "start_up", each.index)
        if not 0 <= each.sub <= 0xFF:
            raise InputError(
                "device.field",
                f"{path}: field 'start_up' names the entry {each.index:#06x}:{each.sub}, which "
                "cannot be.",
                "Give an entry from 0 to 255.",
            )


def check_values(path: Path, device: device_file.DeviceDescription) -> None:
    """Refuse values out of range of their type."""
    for each in device.start_up:
        if each.type == "BITS":
            raise InputError(
                "device.field",
                f"{path}: field 'start_up' has a value of the type BITS, but objects are whole "
                "bytes.",
                "Give a type with a length of its own.",
            )
        whole = 8 * np.dtype(device_file.FORMATS[each.type]).itemsize
        _check_value(path, "start_up", each.type, 1 if each.type == "BOOL" else whole, each.value)
    for pdo in device.outputs:
        for entry in pdo.entries:
            if device_file.Role.CONSTANT in entry.role:
                _check_value(path, "outputs", entry.type, entry.width, entry.value)


def check_memory(path: Path, device: device_file.DeviceDescription, image: ProcessImage) -> None:
    """Refuse process data and mailboxes that exceed the controller's memory."""
    if image.input_bytes > MOST_BYTES or image.output_bytes > MOST_BYTES:
        raise InputError(
            "device.size",
            f"{path}: the process data have {image.input_bytes} bytes in and "
            f"{image.output_bytes} out; at most {MOST_BYTES} each fit.",
            "Map less.",
        )
    filled = sum(one.bits for _index, entries in image.outputs for one in entries)
    if filled < _FEWEST_BITS:
        raise InputError(
            "device.size",
            f"{path}: the outputs have {filled} bits, and the master lets devices with fewer than "
            f"{_FEWEST_BITS} share a byte.",
            "Map more outputs, or a gap behind them if the device accepts one.",
        )
    out, out_bytes, into, in_bytes = device.mailbox
    if min(out_bytes, in_bytes) < _SMALLEST_MAILBOX:
        raise InputError(
            "device.field",
            f"{path}: field 'mailbox' has {min(out_bytes, in_bytes)} bytes, but an object needs "
            f"{_SMALLEST_MAILBOX}.",
            "Give start and size of the mailbox out, then of the mailbox in.",
        )
    outputs, inputs = device.memory
    areas = [
        (out, out_bytes, "mailbox"),
        (into, in_bytes, "mailbox"),
        (outputs, _BUFFERS * image.output_bytes, "memory"),
        (inputs, _BUFFERS * image.input_bytes, "memory"),
    ]
    for place, (start, size, field) in enumerate(areas):
        if not (start >= _RAM and start + size <= _RAM_END) or size < 1:
            raise InputError(
                "device.field",
                f"{path}: field '{field}' names {start:#06x} with {size} bytes, which is not in "
                f"the memory of a controller ({_RAM:#06x} to {_RAM_END:#06x}).",
                "Correct that field.",
            )
        for other, other_size, _name in areas[:place]:
            if start < other + other_size and other < start + size:
                raise InputError(
                    "device.field",
                    f"{path}: field '{field}': {start:#06x} overlaps {other:#06x}.",
                    "Correct that field; process data have three buffers behind each other.",
                )


def _check_value(
    path: Path, field: str, kind: device_file.TypeName, bits: int, value: float
) -> None:
    form = np.dtype(device_file.FORMATS[kind])
    if form.kind == "f":
        return
    low = -(1 << (bits - 1)) if form.kind == "i" else 0
    high = low + (1 << bits) - 1
    if value != round(value) or not low <= value <= high:
        raise InputError(
            "device.field",
            f"{path}: field '{field}' has the value {value:g}, but a {kind} of {bits} bit(s) is a "
            f"whole number from {low} to {high}.",
            "Correct value or type.",
        )
