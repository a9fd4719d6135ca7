"""Rules of the services: black image, snapshot, intrinsics, identify; firmware updates (FoE)."""

from __future__ import annotations

import hashlib
import struct
import zlib

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import NotAsDescribedError, NotTestedError, RuleFindings
from ocmm_bench.conform._mail_line import BOOT, ERASE_LIMIT_NS, INIT, MS, PACKET_LIMIT_NS, PREOP
from ocmm_bench.conform._rules_objects import BUSY, NO_DATA, VALUE
from ocmm_bench.conform._sdo_talk import FOE, SdoRefusal, parts
from ocmm_core.fieldbus.device import (
    BLACK_IMAGE,
    BLOB_BYTES,
    CALIBRATION,
    CHUNK_BYTES,
    CONFIGURATION,
    IDENTIFY,
    INFORMATION,
    MAILBOX_BYTES,
    SNAPSHOT,
    CameraStatus,
    Firmware,
    Intrinsics,
    Work,
)
from ocmm_core.fieldbus.objects import FIRMWARE_NAME

_COMMANDS = "Commands"
_WORK_NS = 10_000 * MS
_IN_USE, _STORED, _SAME = 1, 2, 4
_EXPOSURES = 400


def identify(bench: Bench, see: RuleFindings) -> None:
    """Blink the camera's identification LED."""
    bench.again(PREOP)
    see.expect(bench.mail.write(IDENTIFY, 1, b"\x05\x00") is None, "5 s are refused.")
    left = bench.mail.count(IDENTIFY, 2)
    see.expect(left in (4, 5), f"Of 5 s {left} are left.")
    bench.line.sleep(1.2)
    left = bench.mail.count(IDENTIFY, 2)
    see.expect(left in (3, 4), f"Of 5 s {left} are left after 1.2 s.")
    bench.mail.set(IDENTIFY, 1, bytes(2))
    see.equal("What is left after 0", bench.mail.count(IDENTIFY, 2), 0)


