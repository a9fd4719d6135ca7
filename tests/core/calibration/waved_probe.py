"""A virtual probe waved before virtual cameras, bars and seats, for the tests of relocation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.relocation_data import (
    LengthBar,
    Observations,
    ProbeFrames,
    ShownBar,
    TouchedBar,
)
from ocmm_core.calibration.relocation_quality import random_lines
from ocmm_core.camera.model import CameraModel, on_sensor, project
from ocmm_core.camera.rig import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, Pixels, Points3, rotation_from_vector, rotation_xyz
from ocmm_core.tracking.body import ProbeBody, load_probe

SIGMA_PX = 0.0105
LED_SIGMA = 0.001
VOLUME = np.array([[-200.0, -150.0, -200.0], [200.0, 150.0, 200.0]])
TILTS = np.radians([45.0, 30.0, 45.0])
BAR = LengthBar("bar", 400.0, 0.001)


def rig() -> Rig:
    return load_rig(resource("rigs", "thesis.toml"))


def probe() -> ProbeBody:
    """Return the probe of the thesis, its LEDs known to `LED_SIGMA`."""
    body = load_probe(resource("probes", "thesis.toml"))
    sigmas = np.concatenate([np.full(body.leds_probe.size, LED_SIGMA), np.full(3, 0.002)])
    return replace(body, geometry_covariance=np.diag(sigmas**2))


def see(cameras: tuple[CameraModel, ...], points: Float, rng: np.random.Generator) -> Pixels:
    """Return noisy spots (n, C, k, 2), px, of points (n, k, 3), mm; NaN off the sensor."""
    uv = np.stack([project(camera, points) for camera in cameras], axis=1)
    seen = np.stack([on_sensor(c, uv[:, i]) for i, c in enumerate(cameras)], axis=1)
    noisy: Pixels = np.where(
        seen[..., None], uv + SIGMA_PX * rng.standard_normal(uv.shape), np.nan
    )
    return noisy


@dataclass(frozen=True, slots=True)
class World:
    """What is true in one run: the rig, the probe as it is, and the bar as it is.

    Attributes
    ----------
    rig
        With the true cameras.
    body
        As its document says, with errors of its geometry.
    leds, tip
        As they are, mm, probe.
    length
        Of the bar, mm.
    rng
        For everything else.
    """

    rig: Rig
    body: ProbeBody
    leds: Points3
    tip: Float
    length: float
    rng: np.random.Generator

    def waved(self, n: int) -> ProbeFrames:
        """Return frames of the probe anywhere in the volume, its LEDs' mean in it."""
        turns = self.rng.uniform(-1.0, 1.0, (n, 3)) * TILTS
        rotations = np.stack([rotation_xyz(*turn) for turn in turns])
        centres = VOLUME[0] + self.rng.random((n, 3)) * (VOLUME[1] - VOLUME[0])
        origins = centres - rotations @ self.leds.mean(axis=0)
        return ProbeFrames.waved(self._spots(rotations, origins), SIGMA_PX)

    def shown(self, placements: int) -> ShownBar:
        """Return the bar in several placements."""
        ends = random_lines(VOLUME, self.length, placements, int(self.rng.integers(1 << 30)))
        uv = see(self.rig.cameras, ends, self.rng)
        return ShownBar(BAR, uv, np.full(placements, SIGMA_PX))

    def seated(self, places: Points3, frames: int, sigma: float) -> ProbeFrames:
        """Return ``frames`` of the probe in every seat (s, 3), numbered from 0."""
        n = len(places) * frames
        turns = self.rng.uniform(-0.5, 0.5, (n, 3)) * TILTS
        rotations = np.stack([rotation_xyz(*turn) for turn in turns])
        tips = np.repeat(places, frames, axis=0) + sigma * self.rng.standard_normal((n, 3))
        uv = self._spots(rotations, tips - rotations @ self.tip)
        seats = np.repeat(np.arange(len(places)), frames)
        return ProbeFrames(uv, np.full(n, SIGMA_PX), seats)

    def touched(
        self, placements: int, frames: int, sigma: float
    ) -> tuple[TouchedBar, ProbeFrames, tuple[str, ...]]:
        """Return a bar whose seats were touched, the frames, and the names of the seats."""
        box = VOLUME - [[0.0, 0.0, 150.0]]
        ends = random_lines(box, self.length, placements, int(self.rng.integers(1 << 30)))
        names = tuple(f"{index}{end}" for index in range(placements) for end in "AB")
        pairs = tuple(zip(names[::2], names[1::2], strict=True))
        return TouchedBar(BAR, pairs), self.seated(ends.reshape(-1, 3), frames, sigma), names

    def _spots(self, rotations: Float, origins: Points3) -> Pixels:
        leds = np.einsum("nij,lj->nli", rotations, self.leds) + origins[:, None]
        return see(self.rig.cameras, leds, self.rng)


def world(seed: int, true_rig: Rig | None = None, body: ProbeBody | None = None) -> World:
    """Return what is true in the run with this seed."""
    rng = np.random.default_rng(seed)
    known = body or probe()
    sigmas = np.sqrt(np.diag(known.geometry_covariance))
    off = sigmas * rng.standard_normal(len(sigmas))
    return World(
        rig=true_rig or rig(),
        body=known,
        leds=known.leds_probe + off[:-3].reshape(-1, 3),
        tip=known.tip_probe + off[-3:],
        length=BAR.length + BAR.sigma * float(rng.standard_normal()),
        rng=rng,
    )


def observe(true: World, frames: int, placements: int = 10) -> Observations:
    """Return a waved probe and a shown bar."""
    waved = true.waved(frames)
    return Observations(waved, (true.shown(placements),) if placements else ())


def disturbed(rig: Rig, rng: np.random.Generator, lenses: bool = True) -> Rig:
    """Return the rig as it was before: 10 mm, 0.6 degrees and, with lenses, 2 % and 20 px off.

    Lenses then have no distortion at all.
    """
    cameras = []
    for camera in rig.cameras:
        change = np.zeros(14)
        change[0:3] = np.radians(0.6) * rng.uniform(-1.0, 1.0, 3)
        change[3:6] = 10.0 * rng.uniform(-1.0, 1.0, 3)
        if lenses:
            change[6] = 0.02 * camera.focal * rng.uniform(-1.0, 1.0)
            change[8:10] = 20.0 * rng.uniform(-1.0, 1.0, 2)
            camera = replace(camera, k1=0.0, k2=0.0, p1=0.0, p2=0.0)
        cameras.append(camera.perturbed(change))
    return replace(rig, cameras=tuple(cameras))


def four_cameras() -> Rig:
    """Return a rig with two more cameras, above and beside the others."""
    two = rig()
    more = []
    for index, vector in enumerate(([0.0, 0.25, 0.12], [0.0, -0.25, -0.12])):
        first = two.cameras[index]
        turn = rotation_from_vector(np.array([vector[2], 0.0, vector[1]]))
        pose = first.T_camera_from_world
        more.append(
            replace(
                first,
                name=f"extra {index}",
                serial=20330010 + index,
                T_camera_from_world=replace(pose, rotation=pose.rotation @ turn),
            )
        )
    return replace(two, cameras=(*two.cameras, *more), aliases=(*two.aliases, 31, 32))
