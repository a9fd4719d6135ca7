"""The program that reads a tracker: packets of the network cannot end the station with it.

It reads its configuration as one line of JSON from standard input, fills a ring, and ends on
request in the ring, on SIGTERM, or at the end of standard input.
"""

from __future__ import annotations

import sys

import msgspec
import numpy as np

from ocmm_core.acquisition.bus_process import ProcessConfig, read_first_line, stopped_by_parent
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing, SourceDescription
from ocmm_core.camera import TrackerDocument, Vector3, tracker_rig
from ocmm_core.failure import REOPEN, exit_with
from ocmm_trackers._igtl import IgtlDecoder
from ocmm_trackers._messages import Decoder
from ocmm_trackers._motion_capture import NatNetDecoder, QtmDecoder
from ocmm_trackers._ndi import NdiDecoder
from ocmm_trackers._source import TrackerSource

PROTOCOLS: dict[str, type[Decoder]] = {
    "igtl": IgtlDecoder, "natnet": NatNetDecoder, "ndi": NdiDecoder, "qtm": QtmDecoder,
}  # fmt: skip
"""By the prefixes of their sources."""


class TrackerConfig(ProcessConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A tracker, the probe that proves its unit and axes, and the ring for its frames."""

    name: str
    protocol: str
    """Name in `PROTOCOLS`."""
    ring_path: str
    host: str
    port: int
    document: TrackerDocument
    """As calibrated."""
    leds: tuple[Vector3, ...]
    serials: tuple[int, ...]
    period_ns: int
    n_slots: int
    stretched: bool = False
    """A virtual tracker, whose time waits for this computer."""
    connect_s: float = 5.0


def tracker_command() -> list[str]:
    """Return the command of this program."""
    return [sys.executable, "-m", "ocmm_trackers._process"]


def tracker_description(config: TrackerConfig) -> SourceDescription:
    return SourceDescription(
        name=config.name,
        camera_serials=config.serials,
        frame_period_ns=config.period_ns,
        cycle_period_ns=config.period_ns,
        live=True,
        simulated=config.stretched,
        stretched=config.stretched,
        n_slots=config.n_slots,
    )


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
        document = config.document
        source = TrackerSource(
            tracker_description(config), PROTOCOLS[config.protocol](document),
            (config.host, config.port), document, tracker_rig(document, ""), np.array(config.leds),
            config.connect_s,
        )  # fmt: skip
        return AcquisitionWorker(source, ring, stopped_by_parent()).run_program()
    finally:
        ring.close()


if __name__ == "__main__":
    main()
