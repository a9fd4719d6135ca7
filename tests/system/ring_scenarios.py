"""Breaks in a ring with a redundancy cable, inside a private network namespace; not collected.

``python ring_scenarios.py`` makes two virtual cables, closes software cameras to a ring between
them, breaks it at several places and prints frames and reports as JSON.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.camera_faults import CameraDeed, FaultKind
from benchmarks.faulty_cameras import CLOCK, MODULE, FaultySegment
from ocmm_core.acquisition.bus_process import BUS_PRIORITY, EthercatSource, take_priority
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing
from ocmm_core.fieldbus.cycle import BusSettings
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.report import BusPhase, decode_report
from ocmm_core.fieldbus.wire import make_link, set_link
from tests.system.frame_watch import FrameWatch, Watched

LEFT, RIGHT = CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2)
FIRST, SECOND, NEAR, FAR = "ring0", "ring2", "ring1", "ring3"
CYCLE_NS = 1_000_000
PHASES = (
    "whole", "between the cameras", "repaired", "second cable", "both whole", "first cable",
    "whole again",
)  # fmt: skip
SETTLE_S, SEEN_S, START_S = 1.6, 0.6, 240.0


def main(folder: Path) -> dict[str, Any]:
    """Play all breaks, one after the other; each is repaired before the next."""
    take_priority(BUS_PRIORITY)
    make_link(FIRST, NEAR)
    make_link(SECOND, FAR)
    control = str(folder / "cameras")
    segment = FaultySegment(
        interface=NEAR, second_interface=FAR, cameras=(LEFT, RIGHT), provider=CLOCK, control=control
    )
    cameras = subprocess.Popen(
        [sys.executable, "-m", MODULE], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert cameras.stdin is not None
    assert cameras.stdout is not None
    cameras.stdin.write(segment.to_json())
    cameras.stdin.flush()
    assert cameras.stdout.readline() == b"ready\n"
    settings = BusSettings(FIRST, (LEFT, RIGHT), 125_000, CYCLE_NS, redundant_interface=SECOND)
    ring = FrameRing.create(2)
    worker = AcquisitionWorker(EthercatSource(settings, ring.set_report), ring)
    try:
        worker.start()
        watch = FrameWatch(ring)
        _look(watch, Watched(), START_S, until_frames=True)
        return {name: _played(watch, ring, name, control) for name in PHASES}
    finally:
        worker.request_stop()
        worker.join(240.0)
        ring.close()
        cameras.stdin.close()
        cameras.wait(240)


def _played(watch: FrameWatch, ring: FrameRing, name: str, control: str) -> dict[str, Any]:
    match name:
        case "between the cameras":
            _break(control, broken=True)
        case "repaired":
            _break(control, broken=False)
        case "second cable" | "both whole":
            set_link(FAR, up=name == "both whole")
        case "first cable" | "whole again":
            set_link(NEAR, up=name == "whole again")
        case _:
            pass
    settling, seen = Watched(), Watched()
    _look(watch, settling, SETTLE_S)
    _look(watch, seen, SEEN_S)
    report = decode_report(ring.report())
    assert report is not None
    return {
        "wrong": settling.wrong + seen.wrong,
        "frames": seen.frames,
        "operation": report.phase is BusPhase.OPERATION,
        "broken": report.redundancy_broken,
        "message": report.message,
        "reported": sorted({event.code for event in (*settling.events, *seen.events)}),
    }


def _look(watch: FrameWatch, seen: Watched, seconds: float, *, until_frames: bool = False) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and not (until_frames and seen.frames):
        watch.look(seen)
        time.sleep(0.01)


def _break(control: str, *, broken: bool) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ask:
        command = CameraDeed(do=FaultKind.BREAK, camera=0, value=int(broken))
        ask.sendto(msgspec.json.encode(command), control)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        sys.stdout.write(json.dumps(main(Path(made))))
