"""The bus process on a virtual cable with a selectable start; run as a program, not collected.

``python confined_scenario.py PYTHON GROUP PREFIX...`` must be started inside a private network. It
makes the cable and the software cameras, starts the command of the service's unit by that Python
behind the prefix, gives the ring to the group, waits for frames, and prints a summary.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core.acquisition.bus_process import BusConfig, rights_of
from ocmm_core.acquisition.frames import AcquisitionState, FrameRing, read_status
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_sim.bus import SegmentConfig

CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
_WAIT_S = 240.0
_FRAMES = 200


def main(python: str, group: str, *prefix: str) -> None:
    """Run the bus process, and print a summary."""
    cable = "link add near0 type veth peer name far0"
    for command in (cable, "link set near0 up", "link set far0 up"):
        subprocess.run(["ip", *command.split()], check=True)
    segment = SegmentConfig(
        interface="far0", cameras=CAMERAS, provider=msgspec.Raw(b'{"pattern":"test"}')
    )
    cameras = subprocess.Popen(
        [sys.executable, "-m", "ocmm_sim.bus._camera_process"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    assert cameras.stdin is not None
    assert cameras.stdout is not None
    cameras.stdin.write(segment.to_json())
    cameras.stdin.flush()
    assert cameras.stdout.readline() == b"ready\n"
    ring = FrameRing.create(len(CAMERAS))
    seen: dict[str, Any] = {"ring": str(ring.path)}
    try:
        if group:
            # As `ServiceBus` does.
            shutil.chown(ring.path, group=group)
            ring.path.chmod(0o660)
        bus = subprocess.Popen(
            [*prefix, python, "-I", "-m", "ocmm_core.acquisition.bus_process._start",
             "--interface", "near0"],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        )  # fmt: skip
        assert bus.stdin is not None
        # Its configuration; the interface is that of the service.
        config = BusConfig(interface="", ring_path=str(ring.path), cameras=CAMERAS)
        bus.stdin.write(config.to_json())
        bus.stdin.flush()
        end = time.monotonic() + _WAIT_S
        while (status := read_status(ring)).frames < _FRAMES and time.monotonic() < end:
            if bus.poll() is not None or status.state is AcquisitionState.STOPPED:
                break
            time.sleep(0.05)
        if bus.poll() is None:
            held = Path(f"/proc/{bus.pid}/status").read_text(encoding="ascii")
            seen["status"] = dict(line.split(":\t", 1) for line in held.splitlines())
            seen["rights"] = sorted(rights_of(bus.pid).effective)
        bus.stdin.close()
        seen |= {"frames": status.frames, "message": status.message, "ended": bus.wait(_WAIT_S)}
    finally:
        ring.close()
        cameras.stdin.close()
        cameras.wait(_WAIT_S)
    sys.stdout.write(json.dumps(seen))


if __name__ == "__main__":
    main(*sys.argv[1:])
