"""Rules of the mailboxes: segments, malformed requests, repetition, SDO info."""

from __future__ import annotations

import itertools
import struct

from ocmm_bench.conform import _sdo_talk as sdo_talk
from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import INIT, PREOP, SDO_LIMIT_NS
from ocmm_core.fieldbus.device import CALIBRATION, COUNTERS, MAILBOX_BYTES, MAILBOX_IN_START

SECTION = "Mailboxes"
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
    again = bench.mail.fetch(SDO_LIMIT_NS)
    see.equal("The answer that is sent again", again, first)
    echo = bench.number(_SM_IN_CONTROL + 1, 1)
    see.equal("The repeat acknowledge bit (0x080F)", echo & 0x02, (control ^ 0x02) & 0x02)
    see.expect(bench.put(MAILBOX_IN_START, b"\x00") == 0, "The answer's mailbox can be written.")
    bench.go(INIT)


def counters(bench: Bench, see: RuleFindings) -> None:
    """Check the counters of the answering mailboxes."""
    bench.again(PREOP)
    bench.mail.reply_counters.clear()
    for _ in range(16):
        bench.mail.value(0x1000)
    found = bench.mail.reply_counters
    for one, next_one in itertools.pairwise(found):
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


RULES = (
    Rule("mailbox.segments", SECTION, "Long values travel in segments of any size.", segments),
    Rule("mailbox.broken", SECTION, "Transfers that are broken off leave nothing behind.",
         broken_transfers),
    Rule("mailbox.bad", SECTION, "A bad mailbox gets an error reply and is counted.",
         bad_mailboxes),
    Rule("mailbox.repeat", SECTION, "The last answer is sent again when it is asked for.",
         repetition),
    Rule("mailbox.counter", SECTION, "The counter of the answers runs from 1 to 7.", counters),
    Rule("mailbox.information", SECTION, "SDO information describes every object.", information),
    Rule("mailbox.deadline", SECTION, "SDO requests are answered within 80 ms.", deadlines),
)  # fmt: skip
