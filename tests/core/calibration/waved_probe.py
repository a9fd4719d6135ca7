"""A virtual probe waved before virtual cameras, bars and seats, for the tests of relocation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ocmm_core.calibration.bundle import BundleState
from ocmm_core.calibration.guided import random_lines
from ocmm_core.calibration.relocation import (
    BarDistance,
    KeptByCameras,
    Observations,
    ProbeFrames,
    ShownBar,
)
from ocmm_core.calibration.relocation._data import RelocationResult, TouchedBar
from ocmm_core.calibration.relocation._frame import motion_to_world
from ocmm_core.camera import (
    N_PARAMETERS,
    PARAMETERS,
    CalibrationDesign,
    CameraModel,
    Rig,
    known_points_covariance,
    load_rig,
    on_sensor,
    project,
)
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, Pixels, Points3, rotation_from_vector, rotation_xyz
from ocmm_core.tracking import ProbeBody, load_probe, triangulate

SIGMA_PX = 0.0105
LED_SIGMA = 0.0005
"""mm; remains after a calibration of the probe with thousands of poses."""

VOLUME = np.array([[-200.0, -150.0, -200.0], [200.0, 150.0, 200.0]])
TILTS = np.radians([45.0, 30.0, 45.0])
BAR = BarDistance("bar", 400.0, 0.001)


def rig() -> Rig:
    return load_rig(resource("rigs", "thesis.toml"))


def probe(led_sigma: float = LED_SIGMA) -> ProbeBody:
    """Return the probe of the thesis, with LEDs calibrated to ``led_sigma``, mm per axis."""
    body = load_probe(resource("probes", "thesis.toml"))
    sigmas = np.concatenate([np.full(body.leds_probe.size, led_sigma), np.full(3, 0.002)])
    return replace(body, geometry_covariance=np.diag(sigmas**2))


def see(cameras: tuple[CameraModel, ...], points: Float, rng: np.random.Generator) -> Pixels:
    """Return noisy spots (n, C, k, 2), px, of points (n, k, 3), mm; NaN off the sensor."""
    uv = np.stack([project(camera, points) for camera in cameras], axis=1)
    seen = np.stack([on_sensor(c, uv[:, i]) for i, c in enumerate(cameras)], axis=1)
    noisy: Pixels = np.where(seen[..., None], uv + SIGMA_PX * rng.standard_normal(uv.shape), np.nan)
    return noisy


@dataclass(frozen=True, slots=True)
class World:
    """The truth of one run: the rig, the probe and the bar.

    Attributes
    ----------
    rig
        With the true cameras.
    body
        As in its document, with errors of its geometry.
    leds, tip
        True places, mm, probe.
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

    def waved(self, n: int, depth: float = 300.0, tilt: float = 1.0) -> ProbeFrames:
        """Return frames of the probe anywhere in the volume, its LEDs' mean in it.

        The volume may be made less deep, mm, and the tilts smaller.
        """
        turns = self.rng.uniform(-tilt, tilt, (n, 3)) * TILTS
        rotations = np.stack([rotation_xyz(*turn) for turn in turns])
        centres = VOLUME[0] + self.rng.random((n, 3)) * (VOLUME[1] - VOLUME[0])
        centres[:, 1] *= depth / 300.0
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


def joined(*parts: ProbeFrames) -> ProbeFrames:
    return ProbeFrames(
        np.concatenate([one.uv for one in parts]),
        np.concatenate([one.sigma_px for one in parts]),
        np.concatenate([one.seats for one in parts]),
    )


def world(seed: int, true_rig: Rig | None = None, body: ProbeBody | None = None) -> World:
    """Return the truth of the run with this seed."""
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


