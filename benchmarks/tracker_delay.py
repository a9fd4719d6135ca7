"""Delay of trackers: from the packet that leaves the device to the readout that contains it.

Part of `benchmarks.trackers` (``--delay SECONDS``). A software tracker on this computer, the reader
of the product in its own process, and a station whose readout is queried every millisecond. The
place of a marker is the number of its frame.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread

import msgspec
import numpy as np

from ocmm_core.camera import TrackerDocument, load_rig, load_tracker, project
from ocmm_core.composition import STANDARD_PROBE, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.settings import toml_text
from ocmm_core.tracking import load_probe
from ocmm_sim.trackers import (
    IgtlEncoder,
    MarkerEncoder,
    MarkerErrors,
    NatNetEncoder,
    NdiEncoder,
    QtmEncoder,
    TrackerServer,
)  # fmt: skip

RATES_HZ = (60, 100, 200, 330)
_DEVICES: dict[str, tuple[str, Callable[[TrackerDocument], MarkerEncoder]]] = {
    "igtl": ("tracker", IgtlEncoder), "natnet": ("tracker_natnet", NatNetEncoder),
    "qtm": ("tracker_qtm", QtmEncoder), "ndi": ("tracker_ndi", NdiEncoder),
}  # fmt: skip
_FIRST_NS = 1_764_500_000_000_000_000
_STARTING_S, _LONGEST_S = 2.0, 60.0
_LEDS = load_probe(STANDARD_PROBE).leds_probe
_CODES, _STEP_MM = 50, 0.2
"""Frames until a place is repeated; a step is many standard deviations of a marker."""


class Sender:
    """Frames of a probe at their times; ``sent``: when each was sent, s."""

    def __init__(self, encoder: MarkerEncoder) -> None:
        self.server, self.sent, self.last = TrackerServer(encoder), dict[int, float](), -1
        self._encoder, self._ended = encoder, Event()
        self._thread = Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        rate_hz = self._encoder.document.frame_rate_hz
        errors = MarkerErrors(self._encoder.document, 1)
        start, before = time.monotonic(), -1
        while not self._ended.is_set():
            number = int((time.monotonic() - start) * rate_hz)
            if not self.server.accepted() or number == before:
                time.sleep(2e-4)
                continue
            frame = self._encoder.frame(
                errors.reported(shifted(number % _CODES)), _FIRST_NS + round(number * 1e9 / rate_hz)
            )
            # Known before the readout can contain it.
            self.sent[number] = time.monotonic()
            self.last = before = number
            self.server.send(frame)

    def close(self) -> None:
        """End the frames."""
        self._ended.set()
        self._thread.join()
        self.server.close()


def shifted(code: int) -> Float:
    """Return the LEDs (L, 3) of the probe in a frame, mm."""
    found: Float = _LEDS + np.array([_STEP_MM * code, 0.0, 0.0])
    return found


def delays(protocol: str, rate_hz: int, seconds: float, folder: Path) -> list[float]:
    """Return the delay of each readout with a new frame, s."""
    name, make = _DEVICES[protocol]
    document = load_tracker(resource("rigs", f"{name}.toml"))
    document = msgspec.structs.replace(document, frame_rate_hz=rate_hz)
    rig = folder / "tracker.toml"
    rig.write_text(toml_text(msgspec.to_builtins(document)))
    sender = Sender(make(document))
    built = build_station(
        StationRequest(
            plan=resource("plans", "demo.toml"), out=folder, rig=rig, uncalibrated=True,
            source=f"{protocol}:127.0.0.1:{sender.server.port}", calibrations=folder, probes=folder,
        )
    )  # fmt: skip
    found, station, before = list[float](), built.station, -1
    try:
        station.start()
        limit = time.monotonic() + _LONGEST_S
        while before < 0 and time.monotonic() < limit:
            before = station.looks.live().frame_counter
            time.sleep(1e-3)
        from_s = time.monotonic() + _STARTING_S
        camera = load_rig(rig).cameras[0]
        spots = project(camera, np.array([shifted(code)[0] for code in range(_CODES)]))
        while time.monotonic() < from_s + seconds:
            view, last = station.looks.live(), sender.last
            now = time.monotonic()
            if view.frame_counter != before and now > from_s and view.tip_world is not None:
                code = int(np.linalg.norm(spots - view.spots[0, 0], axis=1).argmin())
                sent_s = sender.sent.get(last - (last - code) % _CODES, now)
                found.append(now - sent_s)
            before = view.frame_counter
            time.sleep(1e-3)
        if not found:
            print(f"{protocol} {rate_hz} Hz: {station.looks.live().reason}")
    finally:
        station.close()
        sender.close()
    return found


def report(seconds: float) -> None:
    """Print median, 99th percentile and maximum for each protocol and rate."""
    for protocol in _DEVICES:
        for rate_hz in RATES_HZ if protocol != "ndi" else RATES_HZ[:1]:
            with tempfile.TemporaryDirectory() as folder:
                found = 1000.0 * np.array(delays(protocol, rate_hz, seconds, Path(folder)))
            median, p99, most = np.percentile(found, [50, 99, 100]) if len(found) else [np.nan] * 3
            print(f"{protocol:<6} {rate_hz:>3} Hz  N = {len(found):>5}  median {median:5.1f} ms  "
                  f"p99 {p99:5.1f} ms  maximum {most:5.1f} ms", flush=True)  # fmt: skip
