"""Rules of process data: checksums, counters, acknowledgement and overrun."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Sequence

from ocmm_bench.conform._bench import Bench, Rule
from ocmm_bench.conform._findings import RuleFindings
from ocmm_bench.conform._mail_line import INIT, PREOP, SAFEOP, ExchangeCycle
from ocmm_core.fieldbus.device import (
    COUNTERS,
    FRAMES_PER_CYCLE,
    INFORMATION,
    N_SLOTS,
    SYNC0_NS,
    CameraStatus,
)
from ocmm_core.fieldbus.wire import Command

SECTION = "Process data"
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
        right_ns = bench.sync0_start + header.counter * SYNC0_NS
        see.equal("start_ns", header.start_ns, right_ns)
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


RULES = (
    Rule("frames.exchange", SECTION, "Process data are exchanged from SAFEOP on.", exchange),
    Rule("frames.inputs", SECTION, "Check sum with serial number, counters, times and status.",
         inputs),
    Rule("frames.order", SECTION, "Every exposure comes once, in order, when it is over.", order),
    Rule("frames.go_back", SECTION, "Frames come again until they are acknowledged.", go_back),
    Rule("frames.overrun", SECTION, "What runs over is dropped, marked and counted.", overrun),
    Rule("frames.objects", SECTION, "The objects show the process data.", objects),
    Rule("frames.sensor", SECTION, "Valid spots are on the sensor.", sensor_limits),
)  # fmt: skip
