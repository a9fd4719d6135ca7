"""An application without rights and its bus process; run as a program, not collected.

``python rights_scenario.py INTERFACE [SOCKET]`` plays the window: it starts the bus process on an
interface with cameras, or requests one from the service at the socket, waits, and prints as JSON
the rights of both and the report of the bus.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

from ocmm_core.acquisition.bus_process import BusConfig, BusProcess, ServiceBus, rights_of
from ocmm_core.acquisition.frames import AcquisitionState, FrameRing, read_status
from ocmm_core.fieldbus.device import CameraIdentity

CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
_OPEN_S = 240.0
_FRAMES = 2000


def rights(pid: int) -> dict[str, Any]:
    """Return the rights of every thread of a process; the kernel keeps them by thread."""
    threads = [rights_of(int(entry.name)) for entry in Path(f"/proc/{pid}/task").iterdir()]
    return {
        "effective": sorted({tuple(sorted(thread.effective)) for thread in threads}),
        "permitted": sorted({tuple(sorted(thread.permitted)) for thread in threads}),
        "inheritable": sorted({tuple(sorted(thread.inheritable)) for thread in threads}),
        "ambient": sorted({tuple(sorted(thread.ambient)) for thread in threads}),
        "no_new_privileges": all(thread.no_new_privileges for thread in threads),
    }


def how_it_runs(pid: int) -> dict[str, Any]:
    """Return priority, processors and locked memory of a process, from the kernel."""
    fields = dict(
        line.split(":", 1)
        for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    )
    return {
        "policy": os.sched_getscheduler(pid),
        "processors": len(os.sched_getaffinity(pid)),
        "locked_kib": int(fields["VmLck"].split()[0]),
    }


def main(interface: str, *service: str) -> None:
    """Start the bus process, examine both while it works, and print a summary."""
    ring = FrameRing.create(len(CAMERAS))
    config = BusConfig(interface=interface, ring_path=str(ring.path), cameras=CAMERAS)
    bus = ServiceBus(config, ring, Path(*service)) if service else BusProcess(config, ring)
    seen: dict[str, Any] = {"user": os.getuid(), "window": rights(os.getpid())}
    try:
        bus.start()
        end = time.monotonic() + _OPEN_S
        while (status := read_status(ring)).frames < _FRAMES and time.monotonic() < end:
            if status.state is AcquisitionState.STOPPED:
                break
            time.sleep(0.01)
        if status.state is AcquisitionState.RUNNING and bus.pid is not None:
            seen["bus"] = rights(bus.pid)
            seen["runs"] = how_it_runs(bus.pid)
            seen["command"] = Path(f"/proc/{bus.pid}/cmdline").read_bytes().decode().split("\0")
        report = ring.report()
        seen["notes"] = json.loads(report)["notes"] if report else []
        bus.request_stop()
        seen["ended"] = bus.join(240.0)
        status = read_status(ring)
        seen.update(frames=status.frames, message=status.message)
    finally:
        ring.close()
    sys.stdout.write(json.dumps(seen))


if __name__ == "__main__":
    main(*sys.argv[1:])
