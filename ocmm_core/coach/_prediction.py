"""Predicted visibility of a turned probe, and the uncertainty of its ball."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import Rig, on_sensor, project
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.tracking import ProbeBody, TipSensitivity, tip_sensitivities

LEAST_FOR_POSE = 3
"""LEDs seen by two cameras; fewer do not determine the pose."""

Bool = NDArray[np.bool_]
Sensitivities = Callable[[Float], Sequence[TipSensitivity]]
"""From spots (n, C, L, 2), px, to ball sensitivities; raises TrackingError like the core."""


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """Attitude and visibility of the probe."""

    rotation_world_from_probe: Float
    """(3, 3)."""
    tip_world: Float
    """(3,), mm: of the resting ball."""
    seen: Bool
    """(C, L): which camera sees which LED now."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """LEDs seen by the cameras by the model of their light, and their spots."""

    seen: Bool
    """(n, C, L)."""
    on_sensor: Bool
    """(n, C, L): whether the image of the LED lies on the sensor, lit or not."""
    spots: Float
    """(n, C, L, 2), px, of all LEDs, seen or not."""


def sight_of(
    rig: Rig, body: ProbeBody, rotations: Float, tip_world: Float, margin_rad: float = 0.0
) -> Sight:
    """Return the visibility for attitudes (n, 3, 3) about the ball (3,), mm.

    An LED shines into a cone (`ProbeBody.emission_half_angle`), reduced by ``margin_rad``.
    """
    arms = body.leds_probe - body.tip_probe
    places = np.einsum("nij,lj->nli", rotations, arms) + tip_world
    light = np.einsum("nij,lj->nli", rotations, body.led_directions_probe)
    least = np.cos(max(body.emission_half_angle - margin_rad, 0.0))
    lit, inside, spots = [], [], []
    for camera in rig.cameras:
        ray = camera.centre_world - places
        facing = np.sum(ray * light, axis=2) > least * np.linalg.norm(ray, axis=2)
        uv = project(camera, places)
        there = on_sensor(camera, uv)
        spots.append(uv)
        inside.append(there)
        lit.append(facing & there)
    return Sight(np.stack(lit, axis=1), np.stack(inside, axis=1), np.stack(spots, axis=1))


def common(seen: Bool) -> NDArray[np.int64]:
    """Return the number of LEDs that two cameras see, (n,), from (n, C, L)."""
    count: NDArray[np.int64] = np.count_nonzero(np.count_nonzero(seen, axis=1) >= 2, axis=1)
    return count


def uncertainties(
    sight: Sight, rig: Rig, body: ProbeBody, sensitivities: Sensitivities | None = None
) -> Float:
    """Return U (n,), mm, k = 2, of averaged points, worst direction; NaN without pose.

    The same propagation as for the readout (`measuring.point_uncertainty`), from predicted spots.
    ``sensitivities`` is for a reference body; None for `tracking.tip_sensitivities`.
    """
    found = np.full(len(sight.seen), np.nan)
    usable = np.flatnonzero(common(sight.seen) >= LEAST_FOR_POSE)
    spots = np.where(sight.seen[..., None], sight.spots, np.nan)
    answers = _answers(spots[usable], rig, body, sensitivities)
    kept = [
        (place, answer) for place, answer in zip(usable, answers, strict=True) if answer is not None
    ]
    if kept:
        covariances = covariances_of([answer for _, answer in kept], rig, body)
        worst = COVERAGE_FACTOR * np.sqrt(np.linalg.eigvalsh(covariances)[:, -1])
        found[[place for place, _ in kept]] = worst
    return found


def _answers(
    spots: Float, rig: Rig, body: ProbeBody, sensitivities: Sensitivities | None
) -> Sequence[TipSensitivity | None]:
    if not len(spots):
        return ()

    def plain(uv: Float) -> Sequence[TipSensitivity]:
        return tip_sensitivities(uv, rig, body)

    ask = plain if sensitivities is None else sensitivities
    try:
        return ask(spots)
    except TrackingError:
        # If one of them is degenerate, ask for each alone.
        return [_one(ask, uv) for uv in spots]


def _one(ask: Sensitivities, uv: Float) -> TipSensitivity | None:
    try:
        return ask(uv[None])[0]
    except TrackingError:
        return None


def covariance_of(answer: TipSensitivity, rig: Rig, body: ProbeBody) -> Float:
    """Return the covariance (3, 3), mm^2, of the ball, without its own window."""
    found: Float = covariances_of([answer], rig, body)[0]
    return found


def covariances_of(answers: Sequence[TipSensitivity], rig: Rig, body: ProbeBody) -> Float:
    """Return the covariance of each ball, (n, 3, 3), mm^2.

    Equals `measuring.systematic_covariance` of one point, vectorised because a hint needs up to
    eighty: cameras, probe and reference body, and the field of the sensors' patterns in closed form
    instead of on a grid (`measuring._pattern_field`).
    """
    cameras = np.stack([answer.by_cameras for answer in answers])
    geometry = np.stack([answer.by_geometry for answer in answers])
    common_to_all = np.stack([answer.by_common for answer in answers])
    total = cameras @ rig.parameter_covariance @ cameras.transpose(0, 2, 1)
    total += geometry @ body.geometry_covariance @ geometry.transpose(0, 2, 1)
    total += common_to_all @ common_to_all.transpose(0, 2, 1)
    noise = rig.noise
    if noise.pattern_px > 0.0:
        most = max(len(answer.camera) for answer in answers)
        places = np.zeros((len(answers), most, 2))
        camera = np.full((len(answers), most), -1)
        slopes = np.zeros((len(answers), 3, most, 2))
        for row, answer in enumerate(answers):
            count = len(answer.camera)
            places[row, :count], camera[row, :count] = answer.uv, answer.camera
            slopes[row, :, :count] = noise.pattern_px * answer.by_spots
        # Spots of one camera at distance d share exp(-d^2 / (2 l^2)) of the pattern; spots of two
        # cameras, and u and v, are independent. Unfilled places have zero slope.
        apart = np.sum((places[:, :, None] - places[:, None]) ** 2, axis=3)
        shared = np.exp(-apart / (2.0 * noise.pattern_length_px**2))
        shared *= camera[:, :, None] == camera[:, None]
        for axis in range(2):
            one = slopes[..., axis]
            total += one @ shared @ one.transpose(0, 2, 1)
    return total
