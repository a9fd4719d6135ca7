"""Relocations with one wrong input, for `benchmarks.lies` and the tests.

Thesis rig, lenses calibrated earlier, 500 poses of a waved probe, a bar of 400 mm +- 1 um in ten
placements; every other session has four control points with a sigma of 4 um. Errors are drawn from
their stated distributions; then one input is changed by an amount from the range of its lie.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ocmm_core.calibration.guided import random_lines
from ocmm_core.calibration.monitor import camera_changes
from ocmm_core.calibration.relocation import (
    BarDistance,
    KeptByCameras,
    KeptByPoints,
    Observations,
    ProbeFrames,
    RelocationOptions,
    ShownBar,
)
from ocmm_core.camera import CameraModel, Rig
from ocmm_core.geometry import Float, rotation_xyz, unit
from ocmm_core.tracking import ProbeBody
from tests.core.calibration.waved_probe import (
    BAR,
    SIGMA_PX,
    TILTS,
    VOLUME,
    as_known_before,
    disturbed,
    probe,
    rig,
    see,
    with_lens_errors,
)

PLACEMENTS, TOUCHES = 10, 3
POINTS = np.array([[-150.0, 0.0, -180.0], [150.0, 20.0, -170.0], [-80.0, 120.0, -150.0],
                   [100.0, -110.0, -160.0]])  # fmt: skip
NAMES = ("N1", "N2", "N3", "N4")
POINTS_SIGMA, SEAT_SIGMA = 0.004, 0.001
MOUNT_MM = 60.0
"""A nudged camera turns about its mount, so far from its projection centre."""

EXPANSION_PROBE, EXPANSION_BAR = 23e-6, 11.5e-6
"""Aluminium and steel, 1/K."""


@dataclass(slots=True)
class Scene:
    """A session before it is observed.

    Attributes
    ----------
    rng
        Generator of all random numbers.
    poses
        Poses of the waved probe.
    start, body, bar, points
        Inputs of the session: cameras, probe, certified length and control points.
    cameras, leds, length, places
        True values; LEDs (L, 3) and control points (4, 3) in mm.
    touched
        (4,): index of the point actually probed under each name.
    moves
        Motion of the cameras as a function of time, from 0 to 1 of the session.
    by_points
        Whether the control points define the world frame.
    lie
        Description of the change.
    """

    rng: np.random.Generator
    poses: int
    start: Rig
    body: ProbeBody
    bar: BarDistance
    points: Float
    cameras: tuple[CameraModel, ...]
    leds: Float
    length: float
    places: Float
    touched: list[int]
    moves: Callable[[float], tuple[CameraModel, ...]]
    by_points: bool
    lie: str = ""

    @property
    def options(self) -> RelocationOptions:
        """Return how the session is evaluated."""
        if not self.by_points:
            return RelocationOptions(world=KeptByCameras())
        listed = {name: self.points[index] for index, name in enumerate(NAMES)}
        return RelocationOptions(world=KeptByPoints(listed, POINTS_SIGMA))

    def observed(self) -> Observations:
        """Return the cameras' observations, in the order of a session."""
        rng, tip = self.rng, self.body.tip_probe
        seats = len(NAMES) * TOUCHES if self.by_points else 0
        times = np.linspace(0.0, 1.0, self.poses + PLACEMENTS + seats)
        turns = rng.uniform(-1.0, 1.0, (self.poses + seats, 3)) * TILTS
        turns[self.poses :] *= 0.5
        rotations = np.stack([rotation_xyz(*turn) for turn in turns])
        centres = VOLUME[0] + rng.random((self.poses, 3)) * (VOLUME[1] - VOLUME[0])
        origins = centres - rotations[: self.poses] @ self.leds.mean(axis=0)
        if seats:
            at = np.repeat(self.places[self.touched], TOUCHES, axis=0)
            balls = at + SEAT_SIGMA * rng.standard_normal(at.shape)
            origins = np.concatenate([origins, balls - rotations[self.poses :] @ tip])
        leds = np.einsum("nij,lj->nli", rotations, self.leds) + origins[:, None]
        ends = random_lines(VOLUME, self.length, PLACEMENTS, int(rng.integers(1 << 30)))
        when = np.concatenate([times[: self.poses], times[self.poses + PLACEMENTS :]])
        uv = np.concatenate(
            [see(self.moves(t), one[None], rng) for t, one in zip(when, leds, strict=True)]
        )
        shown = np.concatenate([
            see(self.moves(t), one[None], rng)
            for t, one in zip(times[self.poses :], ends, strict=False)
        ])  # fmt: skip
        seat = np.concatenate([
            np.full(self.poses, -1), np.repeat(np.arange(len(NAMES)), TOUCHES)[:seats]
        ]).astype(np.int64)  # fmt: skip
        return Observations(
            ProbeFrames(uv, np.full(len(uv), SIGMA_PX), seat),
            (ShownBar(self.bar, shown, np.full(PLACEMENTS, SIGMA_PX)),),
            seats=NAMES if seats else (),
            seat_sigma=SEAT_SIGMA,
        )


