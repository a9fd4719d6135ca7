"""Random scenes for the search for labels: poses, hidden LEDs, reflections, slots in any order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import N_PARAMETERS, USUAL_SLOTS, CameraModel, Rig, on_sensor, project
from ocmm_core.geometry import Float, Int, RigidTransform, unit
from ocmm_core.tracking import LedBody

HIDDEN_SPOTS = (0.0, 0.1, 0.25, 0.45)
"""Chance of one spot to be hidden in one camera; every frame has one of these."""

HIDDEN_LEDS = (0.0, 0.0, 0.2, 0.45)
"""Chance of an LED to be hidden from all cameras."""

MOST_GHOSTS = 4
BESIDE_MM = (2.0, 20.0)
"""Distances of reflections from an LED: closer ones fall on its own lens."""


@dataclass(frozen=True, slots=True)
class Scenes:
    """Frames and their truth.

    Attributes
    ----------
    spots
        (n, C, 8, 2), px, NaN for an empty slot.
    slots
        (n, C, L): slot of the LED, -1 if it is hidden.
    rotations, origins
        (n, 3, 3) and (n, 3), mm: pose of the body in the world.
    """

    spots: Float
    slots: Int
    rotations: Float
    origins: Float


def rig_with(rig: Rig, n_cameras: int) -> Rig:
    """Return a rig of cameras like the first one of ``rig``.

    Up to four in a row, up to sixteen on a wall, all turned to the origin.
    """
    if n_cameras == len(rig.cameras):
        return rig
    heights = (0.0, 60.0, -60.0, 20.0)
    centres = [
        np.array([x, -1000.0, z])
        for x, z in zip(np.linspace(-300.0, 300.0, n_cameras), heights, strict=False)
    ]
    if n_cameras > len(heights):
        # Seven places further is another row and another column.
        grid = [
            (x, z) for z in (-300.0, -100.0, 100.0, 300.0) for x in (-450.0, -150.0, 150.0, 450.0)
        ]
        places = [grid[7 * number % len(grid)] for number in range(n_cameras)]
        centres = [np.array([x, -1000.0, z]) for x, z in places]
    size = N_PARAMETERS * n_cameras
    return replace(
        rig,
        cameras=tuple(_towards_origin(rig.cameras[0], centre) for centre in centres),
        aliases=tuple(range(1, n_cameras + 1)),
        parameter_covariance=np.zeros((size, size)),
    )


def draw_rotations(rng: np.random.Generator, n: int, tilt_deg: tuple[float, float, float]) -> Float:
    """Return rotations (n, 3, 3) by three angles, each even within its range."""
    turned = np.tile(np.eye(3), (n, 1, 1))
    for axis, tilt in enumerate(np.radians(tilt_deg)):
        angles = rng.uniform(-tilt, tilt, n)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.tile(np.eye(3), (n, 1, 1))
        turn[:, i, i] = turn[:, j, j] = np.cos(angles)
        turn[:, j, i] = np.sin(angles)
        turn[:, i, j] = -turn[:, j, i]
        turned = turn @ turned
    return turned


def draw_scenes(
    rng: np.random.Generator, rig: Rig, body: LedBody, n: int,
    *, sigma_px: float, hidden: bool = True, ghosts: bool = True,
) -> Scenes:  # fmt: skip
    """Return ``n`` frames of a body held by its orientation rules.

    Ghosts are points with the light of LEDs, anywhere about the body, near an LED, or at the mirror
    image of one; and single spots in one camera.
    """
    # Rules that forbid half turns leave some 75 degrees to both sides.
    tilt = (40.0, 40.0, 40.0) if body.rules else (50.0, 180.0, 50.0)
    rotations = draw_rotations(rng, n, tilt)
    low, high = rig.volume_world
    origins = rng.uniform(low, high, (n, 3))
    leds = np.einsum("nij,lj->nli", rotations, body.leds_body) + origins[:, None]
    directions = np.einsum("nij,lj->nli", rotations, body.led_directions_body)
    dark = np.zeros((n, len(rig.cameras), body.n_leds), dtype=bool)
    if hidden:
        dark = rng.random(dark.shape) < rng.choice(HIDDEN_SPOTS, n)[:, None, None]
        dark |= (rng.random(leds.shape[:2]) < rng.choice(HIDDEN_LEDS, n)[:, None])[:, None]
    lights, shines = leds, ~dark
    for c, camera in enumerate(rig.cameras):
        sight = camera.centre_world - leds
        cosine = np.sum(sight * directions, axis=2) / np.linalg.norm(sight, axis=2)
        shines[:, c] &= cosine > np.cos(body.emission_half_angle)
    if ghosts:
        extra, shown = _ghosts(rng, rig, body, leds, directions)
        lights = np.concatenate([leds, extra], axis=1)
        there = rng.random(extra.shape[:2]) < rng.choice((0.0, 0.3, 0.7), n)[:, None]
        seen = there[:, None] & shown & (rng.random(shown.shape) < 0.8)
        shines = np.concatenate([shines, seen], axis=2)
    uv = np.stack([project(camera, lights) for camera in rig.cameras], axis=1)
    for c, camera in enumerate(rig.cameras):
        shines[:, c] &= on_sensor(camera, uv[:, c])
    uv += sigma_px * rng.standard_normal(uv.shape)
    return _in_slots(rng, uv, shines, body.n_leds, rotations, origins, ghosts=ghosts)


def mirrored(body: LedBody) -> LedBody:
    """Return the mirror image of a body."""
    flip = np.array([-1.0, 1.0, 1.0])
    return replace(
        body, leds_body=body.leds_body * flip, led_directions_body=body.led_directions_body * flip
    )


def together(
    rng: np.random.Generator, rig: Rig, bodies: tuple[LedBody, LedBody], n: int, *, sigma_px: float
) -> tuple[Scenes, Scenes]:
    """Return ``n`` frames with two visible bodies, and the truth of each."""
    first = draw_scenes(rng, rig, bodies[0], n, sigma_px=sigma_px)
    second = draw_scenes(rng, rig, bodies[1], n, sigma_px=sigma_px, ghosts=False)
    spots = first.spots.copy()
    slots = np.full_like(second.slots, -1)
    for led in range(bodies[1].n_leds):
        free = np.isnan(spots[..., 0])
        f, c = np.nonzero((second.slots[:, :, led] >= 0) & free.any(axis=2))
        slot = np.argmax(free[f, c], axis=1)
        slots[f, c, led] = slot
        spots[f, c, slot] = second.spots[f, c, second.slots[f, c, led]]
    return replace(first, spots=spots), replace(second, spots=spots, slots=slots)


def _ghosts(
    rng: np.random.Generator, rig: Rig, body: LedBody, leds: Float, directions: Float
) -> tuple[Float, NDArray[np.bool_]]:
    """Return points (n, G, 3), mm, in the world, and which camera may see them (n, C, G)."""
    n = len(leds)
    shape = (n, MOST_GHOSTS, 3)
    middle = leds.mean(axis=1)
    about = middle[:, None] + rng.uniform(-90.0, 90.0, shape)
    picked = rng.permuted(np.tile(np.arange(body.n_leds), (n, 1)), axis=1)[:, :MOST_GHOSTS]
    chosen = leds[np.arange(n)[:, None], picked]
    aside = rng.uniform(*BESIDE_MM, (*shape[:2], 1)) * unit(rng.standard_normal(shape))
    beside = chosen + aside
    # A mirror in front of the whole probe.
    normal = unit(rng.standard_normal((n, 3)))
    height = np.einsum("nlk,nk->nl", leds - middle[:, None], normal)
    plane = height.min(axis=1) - rng.uniform(0.0, 150.0, n)
    above = np.take_along_axis(height, picked, axis=1) - plane[:, None]
    mirrored = chosen - 2.0 * above[..., None] * normal[:, None]
    kind = rng.integers(3, size=n)[:, None, None]
    places: Float = np.where(kind == 0, about, np.where(kind == 1, beside, mirrored))
    shown = np.ones((n, len(rig.cameras), MOST_GHOSTS), dtype=bool)
    heading = directions[np.arange(n)[:, None], picked]
    for c, camera in enumerate(rig.cameras):
        # The LED shines at the mirror image of the camera.
        high = np.sum((camera.centre_world - middle) * normal, axis=1) - plane
        image = camera.centre_world - 2.0 * high[:, None] * normal
        sight = unit(image[:, None] - chosen)
        lit = (np.sum(sight * heading, axis=2) > np.cos(body.emission_half_angle)) & (high > 0.0)[
            :, None
        ]
        # Never all of them: a symmetric flat probe cannot be distinguished from its mirror image.
        lit[:, body.n_leds - 1 :] = False
        shown[:, c] = lit | (kind[:, :, 0] != 2)
    return places, shown


def _in_slots(
    rng: np.random.Generator, uv: Float, shines: NDArray[np.bool_], n_leds: int,
    rotations: Float, origins: Float, *, ghosts: bool,
) -> Scenes:  # fmt: skip
    """Put spots into slots in any order; spots beyond the number of slots are lost."""
    n, n_cameras, n_lights = shines.shape
    n_slots = max(USUAL_SLOTS, n_leds)
    spots = np.full((n, n_cameras, n_slots, 2), np.nan)
    slots = np.full((n, n_cameras, n_lights), -1, dtype=np.int64)
    order = rng.permuted(np.tile(np.arange(n_slots), (n, n_cameras, 1)), axis=2)
    rank = np.cumsum(shines, axis=2) - 1
    given = shines & (rank < n_slots)
    f, c, light = np.nonzero(given)
    slots[f, c, light] = order[f, c, rank[f, c, light]]
    spots[f, c, slots[f, c, light]] = uv[f, c, light]
    if ghosts:
        # A single spot in one camera, near the others, if a slot is free.
        lone = rng.random((n, n_cameras)) < 0.25
        free = np.isnan(spots[:, :, :, 0])
        f, c = np.nonzero(lone & free.any(axis=2) & ~free.all(axis=2))
        middle = np.nanmean(spots[f, c], axis=1)
        spots[f, c, np.argmax(free[f, c], axis=1)] = middle + rng.uniform(-200, 200, (len(f), 2))
    return Scenes(spots, slots[:, :, :n_leds], rotations, origins)


def _towards_origin(like: CameraModel, centre: Float) -> CameraModel:
    z = unit(-centre)
    x = unit(np.cross(z, [0.0, 0.0, 1.0]))
    rotation = np.stack([x, np.cross(z, x), z])
    return replace(like, T_camera_from_world=RigidTransform(rotation, -rotation @ centre))
