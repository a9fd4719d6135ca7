"""Rules of watchdog, errors and mailboxes: end of operation, messages, recovery, bad requests."""

from __future__ import annotations

import itertools
import struct

from ocmm_bench.conform import _mail_line as mail_line
from ocmm_bench.conform import _sdo_talk as sdo_talk
from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import MS, OP, PREOP, SAFEOP, SDO_LIMIT_NS
from ocmm_bench.conform._rules_objects import VALUE
from ocmm_bench.conform._sdo_talk import SdoRefusal
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.device import CALIBRATION, COUNTERS, MAILBOX_BYTES, MAILBOX_IN_START

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
        see.equal("The state afterwards", status.state, SAFEOP | mail_line.ERROR)
        see.equal("Its code", status.code, _WATCHDOG_CODE)
        see.equal("0x0442", bench.number(_WATCHDOG_COUNT, 1), events + 1)
        bench.put(_WATCHDOG_TIME, struct.pack("<H", 1000))
    bench.go(mail_line.INIT)


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
    bench.go(mail_line.INIT)


def check_reports(bench: Bench, see: RuleFindings) -> None:
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
    see.timed("Way back from SAFEOP to OP", bench.line.now_ns() - before, mail_line.BACK_LIMIT_NS)
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
    bench.go(mail_line.INIT)


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
    bench.go(mail_line.INIT)


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
    kind, found, found_flags, text, time_ns, usint, _, octets, _ = _MESSAGE.unpack(content)
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
    Rule("errors.told", SECTION, "An error and its end are told, kept and acknowledged.",
         check_reports),
    Rule("errors.history", SECTION, "The history holds 16 messages; the oldest gives way.",
         history),
)  # fmt: skip


MAILBOX = "Mailboxes"
_NOTE, _BAD_MAILBOXES = 5, 4
_TOGGLE, _COMMAND = 0x05030000, 0x05040001
_ERROR_REPLY = 0
_PROTOCOL, _SERVICE, _SHORT, _SIZE = 2, 4, 6, 8
_SM_IN_CONTROL = 0x080E
_LIST, _OBJECT, _ENTRY = 1, 3, 5


def segments(bench: Bench, see: RuleFindings) -> None:
    """Write and read a value that needs several mailboxes."""
    bench.again(PREOP)
    before = bench.mail.value(CALIBRATION, _NOTE)
    for size in (1, 4, 5, 240, 241, 250, 1199, 1200):
        text = bytes(33 + n * 7 % 90 for n in range(size))
        see.expect(bench.mail.write(CALIBRATION, _NOTE, text) is None, f"{size} bytes are refused.")
        see.equal(f"A value of {size} bytes", bench.mail.read(CALIBRATION, _NOTE), text)
    text = b"segments of seven bytes, not of a whole mailbox"
    refused = sdo_talk.download(bench.mail.sdo, CALIBRATION, _NOTE, text, room=7, expedited=False)
    see.expect(refused is None, f"Segments of 7 bytes are {refused}.")
    see.equal("A value from segments of 7 bytes", bench.mail.read(CALIBRATION, _NOTE), text)
    bench.mail.set(CALIBRATION, _NOTE, before)


