"""The virtual rig seen by a software tracker, in a private network namespace.

The program of this module runs the server and starts its reader.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from ocmm_core.acquisition.bus_process import read_first_line
from ocmm_core.acquisition.frames import FrameFlag, FrameRing
from ocmm_core.camera import Rig, TrackerDocument, load_tracker
from ocmm_core.composition import Feed
from ocmm_core.fieldbus.wire import set_link
from ocmm_sim.bus import VirtualWire, paced, run_both, run_inside
from ocmm_sim.scene import RigScript
from ocmm_sim.trackers._device import SoftwareTracker
from ocmm_sim.trackers._encoder import MarkerEncoder, TrackerServer
from ocmm_sim.trackers._ndi import NdiEncoder
from ocmm_sim.trackers._streams import IgtlEncoder, NatNetEncoder, QtmEncoder
from ocmm_trackers import (
    PROTOCOLS,
    TrackerConfig,
    tracker_command,
    tracker_config,
    tracker_description,
)

_MODULE = "ocmm_sim.trackers._virtual"
_FIRST_NS = 1_764_500_000_000_000_000
_ENCODERS: dict[str, Callable[[TrackerDocument], MarkerEncoder]] = {
    "igtl": IgtlEncoder, "natnet": NatNetEncoder, "ndi": NdiEncoder, "qtm": QtmEncoder,
}  # fmt: skip
_CONNECT_S = 60.0


def virtual_tracker_feed(protocol: str, script: RigScript, rig: Rig, name: str) -> Feed:
    """Return the tracker of a script and its reader, ready to start."""
    address = f"127.0.0.1:{PROTOCOLS[protocol].port}"
    config, ring = tracker_config(
        protocol, Path(script.rig), Path(script.probe), rig, address, name
    )
    config = msgspec.structs.replace(config, stretched=True, connect_s=_CONNECT_S)
    # For the server and for the reader.
    lines = script.to_json().encode() + b"\n" + config.to_json() * 2
    return Feed(VirtualWire(_MODULE, lines, ring), ring, tracker_description(config), live=True)


def main() -> None:
    """Inside the namespace: run the tracker, and start what reads it."""
    run_inside(_run)


def _run() -> int:
    descriptor = sys.stdin.fileno()
    rig = msgspec.json.decode(read_first_line(descriptor), type=RigScript).build()
    config = msgspec.json.decode(read_first_line(descriptor), type=TrackerConfig)
    ring = FrameRing.attach(config.ring_path)
    document = load_tracker(config.rig)
    set_link("lo", up=True)
    tracker = SoftwareTracker(rig, document, rig.seed)
    tracker.markers(0)
    encoder = _ENCODERS[config.protocol](document)
    server = TrackerServer(encoder, config.port)

    def serve(ended: Callable[[], bool]) -> None:
        for frame in paced(ring, ended, server.accepted):
            pressed = bool(rig.flags(rig.motion(frame, 1), frame)[0] & FrameFlag.BUTTON)
            time_ns = _FIRST_NS + frame * rig.frame_period_ns
            if not server.send(encoder.frame(tracker.markers(frame), time_ns, pressed=pressed)):
                # The reader has ended, or is about to.
                time.sleep(1e-2)

    try:
        return run_both(tracker_command(), rig, serve)
    finally:
        server.close()
        ring.close()


if __name__ == "__main__":
    main()
