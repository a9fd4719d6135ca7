"""Spots of a planned rig: what hides an LED, its brightness, blur, and error."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import Rig, on_sensor, project
from ocmm_core.geometry import Float
from ocmm_planner._plan import RigPlan

SEEN, OUTSIDE, AWAY, BLOCKED, BLURRED, DARK = range(6)
"""Whether a camera sees an LED, or the first reason why not."""

_PLANCK_J_S, _LIGHT_M_S = 6.62607015e-34, 2.99792458e8
_AIRY_SIGMA = 0.42
"""Standard deviation of the Gaussian next to an Airy disc, by wavelength times stop."""
_FULL = 0.7
"""Brightest pixel of the nearest spot, by the saturation."""
_LEAST_PEAK = 10.0
"""Brightest pixel of a usable spot, by the read noise."""
_PIXEL = 1.0 / 12.0
"""Variance of a position within a pixel, px^2."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A plan with its cameras placed."""

    plan: RigPlan
    places: Float
    """(C, 6), mm: projection centres and targets."""
    rig: Rig
    focus: Float
    """(C,), mm: distance of best focus along the axis."""
    exposure_us: Float
    """(C,): shortened so that the nearest possible spot does not saturate; NaN without light."""


@dataclass(frozen=True, slots=True)
class PlannedSpots:
    """Spots of n poses, each (n, C, L)."""

    uv: Float
    """(n, C, L, 2), px; NaN unless seen."""
    stage: NDArray[np.int8]
    """`SEEN` or why not."""
    white: Float
    """px^2: variance of one exposure, each axis."""
    blur_px: Float
    """Diameter of the defocus."""
    peak: Float
    """Brightest pixel by the saturation; NaN without light."""


def scene_of(plan: RigPlan, places: Float) -> Scene:
    """Return a plan with cameras at places (C, 6), see `Scene`; InputError as `RigPlan.rig`."""
    aims = np.linalg.norm(places[:, 3:] - places[:, :3], axis=1)
    stated = [one.focus or np.nan for one in plan.document.cameras]
    # A lens does not focus nearer than twice its focal length.
    nearest = np.array([2.0 * lens.focal for lens in plan.lenses])
    focus: Float = np.maximum(np.where(np.isnan(stated), aims, stated), nearest)
    scene = Scene(plan, places, plan.rig(places), focus, np.ones(len(places)))
    exposures, light = np.full(len(places), np.nan), plan.document.light
    if light is not None:
        reach = np.linalg.norm(plan.probe.leds_probe - plan.probe.tip_probe, axis=1).max()
        gaps = np.linalg.norm(places[:, :3] - np.clip(places[:, :3], *plan.volume), axis=1)
        near = np.maximum(gaps - reach, 1.0)
        for index in range(len(places)):
            at = slice(index, index + 1)
            # In focus, where its brightest pixel is brightest.
            peak = _spots_in(scene, index, near[at], focus[at], np.ones(1))[2]
            exposures[index] = min(light.exposure_us, _FULL / float(peak[0]))
    return replace(scene, exposure_us=exposures)


