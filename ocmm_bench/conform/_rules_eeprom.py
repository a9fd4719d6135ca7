"""Rules of the EEPROM and of the registers loaded from it (ETG.2010)."""

from __future__ import annotations

import struct

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_core.fieldbus.device import (
    CLOCK_MODES,
    CONTROLLERS,
    DEVICE_GROUP,
    DEVICE_NAME,
    INPUT_PDOS,
    MAILBOX_BYTES,
    MAILBOX_IN_START,
    MAILBOX_OUT_START,
    MAILBOX_REPEATS,
    MEMORY_END,
    OUTPUT_PDO,
    PHYSICAL_PORTS,
    PRODUCT_CODE,
    REVISION,
    SII_BYTES,
    SYNC_MANAGERS,
    VENDOR_ID,
    Pdo,
)
from ocmm_core.fieldbus.wire import read_words, write_word

SECTION = "EEPROM and controller"
_HEAD_WORDS, _ALIAS_WORD, _SUM_WORD = 8, 4, 7
_FIRST_CATEGORY = 0x40
_END = 0xFFFF
_PROTOCOLS, _COE_DETAILS = 0x000C, 0x23
_PDO_FLAGS = 0x0011
_CLOCK_BYTES = 24
_MEMORY, _KB = 0x1000, 1024


def configuration(bench: Bench, see: RuleFindings) -> None:
    """Check the words that the controller loads at power-on."""
    head = bench.eeprom()[:16]
    see.equal("The check sum in word 0x07", head[14], check_sum(head[:14]))
    see.equal("The high byte of word 0x07", head[15], 0)
    words = struct.unpack("<7H", head[:14])
    known = [struct.unpack("<7H", each.content) for each in CONTROLLERS]
    see.expect(
        any(words[:3] == each[:3] for each in known),
        f"Words 0 to 2 are {words[0]:#06x}, {words[1]:#06x}, {words[2]:#06x}: no row of the table.",
    )
    see.equal("Word 3", words[3], 0)
    see.equal("Words 5 and 6", words[5:7], (0, 0))
    see.equal("Register 0x0140", bench.number(0x0140), words[0])
    see.equal("Register 0x0150", bench.number(0x0150), words[1])
    see.equal("Register 0x0982", bench.number(0x0982), words[2])
    see.equal("Register 0x0012 (station alias)", bench.number(0x0012), words[4])


def identity(bench: Bench, see: RuleFindings) -> None:
    """Check the identity words."""
    vendor, product, revision, serial = struct.unpack_from("<IIII", bench.eeprom(), 16)
    see.equal("The vendor (word 0x08)", vendor, VENDOR_ID)
    see.equal("The product (word 0x0A)", product, PRODUCT_CODE)
    see.equal("The revision (word 0x0C)", revision, REVISION)
    see.expect(serial not in (0, 0xFFFFFFFF), f"The serial number (word 0x0E) is {serial:#x}.")
    see.equal("Words 0x10 to 0x13", bench.eeprom()[32:40], bytes(8))


