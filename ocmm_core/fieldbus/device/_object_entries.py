"""Elements of an object dictionary: entries with type, access, limits and unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from ocmm_core.fieldbus.device._camera_slave import DataType

SIZES = {
    DataType.BOOLEAN: 1,
    DataType.USINT: 1,
    DataType.INT: 2,
    DataType.UINT: 2,
    DataType.DINT: 4,
    DataType.UDINT: 4,
    DataType.ULINT: 8,
}
"""Bytes of fixed-length types in a single-entry transfer."""
_SIGNED = (DataType.INT, DataType.DINT)
GENERAL_RECORD = 0x002A
"""Data type of a record without its own type (ETG.1020)."""


class Access(Enum):
    """Write access to an entry."""

    READ = "ro"
    WRITE = "rw"
    WRITE_PREOP = "rw in PREOP"
    """The master, while no frames are made."""


@dataclass(frozen=True, slots=True)
class ObjectEntry:
    """One value of the dictionary."""

    name: str
    kind: DataType
    value: bytes
    writable: bool = False
    preop_only: bool = False
    """`writable`, `preop_only`: writable by the master; only while no frames are made."""
    unit: str = ""
    text: str = ""
    low: int | None = None
    high: int | None = None
    """`low`, `high`: limits of a writable number; None: limits of the type."""
    max_bytes: int = 0
    """Maximum length of variable text or octets; 0: fixed length."""
    live: bool = False
    """Computed when read; ``value`` only defines its length."""
    mapped: bool = False

    @property
    def access(self) -> Access:
        if not self.writable:
            return Access.READ
        return Access.WRITE_PREOP if self.preop_only else Access.WRITE

    @property
    def room(self) -> int:
        """Return its maximum size in bytes."""
        return max(len(self.value), self.max_bytes)

    @property
    def is_number(self) -> bool:
        return self.kind in SIZES

    @property
    def bits(self) -> int:
        """Return the size given in descriptions."""
        return 1 if self.kind == DataType.BOOLEAN else 8 * self.room

    def number(self, value: bytes) -> int:
        return int.from_bytes(value, "little", signed=self.kind in _SIGNED)


@dataclass(frozen=True, slots=True)
class DictionaryObject:
    """An object: a single value (entry 0) or a record (entry 0 is the last number)."""

    name: str
    entries: Mapping[int, ObjectEntry]
    record: bool
    kind: int = GENERAL_RECORD
    """Data type in descriptions: of the single value or the record."""
    text: str = ""


def number(
    name: str,
    kind: DataType,
    value: int = 0,
    text: str = "",
    *,
    unit: str = "",
    access: Access = Access.READ,
    low: int | None = None,
    high: int | None = None,
    live: bool = False,
    mapped: bool = False,
) -> ObjectEntry:
    content = value.to_bytes(SIZES[kind], "little", signed=kind in _SIGNED)
    return ObjectEntry(
        name, kind, content, access is not Access.READ, access is Access.WRITE_PREOP,
        unit, text, low, high, live=live, mapped=mapped,
    )  # fmt: skip


def text_entry(name: str, value: str) -> ObjectEntry:
    """Return an entry that holds ASCII text."""
    return ObjectEntry(name, DataType.VISIBLE_STRING, value.encode("ascii"))


def octets(
    name: str,
    max_bytes: int,
    text: str = "",
    *,
    access: Access = Access.READ,
    live: bool = True,
    value: bytes = b"",
) -> ObjectEntry:
    """Return an entry of up to `max_bytes` octets."""
    return ObjectEntry(
        name, DataType.OCTET_STRING, value, access is not Access.READ, text=text,
        max_bytes=max_bytes, live=live,
    )  # fmt: skip


def variable(entry: ObjectEntry) -> DictionaryObject:
    """Return an object with one value."""
    return DictionaryObject(entry.name, {0: entry}, record=False, kind=entry.kind, text=entry.text)


def record(
    name: str,
    entries: Mapping[int, ObjectEntry] | list[ObjectEntry],
    text: str = "",
    *,
    kind: int = GENERAL_RECORD,
) -> DictionaryObject:
    """Return a record; a list of entries is numbered from 1."""
    numbered = dict(enumerate(entries, start=1)) if isinstance(entries, list) else dict(entries)
    count = number("Highest entry", DataType.USINT, max(numbered))
    return DictionaryObject(name, {0: count, **numbered}, record=True, kind=kind, text=text)
