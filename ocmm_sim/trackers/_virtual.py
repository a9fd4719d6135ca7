"""The virtual rig seen by a software tracker, in a private network namespace.

Markers are as a tracker reports them: errors are drawn in space, not by cameras. The program of
this module runs the server and starts its reader.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.bus_process import read_first_line
from ocmm_core.acquisition.frames import FrameFlag, FrameRing
from ocmm_core.camera import Rig, TrackerDocument, load_tracker
from ocmm_core.composition import Feed
from ocmm_core.fieldbus.wire import set_link
from ocmm_core.geometry import Float
from ocmm_sim.bus import VirtualWire, paced, run_both, run_inside
from ocmm_sim.calibration_scenes import CalibratingScript, CalibrationScenesRig
from ocmm_sim.scene import RigScript, VirtualRig
from ocmm_sim.trackers._encoder import (
    IgtlEncoder,
    MarkerEncoder,
    NatNetEncoder,
    QtmEncoder,
    TrackerServer,
)
from ocmm_sim.trackers._ndi import NdiEncoder
from ocmm_trackers import (
    PROTOCOLS,
    TrackerConfig,
    tracker_command,
    tracker_config,
    tracker_description,
)

_WAVES = 128


class MarkerErrors:
    """Errors of a tracker: noise, place, scale, filter and rounding, all drawn from one seed.

    Successive calls of `reported` are frames of the same markers.
    """

    def __init__(self, document: TrackerDocument, seed: int) -> None:
        noise = document.noise
        self._noise, self._head = noise, np.array(document.head)
        middle = np.mean([document.volume_min, document.volume_max], axis=0)
        self._sight = (middle - self._head) / np.linalg.norm(middle - self._head)
        self._rng = np.random.default_rng([seed, 45])
        self._waves = self._rng.standard_normal((_WAVES, 3, 3)) / noise.place_length
        self._phases = self._rng.uniform(0.0, 2.0 * np.pi, (_WAVES, 3))
        self._scale = 1.0 + noise.scale_sigma * self._rng.standard_normal()
        # A filter of first order leaves noise of this share of its input.
        self._share = np.sqrt((1.0 - noise.correlation) / (1.0 + noise.correlation))
        self._filtered: Float | None = None
        self._at_rest: tuple[Float, Float] | None = None

    def reported(self, places: Float) -> Float:
        """Return the markers (n, 3), mm, of the next frame, NaN kept; or of frames (F, n, 3)."""
        noise = self._noise
        white = self._shaped(places, self._rng.standard_normal(places.shape)) * noise.sigma_across
        raw = self.systematic(places) + white / self._share
        found = raw.reshape(-1, *places.shape[-2:])
        if self._filtered is None:
            # As after many frames at rest.
            found[0] += ((self._share - 1.0) * white / self._share).reshape(found.shape)[0]
        for frame, now in enumerate(found):
            if self._filtered is not None:
                before = np.where(np.isfinite(self._filtered), self._filtered, now)
                found[frame] = noise.correlation * before + (1.0 - noise.correlation) * now
            self._filtered = found[frame].copy()
        if noise.rounding:
            found = np.round(found / noise.rounding) * noise.rounding
        shaped: Float = found.reshape(places.shape)
        return shaped

    def restart(self) -> None:
        """Forget the frames before, as after many frames at rest elsewhere."""
        self._filtered = None

    def systematic(self, places: Float) -> Float:
        """Return the markers with the errors that are the same in all frames."""
        # Markers at rest are the same array in all frames, or equal ones.
        if self._at_rest is not None and np.array_equal(self._at_rest[0], places):
            return self._at_rest[1]
        phase = np.einsum("wai,...ni->...nwa", self._waves, places) + self._phases
        field = np.sqrt(2.0 / _WAVES) * np.cos(phase).sum(axis=-2)
        moved = self._head + self._scale * (places - self._head)
        found: Float = moved + self._shaped(places, field) * self._noise.place_sigma
        self._at_rest = places.copy(), found
        return found

    def _shaped(self, places: Float, errors: Float) -> Float:
        """Return errors (..., n, 3) of unit size, grown with distance, longer along the sight."""
        noise = self._noise
        ratio = noise.sigma_along / noise.sigma_across
        sight, grown = np.broadcast_to(self._sight, places.shape), np.ones(places.shape[:-1])
        if noise.growth == "distance":
            away = np.linalg.norm(places - self._head, axis=-1)
            sight, grown = (places - self._head) / away[..., None], away / noise.distance
        more = np.sum(errors * sight, axis=-1) * (ratio * grown - 1.0)
        found: Float = grown[..., None] * (errors + sight * more[..., None])
        return found


class SoftwareTracker:
    """A tracker that observes the probe of a virtual rig; frames in increasing order."""

    def __init__(
        self, rig: VirtualRig | CalibrationScenesRig, document: TrackerDocument, seed: int
    ) -> None:
        self._rig, self._head = rig, np.array(document.head)
        if isinstance(rig, VirtualRig):
            truth = rig.truth
            self._leds_probe, self._tip_probe = truth.leds_probe, truth.tip_probe
        self._errors = MarkerErrors(document, seed)
        self._cosine = np.cos(rig.body.emission_half_angle)

    def markers(self, frame: int) -> Float:
        """Return the reported markers (L, 3), mm, NaN if hidden."""
        places, lights = self._lit(frame)
        rays = self._head - places
        seen = np.sum(lights * rays, axis=1) >= self._cosine * np.linalg.norm(rays, axis=1)
        found: Float = np.where(seen[:, None], self._errors.reported(places), np.nan)
        return found

    def pressed(self, frame: int) -> bool:
        """Return whether the button is held."""
        rig = self._rig
        if isinstance(rig, CalibrationScenesRig):
            return False
        return bool(rig.flags(rig.motion(frame, 1), frame)[0] & FrameFlag.BUTTON)

    def _lit(self, frame: int) -> tuple[Float, Float]:
        rig = self._rig
        if isinstance(rig, CalibrationScenesRig):
            (places,), (lights,) = rig.leds(min(frame, rig.n_frames - 1), 1)
            return places, lights
        motion = rig.motion(frame, 1)
        turn = motion.rotation_world_from_probe[0]
        places = self._leds_probe @ turn.T + motion.origin_world(self._tip_probe)[0]
        return places, rig.body.led_directions_probe @ turn.T


_MODULE = "ocmm_sim.trackers._virtual"
_FIRST_NS = 1_764_500_000_000_000_000
_ENCODERS: dict[str, Callable[[TrackerDocument], MarkerEncoder]] = {
    "igtl": IgtlEncoder, "natnet": NatNetEncoder, "ndi": NdiEncoder, "qtm": QtmEncoder,
}  # fmt: skip
_CONNECT_S = 60.0


def virtual_tracker_feed(
    protocol: str, script: RigScript | CalibratingScript, rig: Rig, name: str
) -> Feed:
    """Return the tracker of a script and its reader, ready to start."""
    address = f"127.0.0.1:{PROTOCOLS[protocol].port}"
    config, ring = tracker_config(protocol, Path(script.probe), rig, address, name)
    config = msgspec.structs.replace(config, stretched=True, connect_s=_CONNECT_S)
    # For the server and for the reader.
    lines = script.to_json().encode() + b"\n" + config.to_json() * 2
    return Feed(VirtualWire(_MODULE, lines, ring), ring, tracker_description(config), live=True)


def main() -> None:
    """Inside the namespace: run the tracker, and start what reads it."""
    run_inside(_run)


def _run() -> int:
    descriptor = sys.stdin.fileno()
    line = read_first_line(descriptor)
    script: CalibratingScript | RigScript
    if b'"calibrating":' in line:
        script = msgspec.json.decode(line, type=CalibratingScript)
    else:
        script = msgspec.json.decode(line, type=RigScript)
    rig = script.build()
    config = msgspec.json.decode(read_first_line(descriptor), type=TrackerConfig)
    ring = FrameRing.attach(config.ring_path)
    document = load_tracker(script.rig)
    set_link("lo", up=True)
    tracker = SoftwareTracker(rig, document, rig.seed)
    tracker.markers(0)
    encoder = _ENCODERS[config.protocol](document)
    server = TrackerServer(encoder, config.port)

    def serve(ended: Callable[[], bool]) -> None:
        for frame in paced(ring, ended, server.accepted):
            pressed = tracker.pressed(frame)
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
