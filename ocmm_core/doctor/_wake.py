"""Wake-up latency of cycles under bus process conditions, and judgement of cycles on a cable.

    python -m ocmm_core.doctor._wake SECONDS PROCESSOR

A process with interpreter, priority, processor and locked memory of the bus process, if permitted,
waits for a deadline every millisecond and reports the maximum: a late cycle is lost.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from array import array
from collections.abc import Sequence
from typing import TypeVar

import msgspec

from ocmm_core.acquisition import bus_process
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._kernel_checks import bus_core
from ocmm_core.doctor._registry import CheckSpec
from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.fieldbus.wire import HostTime

PERIOD_NS = 1_000_000
GOOD_MISSED, BAD_MISSED = 0.0005, 0.02
"""Fractions of cycles a whole cycle late. A virtual machine without PREEMPT_RT under load can have
0.05 %; untuned ones had 0.35 to 1.9 %."""
ENOUGH_CYCLES = 10_000
"""In fewer the share of 0.05 % is less than five."""
GOOD_P999_US = 500.0
WATCHDOG_US = 100_000.0
"""Camera watchdog time (register 0x0420, default)."""
_START_S = 60.0
_LONGEST_S = 3600.0
"""Limit, because the program may carry rights."""
_MODULE = "ocmm_core.doctor._wake"

T = TypeVar("T", bound=msgspec.Struct)


class WakeTimes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    cycles: int
    missed: int
    """`cycles`, `missed`: number of cycles, and of those a whole cycle late."""
    p50_us: float
    p99_us: float
    p999_us: float
    max_us: float
    """`p50_us`, `p99_us`, `p999_us`, `max_us`: lateness, us."""
    real_time: bool
    core: int
    """Processor used; -1 if none was reserved."""


def wake_check(seconds: float) -> CheckSpec:
    """Return the check that measures for `seconds`."""
    return CheckSpec(
        "wake",
        "Wake-up jitter",
        "at most 0.05 % of the cycles come a cycle late, 99.9 % within 0.5 ms",
        lambda computer: judge_wakes(_measured(computer, seconds)),
    )


def judge_wakes(times: WakeTimes) -> Answer:
    """Judge wake-up times for the bus."""
    share = times.missed / times.cycles
    how = "" if times.real_time else ", without real-time priority"
    what = (
        f"Wakes up {times.p50_us:.0f} us late in the median, 99.9 % within {times.p999_us:.0f} us, "
        f"worst of {times.cycles:,}: {times.max_us:.0f} us; {100.0 * share:.2f} % a whole cycle "
        f"late{how}."
    )
    figures = {
        "p50_us": times.p50_us, "p99_us": times.p99_us, "p999_us": times.p999_us,
        "max_us": times.max_us, "missed": float(times.missed), "cycles": float(times.cycles),
        "real_time": float(times.real_time),
    }  # fmt: skip
    remedy = (
        "See the lines on kernel, processor, governor and idle states; end other programs."
        if times.real_time
        else "Give the bus process its rights, or measure with sudo, where the service has them."
    )
    if times.max_us > WATCHDOG_US or share > BAD_MISSED:
        return red("wake.very_late", what, remedy, **figures)
    if share > GOOD_MISSED or times.p999_us > GOOD_P999_US:
        return amber("wake.late", what, remedy, **figures)
    if times.cycles < ENOUGH_CYCLES:
        return too_short("wake.short", what, **figures)
    if not times.real_time:
        return amber("wake.ordinary", what, remedy, **figures)
    return green(what, **figures)


def measure_wakes(seconds: float, core: int) -> WakeTimes:
    """Return this process's wake-up times; keeps priority and processor (-1: any)."""
    # In the order of the bus process: memory locked as root beyond the limit would leave none after
    # dropping the right.
    bus_process.allow_locked_memory()
    bus_process.give_up_all_but(bus_process.NEEDED)
    real_time = bus_process.take_priority(bus_process.BUS_PRIORITY) is None
    try:
        os.sched_setaffinity(0, {core} if core >= 0 else os.sched_getaffinity(0))
    except OSError:
        core = -1
    bus_process.lock_memory()
    clock = HostTime()
    count = max(1, round(seconds * 1e9 / PERIOD_NS))
    late = array("q", bytes(8 * count))
    gc.disable()
    deadline = clock.now_ns() + PERIOD_NS
    for cycle in range(count):
        late[cycle] = clock.wait_until(deadline)
        deadline += PERIOD_NS
        if late[cycle] > PERIOD_NS:
            # Missed cycles are over; wait for the next.
            deadline += late[cycle] // PERIOD_NS * PERIOD_NS
    gc.enable()
    found = sorted(late)
    return WakeTimes(
        cycles=count, missed=sum(one > PERIOD_NS for one in found), real_time=real_time, core=core,
        p50_us=part(found, 0.5), p99_us=part(found, 0.99), p999_us=part(found, 0.999),
        max_us=part(found, 1.0),
    )  # fmt: skip