def intrinsics(bench: Bench, see: RuleFindings) -> None:
    """Write intrinsics that are damaged, foreign and valid; restore the previous ones."""
    bench.again(PREOP)
    before = bench.mail.value(CALIBRATION, 1)
    width, height = bench.mail.count(INFORMATION, 2), bench.mail.count(INFORMATION, 3)
    lens = (0.012, 25.0, 1.0, width / 2, height / 2, 1e-5, 0.0, 0.0, 0.0)
    block = Intrinsics(bench.serial, 1_700_000_000, width, height, *lens).encode()
    foreign = Intrinsics(bench.serial ^ 1, 1_700_000_000, width, height, *lens).encode()
    damaged = bytearray(block)
    damaged[50] ^= 0x10
    bench.mail.set(CALIBRATION, 1, b"")
    see.equal("0x8010:02 without a block", bench.mail.count(CALIBRATION, 2), 0)
    _is(see, "Mode 1 without intrinsics", bench.mail.write(CONFIGURATION, 4, b"\x01"), NO_DATA)
    for what, content in (
        ("a damaged block", bytes(damaged)),
        ("a block of another camera", foreign),
        ("half a block", block[: BLOB_BYTES // 2]),
    ):
        _is(see, what, bench.mail.write(CALIBRATION, 1, content), VALUE)
        see.equal(f"0x8010:02 after {what}", bench.mail.count(CALIBRATION, 2), 0)
    see.expect(bench.mail.write(CALIBRATION, 1, block) is None, "A right block is refused.")
    see.equal("The block", bench.mail.value(CALIBRATION, 1), block)
    see.equal("Its length", bench.mail.count(CALIBRATION, 2), len(block))
    see.equal("Its SHA-256", bench.mail.value(CALIBRATION, 3), hashlib.sha256(block).digest())
    see.equal("Its CRC-32", bench.mail.count(CALIBRATION, 4), zlib.crc32(block))
    see.expect(bench.mail.write(CONFIGURATION, 4, b"\x01") is None, "Mode 1 is refused.")
    bench.mail.set(CONFIGURATION, 4, b"\x00")
    see.expect(bench.mail.write(CALIBRATION, 1, before) is None, "The old block is refused.")
    see.equal("The old block", bench.mail.value(CALIBRATION, 1), before)


def black_image(bench: Bench, see: RuleFindings) -> None:
    """Measure, store, load and drop a black image; the camera ends without one."""
    bench.again(PREOP)
    bench.mail.set(BLACK_IMAGE, 1, b"\x04")
    _done(bench, see, BLACK_IMAGE, 3)
    see.equal("0x8020:05 without an image", bench.mail.count(BLACK_IMAGE, 5), 0)
    see.equal("The SHA-256 without an image", bench.mail.value(BLACK_IMAGE, 6), b"")
    for what, command in (("storing", 2), ("loading", 3)):
        _is(
            see,
            f"{what} without an image",
            bench.mail.write(BLACK_IMAGE, 1, bytes([command])),
            NO_DATA,
        )
    bench.streaming()
    bench.run(5)
    bench.feeding = True
    bench.mail.set(BLACK_IMAGE, 2, struct.pack("<H", _EXPOSURES))
    bench.mail.set(BLACK_IMAGE, 1, b"\x01")
    see.equal("The state after the command", bench.mail.count(BLACK_IMAGE, 3), Work.BUSY)
    _is(see, "a command while another runs", bench.mail.write(BLACK_IMAGE, 1, b"\x01"), BUSY)
    dark = [each for each in bench.run(20) if each.header.status & CameraStatus.DARK]
    see.expect(bool(dark), "Status bit 3 stays clear while a black image is measured.")
    for each in dark[2:]:
        see.expect(each.frame(0)[:2] == bytes(2), "A spot is valid in a frame without light.")
    _done(bench, see, BLACK_IMAGE, 3)
    see.equal("The progress at the end", bench.mail.count(BLACK_IMAGE, 4), 100)
    see.equal("0x8020:05 after measuring", bench.mail.count(BLACK_IMAGE, 5), _IN_USE)
    digest = bench.mail.value(BLACK_IMAGE, 6)
    see.equal("The length of its SHA-256", len(digest), 32)
    for command, images in ((2, _IN_USE | _STORED | _SAME), (3, _IN_USE | _STORED | _SAME), (4, 0)):
        bench.mail.set(BLACK_IMAGE, 1, bytes([command]))
        _done(bench, see, BLACK_IMAGE, 3)
        see.equal(f"0x8020:05 after command {command}", bench.mail.count(BLACK_IMAGE, 5), images)
        if images:
            see.equal("The SHA-256", bench.mail.value(BLACK_IMAGE, 6), digest)
    bench.feeding = False
    bench.go(INIT)


def snapshot(bench: Bench, see: RuleFindings) -> None:
    """Capture and read an image of a region."""
    bench.again(PREOP)
    width, height = bench.mail.count(INFORMATION, 2), bench.mail.count(INFORMATION, 3)
    bench.mail.set(SNAPSHOT, 5, b"\x02")
    see.equal("The state without a picture", bench.mail.count(SNAPSHOT, 6), Work.IDLE)
    chunk = bench.mail.read(SNAPSHOT, 0x0A)
    _is(see, "a chunk without a picture", chunk if isinstance(chunk, SdoRefusal) else None, NO_DATA)
    _region(bench, width - 10, 0, 20, 20)
    _is(see, "a region off the sensor", bench.mail.write(SNAPSHOT, 5, b"\x01"), VALUE)
    _region(bench, 8, min(16, height - 48), 64, 48)
    bench.mail.set(SNAPSHOT, 5, b"\x01")
    _done(bench, see, SNAPSHOT, 6)
    total = bench.mail.count(SNAPSHOT, 8)
    see.equal("The bytes of the picture", total, 2 * 64 * 48)
    see.equal("Its width", bench.mail.count(SNAPSHOT, 0x0C), 64)
    see.equal("Its height", bench.mail.count(SNAPSHOT, 0x0D), 48)
    content = b""
    while len(content) < total:
        bench.mail.set(SNAPSHOT, 9, struct.pack("<I", len(content)))
        part = bench.mail.value(SNAPSHOT, 0x0A)
        see.need(0 < len(part) <= CHUNK_BYTES, f"A chunk has {len(part)} bytes.")
        content += part
    see.equal("The bytes of all chunks", len(content), total)
    see.equal("The CRC-32 of the picture", zlib.crc32(content), bench.mail.count(SNAPSHOT, 0x0B))
    bench.mail.set(SNAPSHOT, 9, struct.pack("<I", total))
    chunk = bench.mail.read(SNAPSHOT, 0x0A)
    _is(see, "a chunk behind the end", chunk if isinstance(chunk, SdoRefusal) else None, NO_DATA)
    bench.mail.set(SNAPSHOT, 5, b"\x02")
    see.equal("The state after release", bench.mail.count(SNAPSHOT, 6), Work.IDLE)
    _region(bench, 0, 0, 0, 0)
    bench.mail.set(SNAPSHOT, 9, bytes(4))
    bench.go(INIT)


def _region(bench: Bench, *numbers: int) -> None:
    for sub, number in enumerate(numbers, start=1):
        bench.mail.set(SNAPSHOT, sub, struct.pack("<H", number))


def _done(bench: Bench, see: RuleFindings, index: int, sub: int) -> None:
    deadline = bench.line.now_ns() + _WORK_NS
    while (state := bench.mail.count(index, sub)) == Work.BUSY:
        if bench.line.now_ns() > deadline:
            raise NotAsDescribedError(f"A command of {index:#06x} is still busy after 10 s.")
        bench.line.sleep(0.01)
    see.equal(f"The state of {index:#06x}:{sub:02X} at the end", state, Work.DONE)


def _is(see: RuleFindings, what: str, found: SdoRefusal | None, code: int) -> None:
    if found is None:
        see.expect(False, f"{what.capitalize()} is not refused ({code:#010x}).")
    else:
        see.equal(f"The code of {what}", found.code, code)


COMMANDS = (
    Rule("command.identify", _COMMANDS, "The camera blinks for as long as it is told.", identify),
    Rule("command.intrinsics", _COMMANDS, "Intrinsics are kept; damaged or foreign ones are not.",
         intrinsics),
    Rule("command.black_image", _COMMANDS, "A black image is measured, kept, loaded and dropped.",
         black_image),
    Rule("command.snapshot", _COMMANDS, "A picture is taken and read in chunks.", snapshot),
)  # fmt: skip


_FIRMWARE = "Firmware"
_READ, _WRITE, _DATA, _ACK, _ERROR, _BUSY = 1, 2, 3, 4, 5, 6
_HEAD = struct.Struct("<BBI")
_NOT_FOUND, _DENIED, _ILLEGAL, _PACKET, _WRONG = 0x8001, 0x8002, 0x8004, 0x8005, 0x8009
_ROOM = MAILBOX_BYTES - 12
_VERSION = 0x100A
_SHARE = 2
"""Interrupt an update after this fraction (1 / 2)."""


def refusals(bench: Bench, see: RuleFindings) -> None:
    """Send requests that must be refused."""
    bench.go(PREOP)
    _error(bench, see, "a file outside of BOOT", _foe(_WRITE, 0, FIRMWARE_NAME), _ILLEGAL)
    bench.go(BOOT)
    _error(bench, see, "a file of another name", _foe(_WRITE, 0, b"settings"), _NOT_FOUND)
    _error(bench, see, "reading", _foe(_READ, 0, FIRMWARE_NAME), _DENIED)
    _error(bench, see, "a packet of nothing", _foe(_DATA, 1, bytes(_ROOM)), _ILLEGAL)
    _start(bench, see)
    _packet(bench, see, 1, bytes(_ROOM))
    _packet(bench, see, 1, bytes(_ROOM))
    _error(bench, see, "a packet that is left out", _foe(_DATA, 3, bytes(_ROOM)), _PACKET)
    _error(bench, see, "a packet after a refused one", _foe(_DATA, 4, bytes(_ROOM)), _ILLEGAL)
    bench.go(INIT)


def wrong_files(bench: Bench, see: RuleFindings) -> None:
    """Send files that are no firmware of this camera; the old firmware keeps running."""
    bench.go(PREOP)
    before = bench.mail.value(_VERSION)
    files: list[tuple[str, bytes]] = [("bytes of nothing", bytes(1000)), ("an empty file", b"")]
    if bench.firmware:
        changed, other = bytearray(bench.firmware), bytearray(bench.firmware)
        changed[len(changed) // 2] ^= 1
        other[8] ^= 1
        files += [
            ("a changed file", bytes(changed)),
            ("a file for another product", bytes(other)),
            ("a file that is cut off", bench.firmware[:-1]),
            ("a file with another signature", bench.firmware[:-64] + bytes(64)),
        ]
    for what, content in files:
        bench.go(BOOT)
        _start(bench, see)
        answer = _send(bench, see, content)
        see.equal(f"The answer to {what}", answer, (_ERROR, _WRONG))
        bench.go(INIT)
        bench.go(PREOP)
        see.equal(f"The firmware after {what}", bench.mail.value(_VERSION), before)
    bench.go(INIT)


def interrupted(bench: Bench, see: RuleFindings) -> None:
    """Abort an update midway, and start another during an update."""
    bench.go(PREOP)
    before = bench.mail.value(_VERSION)
    content = bench.firmware or bytes(20 * _ROOM)
    bench.go(BOOT)
    _start(bench, see)
    for number in range(1, max(2, len(content) // _ROOM // _SHARE)):
        _packet(bench, see, number, content[(number - 1) * _ROOM : number * _ROOM])
    bench.go(INIT)
    bench.go(PREOP)
    see.equal("The firmware after an interrupted update", bench.mail.value(_VERSION), before)
    bench.go(BOOT)
    _error(bench, see, "a packet of an update before", _foe(_DATA, 2, bytes(_ROOM)), _ILLEGAL)
    _start(bench, see)
    _packet(bench, see, 1, bytes(_ROOM))
    _start(bench, see)
    _packet(bench, see, 1, bytes(_ROOM))
    bench.go(INIT)


def update(bench: Bench, see: RuleFindings) -> None:
    """Update twice: without PREOP, which rolls back, then permanently."""
    if not bench.firmware:
        raise NotTestedError("No firmware of the camera's maker was given (--firmware).")
    version = Firmware.read(bench.firmware).version.encode("ascii")
    bench.go(PREOP)
    before = bench.mail.value(_VERSION)
    if before.rstrip(b"\x00") == version:
        raise NotTestedError("The camera runs the given firmware already; give another one.")
    _update(bench, see)
    # Leaving BOOT again is a start that PREOP did not confirm.
    bench.go(BOOT)
    bench.go(INIT)
    bench.go(PREOP)
    see.equal("The firmware after a trial that failed", bench.mail.value(_VERSION), before)
    _update(bench, see)
    bench.go(PREOP)
    see.equal("The firmware after the update", bench.mail.value(_VERSION).rstrip(b"\x00"), version)
    bench.go(BOOT)
    bench.go(INIT)
    bench.go(PREOP)
    see.equal("The confirmed firmware", bench.mail.value(_VERSION).rstrip(b"\x00"), version)
    bench.go(INIT)


def _update(bench: Bench, see: RuleFindings) -> None:
    bench.go(BOOT)
    _start(bench, see)
    see.equal("The answer to the last packet", _send(bench, see, bench.firmware)[0], _ACK)
    bench.go(INIT)


def _start(bench: Bench, see: RuleFindings) -> None:
    before = bench.line.now_ns()
    answer = _ask(bench, _foe(_WRITE, 0, FIRMWARE_NAME), ERASE_LIMIT_NS)
    see.timed("Answer to the request to write a file", bench.line.now_ns() - before, ERASE_LIMIT_NS)
    if answer != (_ACK, 0):
        raise NotAsDescribedError(f"The request to write a file is answered with {answer}.")
    see.checked += 1


def _send(bench: Bench, see: RuleFindings, content: bytes) -> tuple[int, int]:
    """Send a file; return the answer to its last or first refused packet."""
    number = 0
    while True:
        part = content[number * _ROOM : (number + 1) * _ROOM]
        number += 1
        before = bench.line.now_ns()
        answer = _ask(bench, _foe(_DATA, number, part), PACKET_LIMIT_NS)
        see.timed("Answer to a packet of a file", bench.line.now_ns() - before, PACKET_LIMIT_NS)
        if len(part) < _ROOM or answer != (_ACK, number):
            return answer


def _packet(bench: Bench, see: RuleFindings, number: int, content: bytes) -> None:
    answer = _ask(bench, _foe(_DATA, number, content), PACKET_LIMIT_NS)
    see.equal(f"The answer to packet {number}", answer, (_ACK, number))


def _error(bench: Bench, see: RuleFindings, what: str, request: bytes, code: int) -> None:
    see.equal(f"The answer to {what}", _ask(bench, request, ERASE_LIMIT_NS), (_ERROR, code))


def _foe(operation: int, number: int, rest: bytes) -> bytes:
    return _HEAD.pack(operation, 0, number) + rest


def _ask(bench: Bench, request: bytes, limit_ns: int) -> tuple[int, int]:
    """Return opcode and number of the answer; wait while the camera is busy."""
    deadline = bench.line.now_ns() + limit_ns
    while True:
        answer = bench.mail.talk(FOE, request, limit_ns)
        if answer is None:
            raise NotAsDescribedError("A FoE request is not answered.")
        kind, _counter, body = parts(answer)
        if kind != FOE or len(body) < _HEAD.size:
            raise NotAsDescribedError(f"A FoE request is answered with protocol {kind}.")
        operation, _reserved, number = _HEAD.unpack_from(body)
        if operation != _BUSY or bench.line.now_ns() > deadline:
            return operation, number
        bench.line.sleep(0.01)


FIRMWARE = (
    Rule("firmware.refusals", _FIRMWARE, "Wrong requests are refused with their codes.", refusals),
    Rule("firmware.wrong", _FIRMWARE, "Files that the maker did not sign for this camera stay out.",
         wrong_files),
    Rule("firmware.interrupted", _FIRMWARE, "An interrupted update leaves the old firmware.",
         interrupted),
    Rule("firmware.update", _FIRMWARE, "Firmware runs on trial, goes back, and stays in PREOP.",
         update),
)  # fmt: skip
