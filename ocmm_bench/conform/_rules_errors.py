"""Rules of watchdog and errors: end of operation, messages and recovery."""

from __future__ import annotations

import struct

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import BACK_LIMIT_NS, ERROR, INIT, MS, OP, PREOP, SAFEOP
from ocmm_bench.conform._rules_objects import VALUE
from ocmm_bench.conform._sdo_talk import SdoRefusal
from ocmm_core.fieldbus import device

SECTION = "Watchdog and errors"
_WATCHDOG_CODE, _WATCHDOG_TIME, _WATCHDOG_COUNT = 0x001B, 0x0420, 0x0442
_UNIT_NS = 100_000
"""Watchdog time unit with the power-on divider: (2498 + 2) x 40 ns."""
_SLACK_NS = 50 * MS
_NEWEST, _ACKNOWLEDGED, _NEW, _FLAGS = 2, 3, 4, 5
_MESSAGE = struct.Struct("<HHHHQHBH5s")


def watchdog(bench: Bench, see: RuleFindings) -> None:
    """Stop the outputs, with the power-on watchdog (100 ms) and other times."""
    for ticks in (1000, 300):
        limit = ticks * _UNIT_NS
        bench.streaming()
        bench.put(_WATCHDOG_TIME, struct.pack("<H", ticks))
        bench.run(5)
        for _ in range(4):
            bench.line.sleep(0.6 * limit * 1e-9)
            bench.cycle()
        see.equal("The state with outputs every 0.6 of the watchdog time", bench.status().state, OP)
        events = bench.number(_WATCHDOG_COUNT, 1)
        begin = bench.line.now_ns()
        bench.cycle()
        fell = _fall(bench, limit)
        see.expect(fell is not None, f"Outputs stay away for {2 * limit // MS} ms, and OP goes on.")
        if fell is not None:
            see.expect(fell - begin >= 0.9 * limit, f"OP ends after {(fell - begin) / MS:.0f} ms.")
            see.timed(
                f"End of OP without outputs ({limit // MS} ms)", fell - begin, limit + _SLACK_NS
            )
        status = bench.status()
        see.equal("The state afterwards", status.state, SAFEOP | ERROR)
        see.equal("Its code", status.code, _WATCHDOG_CODE)
        see.equal("0x0442", bench.number(_WATCHDOG_COUNT, 1), events + 1)
        bench.put(_WATCHDOG_TIME, struct.pack("<H", 1000))
    bench.go(INIT)


def frames_go_on(bench: Bench, see: RuleFindings) -> None:
    """Check that exposures continue without outputs and none is lost."""
    bench.streaming()
    last = bench.run(10)[-1].header
    _end_operation(bench)
    found = bench.cycle()
    see.expect(found.header.frames_valid > 0, "There are no frames after the watchdog.")
    see.equal("The next frame", found.header.counter, last.counter)
    see.equal("period_ns", found.header.period_ns, device.SYNC0_NS)
    see.expect(
        not found.header.status & device.CameraStatus.OPERATIONAL, "Status bit 0 is set in SAFEOP."
    )
    bench.go(INIT)


def told(bench: Bench, see: RuleFindings) -> None:
    """Check all reports of a watchdog event."""
    bench.again(PREOP)
    bench.mail.set(device.HISTORY, _FLAGS, b"\x01\x00")
    bench.streaming()
    bench.feeding = True
    bench.mail.set(device.HISTORY, _ACKNOWLEDGED, b"\x00")
    events, sent = bench.mail.count(device.COUNTERS, 2), bench.mail.count(device.COUNTERS, 6)
    bench.mail.drain()
    bench.mail.emergencies.clear()
    _end_operation(bench)
    bench.mail.drain(20 * MS)
    codes = [code for code, _register, _data in bench.mail.emergencies]
    see.expect(
        codes == [device.ErrorCode.WATCHDOG],
        f"The emergencies are {[hex(code) for code in codes]}, must be 0x8130.",
    )
    for _code, register, _data in bench.mail.emergencies[:1]:
        _communication(see, "The error register of the emergency", register)
    _communication(see, "0x1001", bench.mail.count(device.ERROR_REGISTER, 0))
    see.equal("0xA000:02", bench.mail.count(device.COUNTERS, 2), events + 1)
    see.equal("0xA000:06", bench.mail.count(device.COUNTERS, 6), sent + 1)
    newest = bench.mail.count(device.HISTORY, _NEWEST)
    see.equal("The newest message", newest, device.HISTORY_FIRST)
    see.equal("New messages available", bench.mail.count(device.HISTORY, _NEW), 1)
    _message(bench, see, newest, device.ErrorCode.WATCHDOG, 0x0202)
    status = bench.cycle().header.status
    see.expect(bool(status & device.CameraStatus.DIAGNOSIS), "Status bit 4 is clear.")
    before = bench.line.now_ns()
    status_now = bench.ask_state(OP, acknowledge=True)
    see.timed("Way back from SAFEOP to OP", bench.line.now_ns() - before, BACK_LIMIT_NS)
    see.equal("The state after the acknowledgement", status_now.state, OP)
    bench.feeding = True
    bench.mail.drain(20 * MS)
    codes = [code for code, _register, _data in bench.mail.emergencies]
    see.expect(codes[-1:] == [device.ErrorCode.RESET], "The end of the error is not told (0x0000).")
    see.equal("0x1001 when the error is over", bench.mail.count(device.ERROR_REGISTER, 0), 0)
    newest = bench.mail.count(device.HISTORY, _NEWEST)
    see.equal("The newest message when it is over", newest, device.HISTORY_FIRST + 1)
    _message(bench, see, newest, device.ErrorCode.RESET, 0x0200)
    see.expect(
        isinstance(
            refused := bench.mail.write(device.HISTORY, _ACKNOWLEDGED, bytes([newest + 1])),
            SdoRefusal,
        )
        and refused.code == VALUE,
        "A message that is not there can be acknowledged.",
    )
    bench.mail.set(device.HISTORY, _ACKNOWLEDGED, bytes([newest]))
    see.equal("New messages available when acknowledged", bench.mail.count(device.HISTORY, _NEW), 0)
    status = bench.cycle().header.status
    see.expect(not status & device.CameraStatus.DIAGNOSIS, "Status bit 4 is set.")
    bench.mail.set(device.HISTORY, _ACKNOWLEDGED, b"\x00")
    see.equal("The newest message when cleared", bench.mail.count(device.HISTORY, _NEWEST), 0)
    see.equal("A message when cleared", bench.mail.value(device.HISTORY, device.HISTORY_FIRST), b"")
    bench.feeding = False
    bench.go(INIT)


