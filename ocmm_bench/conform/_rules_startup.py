"""Rules of the start: EEPROM, registers loaded from it (ETG.2010), and states (ETG.1000.6, 6.4)."""

from __future__ import annotations

import struct

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import BOOT, ERROR, INIT, MS, NAMES, OP, PREOP, SAFEOP, Status
from ocmm_bench.conform._sdo_talk import COE, mailbox
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.objects import check_sum
from ocmm_core.fieldbus.wire import read_words, write_word
from ocmm_sim import slave

_EEPROM = "EEPROM and controller"
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
    known = [struct.unpack("<7H", each.content) for each in slave.CONTROLLERS]
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
    see.equal("The vendor (word 0x08)", vendor, device.VENDOR_ID)
    see.equal("The product (word 0x0A)", product, device.PRODUCT_CODE)
    see.equal("The revision (word 0x0C)", revision, device.REVISION)
    see.expect(serial not in (0, 0xFFFFFFFF), f"The serial number (word 0x0E) is {serial:#x}.")
    see.equal("Words 0x10 to 0x13", bench.eeprom()[32:40], bytes(8))


def mailboxes(bench: Bench, see: RuleFindings) -> None:
    """Check the EEPROM's mailboxes, protocols and size."""
    eeprom = bench.eeprom()
    boxes = (
        device.MAILBOX_OUT_START,
        device.MAILBOX_BYTES,
        device.MAILBOX_IN_START,
        device.MAILBOX_BYTES,
    )
    see.equal(
        "The mailboxes in BOOT (words 0x14 to 0x17)", struct.unpack_from("<4H", eeprom, 40), boxes
    )
    see.equal("The mailboxes (words 0x18 to 0x1B)", struct.unpack_from("<4H", eeprom, 48), boxes)
    see.equal("The protocols (word 0x1C)", struct.unpack_from("<H", eeprom, 56)[0], _PROTOCOLS)
    size, version = struct.unpack_from("<HH", eeprom, 0x7C)
    see.equal("The size (word 0x3E)", size, slave.SII_BYTES * 8 // 1024 - 1)
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
        (50, len(device.INPUT_PDOS)),
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
    see.equal("The group", _text(texts, general[0]), slave.DEVICE_GROUP)
    see.equal("The group, once more (byte 14)", general[14], general[0])
    see.equal("The order number", _text(texts, general[2]), device.DEVICE_NAME)
    see.equal("The name", _text(texts, general[3]), device.DEVICE_NAME)
    see.equal("Details of CoE", general[5], _COE_DETAILS)
    see.equal("FoE", general[6], 1)
    see.equal("The flags", general[11], slave.MAILBOX_REPEATS)
    see.equal("The ports", struct.unpack_from("<H", general, 16)[0], slave.PHYSICAL_PORTS)
    see.equal("Category FMMU", found[40][0][:2], bytes([1, 2]))
    managers = b"".join(struct.pack("<HHBBBB", *each) for each in device.SYNC_MANAGERS)
    see.equal("Category sync managers", found[41][0], managers)
    for pdo, content in zip(
        (*device.INPUT_PDOS, device.OUTPUT_PDO), (*found[50], *found[51]), strict=True
    ):
        _mapping(see, pdo, content, texts)
    clock = found[60][0]
    see.equal("The bytes of category clock", len(clock), _CLOCK_BYTES * len(slave.CLOCK_MODES))
    for number, mode in enumerate(slave.CLOCK_MODES):
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
    see.expect(
        managers >= len(device.SYNC_MANAGERS), f"The controller has {managers} sync managers."
    )
    see.expect(
        _MEMORY + ram * _KB >= slave.MEMORY_END,
        f"The controller has {ram} kB of memory (0x0006), which must reach to "
        f"{slave.MEMORY_END:#06x}.",
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


def _mapping(see: RuleFindings, pdo: device.Pdo, content: bytes, texts: list[str]) -> None:
    index, count, manager, _sync, name, flags = struct.unpack_from("<HBBBBH", content)
    see.equal(f"A PDO of the category ({pdo.name})", index, pdo.index)
    see.equal(f"The sync manager of {pdo.name}", manager, 2 if pdo is device.OUTPUT_PDO else 3)
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


EEPROM = (
    Rule("eeprom.configuration", _EEPROM, "The controller loads the words of its row.",
         configuration),
    Rule("eeprom.identity", _EEPROM, "Vendor, product, revision and serial number.", identity),
    Rule("eeprom.mailboxes", _EEPROM, "Mailboxes, protocols, size and version.", mailboxes),
    Rule("eeprom.categories", _EEPROM, "All categories, equal to the device description.",
         categories),
    Rule("controller.registers", _EEPROM, "FMMUs, sync managers, clock of 64 bits, watchdog.",
         registers),
    Rule("eeprom.alias", _EEPROM, "A new station alias is kept with its check sum.", alias),
)  # fmt: skip


_STATES = "States"
_INVALID, _UNKNOWN, _NO_MAILBOX, _NO_BOOT_MAILBOX = 0x0011, 0x0012, 0x0016, 0x0015
_NO_OUTPUTS, _NO_INPUTS, _BAD_CLOCK, _CONTRADICTION = 0x001D, 0x001E, 0x0030, 0x0026
_UP = ((INIT, PREOP), (PREOP, SAFEOP), (SAFEOP, OP))
_DOWN = ((OP, SAFEOP), (OP, PREOP), (OP, INIT), (SAFEOP, PREOP), (SAFEOP, INIT), (PREOP, INIT))
_FORBIDDEN = (
    (INIT, SAFEOP, _INVALID), (INIT, OP, _INVALID), (PREOP, OP, _INVALID), (PREOP, BOOT, _INVALID),
    (SAFEOP, BOOT, _INVALID), (INIT, 5, _UNKNOWN), (PREOP, 7, _UNKNOWN),
)  # fmt: skip


def allowed(bench: Bench, see: RuleFindings) -> None:
    """Run every allowed transition."""
    for start, end in (*_UP, *_DOWN):
        bench.go(start)
        if end > start:
            bench.prepare(end)
        status = bench.ask_state(end)
        see.expect(status.state == end, f"From {NAMES[start]} to {NAMES[end]}: {status}.")
        see.equal(f"The AL status code in {NAMES[end]}", status.code, 0)


def forbidden(bench: Bench, see: RuleFindings) -> None:
    """Request every forbidden transition."""
    for start, end, code in _FORBIDDEN:
        bench.go(start)
        status = bench.ask_state(end, settle_s=0.0)
        _refused(see, f"{NAMES[start]} to {NAMES.get(end, end)}", status, start, code)
        bench.ask_state(start, acknowledge=True)


def acknowledged(bench: Bench, see: RuleFindings) -> None:
    """Leave an error only by acknowledging it."""
    bench.go(PREOP)
    bench.ask_state(OP, settle_s=0.0)
    bench.prepare(SAFEOP)
    ignored = bench.ask_state(SAFEOP, settle_s=0.01)
    _refused(see, "a request with an error that is not acknowledged", ignored, PREOP)
    taken = bench.ask_state(PREOP, acknowledge=True)
    see.expect(taken.state == PREOP, f"After an acknowledgement the camera is in {taken}.")
    see.equal("The AL status code after an acknowledgement", taken.code, 0)
    see.equal("SAFEOP afterwards", bench.ask_state(SAFEOP).state, SAFEOP)


def missing_managers(bench: Bench, see: RuleFindings) -> None:
    """Request states without their sync managers."""
    for number in (0, 1):
        bench.go(INIT)
        bench.prepare(PREOP, without=(number,))
        status = bench.ask_state(PREOP, settle_s=0.0)
        _refused(see, f"PREOP without sync manager {number}", status, INIT, _NO_MAILBOX)
    bench.go(INIT)
    bench.prepare(PREOP)
    bench.set_manager(
        1, device.MAILBOX_IN_START, device.MAILBOX_BYTES // 2, device.SYNC_MANAGERS[1][2], 1
    )
    status = bench.ask_state(PREOP, settle_s=0.0)
    _refused(see, "PREOP with a mailbox of half the size", status, INIT, _NO_MAILBOX)
    for number, code in ((2, _NO_OUTPUTS), (3, _NO_INPUTS)):
        bench.again(PREOP)
        bench.prepare(SAFEOP, without=(number,))
        status = bench.ask_state(SAFEOP, settle_s=0.0)
        _refused(see, f"SAFEOP without sync manager {number}", status, PREOP, code)
    for number, code in ((2, _NO_OUTPUTS), (3, _NO_INPUTS)):
        bench.again(PREOP)
        bench.prepare(SAFEOP)
        start, size, control = device.SYNC_MANAGERS[number][:3]
        bench.set_manager(number, start, size + 2, control, 1)
        status = bench.ask_state(SAFEOP, settle_s=0.0)
        _refused(see, f"SAFEOP with sync manager {number} too long", status, PREOP, code)


def clock_too_fast(bench: Bench, see: RuleFindings) -> None:
    """Request SAFEOP with too fast exposures."""
    bench.again(PREOP)
    bench.prepare(SAFEOP, sync0_ns=49_999)
    status = bench.ask_state(SAFEOP, settle_s=0.0)
    _refused(see, "SAFEOP with SYNC0 every 49,999 ns", status, PREOP, _BAD_CLOCK)
    bench.again(PREOP)
    bench.prepare(SAFEOP, sync0_ns=50_000)
    see.equal("SAFEOP with SYNC0 every 50,000 ns", bench.ask_state(SAFEOP).state, SAFEOP)
    bench.go(INIT)


def contradictions(bench: Bench, see: RuleFindings) -> None:
    """Start with contradictory configurations."""
    bench.again(PREOP)
    width = bench.mail.count(device.INFORMATION, 2)
    period = bench.mail.value(device.CONFIGURATION, 1)
    before = {(device.CONFIGURATION, 2): bench.mail.value(device.CONFIGURATION, 2)}
    before |= {(device.WINDOWS, sub): bench.mail.value(device.WINDOWS, sub) for sub in range(1, 5)}
    off = {1: width - 10, 2: 0, 3: 20, 4: 20}
    changes = (
        ("an exposure as long as the period", {(device.CONFIGURATION, 2): period}),
        ("a window that is not on the sensor",
         {(device.WINDOWS, sub): struct.pack("<H", value) for sub, value in off.items()}),
    )  # fmt: skip
    for what, change in changes:
        for (index, sub), value in change.items():
            bench.mail.set(index, sub, value)
        bench.prepare(SAFEOP)
        status = bench.ask_state(SAFEOP, settle_s=0.02)
        if not status.state & ERROR:
            bench.line.sleep(0.02)
            status = bench.status()
        _refused(see, f"a start with {what}", status, PREOP, _CONTRADICTION)
        bench.go(PREOP)
        for (index, sub), value in before.items():
            bench.mail.set(index, sub, value)
    bench.prepare(SAFEOP)
    see.equal("SAFEOP with the old configuration", bench.ask_state(SAFEOP).state, SAFEOP)


def boot(bench: Bench, see: RuleFindings) -> None:
    """Enter and leave BOOT, and request forbidden transitions to it."""
    bench.go(INIT)
    bench.prepare(PREOP, without=(1,))
    status = bench.ask_state(BOOT, settle_s=0.0)
    _refused(see, "BOOT without a mailbox", status, INIT, _NO_BOOT_MAILBOX)
    bench.go(BOOT)
    see.equal("The state", bench.status().state, BOOT)
    for wanted in (PREOP, SAFEOP, OP):
        status = bench.ask_state(wanted, settle_s=0.0)
        _refused(see, f"BOOT to {NAMES[wanted]}", status, BOOT, _INVALID)
        bench.ask_state(BOOT, acknowledge=True)
    request = struct.pack("<HBHB4x", 2 << 12, 0x40, 0x1000, 0)
    bench.mail.post(mailbox(COE, request, bench.mail.next_counter()))
    answer = bench.mail.fetch(50 * MS)
    see.expect(answer is None or answer[5] & 0x0F != COE, "The camera answers CoE in BOOT.")
    bench.mail.drain()
    see.equal("The state after BOOT to INIT", bench.ask_state(INIT).state, INIT)


def _refused(
    see: RuleFindings, what: str, status: Status, stays: int, code: int | None = None
) -> None:
    found = status.state
    see.expect(
        found == stays | ERROR,
        f"After {what} the camera is in {NAMES.get(found & 0x0F, found)}"
        f"{' with' if found & ERROR else ' without'} the error bit, must be in {NAMES[stays]} "
        "with it.",
    )
    if code is not None:
        see.equal(f"The code of {what}", status.code, code)


STATES = (
    Rule("state.allowed", _STATES, "Every allowed change of state, within its deadline.", allowed),
    Rule("state.forbidden", _STATES, "A change that is not allowed is refused with its code.",
         forbidden),
    Rule("state.acknowledge", _STATES, "An error stays until it is acknowledged.", acknowledged),
    Rule("state.sync_managers", _STATES, "No state without the sync managers that it needs.",
         missing_managers),
    Rule("state.clock", _STATES, "SYNC0 faster than 50,000 ns is refused.", clock_too_fast),
    Rule("state.configuration", _STATES, "A configuration that contradicts itself is not started.",
         contradictions),
    Rule("state.boot", _STATES, "BOOT only from INIT and only back to it, without CoE.", boot),
)  # fmt: skip
