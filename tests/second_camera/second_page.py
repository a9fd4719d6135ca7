"""The tables of docs/integrator/camera_objects.md, read as a maker of cameras reads them.

Only this file is used, and no part of the program: a camera built from the page alone shows whether
the page suffices.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "integrator" / "camera_objects.md"
SIZES = {"BOOL": 1, "USINT": 1, "INT": 2, "UINT": 2, "DINT": 4, "UDINT": 4, "ULINT": 8}
CODES = {"BOOL": 1, "INT": 3, "DINT": 4, "USINT": 5, "UINT": 6, "UDINT": 7, "ULINT": 0x1B,
         "STRING": 9, "OCTET_STRING": 0x0A}  # fmt: skip
"""Data types of CoE (ETG.1000.6, table 64)."""


@dataclass
class Item:
    """An entry: its name, type, bytes (at most), access, limits and value."""

    name: str
    kind: str
    size: int
    access: str
    value: bytes
    low: int | None = None
    high: int | None = None

    @property
    def variable(self) -> bool:
        return self.kind == "OCTET_STRING"

    @property
    def whole_number(self) -> bool:
        return self.kind in SIZES and self.kind != "BOOL"


@dataclass
class Thing:
    """An object: its name, its entries, and whether it is a record."""

    name: str
    record: bool
    items: dict[int, Item] = field(default_factory=dict)


def rows(text: str) -> list[list[str]]:
    """Return the cells of the table lines in a text, without its head."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def between(text: str, begin: str, end: str) -> str:
    """Return the text behind one line and before another."""
    return text.split(begin, 1)[1].split(end, 1)[0]


def layout(text: str, begin: str, end: str) -> list[tuple[str, str]]:
    """Return names and types of process data."""
    return [(row[1], row[2]) for row in rows(between(text, begin, end))]


def things(text: str) -> dict[int, Thing]:
    """Return all objects of the page."""
    found: dict[int, Thing] = {}
    for part in text.split("\n### 0x")[1:]:
        head, body = part.split("\n", 1)
        index, name = int(head[:4], 16), head[5:]
        table = rows(body)
        if not table:
            found[index] = _like(found, index, name, body)
            continue
        record = table[0][0] != "00"
        items = {int(row[0], 16): _item(row) for row in table}
        if record:
            items = {0: Item("Highest entry", "USINT", 1, "ro", bytes([max(items)])), **items}
        found[index] = Thing(name, record, items)
    return found


def _like(found: dict[int, Thing], index: int, name: str, body: str) -> Thing:
    """Return an object that is "As 0x1a10" or "As 0x6100": the same for another frame."""
    match = re.search(r"As (0x[0-9a-fA-F]+)", body)
    assert match is not None, body
    model_index = int(match[1], 16)
    model = found[model_index]
    items = {}
    for sub, item in model.items.items():
        value = item.value
        if model_index == 0x1A10 and sub:
            mapping = int.from_bytes(value, "little") + ((index - model_index) * 0x10 << 16)
            value = mapping.to_bytes(4, "little")
        items[sub] = Item(item.name, item.kind, item.size, item.access, value)
    return Thing(name, model.record, items)


def _item(row: list[str]) -> Item:
    _sub, name, kind, access, _unit, default, meaning = row
    length = re.fullmatch(r"(STRING|OCTET_STRING)\((\d+)\)", kind)
    if length:
        size = int(length[2])
        value = default.encode("ascii") if length[1] == "STRING" else b""
        return Item(name, length[1], size, access, value)
    number = int(default, 0) if default else 0
    value = number.to_bytes(SIZES[kind], "little")
    limits = re.search(r"(\d+) to (\d+)\.(?: |$)", meaning) if access != "ro" else None
    low, high = (int(limits[1]), int(limits[2])) if limits else (None, None)
    return Item(name, kind, SIZES[kind], access, value, low, high)


