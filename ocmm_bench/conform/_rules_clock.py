"""Rules of the clock: bus time, SYNC0 phase and period, late start."""

from __future__ import annotations

import itertools
import struct

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import INIT, MS, OP, PREOP, SAFEOP
from ocmm_core.fieldbus.device import CONFIGURATION, INPUT_SYNC, OUTPUT_SYNC, SYNC0_NS, CameraStatus

SECTION = "Clock"
_SYSTEM_TIME, _OFFSET, _DIFFERENCE, _SPEED = 0x0910, 0x0920, 0x092C, 0x0930
_BEHIND = 1 << 31
_MOST_PPM = 500.0
_RATE_S = 0.5
_LATE_START_NS = 50 * MS
_FREE_PERIOD_NS = 250_000


def system_time(bench: Bench, see: RuleFindings) -> None:
    """Check the bus time: 64 bits, running, offset applied, rate of the computer."""
    bench.go(INIT)
    times = [bench.system_ns() for _ in range(20)]
    see.expect(all(a < b for a, b in itertools.pairwise(times)), "Bus time stands still.")
    before = bench.get(_OFFSET, 8)
    shift = 1 << 40
    first = bench.system_ns()
    (offset,) = struct.unpack("<q", before)
    bench.put(_OFFSET, struct.pack("<q", offset + shift))
    moved = bench.system_ns() - first
    see.expect(
        shift <= moved < shift + 500 * MS, f"An offset of 2^40 ns moves bus time by {moved}."
    )
    bench.put(_OFFSET, before)
    reading = [(bench.line.now_ns(), bench.system_ns(), bench.line.now_ns()) for _ in range(5)]
    bench.line.sleep(_RATE_S)
    after = [(bench.line.now_ns(), bench.system_ns(), bench.line.now_ns()) for _ in range(5)]
    # The reading with the shortest round trip is the most accurate.
    begin, end = (min(each, key=lambda one: one[2] - one[0]) for each in (reading, after))
    passed = (end[0] + end[2] - begin[0] - begin[2]) / 2
    doubt = (end[2] - end[0] + begin[2] - begin[0]) / 2
    wrong = abs(end[1] - begin[1] - passed) - doubt
    ppm = max(0.0, wrong) / passed * 1e6
    see.expect(ppm <= _MOST_PPM, f"The clock is {ppm:.0f} ppm wrong against this computer.")


def difference(bench: Bench, see: RuleFindings) -> None:
    """Send a reference time ahead of and behind the clock."""
    bench.go(INIT)
    for ahead_ns in (10 * MS, -10 * MS):
        bench.put(_SYSTEM_TIME, struct.pack("<Q", bench.system_ns() + ahead_ns))
        found = bench.number(_DIFFERENCE, 4)
        amount = found & ~_BEHIND
        behind = bool(found & _BEHIND)
        see.expect(
            abs(amount - 10 * MS) < 5 * MS and behind == (ahead_ns > 0),
            f"A reference that is {ahead_ns} ns ahead gives {found:#x} in 0x092C.",
        )
    bench.put(_SPEED, bench.get(_SPEED, 2))


def phase(bench: Bench, see: RuleFindings) -> None:
    """Program other SYNC0 periods, and check the exposure times."""
    for period in (SYNC0_NS, 250_000, 100_000):
        bench.streaming(sync0_ns=period)
        for each in bench.run(40):
            header = each.header
            see.equal("period_ns", header.period_ns, period)
            off = (header.start_ns - bench.sync0_start) - header.counter * period
            see.timed("Exposures off SYNC0", abs(off), 1000)
            see.equal("Phase of an exposure to SYNC0, ns", off, 0)
    bench.go(INIT)


def late_start(bench: Bench, see: RuleFindings) -> None:
    """Program a late SYNC0 start: no exposure before it, the first one at it."""
    bench.again(PREOP)
    bench.prepare(SAFEOP)
    bench.program_clock(SYNC0_NS, _LATE_START_NS)
    see.equal("SAFEOP", bench.ask_state(SAFEOP).state, SAFEOP)
    bench.prepare(OP)
    bench.ask_state(OP)
    while True:
        each = bench.cycle()
        if each.header.frames_valid:
            break
        if each.system_ns > bench.sync0_start + _LATE_START_NS:
            see.expect(False, "No exposure comes after a SYNC0 that begins 50 ms late.")
            return
        bench.line.sleep(0.0005)
    see.expect(
        each.system_ns >= bench.sync0_start + SYNC0_NS,
        f"A frame is readable {bench.sync0_start - each.system_ns} ns before SYNC0 began.",
    )
    see.equal("The first exposure", each.header.counter, 0)
    see.equal("The time of the first exposure", each.header.start_ns, bench.sync0_start)
    bench.go(INIT)


def free_running(bench: Bench, see: RuleFindings) -> None:
    """Start without SYNC0, and check the reported mode."""
    bench.again(PREOP)
    bench.program_clock(0)
    before = bench.mail.value(CONFIGURATION, 1)
    bench.mail.set(CONFIGURATION, 1, struct.pack("<I", _FREE_PERIOD_NS))
    for index in (OUTPUT_SYNC, INPUT_SYNC):
        see.equal(f"{index:#06x}:01 without SYNC0", bench.mail.count(index, 1), 0)
    found = bench.streaming(sync0_ns=0)
    see.equal("period_ns without SYNC0", found.header.period_ns, _FREE_PERIOD_NS)
    see.expect(not found.header.status & CameraStatus.SYNCHRONISED, "Status bit 1 is set.")
    bench.go(PREOP)
    bench.mail.set(CONFIGURATION, 1, before)
    bench.streaming()
    bench.feeding = True
    for index in (OUTPUT_SYNC, INPUT_SYNC):
        see.equal(f"{index:#06x}:01 with SYNC0", bench.mail.count(index, 1), 2)
        see.equal(f"{index:#06x}:20 (sync error)", bench.mail.count(index, 0x20), 0)
    bench.feeding = False
    bench.go(INIT)


def restarted(bench: Bench, see: RuleFindings) -> None:
    """Start exposures twice: each start begins with exposure 0 of its SYNC0."""
    for _ in range(2):
        header = bench.streaming().header
        see.equal("The first exposure of a start", header.counter, 0)
        see.equal("Its time", header.start_ns, bench.sync0_start)
        bench.run(10)
    bench.go(INIT)


RULES = (
    Rule("clock.time", SECTION, "Bus time has 64 bits, an offset, and the right rate.",
         system_time),
    Rule("clock.difference", SECTION, "The difference to the reference clock is shown.",
         difference),
    Rule("clock.phase", SECTION, "Exposure k happens at SYNC0 start + k periods.", phase),
    Rule("clock.late", SECTION, "No exposure before SYNC0 begins.", late_start),
    Rule("clock.free", SECTION, "Without SYNC0 the camera exposes by its own period.",
         free_running),
    Rule("clock.restart", SECTION, "Every start begins with exposure 0.", restarted),
)  # fmt: skip