def mailboxes(bench: Bench, see: RuleFindings) -> None:
    """Check the EEPROM's mailboxes, protocols and size."""
    eeprom = bench.eeprom()
    boxes = (MAILBOX_OUT_START, MAILBOX_BYTES, MAILBOX_IN_START, MAILBOX_BYTES)
    see.equal(
        "The mailboxes in BOOT (words 0x14 to 0x17)", struct.unpack_from("<4H", eeprom, 40), boxes
    )
    see.equal("The mailboxes (words 0x18 to 0x1B)", struct.unpack_from("<4H", eeprom, 48), boxes)
    see.equal("The protocols (word 0x1C)", struct.unpack_from("<H", eeprom, 56)[0], _PROTOCOLS)
    size, version = struct.unpack_from("<HH", eeprom, 0x7C)
    see.equal("The size (word 0x3E)", size, SII_BYTES * 8 // 1024 - 1)
    see.equal("The version (word 0x3F)", version, 1)


def categories(bench: Bench, see: RuleFindings) -> None:
    """Check the categories, which tools read without the device's ESI file."""
    found: dict[int, list[bytes]] = {}
    eeprom, at = bench.eeprom(), 2 * _FIRST_CATEGORY
    while True:
        see.need(at + 4 <= len(eeprom), "The categories have no end (0xFFFF).")
        kind, words = struct.unpack_from("<HH", eeprom, at)
        if kind == _END:
            break
        found.setdefault(kind, []).append(eeprom[at + 4 : at + 4 + 2 * words])
        at += 4 + 2 * words
    for kind, count in (
        (10, 1),
        (30, 1),
        (40, 1),
        (41, 1),
        (50, len(INPUT_PDOS)),
        (51, 1),
        (60, 1),
    ):
        see.need(
            len(found.get(kind, ())) == count,
            f"Category {kind} is there {len(found.get(kind, ()))} times, not {count}.",
        )
    texts = _texts(found[10][0])
    general = found[30][0]
    see.need(len(general) >= 18, f"Category general has {len(general)} bytes.")
    see.equal("The group", _text(texts, general[0]), DEVICE_GROUP)
    see.equal("The group, once more (byte 14)", general[14], general[0])
    see.equal("The order number", _text(texts, general[2]), DEVICE_NAME)
    see.equal("The name", _text(texts, general[3]), DEVICE_NAME)
    see.equal("Details of CoE", general[5], _COE_DETAILS)
    see.equal("FoE", general[6], 1)
    see.equal("The flags", general[11], MAILBOX_REPEATS)
    see.equal("The ports", struct.unpack_from("<H", general, 16)[0], PHYSICAL_PORTS)
    see.equal("Category FMMU", found[40][0][:2], bytes([1, 2]))
    managers = b"".join(struct.pack("<HHBBBB", *each) for each in SYNC_MANAGERS)
    see.equal("Category sync managers", found[41][0], managers)
    for pdo, content in zip((*INPUT_PDOS, OUTPUT_PDO), (*found[50], *found[51]), strict=True):
        _mapping(see, pdo, content, texts)
    clock = found[60][0]
    see.equal("The bytes of category clock", len(clock), _CLOCK_BYTES * len(CLOCK_MODES))
    for number, mode in enumerate(CLOCK_MODES):
        *times, factor1, activate, factor0, name, text = struct.unpack_from(
            "<IIIhHhBB", clock, _CLOCK_BYTES * number
        )
        see.equal(f"Times of clock mode {mode.name}", times, [0, 0, 0])
        see.equal(f"Clock mode {mode.name}", activate, mode.activate)
        see.equal(
            f"Factors of clock mode {mode.name}",
            (factor0, factor1),
            (mode.sync0_factor, mode.sync1_factor),
        )
        see.equal("Name of a clock mode", _text(texts, name), mode.name)
        see.equal(f"Text of clock mode {mode.name}", _text(texts, text), mode.text)


def registers(bench: Bench, see: RuleFindings) -> None:
    """Check the controller's resources and its watchdog at power-on."""
    _kind, _revision, _build, fmmus, managers, ram, _ports, features = struct.unpack(
        "<BBHBBBBH", bench.get(0x0000, 10)
    )
    see.expect(fmmus >= 2, f"The controller has {fmmus} FMMUs, must have 2.")
    see.expect(managers >= len(SYNC_MANAGERS), f"The controller has {managers} sync managers.")
    see.expect(
        _MEMORY + ram * _KB >= MEMORY_END,
        f"The controller has {ram} kB of memory (0x0006), which must reach to {MEMORY_END:#06x}.",
    )
    see.expect(bool(features & 0x04), "The controller has no distributed clock (0x0008).")
    see.expect(bool(features & 0x08), "The clock of the controller has no 64 bits (0x0008).")
    see.equal("The watchdog divider (0x0400)", bench.number(0x0400), 2498)
    see.equal("The watchdog time (0x0420)", bench.number(0x0420), 1000)


def alias(bench: Bench, see: RuleFindings) -> None:
    """Store another station alias with checksum, and restore the old one."""
    head = bench.eeprom()[:14]
    other = bytearray(head)
    struct.pack_into("<H", other, 8, struct.unpack_from("<H", head, 8)[0] ^ 0x5A5A)
    for content in (bytes(other), head):
        write_word(bench.exchange_one, bench.place, _SUM_WORD, check_sum(content))
        (value,) = struct.unpack_from("<H", content, 8)
        write_word(bench.exchange_one, bench.place, _ALIAS_WORD, value)
        stored = read_words(bench.exchange_one, bench.place, 0, _HEAD_WORDS)
        see.equal("The EEPROM after a new alias", stored[:14], content)
        see.equal("Its check sum", stored[14], check_sum(content))


def check_sum(content: bytes) -> int:
    """Return the CRC-8 of the first 14 bytes of an EEPROM (ETG.2010, table 2)."""
    crc = 0xFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    return crc


def _mapping(see: RuleFindings, pdo: Pdo, content: bytes, texts: list[str]) -> None:
    index, count, manager, _sync, name, flags = struct.unpack_from("<HBBBBH", content)
    see.equal(f"A PDO of the category ({pdo.name})", index, pdo.index)
    see.equal(f"The sync manager of {pdo.name}", manager, 2 if pdo is OUTPUT_PDO else 3)
    see.equal(f"The name of {pdo.name}", _text(texts, name), pdo.name)
    see.equal(f"The flags of {pdo.name}", flags, _PDO_FLAGS)
    if not see.equal(f"The entries of {pdo.name}", count, len(pdo.entries)):
        return
    for number, entry in enumerate(pdo.entries):
        place, sub, name, kind, bits = struct.unpack_from("<HBBBB", content, 8 + 8 * number)
        see.equal(
            f"{pdo.name}, entry {entry.name}",
            (place, sub, _text(texts, name), kind, bits),
            (entry.index, entry.sub, entry.name, int(entry.kind), entry.bits),
        )


def _texts(content: bytes) -> list[str]:
    texts, at = [], 1
    for _ in range(content[0]):
        size = content[at]
        texts.append(content[at + 1 : at + 1 + size].decode("ascii", errors="replace"))
        at += 1 + size
    return texts


def _text(texts: list[str], number: int) -> str:
    return texts[number - 1] if 0 < number <= len(texts) else ""


RULES = (
    Rule("eeprom.configuration", SECTION, "The controller loads the words of its row.",
         configuration),
    Rule("eeprom.identity", SECTION, "Vendor, product, revision and serial number.", identity),
    Rule("eeprom.mailboxes", SECTION, "Mailboxes, protocols, size and version.", mailboxes),
    Rule("eeprom.categories", SECTION, "All categories, equal to the device description.",
         categories),
    Rule("controller.registers", SECTION, "FMMUs, sync managers, clock of 64 bits, watchdog.",
         registers),
    Rule("eeprom.alias", SECTION, "A new station alias is kept with its check sum.", alias),
)  # fmt: skip
