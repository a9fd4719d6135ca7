"""The program that reads a tracker: packets of the network cannot end the station with it.

It reads its configuration as one line of JSON from standard input, fills a ring, and ends on
request in the ring, on SIGTERM, or at the end of standard input.
"""

from __future__ import annotations

import sys

import msgspec

from ocmm_core.acquisition.bus_process import read_first_line, stopped_by_parent
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing
from ocmm_core.failure import REOPEN, exit_with
from ocmm_trackers._source import TrackerConfig, TrackerSource


def tracker_command() -> list[str]:
    """Return the command of this program."""
    return [sys.executable, "-m", "ocmm_trackers._process"]


def main() -> None:
    """Run the program."""
    try:
        sys.exit(_run())
    except Exception as error:
        exit_with(error, "The tracker process", REOPEN)


def _run() -> int:
    config = msgspec.json.decode(read_first_line(sys.stdin.fileno()), type=TrackerConfig)
    ring = FrameRing.attach(config.ring_path)
    try:
        source = TrackerSource(config)
        return AcquisitionWorker(source, ring, stopped_by_parent()).run_program()
    finally:
        ring.close()


if __name__ == "__main__":
    main()