@dataclass(frozen=True, slots=True)
class Lie:
    """One way to be wrong.

    Attributes
    ----------
    name
        Label in the table.
    tell
        Function that applies the change. It returns the error code and a word that the answer
        must contain, or several such pairs of which each is right.
    """

    name: str
    tell: Callable[[Scene], tuple[tuple[str, str], ...]]


def honest(seed: int, poses: int) -> Scene:
    """Return a session in which all is as it is stated."""
    rng = np.random.default_rng(seed)
    true, body = rig(), probe()
    sigmas = np.sqrt(np.diag(body.geometry_covariance))[:-3]
    start = disturbed(with_lens_errors(as_known_before(true), rng), rng, lenses=False)
    return Scene(
        rng=rng, poses=poses, start=start, body=body, bar=BAR,
        points=POINTS + POINTS_SIGMA * rng.standard_normal(POINTS.shape),
        cameras=true.cameras,
        leds=body.leds_probe + (sigmas * rng.standard_normal(len(sigmas))).reshape(-1, 3),
        length=BAR.length + BAR.sigma * float(rng.standard_normal()),
        places=POINTS.copy(), touched=list(range(len(NAMES))),
        moves=lambda _: true.cameras, by_points=bool(seed % 2),
    )  # fmt: skip


def honest_twin(scene: Scene, noise: Mapping[str, Any]) -> Scene:
    """Return the session without bent LEDs, wrong bars and movements, with the same noise.

    Documents are correct, and the cameras stay at their final poses throughout. ``noise``: state of
    the generator before the session was observed.
    """
    last = scene.moves(1.0)
    rng = np.random.default_rng()
    rng.bit_generator.state = noise
    body = replace(scene.body, leds_probe=scene.leds)
    return replace(scene, rng=rng, body=body, bar=BAR, moves=lambda _: last)


def _log_uniform(scene: Scene, low: float, high: float) -> float:
    return float(np.exp(scene.rng.uniform(np.log(low), np.log(high))))


def _direction(scene: Scene) -> Float:
    return unit(scene.rng.standard_normal(3))