def too_short(code: str, what: str, /, **figures: float) -> Answer:
    """Return that no fault was found, but in too short a time."""
    return amber(
        code, f"{what[:-1]}; too few to be sure.", "Measure for a minute: --seconds 60", **figures
    )


def part(ordered: Sequence[int], share: float) -> float:
    """Return the quantile of ordered times, ns, in us."""
    return round(ordered[min(int(share * len(ordered)), len(ordered) - 1)] / 1e3, 1)


def answer_of(command: Sequence[str], seconds: float, kind: type[T]) -> T:
    """Return the JSON result of a measuring process; NotAskedError if it fails."""
    try:
        done = subprocess.run(  # noqa: S603 - our own interpreter and modules, no shell
            list(command), stdin=subprocess.DEVNULL, capture_output=True,
            timeout=seconds + _START_S, check=False,
        )  # fmt: skip
        return msgspec.json.decode(done.stdout, type=kind)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NotAskedError(f"It could not be measured ({type(error).__name__}).") from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        said = done.stderr.decode("utf-8", errors="replace").strip().splitlines()
        last = "".join(sign if sign.isprintable() else "?" for sign in (said or ["no answer"])[-1])
        raise NotAskedError(f"It could not be measured ({last[:200]}).") from error


def _measured(computer: Computer, seconds: float) -> WakeTimes:
    if seconds <= 0.0:
        raise NotAskedError("Not measured.", "Measure it: --seconds 60")
    if not hasattr(os, "sched_setaffinity"):
        raise NotAskedError("This system has no real-time priority.")
    try:
        core = bus_core(computer)
    except NotAskedError:
        core = None
    command = wake_command(bus_process.bus_command(), seconds, -1 if core is None else core)
    return answer_of(command, seconds, WakeTimes)


def wake_command(bus: Sequence[str], seconds: float, core: int) -> list[str]:
    """Return the measuring command with the bus process's rights, from its command.

    A packaged program has no modules; it is called with the option of this measurement.
    """
    program, asked = bus[0], [str(seconds), str(core)]
    if len(bus) == 1:
        return [program, "--wake", *asked]
    # A program with rights loads no code from the current folder or environment.
    alone = ["-I"] if program != sys.executable else []
    return [program, *alone, "-m", _MODULE, *asked]


def main() -> None:
    """Measure, and print JSON."""
    times = measure_wakes(min(float(sys.argv[1]), _LONGEST_S), int(sys.argv[2]))
    sys.stdout.write(msgspec.json.encode(times).decode())


if __name__ == "__main__":
    main()


class LoopTimes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    cycles: int
    """Frames sent, one per millisecond."""
    late: int
    lost: int
    """`late`, `lost`: answered after their cycle, and never."""
    p50_us: float
    p999_us: float
    max_us: float
    """`p50_us`, `p999_us`, `max_us`: from sending a frame to its answer, us."""
    real_time: bool


def judge_loop(times: LoopTimes) -> Answer:
    """Judge the transit of frames through the kernel, without adapter and cable."""
    share = (times.late + times.lost) / times.cycles
    how = "" if times.real_time else ", without real-time priority"
    what = (
        f"A frame is back after {times.p50_us:.0f} us in the median, 99.9 % within "
        f"{times.p999_us:.0f} us, worst of {times.cycles:,}: {times.max_us:.0f} us; "
        f"{100.0 * share:.2f} % not in their cycle, {times.lost} lost{how}."
    )
    figures = {
        "p50_us": times.p50_us, "p999_us": times.p999_us, "max_us": times.max_us,
        "late": float(times.late), "lost": float(times.lost), "cycles": float(times.cycles),
        "real_time": float(times.real_time),
    }  # fmt: skip
    remedy = "See the lines on kernel, processor and wake-up jitter; end other programs."
    # A virtual cable loses nothing; losses are due to this computer.
    if share > BAD_MISSED:
        return red("loop.very_late", what, remedy, **figures)
    if share > GOOD_MISSED:
        return amber("loop.late", what, remedy, **figures)
    if times.cycles < ENOUGH_CYCLES:
        return too_short("loop.short", what, **figures)
    return green(what, **figures)
