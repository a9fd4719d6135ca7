"""Rules of firmware (FoE): refusals, interrupted updates and rollback."""

from __future__ import annotations

import struct

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import NotAsDescribedError, NotTestedError, RuleFindings
from ocmm_bench.conform._mail_line import BOOT, ERASE_LIMIT_NS, INIT, PACKET_LIMIT_NS, PREOP
from ocmm_bench.conform._sdo_talk import FOE, parts
from ocmm_core.fieldbus.device import MAILBOX_BYTES, Firmware
from ocmm_core.fieldbus.objects import FIRMWARE_NAME

SECTION = "Firmware"
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
    _begin(bench, see)
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
        _begin(bench, see)
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
    _begin(bench, see)
    for number in range(1, max(2, len(content) // _ROOM // _SHARE)):
        _packet(bench, see, number, content[(number - 1) * _ROOM : number * _ROOM])
    bench.go(INIT)
    bench.go(PREOP)
    see.equal("The firmware after an interrupted update", bench.mail.value(_VERSION), before)
    bench.go(BOOT)
    _error(bench, see, "a packet of an update before", _foe(_DATA, 2, bytes(_ROOM)), _ILLEGAL)
    _begin(bench, see)
    _packet(bench, see, 1, bytes(_ROOM))
    _begin(bench, see)
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
    _begin(bench, see)
    see.equal("The answer to the last packet", _send(bench, see, bench.firmware)[0], _ACK)
    bench.go(INIT)


def _begin(bench: Bench, see: RuleFindings) -> None:
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


RULES = (
    Rule("firmware.refusals", SECTION, "Wrong requests are refused with their codes.", refusals),
    Rule("firmware.wrong", SECTION, "Files that the maker did not sign for this camera stay out.",
         wrong_files),
    Rule("firmware.interrupted", SECTION, "An interrupted update leaves the old firmware.",
         interrupted),
    Rule("firmware.update", SECTION, "Firmware runs on trial, goes back, and stays in PREOP.",
         update),
)  # fmt: skip
