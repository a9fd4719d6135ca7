"""Rules of process data and clock: checksums, counters, overrun; bus time, SYNC0, late start."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Sequence

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import INIT, MS, OP, PREOP, SAFEOP, ExchangeCycle
from ocmm_core.fieldbus.device import (
    CONFIGURATION,
    COUNTERS,
    FRAMES_PER_CYCLE,
    INFORMATION,
    INPUT_SYNC,
    N_SLOTS,
    OUTPUT_SYNC,
    SYNC0_NS,
    CameraStatus,
)
from ocmm_core.fieldbus.wire import Command

_FRAMES = "Process data"
_CYCLES = 300
_BUFFER = 1024
_LOST_FLAG = 0x0002
_KNOWN_STATUS, _KNOWN_FLAGS = 0x1F, 0x000F
_HEADER_OBJECT, _OUTPUT_OBJECT = 0x6000, 0x7000
_LATE_NS = 100_000
"""A frame that ended earlier must be readable: 20 us to compute plus read time."""


def exchange(bench: Bench, see: RuleFindings) -> None:
    """Check when the camera takes part in the process data exchange."""
    bench.again(PREOP)
    bench.prepare(SAFEOP)
    see.equal("The working counter in PREOP", bench.cycle().working_counter, 0)
    see.equal("SAFEOP", bench.ask_state(SAFEOP).state, SAFEOP)
    see.equal("The working counter of LRW in SAFEOP", bench.cycle().working_counter, 3)
    status = bench.cycle().header.status
    see.expect(not status & CameraStatus.OPERATIONAL, "Status bit 0 is set in SAFEOP.")
    bench.streaming()
    found = bench.cycle()
    see.equal("The working counter of LRW in OP", found.working_counter, 3)
    see.expect(bool(found.header.status & CameraStatus.OPERATIONAL), "Status bit 0 is clear in OP.")
    see.equal("The working counter of LRD", bench.cycle(command=Command.LRD).working_counter, 1)
    see.equal("The working counter of LWR", bench.cycle(command=Command.LWR).working_counter, 1)


def inputs(bench: Bench, see: RuleFindings) -> None:
    """Acknowledge frames for a while, and check every meaningful byte."""
    bench.streaming()
    boots = bench.cycle().header.boot_counter
    see.expect(boots > 0, "boot_counter is 0.")
    cycles = bench.run(_CYCLES)
    _check_sums(bench, see, cycles)
    for one, following in itertools.pairwise(cycles):
        went = (following.header.cycle_counter - one.header.cycle_counter) % (1 << 16)
        see.equal("cycle_counter went on by", went, 1)
    for each in cycles:
        header = each.header
        see.equal("boot_counter", header.boot_counter, boots)
        see.equal("period_ns", header.period_ns, SYNC0_NS)
        see.expect(
            header.frames_valid <= FRAMES_PER_CYCLE, f"frames_valid is {header.frames_valid}."
        )
        see.equal("start_ns", header.start_ns, bench.sync0_start + header.counter * SYNC0_NS)
        see.expect(
            not header.status & ~_KNOWN_STATUS, f"Status {header.status:#x} has unknown bits."
        )
        see.expect(bool(header.status & CameraStatus.SYNCHRONISED), "Status bit 1 is clear.")
        see.expect(not header.status & CameraStatus.OVERRUN, "Status bit 2 is set without a loss.")
        for number in range(min(header.frames_valid, FRAMES_PER_CYCLE)):
            _frame(see, each.frame(number))
    bench.feeding = True
    see.equal("0xA000:01 (frames lost)", bench.mail.count(COUNTERS, 1), 0)
    bench.go(INIT)


def order(bench: Bench, see: RuleFindings) -> None:
    """Check that each exposure comes once, in order, and not before its end."""
    bench.streaming()
    cycles = bench.run(_CYCLES)
    expected = cycles[0].header.counter
    for each in cycles:
        header = each.header
        if not header.frames_valid:
            continue
        if not see.equal("The counter of a block", header.counter, expected):
            expected = header.counter
        expected += header.frames_valid
        newest_ns = header.start_ns + (header.frames_valid - 1) * header.period_ns
        age = each.system_ns - newest_ns
        see.expect(age >= SYNC0_NS, f"A frame is readable {age} ns after its exposure began.")
        if header.frames_valid < FRAMES_PER_CYCLE:
            see.expect(
                age <= 2 * SYNC0_NS + _LATE_NS,
                f"A frame is missing {age - SYNC0_NS} ns after the newest one began.",
            )
            see.timed("Age of the newest frame when it is read", age)
    see.equal("The first exposure", cycles[0].header.counter, 0)


def go_back(bench: Bench, see: RuleFindings) -> None:
    """Acknowledge nothing, a part, and frames never sent."""
    bench.streaming()
    bench.run(3)
    bench.line.sleep(0.004)
    first = bench.cycle()
    see.need(first.header.frames_valid > 6, "There are fewer than 7 frames after 4 ms.")
    begin = first.header.counter
    for what, each in (
        ("after a cycle that acknowledged nothing", bench.cycle()),
        ("after an acknowledgement without control bit 0", _after(bench, 0, begin + 3)),
        ("after an acknowledgement of what is far ahead", _after(bench, 1, begin + 5000)),
        ("after an acknowledgement of what was acknowledged before", _after(bench, 1, begin - 3)),
        ("after an acknowledgement of what was just acknowledged", _after(bench, 1, begin - 1)),
    ):
        see.equal(f"The first frame {what}", each.header.counter, begin)
        same = all(each.frame(n) == first.frame(n) for n in range(first.header.frames_valid))
        see.expect(same, f"Frames are changed when they are sent again {what}.")
    part = _after(bench, 1, begin + 3)
    see.equal("The first frame after a part was acknowledged", part.header.counter, begin + 4)
    see.equal("A frame that comes again in another place", part.frame(0), first.frame(4))
    _check_sums(bench, see, (first, part))


def overrun(bench: Bench, see: RuleFindings) -> None:
    """Overrun the buffer with a master that never acknowledges."""
    bench.streaming()
    lost, overruns = bench.mail.count(COUNTERS, 1), bench.mail.count(COUNTERS, 3)
    last: ExchangeCycle | None = None
    begin = bench.line.now_ns()
    while bench.line.now_ns() - begin < (_BUFFER + 240) * SYNC0_NS:
        last = bench.cycle()
        bench.line.sleep(0.002)
    found = bench.cycle()
    see.need(last is not None and found.header.frames_valid > 0, "There are no frames.")
    see.expect(
        bool(found.header.status & CameraStatus.OVERRUN), "Status bit 2 is clear after a loss."
    )
    (flags,) = struct.unpack_from("<H", found.frame(0), 2)
    see.expect(bool(flags & _LOST_FLAG), "Bit 1 of the flags is clear behind a gap.")
    (flags,) = struct.unpack_from("<H", found.frame(1), 2)
    see.expect(not flags & _LOST_FLAG, "Bit 1 of the flags is set where there is no gap.")
    newest = (found.system_ns - bench.sync0_start) // SYNC0_NS - 1
    held = newest - found.header.counter + 1
    see.expect(
        _BUFFER - 2 <= held <= _BUFFER + 2, f"The buffer holds {held} frames, not {_BUFFER}."
    )
    again = _after(bench, 1, found.header.counter + found.header.frames_valid - 1)
    see.expect(
        bool(again.header.status & CameraStatus.OVERRUN)
        == (again.header.counter != found.header.counter + found.header.frames_valid),
        "Status bit 2 stays set behind the gap.",
    )
    bench.feeding = True
    counted = bench.mail.count(COUNTERS, 1) - lost
    see.expect(
        found.header.counter <= counted,
        f"0xA000:01 counts {counted} of {found.header.counter} lost.",
    )
    see.expect(bench.mail.count(COUNTERS, 3) > overruns, "0xA000:03 does not count an overrun.")
    bench.go(INIT)


def objects(bench: Bench, see: RuleFindings) -> None:
    """Read process data as objects."""
    bench.streaming()
    cycle = bench.outputs(0, 0x12345678)
    see.equal("0x7000:03", bench.mail.count(_OUTPUT_OBJECT, 3), 0x12345678)
    header = cycle.header
    see.equal("0x6000:03", bench.mail.count(_HEADER_OBJECT, 3), header.period_ns)
    see.equal("0x6000:07", bench.mail.count(_HEADER_OBJECT, 7), header.config_crc)
    see.equal("0x6000:08", bench.mail.count(_HEADER_OBJECT, 8), header.boot_counter)
    bench.go(INIT)


def sensor_limits(bench: Bench, see: RuleFindings) -> None:
    """Check that every valid spot lies on the sensor."""
    bench.go(PREOP)
    width, height = bench.mail.count(INFORMATION, 2), bench.mail.count(INFORMATION, 3)
    bench.streaming()
    for cycle in bench.run(20):
        for number in range(min(cycle.header.frames_valid, FRAMES_PER_CYCLE)):
            frame = cycle.frame(number)
            (valid,) = struct.unpack_from("<H", frame)
            for slot in range(N_SLOTS):
                if valid >> slot & 1:
                    x, y = struct.unpack_from("<ii", frame, 4 + 8 * slot)
                    see.expect(
                        0 <= x < width << 16 and 0 <= y < height << 16,
                        f"A valid spot is at {x / 65536:.1f}, {y / 65536:.1f} px, off the sensor.",
                    )


def _frame(see: RuleFindings, frame: bytes) -> None:
    valid, flags = struct.unpack_from("<HH", frame)
    see.expect(not valid >> N_SLOTS, f"valid is {valid:#x}, which has slots that are not there.")
    see.expect(not flags & ~_KNOWN_FLAGS, f"Flags {flags:#x} have unknown bits.")
    see.expect(not flags & _LOST_FLAG, "Bit 1 of the flags is set without a loss.")


def _check_sums(bench: Bench, see: RuleFindings, cycles: Sequence[ExchangeCycle]) -> None:
    for each in cycles:
        see.expect(
            bench.belongs(each), "data_crc is not the check sum of serial number and inputs."
        )


def _after(bench: Bench, control: int, number: int) -> ExchangeCycle:
    """Send an acknowledgement, wait, and return the inputs of the next cycle."""
    bench.outputs(control, number)
    bench.line.sleep(1 / 1000)
    return bench.cycle()


FRAMES = (
    Rule("frames.exchange", _FRAMES, "Process data are exchanged from SAFEOP on.", exchange),
    Rule("frames.inputs", _FRAMES, "Check sum with serial number, counters, times and status.",
         inputs),
    Rule("frames.order", _FRAMES, "Every exposure comes once, in order, when it is over.", order),
    Rule("frames.go_back", _FRAMES, "Frames come again until they are acknowledged.", go_back),
    Rule("frames.overrun", _FRAMES, "What runs over is dropped, marked and counted.", overrun),
    Rule("frames.objects", _FRAMES, "The objects show the process data.", objects),
    Rule("frames.sensor", _FRAMES, "Valid spots are on the sensor.", sensor_limits),
)  # fmt: skip


_CLOCK = "Clock"
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
    ppm = max(0.0, abs(end[1] - begin[1] - passed) - doubt) / passed * 1e6
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


CLOCK = (
    Rule("clock.time", _CLOCK, "Bus time has 64 bits, an offset, and the right rate.",
         system_time),
    Rule("clock.difference", _CLOCK, "The difference to the reference clock is shown.",
         difference),
    Rule("clock.phase", _CLOCK, "Exposure k happens at SYNC0 start + k periods.", phase),
    Rule("clock.late", _CLOCK, "No exposure before SYNC0 begins.", late_start),
    Rule("clock.free", _CLOCK, "Without SYNC0 the camera exposes by its own period.",
         free_running),
    Rule("clock.restart", _CLOCK, "Every start begins with exposure 0.", restarted),
)  # fmt: skip
