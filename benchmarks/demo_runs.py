"""Does a first run over EtherCAT always end with a report? The demo, again and again, a row a run.

Prints whether the job is complete, how many cycles were late, how many frames were lost and the
pace of the virtual bus, and ends with 1 where a run is incomplete, lost a frame or has more than
1 % of its cycles late. ``--one-core`` binds the demo and all its processes to one core. The load of
the computer stands in each row. Run: ``python -m benchmarks.demo_runs [--runs N] [--one-core]``.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile

LATE_LIMIT = 0.01
_HANG_S = 1800.0
_CYCLES = re.compile(r"^Cycles +(\d+): \d+ good, (\d+) late", re.MULTILINE)
_FRAMES = re.compile(r"^Frames +\d+ delivered, (\d+) lost, (\d+) overrun", re.MULTILINE)
_PACE = re.compile(r"^Pace +([\d.]+):", re.MULTILINE)


def row_of(code: int, text: str) -> tuple[str, bool]:
    """Return the row of a run that ended with ``code`` and said ``text``, and whether it is fine.

    Exit codes 0 and 1 are complete jobs, of parts that conform and of others.
    """
    cycles, frames, pace = (pattern.search(text) for pattern in (_CYCLES, _FRAMES, _PACE))
    if cycles is None or frames is None or pace is None:
        return f"ended with {code} and no counters", False
    late = int(cycles[2]) / max(1, int(cycles[1]))
    lost = int(frames[1]) + int(frames[2])
    complete = code in (0, 1)
    fine = complete and not lost and late <= LATE_LIMIT
    return (
        f"{'complete' if complete else 'INCOMPLETE':10s} {cycles[1]:>8s} cycles, "
        f"{100 * late:.2f} % late, {lost} frames lost, pace {pace[1]}  {'ok' if fine else 'BROKEN'}"
    ), fine


def run(options: argparse.Namespace) -> tuple[str, bool]:
    """Run the demo once."""
    prefix = ["taskset", "-c", "0"] if options.one_core else []
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "ocmm_cli", "demo", "--headless"]
        plan = [] if options.plan is None else ["--plan", options.plan]
        try:
            done = subprocess.run(  # noqa: S603 - this program
                [*prefix, *command, "--source", options.source, "--out", folder, *plan],
                capture_output=True, text=True, check=False, timeout=_HANG_S,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return f"no end within {_HANG_S:.0f} s", False
    return row_of(done.returncode, done.stdout)


def main() -> int:
    """Print the rows and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--one-core", action="store_true")
    parser.add_argument("--source", default="ethercat:virtual")
    parser.add_argument("--plan")
    options = parser.parse_args()
    good = 0
    for number in range(1, options.runs + 1):
        load = os.getloadavg()[0]
        words, fine = run(options)
        good += fine
        sys.stdout.write(f"{number:3d}  load {load:5.2f}  {words}\n")
        sys.stdout.flush()
    sys.stdout.write(f"{good} of {options.runs} runs ok\n")
    return 0 if good == options.runs else 1


if __name__ == "__main__":
    sys.exit(main())