def broken_transfers(bench: Bench, see: RuleFindings) -> None:
    """Abort transfers, and continue transfers that were never started."""
    bench.go(PREOP)
    before = bench.mail.value(CALIBRATION, _NOTE)
    bench.mail.set(CALIBRATION, _NOTE, bytes(600))
    bench.mail.sdo(struct.pack("<BHB4x", 0x40, CALIBRATION, _NOTE))
    _aborts(
        see,
        "a segment with the wrong toggle bit",
        bench.mail.sdo(bytes([0x70]) + bytes(7)),
        _TOGGLE,
    )
    _aborts(see, "a segment of nothing", bench.mail.sdo(bytes([0x60]) + bytes(7)), _COMMAND)
    _aborts(see, "a segment for nothing", bench.mail.sdo(bytes([0x00]) + bytes(7)), _COMMAND)
    _aborts(see, "an unknown command", bench.mail.sdo(bytes([0xE0]) + bytes(7)), _COMMAND)
    bench.mail.sdo(struct.pack("<BHBI", 0x21, CALIBRATION, _NOTE, 600) + bytes(240))
    body = struct.pack("<BHBI", 0x80, CALIBRATION, _NOTE, 0x08000000)
    bench.mail.drain()
    content = struct.pack("<H", sdo_talk.REQUEST << 12) + body
    bench.mail.post(sdo_talk.mailbox(sdo_talk.COE, content, bench.mail.next_counter()))
    see.expect(bench.mail.fetch(SDO_LIMIT_NS // 4) is None, "An abort of the master is answered.")
    _aborts(see, "a segment after an abort", bench.mail.sdo(bytes([0x00]) + bytes(7)), _COMMAND)
    see.equal("The note after an abort", bench.mail.read(CALIBRATION, _NOTE), bytes(600))
    bench.mail.set(CALIBRATION, _NOTE, before)


def bad_mailboxes(bench: Bench, see: RuleFindings) -> None:
    """Send malformed mailboxes."""
    bench.go(PREOP)
    before = bench.mail.count(COUNTERS, _BAD_MAILBOXES)
    sdo = struct.pack("<HBHB4x", sdo_talk.REQUEST << 12, 0x40, 0x1000, 0)
    cases = (
        ("an unknown protocol", sdo_talk.mailbox(7, sdo, 1), _PROTOCOL),
        ("a CoE service that is unknown",
         sdo_talk.mailbox(sdo_talk.COE, struct.pack("<H", 0x7000) + sdo[2:], 2),
         _SERVICE),
        ("two bytes of CoE", sdo_talk.mailbox(sdo_talk.COE, sdo[:2], 3), _SHORT),
        ("an SDO request of four bytes", sdo_talk.mailbox(sdo_talk.COE, sdo[:6], 4), _SHORT),
        ("more bytes than a mailbox has",
         struct.pack("<HHBB", MAILBOX_BYTES, 0, 0, 5 << 4 | sdo_talk.COE) + sdo, _SIZE),
    )  # fmt: skip
    for what, content, detail in cases:
        bench.mail.drain()
        bench.mail.post(content)
        answer = bench.mail.fetch(SDO_LIMIT_NS)
        if not see.expect(answer is not None, f"After {what} there is no answer.") or not answer:
            continue
        kind, _counter, body = sdo_talk.parts(answer)
        see.expect(
            kind == _ERROR_REPLY and body[:4] == struct.pack("<HH", 1, detail),
            f"After {what} the answer is {body[:4].hex(' ')} of protocol {kind}, must be an error "
            f"reply with detail {detail}.",
        )
    after = bench.mail.count(COUNTERS, _BAD_MAILBOXES)
    see.equal("0xA000:04 after bad mailboxes", after, before + len(cases))


def repetition(bench: Bench, see: RuleFindings) -> None:
    """Request the last answer again, as after a lost return frame."""
    bench.go(PREOP)
    first = bench.mail.sdo(struct.pack("<BHB4x", 0x40, 0x1018, 4))
    control = bench.number(_SM_IN_CONTROL, 1)
    bench.put(_SM_IN_CONTROL, bytes([control ^ 0x02]))
    see.equal("The answer that is sent again", bench.mail.fetch(SDO_LIMIT_NS), first)
    echo = bench.number(_SM_IN_CONTROL + 1, 1)
    see.equal("The repeat acknowledge bit (0x080F)", echo & 0x02, (control ^ 0x02) & 0x02)
    see.expect(bench.put(MAILBOX_IN_START, b"\x00") == 0, "The answer's mailbox can be written.")
    bench.go(mail_line.INIT)


def counters(bench: Bench, see: RuleFindings) -> None:
    """Check the counters of the answering mailboxes."""
    bench.again(PREOP)
    bench.mail.reply_counters.clear()
    for _ in range(16):
        bench.mail.value(0x1000)
    for one, next_one in itertools.pairwise(bench.mail.reply_counters):
        see.equal("A mailbox counter", next_one, one % 7 + 1)


def information(bench: Bench, see: RuleFindings) -> None:
    """Request the list and the descriptions of the objects."""
    bench.go(PREOP)
    objects = bench.objects
    expected = sorted(objects)
    found: list[int] = []
    content = _info(bench, struct.pack("<BBHH", _LIST, 0, 0, 1))
    if content is not None:
        found = sorted(struct.unpack(f"<{(len(content) - 2) // 2}H", content[2:]))
    missing = [index for index in expected if index not in found]
    more = [index for index in found if index not in objects]
    see.expect(not missing, f"The list of objects lacks {len(missing)}, first {missing[:1]}.")
    see.expect(not more, f"The list of objects has {len(more)} too many, first {more[:1]}.")
    for index, item in objects.items():
        content = _info(bench, struct.pack("<BBHH", _OBJECT, 0, 0, index))
        if see.expect(content is not None, f"{index:#06x} has no description.") and content:
            _index, _type, last, shape = struct.unpack_from("<HHBB", content)
            see.equal(f"The last entry of {index:#06x}", last, max(item.entries))
            see.equal(f"The kind of {index:#06x}", shape, 9 if item.record else 7)
        for sub, entry in tuple(item.entries.items())[:6]:
            content = _info(bench, struct.pack("<BBHHBB", _ENTRY, 0, 0, index, sub, 0))
            name = f"{index:#06x}:{sub:02X}"
            if see.expect(content is not None, f"{name} has no description.") and content:
                _index, _sub, _values, kind, bits, access = struct.unpack_from("<HBBHHH", content)
                see.equal(f"The type of {name}", kind, entry.kind)
                if not entry.max_bytes and entry.is_number:
                    see.equal(f"The bits of {name}", bits, entry.bits)
                writable = 0x08 if entry.preop_only else 0x38
                see.equal(
                    f"The access to {name}",
                    access & 0x3F,
                    0x07 | (writable if entry.writable else 0),
                )


def _info(bench: Bench, body: bytes) -> bytes | None:
    answer = bench.mail.talk(sdo_talk.COE, struct.pack("<H", sdo_talk.INFORMATION << 12) + body)
    if answer is None:
        return None
    service, content = sdo_talk.sdo_body(answer)
    if service != sdo_talk.INFORMATION or content[0] & 0x7F != body[0] + 1:
        return None
    whole, left = content[4:], struct.unpack_from("<H", content, 2)[0]
    while left:
        answer = bench.mail.fetch(SDO_LIMIT_NS)
        if answer is None:
            return None
        content = sdo_talk.sdo_body(answer)[1]
        whole, left = whole + content[4:], struct.unpack_from("<H", content, 2)[0]
    return whole


def _aborts(see: RuleFindings, what: str, answer: bytes, code: int) -> None:
    found = sdo_talk.refusal(answer)
    see.expect(
        isinstance(found, sdo_talk.SdoRefusal) and found.code == code,
        f"After {what} the answer is {found or 'no abort'}, must be {code:#010x}.",
    )


def deadlines(bench: Bench, see: RuleFindings) -> None:
    """Send a hundred requests back to back."""
    bench.again(PREOP)
    for _ in range(100):
        found = sdo_talk.upload(bench.mail.sdo, 0x1018, 4)
        see.equal("0x1018:04", found, struct.pack("<I", bench.serial))


MAILBOX_RULES = (
    Rule("mailbox.segments", MAILBOX, "Long values travel in segments of any size.", segments),
    Rule("mailbox.broken", MAILBOX, "Transfers that are broken off leave nothing behind.",
         broken_transfers),
    Rule("mailbox.bad", MAILBOX, "A bad mailbox gets an error reply and is counted.",
         bad_mailboxes),
    Rule("mailbox.repeat", MAILBOX, "The last answer is sent again when it is asked for.",
         repetition),
    Rule("mailbox.counter", MAILBOX, "The counter of the answers runs from 1 to 7.", counters),
    Rule("mailbox.information", MAILBOX, "SDO information describes every object.", information),
    Rule("mailbox.deadline", MAILBOX, "SDO requests are answered within 80 ms.", deadlines),
)  # fmt: skip
