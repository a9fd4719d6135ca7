"""Probing data for the monitor, with and without a change, at a twentieth of the frame rate.

Each frame represents the mean of twenty exposures, with accordingly smaller white noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.monitor import ResidualAccumulator, ResidualSample
from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.tracking import ProbeBody, TrackBlock, TrackingPipeline, load_probe
from ocmm_sim.calibration_scenes import CalibrationScenesRig, FreeMotionScene
from ocmm_sim.scene import Part, VirtualRig, WorldOptions, load_part

RATE_HZ = 400
WAVE_LOOK_NS = 10_000_000


def thinned(rig: Rig) -> Rig:
    """Return the rig with means of twenty exposures as its frames."""
    white = rig.noise.white_px * np.sqrt(RATE_HZ / rig.frame_rate_hz)
    noise = type(rig.noise)(
        white_px=float(white),
        pattern_px=rig.noise.pattern_px,
        pattern_length_px=rig.noise.pattern_length_px,
    )
    return replace(rig, noise=noise, frame_rate_hz=RATE_HZ)


@dataclass(frozen=True, slots=True)
class Monitored:
    """A rig, a probe and their touches, in the world of one seed."""

    rig: Rig
    gate: Rig
    body: ProbeBody
    part: Part
    seed: int

    @classmethod
    def of(cls, rig: str = "recommended", probe: str = "standard", seed: int = 1) -> Monitored:
        gate = load_rig(resource("rigs", f"{rig}.toml"))
        body = load_probe(resource("probes", f"{probe}.toml"))
        return cls(thinned(gate), gate, body, load_part(resource("parts", "demo.toml")), seed)

    def virtual(self, options: WorldOptions | None = None) -> VirtualRig:
        """Return an operator who touches all of the part."""
        touches = [(artefact.name, 6) for artefact in self.part.artefacts]
        return VirtualRig(
            self.rig, self.body, self.part, touches, self.seed, options, frame_rate_hz=RATE_HZ
        )

    def probing(
        self, first_s: float, seconds: float, options: WorldOptions | None = None
    ) -> TrackBlock:
        """Return tracked frames of the operator's work."""
        frames = self.virtual(options).frames(int(first_s * RATE_HZ), int(seconds * RATE_HZ))
        # Single exposures are judged with the noise that they have.
        return TrackingPipeline(self.gate, self.body).process(frames)

    def waved(self, ways: int, options: WorldOptions | None = None) -> list[ResidualSample]:
        """Return the looks at a probe waved through the volume."""
        scene = (FreeMotionScene(ways=ways, seed=self.seed),)
        shown = CalibrationScenesRig(self.rig, self.body, scene, self.seed, options)
        track = TrackingPipeline(self.gate, self.body).process(shown.frames(0, shown.n_frames))
        return ResidualAccumulator(self.rig, self.body, WAVE_LOOK_NS).push(track)