def as_known_before(true: Rig, points: int = 400, depth: float = 200.0) -> Rig:
    """Return the rig with the covariance of a calibration from points in 400 x depth x 400 mm."""
    low, high = np.array([-200.0, -0.5 * depth, -200.0]), np.array([200.0, 0.5 * depth, 200.0])
    design = CalibrationDesign(
        method="known points",
        points=points,
        volume_min=(low[0], low[1], low[2]),
        volume_max=(high[0], high[1], high[2]),
        spot_sigma_px=SIGMA_PX,
        reference_sigma=0.0,
    )
    count = len(true.cameras)
    covariance = np.zeros((N_PARAMETERS * count,) * 2)
    for index, camera in enumerate(true.cameras):
        part = slice(N_PARAMETERS * index, N_PARAMETERS * (index + 1))
        covariance[part, part] = known_points_covariance(Path("design"), camera, design)
    return replace(true, parameter_covariance=covariance)


def with_lens_errors(known: Rig, rng: np.random.Generator) -> Rig:
    """Return the rig with lens errors drawn from its covariance, at the same places."""
    cameras = []
    for index, camera in enumerate(known.cameras):
        lens = slice(N_PARAMETERS * index + 6, N_PARAMETERS * (index + 1))
        covariance = known.parameter_covariance[lens, lens]
        scale = np.sqrt(covariance.diagonal())
        root = np.linalg.cholesky(covariance / np.outer(scale, scale))
        change = np.zeros(N_PARAMETERS)
        change[6:] = scale * (root @ rng.standard_normal(N_PARAMETERS - 6))
        cameras.append(camera.perturbed(change))
    return replace(known, cameras=tuple(cameras))


def length_errors(true: Rig, found: Rig, lines: int = 200) -> Float:
    """Return the errors (lines,), mm, of lengths of 400 mm in the volume, without noise."""
    ends = random_lines(VOLUME, BAR.length, lines, 0)
    spots = np.stack([project(camera, ends.reshape(-1, 3)) for camera in true.cameras])
    measured = triangulate(found, spots).reshape(-1, 2, 3)
    errors: Float = np.linalg.norm(measured[:, 1] - measured[:, 0], axis=1) - BAR.length
    return errors


def parameter_errors(true: Sequence[CameraModel], found: Sequence[CameraModel]) -> Float:
    """Return the differences of the found cameras, (14 C,), in the order of `PARAMETERS`."""
    errors = []
    for right, mine in zip(true, found, strict=True):
        was, now = right.T_camera_from_world, mine.T_camera_from_world
        turn = Rotation.from_matrix(now.rotation @ was.rotation.T).as_rotvec()
        lens = [getattr(mine, name) - getattr(right, name) for name in PARAMETERS[6:]]
        errors.append(np.concatenate([turn, now.translation - was.translation, lens]))
    return np.concatenate(errors)


def normalised_square(true: World, found: RelocationResult) -> float:
    """Return the squared error of all cameras over its covariance and its rank: one if honest.

    Only what does not depend on the choice of the world is compared: the true cameras are laid onto
    the found ones, and motions of everything are projected out.
    """
    truth = _cameras_alone(true, true.rig.cameras)
    near = truth.in_world(motion_to_world(KeptByCameras(), (), truth, found.cameras))
    errors = parameter_errors(near.cameras, found.cameras)
    scale = np.sqrt(found.covariance.diagonal())
    motions = _cameras_alone(true, found.cameras).world_motions()[: len(errors)]
    shapes = np.linalg.qr(motions / scale[:, None], mode="complete")[0][:, 6:]
    reduced = shapes.T @ (found.covariance / np.outer(scale, scale)) @ shapes
    rest = shapes.T @ (errors / scale)
    return float(rest @ np.linalg.solve(reduced, rest) / len(rest))


def _cameras_alone(true: World, cameras: tuple[CameraModel, ...]) -> BundleState:
    return BundleState(
        cameras, true.leds, true.tip, np.zeros((0, 3)), np.zeros(0),
        np.eye(3)[None], np.zeros((1, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)),
    )  # fmt: skip


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
    """Return a rig with two more cameras, above and to the side of the others."""
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
