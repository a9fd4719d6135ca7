"""Process data of a described camera, as numpy structure and as mapping."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.fieldbus.described._device_file import (
    FORMATS,
    DeviceDescription,
    Entry,
    ProcessObject,
    Role,
    TypeName,
)

MOST_BYTES = 1024
"""Inputs of one camera: four must fit into the process image of a bus."""
_CODES: dict[TypeName, int] = {
    "SINT": 0x02, "USINT": 0x05, "INT": 0x03, "UINT": 0x06, "DINT": 0x04, "UDINT": 0x07,
    "LINT": 0x15, "ULINT": 0x1B, "REAL32": 0x08, "REAL64": 0x11,
}  # fmt: skip
"""ETG.1000.6, table 63."""
_PACKED: dict[TypeName, str] = {
    "SINT": "b", "USINT": "B", "INT": "h", "UINT": "H", "DINT": "i", "UDINT": "I",
    "LINT": "q", "ULINT": "Q", "REAL32": "f", "REAL64": "d",
}  # fmt: skip
_SPOT = (Role.X, Role.Y, Role.INTENSITY)


@dataclass(frozen=True, slots=True)
class PlacedEntry:
    """A placed entry."""

    index: int
    sub: int
    type: TypeName
    role: Role
    slot: int
    exposure: int
    """`slot`, `exposure`: -1 if common to all."""
    at: int
    """Offset, bytes."""
    value: int

    @property
    def size(self) -> int:
        return np.dtype(FORMATS[self.type]).itemsize

    @property
    def mapping(self) -> int:
        """Return the word of the entry in a mapping object."""
        return self.index << 16 | self.sub << 8 | 8 * self.size

    @property
    def code(self) -> int:
        return _CODES[self.type]


class ProcessImage:
    """Inputs and outputs of a described camera, mapping objects in wire order."""

    def __init__(self, device: DeviceDescription) -> None:
        self._device = device
        self.inputs = _placed(device, device.inputs)
        self.outputs = _placed(device, device.outputs)
        self.input_bytes = _size(self.inputs)
        self.output_bytes = _size(self.outputs)
        self._all = [entry for _index, entries in self.inputs for entry in entries]
        # Entries follow each other without gaps.
        self._struct = struct.Struct("<" + "".join(_PACKED[entry.type] for entry in self._all))
        self._places = {
            role: tuple(
                np.array(part)
                for part in zip(
                    *(
                        (entry.exposure, entry.slot, entry.at)
                        for entry in self._all
                        if entry.role is role
                    ),
                    strict=True,
                )
            )
            for role in _SPOT
            if device.has(role)
        }
        self._alike = {
            role: next(entry.type for entry in self._all if entry.role is role)
            for role in self._places
        }
        self._of_spots = np.array(
            [
                at
                for one in self._all
                if one.role in _SPOT
                for at in range(one.at, one.at + one.size)
            ],
            np.int64,
        )

    @property
    def heartbeat(self) -> tuple[int, int]:
        """Return offset and size of the cycle number in the outputs; (0, 0) if none."""
        for _index, entries in self.outputs:
            for entry in entries:
                if entry.role is Role.HEARTBEAT:
                    return entry.at, entry.size
        return 0, 0

    def numbers(self, content: bytes, role: Role) -> NDArray[np.float64]:
        """Return the numbers of a role of every spot, (exposures, slots)."""
        exposures, slots, at = self._places[role]
        form = np.dtype(FORMATS[self._alike[role]])
        raw = np.frombuffer(content, np.uint8)
        columns = raw[at[:, None] + np.arange(form.itemsize)]
        found = np.empty((self._device.exposures, self._device.slots))
        found[exposures, slots] = np.ascontiguousarray(columns).view(form)[:, 0]
        return found

    def number(self, content: bytes, role: Role, exposure: int = -1) -> int | None:
        """Return the first integer of a role, or None; one outside the exposures applies to all."""
        for entry in self._all:
            if entry.role is role and entry.exposure in (exposure, -1):
                raw = content[entry.at : entry.at + entry.size]
                return int(np.frombuffer(raw, FORMATS[entry.type])[0])
        return None

    def spot_bytes(self, content: bytes) -> bytes:
        """Return only the bytes with spot positions and intensities."""
        return np.frombuffer(content, np.uint8)[self._of_spots].tobytes()

    def fits(self, role: Role, numbers: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which numbers fit into the type of a role."""
        form = np.dtype(FORMATS[self._alike[role]])
        if form.kind == "f":
            return np.ones(numbers.shape, np.bool_)
        limits = np.iinfo(form)
        return np.asarray((numbers >= limits.min) & (numbers <= limits.max))

    def of_each_exposure(self, role: Role) -> bool:
        """Return whether each exposure has its own value of a role."""
        return any(one.role is role and one.exposure >= 0 for one in self._all)

    def bits(self, role: Role) -> int:
        """Return the number of bits of a role's first value."""
        return next(8 * entry.size for entry in self._all if entry.role is role)

    def pack_inputs(self, values: dict[tuple[Role, int, int], float]) -> bytes:
        """Return inputs with values by role, exposure and slot, else zero; integers wrap around."""
        found = [values.get((entry.role, entry.exposure, entry.slot), 0.0) for entry in self._all]
        return self._struct.pack(
            *[
                value if _PACKED[entry.type] in "fd" else _wrapped(round(value), entry.type)
                for entry, value in zip(self._all, found, strict=True)
            ]
        )

    def pack_outputs(self, token: int) -> bytes:
        """Return the outputs of a bus cycle with this number."""
        image = bytearray(self.output_bytes)
        for _index, entries in self.outputs:
            for entry in entries:
                value = token if entry.role is Role.HEARTBEAT else entry.value
                bits = 8 * entry.size
                image[entry.at : entry.at + entry.size] = (value % (1 << bits)).to_bytes(
                    entry.size, "little"
                )
        return bytes(image)


def _placed(
    device: DeviceDescription, objects: tuple[ProcessObject, ...]
) -> tuple[tuple[int, tuple[PlacedEntry, ...]], ...]:
    at = 0
    placed = []
    for pdo in objects:
        for exposure in range(device.exposures) if pdo.exposures else (-1,):
            shift = max(0, exposure) * pdo.step
            entries = []
            for entry in pdo.entries:
                for sub, role, slot in _spread(entry, device.slots):
                    one = PlacedEntry(
                        entry.index + shift, sub, entry.type, role, slot,
                        0 if exposure < 0 and slot >= 0 else exposure, at, entry.value,
                    )  # fmt: skip
                    at += one.size
                    entries.append(one)
            placed.append((pdo.index + shift, tuple(entries)))
    return tuple(placed)


def _wrapped(value: int, kind: TypeName) -> int:
    limits = np.iinfo(FORMATS[kind])
    low, high = int(limits.min), int(limits.max)
    return (value - low) % (high - low + 1) + low


def _spread(entry: Entry, slots: int) -> Iterator[tuple[int, Role, int]]:
    """Yield sub-index, role and slot of an entry's expansion."""
    sub = entry.sub
    for slot in range(slots) if entry.slots else (-1,):
        for role in entry.role:
            yield sub, role, slot
            sub += 1


def _size(objects: tuple[tuple[int, tuple[PlacedEntry, ...]], ...]) -> int:
    return sum(entry.size for _index, entries in objects for entry in entries)