def eeprom(text: str, serial: int, alias: int) -> bytearray:
    """Return an EEPROM as the page describes it, in the format of ETG.2010."""
    row = next(row for row in rows(between(text, "## EEPROM", "All words")) if "IP core" in row[0])
    head = bytearray(bytes.fromhex(row[4].strip("`").replace(" ", "")))
    struct.pack_into("<H", head, 8, alias)
    head += struct.pack("<H", crc8(head))
    head += struct.pack("<IIII", *identity(text), serial) + bytes(8)
    boxes = struct.pack("<HHHH", 0x1000, 256, 0x1100, 256)
    head += boxes + boxes + struct.pack("<H", 0x000C)
    head = head.ljust(0x7C, b"\x00") + struct.pack("<HH", 31, 1)
    texts: list[str] = []

    def number(name: str) -> int:
        if name not in texts:
            texts.append(name)
        return texts.index(name) + 1

    found = re.search(r"group `(\w+)` \(bytes 0 and 14\), name `([^`]+)` \(byte 3 and", text)
    flags = re.search(r"flags (0x\w+) \(byte 11", text)
    assert found is not None
    assert flags is not None
    group, name = number(found[1]), number(found[2])
    general = struct.pack(
        "<BBBBBBB4xB2xBBH", group, 0, name, name, 0, 0x23, 1, int(flags[1], 16), group, 0, 0x0011
    )
    body = _category(30, general.ljust(32, b"\x00")) + _category(40, b"\x01\x02")
    managers = re.findall(r"(0x1\d00) (\d+) (0x\d+) (\d) (\d)", text)
    body += _category(41, b"".join(
        struct.pack("<HHBBBB", int(a, 16), int(b), int(c, 16), 0, int(d), int(e))
        for a, b, c, d, e in managers))  # fmt: skip
    objects = things(text)
    for index in (0x1A00, *range(0x1A10, 0x1A1C)):
        body += _category(50, _pdo(objects, index, 3, number))
    body += _category(51, _pdo(objects, 0x1600, 2, number))
    clock = b""
    modes = r"`(\w+)` with activation (0x\d+), factors (-?\d+) and (-?\d+), \"([^\"]+)\""
    for mode, activation, sync0, sync1, words in re.findall(modes, text):
        clock += struct.pack(
            "<12xhHhBB4x",
            int(sync1), int(activation, 16), int(sync0), number(mode), number(words),
        )  # fmt: skip
    body += _category(60, clock)
    strings = bytes([len(texts)]) + b"".join(bytes([len(t)]) + t.encode() for t in texts)
    whole = bytes(head) + _category(10, strings) + body + b"\xff\xff"
    return bytearray(whole.ljust(4096, b"\xff"))


def identity(text: str) -> tuple[int, int, int]:
    """Return vendor, product and revision."""
    words = [re.search(rf"\| {word}.*?(0x[0-9a-f]{{8}})\. \|", text) for word in
             ("0x08 to 0x09", "0x0A to 0x0B", "0x0C to 0x0D")]  # fmt: skip
    vendor, product, revision = (int(word[1], 16) for word in words if word is not None)
    return vendor, product, revision


def crc8(content: bytes | bytearray) -> int:
    """Return the check sum of words 0 to 6."""
    crc = 0xFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    return crc


def _pdo(objects: dict[int, Thing], index: int, manager: int, number: object) -> bytes:
    assert callable(number)
    thing = objects[index]
    entries = [item for sub, item in thing.items.items() if sub]
    name = number(thing.name.removesuffix(" mapping"))
    content = struct.pack("<HBBBBH", index, len(entries), manager, 0, name, 0x11)
    for item in entries:
        mapping = int.from_bytes(item.value, "little")
        kind = objects[mapping >> 16].items[mapping >> 8 & 0xFF].kind
        content += struct.pack(
            "<HBBBBH", mapping >> 16, mapping >> 8 & 0xFF, number(item.name), CODES[kind],
            mapping & 0xFF, 0,
        )  # fmt: skip
    return content


def _category(kind: int, content: bytes) -> bytes:
    content += bytes(len(content) % 2)
    return struct.pack("<HH", kind, len(content) // 2) + content
