"""Does the wire keep its cycle? Two software cameras, 1 kHz cycles with 8 kHz frames, 10 s.

Prints cycles kept, how late they began and frames lost against the limits, and ends with 1 where
one is broken. What it cannot show is the wire itself: a virtual cable has no transmission errors
and no interrupt coalescing. Run: ``python -m benchmarks.wire [SECONDS]``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.bus_process import BUS_PRIORITY, EthercatSource, take_priority
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.cycle import BusSettings
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.simulation.bus import SegmentConfig, make_link, namespace_command

SECONDS = 10.0
GOOD_LIMIT = 0.97
LATE_P99_LIMIT_US = 1000.0
LOST_LIMIT = 0.001
CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
_HOST, _FAR = "bench0", "bench1"
_INSIDE = "--inside"


def measure(seconds: float) -> dict[str, float]:
    """Run inside the namespace and return the figures."""
    make_link(_HOST, _FAR)
    segment = SegmentConfig(
        interface=_FAR, cameras=CAMERAS, provider=msgspec.Raw(b'{"pattern":"test"}')
    )
    cameras = subprocess.Popen(
        [sys.executable, "-m", "ocmm_core.simulation.bus._camera_process"],
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
        begin = time.monotonic()
        while time.monotonic() - begin < seconds:
            cycle = source.read()
            counts[cycle.verdict.value] += 1
            counts[cycle.skipped.value] += cycle.elapsed - 1
            counts["elapsed"] += cycle.elapsed
            counts["frames"] += 0 if cycle.frames is None else len(cycle.frames)
            counts["frames lost"] += cycle.frames_lost
            lateness.append(source.lateness_ns * 1e-3)
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
    }


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
    seen: Counter[str] = Counter(json.loads(done.stdout))
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
    ]
    sys.stdout.write("\n".join(lines) + "\n")
    return 0 if all(fine for *_, fine in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
