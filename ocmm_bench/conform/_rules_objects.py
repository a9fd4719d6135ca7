"""Rules of the objects: each entry with its type, access, limits and refusals."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import INIT, OP, PREOP, SAFEOP
from ocmm_bench.conform._sdo_talk import SdoRefusal
from ocmm_core.fieldbus import device

SECTION = "Objects"
READ_ONLY, NO_COMPLETE, NO_OBJECT, NO_ENTRY = 0x06010002, 0x06010004, 0x06020000, 0x06090011
LENGTH, VALUE, TOO_HIGH, TOO_LOW = 0x06070010, 0x06090030, 0x06090031, 0x06090032
BUSY, STATE, NO_DATA = 0x08000021, 0x08000022, 0x08000024
_SNAPSHOT_CHUNK = (device.SNAPSHOT, 0x0A)
_COMMANDS = {(device.BLACK_IMAGE, 1), (device.SNAPSHOT, 5), (device.CONFIGURATION, 4)}
"""Commands, or with preconditions; other rules write them."""
_OWN = {(device.IDENTITY, 4), (device.INFORMATION, 1)}
"""Differ between cameras."""
_ABSENT = ((0x1002, 0), (0x2000, 0), (0x5FFF, 1), (0x8002, 1), (0xA001, 0), (0xFFFF, 0))
_SOFTWARE_VERSION = 0x100A


def reading(bench: Bench, see: RuleFindings) -> None:
    """Read every entry: its length, and its specified value."""
    bench.again(PREOP)
    for index, sub, entry in _entries(bench):
        found = bench.mail.read(index, sub)
        name = f"{index:#06x}:{sub:02X} {entry.name}"
        if isinstance(found, SdoRefusal):
            nothing = (index, sub) == _SNAPSHOT_CHUNK and found.code == NO_DATA
            see.expect(nothing, f"Reading {name} is {found}.")
        elif entry.max_bytes:
            see.expect(len(found) <= entry.max_bytes, f"{name} has {len(found)} bytes.")
        elif not entry.is_number:
            text = found.rstrip(b"\x00")
            see.expect(bool(text) and text.isascii(), f"{name} is no ASCII text.")
            if index == 0x1008:
                see.equal(name, text, entry.value)
        else:
            see.equal(f"The length of {name}", len(found), len(entry.value))
            fixed = not entry.live and not entry.writable and (index, sub) not in _OWN
            if fixed and len(found) == len(entry.value):
                see.equal(name, entry.number(found), entry.number(entry.value))


def identity(bench: Bench, see: RuleFindings) -> None:
    """Compare values that are available in two places."""
    bench.go(PREOP)
    see.equal("0x1018:04, by the EEPROM", bench.mail.count(device.IDENTITY, 4), bench.serial)
    see.equal(
        "0x9010:01, by 0x100A",
        bench.mail.value(device.VERSIONS, 1),
        bench.mail.value(_SOFTWARE_VERSION),
    )
    see.expect(
        bench.mail.count(device.INFORMATION, 1) != 0,
        "0x9000:01 has no serial number of the sensor.",
    )
    for sub, name in ((2, "width"), (3, "height")):
        see.expect(
            bench.mail.count(device.INFORMATION, sub) >= 64,
            f"The {name} of the sensor is below 64 px.",
        )


def absent(bench: Bench, see: RuleFindings) -> None:
    """Read and write absent objects."""
    bench.go(PREOP)
    for index, sub in _ABSENT:
        _refused(see, f"Reading {index:#06x}", bench.mail.read(index, sub), NO_OBJECT)
        _refused(see, f"Writing {index:#06x}", bench.mail.write(index, sub, b"\x00"), NO_OBJECT)
    for index, item in bench.objects.items():
        last = max(item.entries)
        gaps = [sub for sub in range(last) if sub not in item.entries]
        for sub in (*gaps[:1], last + 1):
            found = bench.mail.read(index, sub)
            _refused(see, f"Reading {index:#06x}:{sub:02X}", found, NO_ENTRY)


def read_only(bench: Bench, see: RuleFindings) -> None:
    """Write every read-only entry."""
    bench.go(PREOP)
    for index, sub, entry in _entries(bench):
        if entry.access is device.Access.READ:
            found = bench.mail.write(index, sub, bytes(max(1, min(4, len(entry.value)))))
            _refused(see, f"Writing {index:#06x}:{sub:02X} {entry.name}", found, READ_ONLY)


def limits(bench: Bench, see: RuleFindings) -> None:
    """Write every number at its limits and just outside them."""
    bench.go(PREOP)
    for index, sub, entry in _numbers(bench):
        name = f"{index:#06x}:{sub:02X} {entry.name}"
        before = bench.mail.value(index, sub)
        size = len(entry.value)
        lowest, highest = 0, (1 << 8 * size) - 1
        low = lowest if entry.low is None else entry.low
        high = highest if entry.high is None else entry.high
        if low > lowest:
            found = bench.mail.write(index, sub, _packed(low - 1, size))
            _refused(see, f"{low - 1} in {name}", found, TOO_LOW)
        if high < highest:
            found = bench.mail.write(index, sub, _packed(high + 1, size))
            _refused(see, f"{high + 1} in {name}", found, TOO_HIGH)
        if (index, sub) in _COMMANDS or index == device.HISTORY:
            continue
        for value in dict.fromkeys((low, high)):
            refused = bench.mail.write(index, sub, _packed(value, size))
            if see.expect(refused is None, f"{value} in {name} is {refused}."):
                see.equal(name, bench.mail.value(index, sub), _packed(value, size))
        bench.mail.set(index, sub, before)
        see.equal(f"{name} as before", bench.mail.value(index, sub), before)


def lengths(bench: Bench, see: RuleFindings) -> None:
    """Write too many bytes and too few."""
    bench.go(PREOP)
    for index, sub, entry in _entries(bench):
        if entry.access is device.Access.READ:
            continue
        wrong = [entry.max_bytes + 1] if entry.max_bytes else [len(entry.value) + 1]
        wrong += [len(entry.value) - 1] if not entry.max_bytes and len(entry.value) > 1 else []
        for size in wrong:
            found = bench.mail.write(index, sub, bytes(size))
            _refused(see, f"{size} bytes in {index:#06x}:{sub:02X} {entry.name}", found, LENGTH)


def only_in_preop(bench: Bench, see: RuleFindings) -> None:
    """Write the configuration while the camera exposes."""
    bench.again(PREOP)
    values = {
        (index, sub): bench.mail.value(index, sub)
        for index, sub, entry in _entries(bench)
        if entry.access is device.Access.WRITE_PREOP
    }
    for state in (SAFEOP, OP):
        if state == OP:
            bench.streaming()
            bench.feeding = True
        else:
            bench.go(SAFEOP)
        for (index, sub), value in values.items():
            found = bench.mail.write(index, sub, value)
            _refused(see, f"Writing {index:#06x}:{sub:02X} while frames are made", found, STATE)
        refused = bench.mail.write(device.CALIBRATION, 5, bench.mail.value(device.CALIBRATION, 5))
        see.expect(refused is None, f"Writing the note (0x8010:05) in operation is {refused}.")
    bench.go(INIT)


def complete_access(bench: Bench, see: RuleFindings) -> None:
    """Read and write records as a whole."""
    bench.again(PREOP)
    for index in (device.IDENTITY, device.CONFIGURATION, device.WINDOWS):
        item = bench.objects[index]
        each = b"".join(bench.mail.value(index, sub) for sub in item.entries if sub)
        see.equal(
            f"{index:#06x} as a whole from entry 1", bench.mail.read(index, 1, complete=True), each
        )
        whole = bytes([max(item.entries), 0]) + each
        see.equal(f"{index:#06x} as a whole", bench.mail.read(index, 0, complete=True), whole)
    for index in (device.CALIBRATION, device.BLACK_IMAGE, device.VERSIONS, device.HISTORY):
        found = bench.mail.read(index, 1, complete=True)
        _refused(see, f"{index:#06x} as a whole", found, NO_COMPLETE)
    before = bench.mail.value(device.WINDOWS, 1), bench.mail.value(device.WINDOWS, 32)
    each = struct.pack("<32H", *range(1, 33))
    see.expect(
        bench.mail.write(device.WINDOWS, 1, each, complete=True) is None,
        "0x8001 cannot be written as a whole.",
    )
    see.equal("0x8001 as it was written", bench.mail.read(device.WINDOWS, 1, complete=True), each)
    refused = bench.mail.write(device.WINDOWS, 1, each[:-2], complete=True)
    _refused(see, "0x8001 as a whole, an entry too short", refused, LENGTH)
    bad = struct.pack("<IIHBH", 200_000, 20_000, 0xFFFF, 0, 0)
    values = bench.mail.read(device.CONFIGURATION, 1, complete=True)
    refused = bench.mail.write(device.CONFIGURATION, 1, bad, complete=True)
    _refused(see, "0x8000 as a whole, one value too high", refused, TOO_HIGH)
    see.equal(
        "0x8000 after a refused record",
        bench.mail.read(device.CONFIGURATION, 1, complete=True),
        values,
    )
    bench.mail.set(device.WINDOWS, 1, before[0])
    for sub in range(1, 33):
        bench.mail.set(device.WINDOWS, sub, bytes(2))
    refused = bench.mail.write(device.IDENTITY, 1, bytes(16), complete=True)
    _refused(see, "Writing 0x1018 as a whole", refused, READ_ONLY)


def configuration_sum(bench: Bench, see: RuleFindings) -> None:
    """Compare the checksum in the header with the written configuration."""
    import binascii

    bench.again(PREOP)
    before = bench.mail.value(device.CONFIGURATION, 3)
    for threshold in (struct.pack("<H", 333), before):
        bench.go(PREOP)
        bench.mail.set(device.CONFIGURATION, 3, threshold)
        values = [bench.mail.value(device.CONFIGURATION, sub) for sub in range(1, 6)]
        values += [bench.mail.value(device.WINDOWS, sub) for sub in range(1, 33)]
        expected = binascii.crc_hqx(b"".join(values), 0xFFFF)
        see.equal("config_crc in the header", bench.streaming().header.config_crc, expected)
    bench.go(INIT)


def _entries(bench: Bench) -> Iterator[tuple[int, int, device.ObjectEntry]]:
    for index, item in bench.objects.items():
        for sub, entry in item.entries.items():
            yield index, sub, entry


def _numbers(bench: Bench) -> Iterator[tuple[int, int, device.ObjectEntry]]:
    for index, sub, entry in _entries(bench):
        if entry.writable and entry.is_number and entry.kind is not device.DataType.BOOLEAN:
            yield index, sub, entry


def _packed(value: int, size: int) -> bytes:
    return value.to_bytes(size, "little")


def _refused(see: RuleFindings, what: str, found: object, code: int) -> None:
    if isinstance(found, SdoRefusal):
        see.equal(f"The code of: {what}", found.code, code)
    else:
        see.expect(False, f"{what} is not refused ({code:#010x}).")


RULES = (
    Rule("object.read", SECTION, "Every entry is there, with its length and its fixed value.",
         reading),
    Rule("object.identity", SECTION, "Serial numbers and versions agree with each other.",
         identity),
    Rule("object.absent", SECTION, "What is not there is refused.", absent),
    Rule("object.read_only", SECTION, "What may only be read is not written.", read_only),
    Rule("object.limits", SECTION, "Numbers are kept within their limits and refused outside.",
         limits),
    Rule("object.lengths", SECTION, "Values of a wrong length are refused.", lengths),
    Rule("object.preop", SECTION, "The configuration is not changed while frames are made.",
         only_in_preop),
    Rule("object.complete", SECTION, "Records of whole numbers travel as a whole, others do not.",
         complete_access),
    Rule("object.config_crc", SECTION, "The header shows the check sum of the configuration.",
         configuration_sum),
)  # fmt: skip