def wrong_bar(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Make the bar's certificate wrong by 20 um to 1 mm."""
    off = _log_uniform(scene, 0.02, 1.0) * float(scene.rng.choice([-1.0, 1.0]))
    scene.bar = replace(scene.bar, length=scene.bar.length + off)
    scene.lie = f"bar {1e3 * off:+.0f} um"
    return (("relocation.bar_contradicts", "ar 'bar' is"),)


def bent_led(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Bend one LED by 20 um to 1 mm."""
    led, off = int(scene.rng.integers(scene.body.n_leds)), _log_uniform(scene, 0.02, 1.0)
    scene.leds[led] += off * _direction(scene)
    scene.lie = f"LED {led + 1} by {1e3 * off:.0f} um"
    return (("relocation.probe_changed", f"LED {led + 1} "),)


def _moved(scene: Scene, camera: int, turn: Float) -> tuple[CameraModel, ...]:
    own = scene.cameras[camera]
    change = np.concatenate([turn, np.cross(turn, [0.0, -MOUNT_MM, 0.0]), np.zeros(3)])
    cameras = list(scene.cameras)
    cameras[camera] = own.perturbed(camera_changes(own) @ change)
    return tuple(cameras)


def _nudge(scene: Scene, amount: float) -> tuple[tuple[str, str], ...]:
    camera, moment = int(scene.rng.integers(2)), float(scene.rng.uniform(0.02, 0.98))
    after = _moved(scene, camera, amount * _direction(scene))
    before = scene.cameras
    scene.moves = lambda t: after if t >= moment else before
    name = before[camera].name
    scene.lie = f"camera {name} by {1e6 * amount:.0f} urad at {moment:.2f}"
    return (("relocation.camera_moved", f"'{name}'"),)


def nudged(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Nudge a camera by 30 urad to 1 mrad about its mount, at any moment."""
    return _nudge(scene, _log_uniform(scene, 30e-6, 1e-3))


def barely_nudged(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Nudge a camera by 30 urad (0.06 px) about its mount, at any moment."""
    return _nudge(scene, 30e-6)


def drifting(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Turn a camera evenly by 50 to 500 urad over the session."""
    camera, amount = int(scene.rng.integers(2)), _log_uniform(scene, 50e-6, 5e-4)
    turn = amount * _direction(scene)
    scene.moves = lambda t: _moved(scene, camera, t * turn)
    name = scene.cameras[camera].name
    scene.lie = f"camera {name} drifts by {1e6 * amount:.0f} urad"
    return (("relocation.camera_moved", f"'{name}'"),)


def warm(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Make probe and bar 3 to 20 K warmer or colder than stated."""
    kelvin = _log_uniform(scene, 3.0, 20.0) * float(scene.rng.choice([-1.0, 1.0]))
    centre = scene.leds.mean(axis=0)
    scene.leds = centre + (1.0 + EXPANSION_PROBE * kelvin) * (scene.leds - centre)
    scene.length *= 1.0 + EXPANSION_BAR * kelvin
    scene.lie = f"{kelvin:+.1f} K"
    return (("relocation.bar_contradicts", "as steel would be that is"),)


def wrong_probe(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Wave another probe of the same kind, its LEDs elsewhere by 0.1 to 3 mm."""
    off = _log_uniform(scene, 0.1, 3.0)
    scene.leds = scene.leds + off / np.sqrt(3.0) * scene.rng.standard_normal(scene.leds.shape)
    scene.lie = f"probe by {off:.2f} mm"
    return (("relocation.wrong_probe", "LEDs deviate from their document"),)


def wrong_rig(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Take the calibration of another rig of the same kind, or cameras in the wrong order."""
    cameras = scene.start.cameras
    if scene.rng.random() < 0.5:
        places = [camera.T_camera_from_world for camera in cameras]
        exchanged = [
            replace(cameras[1 - i], T_camera_from_world=places[i], name=cameras[i].name)
            for i in range(2)
        ]
        # Two lenses of one kind are never alike.
        cameras = tuple(
            replace(camera, focal=camera.focal * factor)
            for camera, factor in zip(exchanged, (1.002, 0.998), strict=True)
        )
        scene.lie = "cameras in the wrong order"
    else:
        changed = []
        for camera in cameras:
            change = np.zeros(14)
            change[6] = 0.004 * camera.focal * scene.rng.uniform(0.25, 1.0)
            change[8:10] = scene.rng.uniform(-8.0, 8.0, 2)
            changed.append(camera.perturbed(change))
        cameras = tuple(changed)
        scene.lie = "another rig"
    scene.start = replace(scene.start, cameras=cameras)
    return (("relocation.wrong_rig", "another rig"),)


def swapped_points(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Touch two control points for each other."""
    scene.by_points = True
    first, second = (int(i) for i in scene.rng.choice(len(NAMES), 2, replace=False))
    scene.touched[first], scene.touched[second] = second, first
    low, high = sorted((first, second))
    scene.lie = f"{NAMES[low]} for {NAMES[high]}"
    return (("relocation.points_moved", f"'{NAMES[low]}' and '{NAMES[high]}' were swapped"),)


def moved_point(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Move a control point by 0.05 to 2 mm since its position was found."""
    scene.by_points = True
    index, off = int(scene.rng.integers(len(NAMES))), _log_uniform(scene, 0.05, 2.0)
    scene.places[index] += off * _direction(scene)
    scene.lie = f"{NAMES[index]} by {1e3 * off:.0f} um"
    return (("relocation.points_moved", f"'{NAMES[index]}' has moved"),)


LIES = (
    Lie("bar wrong by 20 um to 1 mm", wrong_bar),
    Lie("one LED bent by 20 um to 1 mm", bent_led),
    Lie("camera nudged by 30 urad to 1 mrad", nudged),
    Lie("camera nudged by 30 urad", barely_nudged),
    Lie("camera drifts by 50 to 500 urad", drifting),
    Lie("3 to 20 K off the stated temperature", warm),
    Lie("another probe", wrong_probe),
    Lie("another rig, or its cameras exchanged", wrong_rig),
    Lie("two control points exchanged", swapped_points),
    Lie("one control point moved", moved_point),
)