def history(bench: Bench, see: RuleFindings) -> None:
    """Fill the history until the oldest message is dropped; then disable it."""
    bench.again(PREOP)
    bench.mail.set(device.HISTORY, _ACKNOWLEDGED, b"\x00")
    bench.streaming()
    bench.put(_WATCHDOG_TIME, struct.pack("<H", 50))
    rounds = device.HISTORY_MESSAGES // 2 + 1
    for _ in range(rounds):
        bench.cycle()
        _fall(bench, 5 * MS)
        bench.cycle()
        bench.mail.drain()
        bench.ask_state(OP, acknowledge=True)
        bench.cycle()
    # Each round logged an error and its end.
    place = device.HISTORY_FIRST + (2 * rounds - 1) % device.HISTORY_MESSAGES
    see.equal(
        "The newest message after the history ran over",
        bench.mail.count(device.HISTORY, _NEWEST),
        place,
    )
    see.equal("0x10F3:01", bench.mail.count(device.HISTORY, 1), device.HISTORY_MESSAGES)
    bench.again(PREOP)
    bench.mail.set(device.HISTORY, _FLAGS, b"\x00\x00")
    bench.streaming()
    bench.put(_WATCHDOG_TIME, struct.pack("<H", 50))
    bench.mail.drain()
    bench.mail.emergencies.clear()
    bench.cycle()
    _fall(bench, 5 * MS)
    bench.mail.drain(20 * MS)
    see.expect(not bench.mail.emergencies, "An emergency is sent although 0x10F3:05 is 0.")
    bench.put(_WATCHDOG_TIME, struct.pack("<H", 1000))
    bench.go(PREOP)
    bench.mail.set(device.HISTORY, _FLAGS, b"\x01\x00")
    bench.mail.set(device.HISTORY, _ACKNOWLEDGED, b"\x00")
    bench.go(INIT)


def _end_operation(bench: Bench) -> None:
    bench.feeding = False
    bench.cycle()
    _fall(bench, 100 * MS)


def _fall(bench: Bench, limit_ns: int) -> int | None:
    """Wait without outputs until OP ends; return the time, or None."""
    begin = bench.line.now_ns()
    while bench.line.now_ns() - begin < limit_ns + 2 * _SLACK_NS:
        if bench.status().state != OP:
            return bench.line.now_ns()
        bench.line.sleep(0.001)
    return None


def _communication(see: RuleFindings, what: str, register: int) -> None:
    wanted = int(device.ErrorRegister.GENERIC | device.ErrorRegister.COMMUNICATION)
    see.expect(register & wanted == wanted, f"{what} is {register:#04x}, must have bits 0 and 4.")


def _message(bench: Bench, see: RuleFindings, place: int, code: int, flags: int) -> None:
    content = bench.mail.value(device.HISTORY, place)
    if not see.equal("The length of a message", len(content), _MESSAGE.size):
        return
    kind, found, found_flags, text, time_ns, usint, _register, octets, _data = _MESSAGE.unpack(
        content
    )
    see.equal("The kind of a message", kind, 0xE800)
    see.equal("The code of a message", (found, text), (code, code))
    see.equal("The flags of a message", found_flags, flags)
    see.equal("The types in a message", (usint, octets), (0x0005, 0x1005))
    age = bench.system_ns() - time_ns
    see.expect(0 <= age < 2000 * MS, f"The bus time of a message is {age / MS:.0f} ms old.")


RULES = (
    Rule("watchdog.time", SECTION, "Without outputs OP ends after the watchdog time.", watchdog),
    Rule("watchdog.frames", SECTION, "Exposures go on without outputs, and none is lost.",
         frames_go_on),
    Rule("errors.told", SECTION, "An error and its end are told, kept and acknowledged.", told),
    Rule("errors.history", SECTION, "The history holds 16 messages; the oldest gives way.",
         history),
)  # fmt: skip
