"""Does the wire keep its cycle? Two software cameras, 1 kHz cycles with 8 kHz frames, 10 s.

Prints cycles kept, how late they began and frames lost against the limits, and ends with 1 where
one is broken. What it cannot show is the wire itself: a virtual cable has no transmission errors
and no interrupt coalescing. Then the same as `ethercat:virtual` runs it, where the bus waits for a
computer that is too slow: its pace, and what it must never lose. Both with the share of a core that
each process takes, its processor time for a cycle, and how often it is woken.
Run: ``python -m benchmarks.wire [SECONDS]``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.bus_process import BUS_PRIORITY, BusConfig, EthercatSource, take_priority
from ocmm_core.acquisition.frames import AcquisitionState, AcquisitionStatus, FrameRing, read_status
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.cycle import BusSettings
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.wire import make_link, namespace_command
from ocmm_sim.bus import SegmentConfig, VirtualBus

SECONDS = 10.0
GOOD_LIMIT = 0.97
LATE_P99_LIMIT_US = 1000.0
LOST_LIMIT = 0.001
CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
_HOST, _FAR = "bench0", "bench1"
_INSIDE = "--inside"
_PATTERN = msgspec.Raw(b'{"pattern":"test"}')
_READ_S = 0.02
_START_S = 60.0


@dataclass(frozen=True, slots=True)
class Usage:
    """Usage of a process: processor time, s, and number of wake-ups."""

    processor_s: float
    wake_ups: int

    @classmethod
    def of(cls, pid: int) -> Usage:
        """Ask the kernel."""
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
        ticks = int(fields[11]) + int(fields[12])
        wake_ups = sum(
            int(line.split()[1])
            for status in Path(f"/proc/{pid}/task").glob("*/status")
            for line in status.read_text(encoding="ascii").splitlines()
            if line.startswith("voluntary_ctxt_switches")
        )
        return cls(ticks / os.sysconf("SC_CLK_TCK"), wake_ups)

    def words(self, before: Usage, seconds: float, cycles: float) -> str:
        """Return the usage since ``before`` in words."""
        processor_s, wake_ups = (
            self.processor_s - before.processor_s,
            self.wake_ups - before.wake_ups,
        )
        return (
            f"{100 * processor_s / seconds:5.1f} % of a core, {1e6 * processor_s / cycles:5.0f} us "
            f"a cycle, woken {wake_ups / cycles:.2f} times a cycle"
        )


def measure_virtual(seconds: float) -> tuple[list[str], AcquisitionStatus]:
    """Run the bus as `ethercat:virtual` does, and return lines and what became of its cycles."""
    ring = FrameRing.create(len(CAMERAS))
    bus = VirtualBus(
        BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS),
        SegmentConfig(interface="", cameras=CAMERAS, provider=_PATTERN),
        ring,
    )
    try:
        bus.start()
        begin = time.monotonic()
        while read_status(ring).state is AcquisitionState.OPENING:
            if time.monotonic() - begin > _START_S:
                raise OSError("the virtual bus does not start")
            time.sleep(_READ_S)
        lines = _watched(bus, ring, seconds)
        bus.request_stop()
        bus.join(_START_S)
        return lines, read_status(ring)
    finally:
        bus.join(0.0)
        ring.close()


def _watched(bus: VirtualBus, ring: FrameRing, seconds: float) -> list[str]:
    if bus.pid is None:
        raise OSError("the virtual bus does not start")
    children = Path(f"/proc/{bus.pid}/task/{bus.pid}/children").read_text(encoding="ascii")
    places = {"cameras": bus.pid, "bus process": int(children.split()[0])}
    before = {name: Usage.of(pid) for name, pid in places.items()}
    begin, cycles = time.monotonic(), read_status(ring).elapsed
    while time.monotonic() - begin < seconds:
        while ring.read(ring.capacity) is not None:
            pass
        time.sleep(_READ_S)
    spent, passed = time.monotonic() - begin, max(1, read_status(ring).elapsed - cycles)
    return [
        f"{name:16s} {Usage.of(pid).words(before[name], spent, passed)}"
        for name, pid in places.items()
    ]


def measure(seconds: float) -> tuple[dict[str, float], list[str]]:
    """Run inside the namespace and return the figures, and lines about the processes."""
    make_link(_HOST, _FAR)
    segment = SegmentConfig(interface=_FAR, cameras=CAMERAS, provider=_PATTERN)
    cameras = subprocess.Popen(
        [sys.executable, "-m", "ocmm_sim.bus._camera_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    source = EthercatSource(BusSettings(_HOST, CAMERAS, 125_000, 1_000_000))
    if cameras.stdin is None or cameras.stdout is None:
        raise OSError("no pipe to the software cameras")
    try:
        cameras.stdin.write(segment.to_json())
        cameras.stdin.flush()
        cameras.stdout.readline()
        real_time = take_priority(BUS_PRIORITY) is None
        source.open()
        counts: Counter[str] = Counter()
        lateness = []
        places = {"cameras": cameras.pid, "bus process": os.getpid()}
        before = {name: Usage.of(pid) for name, pid in places.items()}
        begin = time.monotonic()
        while time.monotonic() - begin < seconds:
            cycle = source.read()
            counts[cycle.verdict.value] += 1
            counts[cycle.skipped.value] += cycle.elapsed - 1
            counts["elapsed"] += cycle.elapsed
            counts["frames"] += 0 if cycle.frames is None else len(cycle.frames)
            counts["frames lost"] += cycle.frames_lost
            lateness.append(source.lateness_ns * 1e-3)
        spent = time.monotonic() - begin
        lines = [
            f"{name:16s} {Usage.of(pid).words(before[name], spent, counts['elapsed'])}"
            for name, pid in places.items()
        ]
    finally:
        source.close()
        cameras.stdin.close()
        cameras.wait(5.0)
    p50, p99, p999 = np.percentile(lateness, [50, 99, 99.9])
    return {
        **{name: float(count) for name, count in counts.items()},
        "p50": float(p50),
        "p99": float(p99),
        "p99.9": float(p999),
        "real time": float(real_time),
    }, lines


def main() -> int:
    """Measure in a private namespace, print the table and return the exit code."""
    arguments = sys.argv[1:]
    if arguments[:1] == [_INSIDE]:
        sys.stdout.write(json.dumps(measure(float(arguments[1]))))
        return 0
    try:
        prefix = namespace_command()
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    seconds = float(arguments[0]) if arguments else SECONDS
    root = str(Path(__file__).resolve().parents[1])
    done = subprocess.run(  # noqa: S603 - this file again
        [*prefix, sys.executable, __file__, _INSIDE, str(seconds)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": root},
        check=False,
    )
    if done.returncode:
        return 2
    figures, lines_of_processes = json.loads(done.stdout)
    seen: Counter[str] = Counter(figures)
    good = seen["good"] / seen["elapsed"]
    lost = seen["frames lost"] / max(1.0, seen["frames"] + seen["frames lost"])
    rows = (
        ("cycles good", good, GOOD_LIMIT, "", good >= GOOD_LIMIT),
        ("cycle late p99", seen["p99"], LATE_P99_LIMIT_US, "us", seen["p99"] <= LATE_P99_LIMIT_US),
        ("frames lost", lost, LOST_LIMIT, "", lost <= LOST_LIMIT),
    )
    priority = "with" if seen["real time"] else "without"
    accounts = ", ".join(f"{seen[name]:.0f} {name}" for name in ("good", "late", "lost", "bad"))
    lines = [
        f"{seen['elapsed']:.0f} cycles of 1 ms, {priority} real-time priority: {accounts}",
        f"{seen['frames']:.0f} frames, {seen['frames lost']:.0f} lost; cycles late by "
        f"{seen['p50']:.0f} us (p50), {seen['p99']:.0f} us (p99), {seen['p99.9']:.0f} us (p99.9)",
        *(
            f"{name:16s} {value:10.4f} {unit:3s} limit {limit:10.4f}  {'ok' if fine else 'BROKEN'}"
            for name, value, limit, unit, fine in rows
        ),
        *lines_of_processes,
    ]
    sys.stdout.write("\n".join(lines) + "\n")
    of_processes, status = measure_virtual(seconds)
    missing = status.late + status.lost + status.bad + status.frames_lost + status.overrun
    lines = [
        f"ethercat:virtual, {status.elapsed} cycles of 1 ms at {status.mean_pace or 0.0:.2f} of "
        f"real time: {100 * status.late / max(1, status.elapsed):.2f} % late, {status.lost} lost, "
        f"{status.bad} bad; {status.frames_lost + status.overrun} frames lost  "
        f"{'BROKEN' if missing else 'ok'}",
        *of_processes,
    ]
    sys.stdout.write("\n".join(lines) + "\n")
    return 0 if all(fine for *_, fine in rows) and not missing else 1


if __name__ == "__main__":
    sys.exit(main())