def spots_of(scene: Scene, rotations: Float, tips_world: Float) -> PlannedSpots:
    """Return the spots of poses (n, 3, 3) and (n, 3), mm, world from probe and ball centres."""
    plan, body = scene.plan, scene.plan.probe
    arms = body.leds_probe - body.tip_probe
    leds = np.einsum("nij,lj->nli", rotations, arms) + tips_world[:, None]
    light = np.einsum("nij,lj->nli", rotations, body.led_directions_probe)
    shape = (len(leds), len(scene.rig.cameras), body.n_leds)
    uv, stage = np.empty((*shape, 2)), np.full(shape, SEEN, np.int8)
    white, blur, peak = (np.empty(shape) for _ in range(3))
    for index, camera in enumerate(scene.rig.cameras):
        ray = scene.places[index, :3] - leds
        distance = np.sqrt(np.einsum("nli,nli->nl", ray, ray))
        facing = np.einsum("nli,nli->nl", ray, light) / distance
        depth = np.maximum(-ray @ camera.T_camera_from_world.rotation[2], 1.0)
        white[:, index], blur[:, index], peak[:, index], dark = _spots_in(
            scene, index, distance, depth, facing
        )
        uv[:, index] = places = project(camera, leds)
        radius = np.linalg.norm(places - [camera.u0, camera.v0], axis=2) * camera.pitch_mm
        # The reason that remains is the one to remove first.
        found = stage[:, index]
        found[dark] = DARK
        found[blur[:, index] > plan.document.measuring.most_blur_px] = BLURRED
        found[_blocked(plan.boxes, leds, ray)] = BLOCKED
        found[facing <= np.cos(body.emission_half_angle)] = AWAY
        found[:, list(plan.hidden_leds)] = AWAY
        inside = on_sensor(camera, places) & (radius <= 0.5 * plan.lenses[index].image_circle)
        found[~inside] = OUTSIDE
    uv[stage != SEEN] = np.nan
    return PlannedSpots(uv, stage, white, blur, peak)


def _spots_in(
    scene: Scene, index: int, distance: Float, depth: Float, facing: Float
) -> tuple[Float, Float, Float, NDArray[np.bool_]]:
    """Return variance, px^2, blur, px, peak, and whether it is too dark, in one camera.

    ``distance`` and ``depth`` of LEDs, mm; ``facing``: cosine between light and ray.
    """
    plan, planned = scene.plan, scene.plan.document.cameras[index]
    camera, lens, focus = plan.cameras[index], plan.lenses[index], scene.focus[index]
    defocus = np.abs(depth - focus) / (depth * (focus - lens.focal))
    blur = np.broadcast_to(lens.focal**2 / planned.stop * defocus / camera.pitch, facing.shape)
    floor, light = np.full_like(facing, camera.white_px**2), plan.document.light
    if light is None:
        return floor, blur, np.full_like(facing, np.nan), np.zeros(facing.shape, np.bool_)
    airy = _AIRY_SIGMA * 1e-6 * light.wavelength_nm * planned.stop
    chip = light.chip * lens.focal / depth / np.sqrt(12.0)
    # A uniform disc has a standard deviation of a quarter of its diameter, each axis.
    variance = (airy**2 + chip**2) / camera.pitch**2 + (0.25 * blur) ** 2
    # The LED radiates by the cosine law, and the ray sees the aperture under an angle.
    cosines = np.maximum(facing, 1e-3) * np.minimum(depth / distance, 1.0)
    solid_angle = 0.25 * np.pi * (lens.focal / planned.stop) ** 2 * cosines / distance**2
    joules = 1e-9 * light.intensity_mw_sr * light.transmission * solid_angle
    per_joule = 1e-9 * light.wavelength_nm / (_PLANCK_J_S * _LIGHT_M_S)
    electrons = joules * per_joule * camera.quantum_efficiency * scene.exposure_us[index]
    peak = electrons / (2.0 * np.pi * (variance + _PIXEL))
    read = 8.0 * np.pi * variance**2 * (camera.read_noise_e / electrons) ** 2
    white = floor + (variance + _PIXEL) / electrons + read
    return white, blur, peak / camera.saturation_e, peak < _LEAST_PEAK * camera.read_noise_e


def _blocked(boxes: Float, points: Float, way: Float) -> NDArray[np.bool_]:
    """Return whether a box is on the way (..., 3) from points to a camera."""
    blocked = np.zeros(points.shape[:-1], np.bool_)
    # A ray parallel to a side crosses it infinitely far away.
    way = np.where(np.abs(way) < 1e-9, 1e-9, way)
    for box in boxes:
        crossed = (box[:, None, None] - points) / way
        enters, leaves = crossed.min(axis=0).max(axis=-1), crossed.max(axis=0).min(axis=-1)
        blocked |= np.maximum(enters, 0.0) < np.minimum(leaves, 1.0)
    return blocked
