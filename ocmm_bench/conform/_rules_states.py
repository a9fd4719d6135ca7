"""Rules of the states: allowed and forbidden transitions (ETG.1000.6, 6.4)."""

from __future__ import annotations

import struct

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import BOOT, ERROR, INIT, MS, NAMES, OP, PREOP, SAFEOP
from ocmm_bench.conform._sdo_talk import COE, mailbox
from ocmm_core.fieldbus.device import (
    CONFIGURATION,
    INFORMATION,
    MAILBOX_BYTES,
    MAILBOX_IN_START,
    SYNC_MANAGERS,
    WINDOWS,
)

SECTION = "States"
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
        _refused(see, f"{NAMES[start]} to {NAMES.get(end, end)}", status.state, start)
        see.equal(f"The code of {NAMES[start]} to {NAMES.get(end, end)}", status.code, code)
        bench.ask_state(start, acknowledge=True)


def acknowledged(bench: Bench, see: RuleFindings) -> None:
    """Leave an error only by acknowledging it."""
    bench.go(PREOP)
    bench.ask_state(OP, settle_s=0.0)
    bench.prepare(SAFEOP)
    ignored = bench.ask_state(SAFEOP, settle_s=0.01)
    _refused(see, "a request with an error that is not acknowledged", ignored.state, PREOP)
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
        _refused(see, f"PREOP without sync manager {number}", status.state, INIT)
        see.equal(f"The code of PREOP without sync manager {number}", status.code, _NO_MAILBOX)
    bench.go(INIT)
    bench.prepare(PREOP)
    bench.set_manager(1, MAILBOX_IN_START, MAILBOX_BYTES // 2, SYNC_MANAGERS[1][2], 1)
    status = bench.ask_state(PREOP, settle_s=0.0)
    _refused(see, "PREOP with a mailbox of half the size", status.state, INIT)
    see.equal("The code of PREOP with a mailbox of half the size", status.code, _NO_MAILBOX)
    for number, code in ((2, _NO_OUTPUTS), (3, _NO_INPUTS)):
        bench.again(PREOP)
        bench.prepare(SAFEOP, without=(number,))
        status = bench.ask_state(SAFEOP, settle_s=0.0)
        _refused(see, f"SAFEOP without sync manager {number}", status.state, PREOP)
        see.equal(f"The code of SAFEOP without sync manager {number}", status.code, code)
    for number, code in ((2, _NO_OUTPUTS), (3, _NO_INPUTS)):
        bench.again(PREOP)
        bench.prepare(SAFEOP)
        start, size, control = SYNC_MANAGERS[number][:3]
        bench.set_manager(number, start, size + 2, control, 1)
        status = bench.ask_state(SAFEOP, settle_s=0.0)
        _refused(see, f"SAFEOP with sync manager {number} too long", status.state, PREOP)
        see.equal(f"The code of SAFEOP with sync manager {number} too long", status.code, code)


def clock_too_fast(bench: Bench, see: RuleFindings) -> None:
    """Request SAFEOP with too fast exposures."""
    bench.again(PREOP)
    bench.prepare(SAFEOP, sync0_ns=49_999)
    status = bench.ask_state(SAFEOP, settle_s=0.0)
    _refused(see, "SAFEOP with SYNC0 every 49,999 ns", status.state, PREOP)
    see.equal("The code of SAFEOP with SYNC0 every 49,999 ns", status.code, _BAD_CLOCK)
    bench.again(PREOP)
    bench.prepare(SAFEOP, sync0_ns=50_000)
    see.equal("SAFEOP with SYNC0 every 50,000 ns", bench.ask_state(SAFEOP).state, SAFEOP)
    bench.go(INIT)


def contradictions(bench: Bench, see: RuleFindings) -> None:
    """Start with contradictory configurations."""
    bench.again(PREOP)
    width = bench.mail.count(INFORMATION, 2)
    period = bench.mail.value(CONFIGURATION, 1)
    before = {(CONFIGURATION, 2): bench.mail.value(CONFIGURATION, 2)}
    before |= {(WINDOWS, sub): bench.mail.value(WINDOWS, sub) for sub in range(1, 5)}
    off = {1: width - 10, 2: 0, 3: 20, 4: 20}
    changes = (
        ("an exposure as long as the period", {(CONFIGURATION, 2): period}),
        ("a window that is not on the sensor",
         {(WINDOWS, sub): struct.pack("<H", value) for sub, value in off.items()}),
    )  # fmt: skip
    for what, change in changes:
        for (index, sub), value in change.items():
            bench.mail.set(index, sub, value)
        bench.prepare(SAFEOP)
        status = bench.ask_state(SAFEOP, settle_s=0.02)
        if not status.state & ERROR:
            bench.line.sleep(0.02)
            status = bench.status()
        _refused(see, f"a start with {what}", status.state, PREOP)
        see.equal(f"The code of a start with {what}", status.code, _CONTRADICTION)
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
    _refused(see, "BOOT without a mailbox", status.state, INIT)
    see.equal("The code of BOOT without a mailbox", status.code, _NO_BOOT_MAILBOX)
    bench.go(BOOT)
    see.equal("The state", bench.status().state, BOOT)
    for wanted in (PREOP, SAFEOP, OP):
        status = bench.ask_state(wanted, settle_s=0.0)
        _refused(see, f"BOOT to {NAMES[wanted]}", status.state, BOOT)
        see.equal(f"The code of BOOT to {NAMES[wanted]}", status.code, _INVALID)
        bench.ask_state(BOOT, acknowledge=True)
    request = struct.pack("<HBHB4x", 2 << 12, 0x40, 0x1000, 0)
    bench.mail.post(mailbox(COE, request, bench.mail.next_counter()))
    answer = bench.mail.fetch(50 * MS)
    see.expect(answer is None or answer[5] & 0x0F != COE, "The camera answers CoE in BOOT.")
    bench.mail.drain()
    see.equal("The state after BOOT to INIT", bench.ask_state(INIT).state, INIT)


def _refused(see: RuleFindings, what: str, found: int, stays: int) -> None:
    see.expect(
        found == stays | ERROR,
        f"After {what} the camera is in {NAMES.get(found & 0x0F, found)}"
        f"{' with' if found & ERROR else ' without'} the error bit, must be in {NAMES[stays]} "
        "with it.",
    )


RULES = (
    Rule("state.allowed", SECTION, "Every allowed change of state, within its deadline.", allowed),
    Rule("state.forbidden", SECTION, "A change that is not allowed is refused with its code.",
         forbidden),
    Rule("state.acknowledge", SECTION, "An error stays until it is acknowledged.", acknowledged),
    Rule("state.sync_managers", SECTION, "No state without the sync managers that it needs.",
         missing_managers),
    Rule("state.clock", SECTION, "SYNC0 faster than 50,000 ns is refused.", clock_too_fast),
    Rule("state.configuration", SECTION, "A configuration that contradicts itself is not started.",
         contradictions),
    Rule("state.boot", SECTION, "BOOT only from INIT and only back to it, without CoE.", boot),
)  # fmt: skip
