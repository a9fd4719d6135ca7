"""Process data of a described camera, as bits and as mapping."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.fieldbus.described._device_file import (
    FORMATS,
    MOST_BITS,
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
    "LINT": 0x15, "ULINT": 0x1B, "REAL32": 0x08, "REAL64": 0x11, "BOOL": 0x01, "BITS": 0x00,
}  # fmt: skip
"""ETG.1000.6, table 63."""
_PACKED: dict[TypeName, str] = {"REAL32": "<f", "REAL64": "<d"}
_WINDOW = 8
"""Bytes read at once: a number of 64 bits spans nine."""
_SPOT = (Role.X, Role.Y, Role.INTENSITY)
_OF_SLOTS = (*_SPOT, Role.VALID)


@dataclass(frozen=True, slots=True)
class PlacedEntry:
    index: int
    sub: int
    type: TypeName
    role: Role
    slot: int
    exposure: int
    """`slot`, `exposure`: -1 if common to all."""
    at: int
    bits: int
    """`at`, `bits`: offset and length, bits."""
    value: int

    @property
    def is_signed(self) -> bool:
        return FORMATS[self.type][1] == "i"

    @property
    def limits(self) -> tuple[int, int]:
        """Return the smallest and largest integer."""
        return (
            (-(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1)
            if self.is_signed
            else (0, (1 << self.bits) - 1)
        )

    @property
    def mapping(self) -> int:
        """Return the word of the entry in a mapping object."""
        return self.index << 16 | self.sub << 8 | self.bits

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
        self._of_slots = {
            role: _Column.from_entries(
                [one for one in self._all if one.role is role and one.slot >= 0]
            )
            for role in _OF_SLOTS
            if any(one.role is role and one.slot >= 0 for one in self._all)
        }
        mask = sum(((1 << one.bits) - 1) << one.at for one in self._all if one.role in _SPOT)
        self._spot_mask = np.frombuffer(mask.to_bytes(self.input_bytes, "little"), np.uint8)

    @property
    def heartbeat(self) -> tuple[int, int]:
        """Return offset and size of the cycle number in the outputs, bytes.

        (0, 0) if none, or if it shares a byte with another entry.
        """
        for _index, entries in self.outputs:
            for entry in entries:
                if entry.role is Role.HEARTBEAT and not (entry.at % 8 or entry.bits % 8):
                    return entry.at // 8, entry.bits // 8
        return 0, 0

    def is_of_slots(self, role: Role) -> bool:
        """Return whether each slot has its own value of a role."""
        return role in self._of_slots

    def numbers(self, content: bytes, role: Role) -> NDArray[np.float64]:
        """Return the numbers of a role of every spot, (exposures, slots)."""
        column = self._of_slots[role]
        found = np.empty((self._device.exposures, self._device.slots))
        found[column.exposures, column.slots] = column.read(content)
        return found

    def number(self, content: bytes, role: Role, exposure: int = -1) -> int | None:
        """Return the first integer of a role, or None; one outside the exposures applies to all."""
        for entry in self._all:
            if entry.role is role and entry.exposure in (exposure, -1):
                whole = content[entry.at // 8 : (entry.at + entry.bits + 7) // 8]
                return _wrapped(int.from_bytes(whole, "little") >> entry.at % 8, entry)
        return None

    def spot_bytes(self, content: bytes) -> bytes:
        """Return the inputs with all but spot positions and intensities cleared."""
        return (np.frombuffer(content, np.uint8) & self._spot_mask).tobytes()

    def fits(self, role: Role, numbers: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which numbers fit into the type of a role."""
        entry = next(one for one in self._all if one.role is role)
        if entry.type in _PACKED:
            return np.ones(numbers.shape, np.bool_)
        low, high = entry.limits
        return np.asarray((numbers >= low) & (numbers <= high))

    def of_each_exposure(self, role: Role) -> bool:
        """Return whether each exposure has its own value of a role."""
        return any(one.role is role and one.exposure >= 0 for one in self._all)

    def bits(self, role: Role) -> int:
        """Return the number of bits of a role's first value."""
        return next(entry.bits for entry in self._all if entry.role is role)

    def pack_inputs(self, values: dict[tuple[Role, int, int], float]) -> bytes:
        """Return inputs with values by role, exposure and slot; others are zero.

        Integers wrap around, as counters do.
        """
        image = 0
        for entry in self._all:
            value = values.get((entry.role, entry.exposure, entry.slot), 0.0)
            image |= _pattern(value, entry) << entry.at
        return image.to_bytes(self.input_bytes, "little")

    def pack_outputs(self, token: int) -> bytes:
        """Return the outputs of a bus cycle with this number."""
        image = 0
        for _index, entries in self.outputs:
            for entry in entries:
                value = token if entry.role is Role.HEARTBEAT else entry.value
                image |= _pattern(value, entry) << entry.at
        return image.to_bytes(self.output_bytes, "little")


