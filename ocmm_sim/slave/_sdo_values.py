"""Values of an object dictionary with access control, single or as records.

Refusals have the abort codes of ETG.1000.6, table 41.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import IntEnum

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import DataType, DictionaryObject, ObjectEntry


class Abort(IntEnum):
    TOGGLE = 0x05030000
    COMMAND = 0x05040001
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    ENTRY_0 = 0x06010003
    NO_COMPLETE_ACCESS = 0x06010004
    TOO_LONG_FOR_MAILBOX = 0x06010005
    NO_OBJECT = 0x06020000
    HARDWARE = 0x06060000
    LENGTH = 0x06070010
    NO_ENTRY = 0x06090011
    VALUE = 0x06090030
    TOO_HIGH = 0x06090031
    TOO_LOW = 0x06090032
    NOT_STORED = 0x08000020
    BUSY = 0x08000021
    STATE = 0x08000022
    NO_DATA = 0x08000024


class AbortError(BusError):
    """A refused transfer, with the reason sent to the master."""

    def __init__(self, reason: Abort) -> None:
        super().__init__(
            "bus.refused",
            f"The camera refuses the object ({reason.name}, {reason.value:#010x}).",
            "Check the object and its value.",
        )
        self.reason = reason

    def __reduce__(self) -> tuple[type[AbortError], tuple[Abort]]:  # type: ignore[override]  # made from its reason alone
        return (type(self), (self.reason,))


Address = tuple[int, int]
_COUNT_BYTES = 2
"""Size of entry 0 in a complete record transfer."""


class SdoValues:
    """Values of the entries."""

    def __init__(
        self,
        objects: Mapping[int, DictionaryObject],
        live: Mapping[Address, Callable[[], bytes]],
        written: Mapping[Address, Callable[[bytes], object]],
        configurable: Callable[[], bool],
    ) -> None:
        self._objects = objects
        self._live = live
        self._written = written
        self._configurable = configurable
        self._values = {
            (index, sub): entry.value
            for index, item in objects.items()
            for sub, entry in item.entries.items()
        }

    def put(self, index: int, sub: int, value: bytes) -> None:
        """Set a value from the device side."""
        self._values[index, sub] = value

    def read(self, index: int, sub: int) -> bytes:
        """Return a value; raise `AbortError` if not allowed."""
        self._entry(index, sub)
        live = self._live.get((index, sub))
        return self._values[index, sub] if live is None else live()

    def read_all(self, index: int, first: int) -> bytes:
        """Return a record from entry `first` (0 or 1); raise `AbortError` if not allowed."""
        content = bytearray()
        for sub in self._together(index, first):
            value = self.read(index, sub)
            content += value if sub else value.ljust(_COUNT_BYTES, b"\x00")
        return bytes(content)

    def check_writable(self, index: int, sub: int, *, complete: bool) -> int:
        """Return the writable size in bytes; raise `AbortError` if not allowed."""
        if not complete:
            entry = self._entry(index, sub)
            self._check_access(entry)
            return entry.room
        room = 0
        for each in self._together(index, sub):
            entry = self._entry(index, each)
            if each:
                self._check_access(entry)
            room += entry.room if each else _COUNT_BYTES
        return room

    def write(self, index: int, sub: int, value: bytes) -> None:
        """Check and store a value; raise `AbortError` if not allowed."""
        self.check_writable(index, sub, complete=False)
        self._check_value(self._entry(index, sub), value)
        written = self._written.get((index, sub))
        if written is not None:
            written(value)
        self._values[index, sub] = value

    def write_all(self, index: int, first: int, content: bytes) -> None:
        """Store the values of a record, if all are valid; otherwise raise `AbortError`."""
        if len(content) != self.check_writable(index, first, complete=True):
            raise AbortError(Abort.LENGTH)
        parts, at = [], 0
        for sub in self._together(index, first):
            entry = self._entry(index, sub)
            size = entry.room if sub else _COUNT_BYTES
            value = content[at : at + size]
            at += size
            if not sub:
                if value != entry.value.ljust(_COUNT_BYTES, b"\x00"):
                    raise AbortError(Abort.ENTRY_0)
                continue
            self._check_value(entry, value)
            parts.append((sub, value))
        for sub, value in parts:
            self.write(index, sub, value)

    def _entry(self, index: int, sub: int) -> ObjectEntry:
        item = self._objects.get(index)
        if item is None:
            raise AbortError(Abort.NO_OBJECT)
        entry = item.entries.get(sub)
        if entry is None:
            raise AbortError(Abort.NO_ENTRY)
        return entry

    def _together(self, index: int, first: int) -> list[int]:
        self._entry(index, 0)
        item = self._objects[index]
        if first not in (0, 1):
            raise AbortError(Abort.NO_ENTRY)
        whole_bytes = all(
            entry.is_number and entry.kind != DataType.BOOLEAN for entry in item.entries.values()
        )
        if not item.record or not whole_bytes:
            raise AbortError(Abort.NO_COMPLETE_ACCESS)
        return sorted(sub for sub in item.entries if sub >= first)

    def _check_access(self, entry: ObjectEntry) -> None:
        if not entry.writable:
            raise AbortError(Abort.READ_ONLY)
        if entry.preop_only and not self._configurable():
            raise AbortError(Abort.STATE)

    @staticmethod
    def _check_value(entry: ObjectEntry, value: bytes) -> None:
        if entry.max_bytes:
            if len(value) > entry.max_bytes:
                raise AbortError(Abort.LENGTH)
            return
        if len(value) != len(entry.value):
            raise AbortError(Abort.LENGTH)
        if not entry.is_number:
            return
        number = entry.number(value)
        if entry.high is not None and number > entry.high:
            raise AbortError(Abort.TOO_HIGH)
        if entry.low is not None and number < entry.low:
            raise AbortError(Abort.TOO_LOW)