@dataclass(frozen=True, slots=True)
class _Column:
    """Numbers of one type, one of each spot."""

    exposures: NDArray[np.int64]
    slots: NDArray[np.int64]
    at: NDArray[np.int64]
    entry: PlacedEntry
    """Any of them."""

    @classmethod
    def from_entries(cls, entries: list[PlacedEntry]) -> _Column:
        places = np.array([(one.exposure, one.slot, one.at) for one in entries], np.int64)
        return cls(places[:, 0], places[:, 1], places[:, 2], entries[0])

    def read(self, content: bytes) -> NDArray[np.float64]:
        """Return the numbers in order."""
        raw = np.frombuffer(content + bytes(_WINDOW + 1), np.uint8)
        first, shift = self.at >> 3, (self.at & 7).astype(np.uint64)
        low = raw[first[:, None] + np.arange(_WINDOW)].view("<u8")[:, 0] >> shift
        # A shift by 64 is undefined: two shifts.
        high = raw[first + _WINDOW].astype(np.uint64) << (np.uint64(63) - shift) << np.uint64(1)
        form, unused = np.dtype(FORMATS[self.entry.type]), np.uint64(MOST_BITS - self.entry.bits)
        found = (low | high) << unused
        if form.kind == "f":
            # A camera may send signalling NaN.
            with np.errstate(invalid="ignore"):
                pattern = (found >> unused).astype(f"<u{form.itemsize}")
                wide: NDArray[np.float64] = pattern.view(form).astype(np.float64)
            return wide
        # Arithmetic shifts extend the sign.
        signed = found.view(np.int64) >> unused.astype(np.int64)
        number: NDArray[np.float64] = (signed if self.entry.is_signed else found >> unused).astype(
            np.float64
        )
        return number


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
                        0 if entry.is_gap else entry.index + shift, sub, entry.type, role, slot,
                        0 if exposure < 0 and slot >= 0 else exposure, at, entry.width,
                        entry.value,
                    )  # fmt: skip
                    at += one.bits
                    entries.append(one)
            placed.append((pdo.index + shift, tuple(entries)))
    return tuple(placed)


def _wrapped(value: int, entry: PlacedEntry) -> int:
    low, _high = entry.limits
    return (value - low) % (1 << entry.bits) + low


def _pattern(value: float, entry: PlacedEntry) -> int:
    """Return the bits of a value; integers wrap around."""
    if entry.type in _PACKED:
        return int.from_bytes(struct.pack(_PACKED[entry.type], value), "little")
    return round(value) % (1 << entry.bits)


def _spread(entry: Entry, slots: int) -> Iterator[tuple[int, Role, int]]:
    """Yield sub-index, role and slot of an entry's expansion."""
    sub = entry.sub
    for slot in range(slots) if entry.slots else (entry.slot,):
        for role in entry.role:
            yield sub, role, slot
            sub += not entry.is_gap


def _size(objects: tuple[tuple[int, tuple[PlacedEntry, ...]], ...]) -> int:
    """Return the bytes that these objects fill; the last one may be filled in part."""
    return (sum(entry.bits for _index, entries in objects for entry in entries) + 7) // 8
