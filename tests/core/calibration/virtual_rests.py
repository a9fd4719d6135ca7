"""The virtual rig rest by rest: spots averaged at rest without frames, for many sessions.

A guided procedure averages a hundred frames to one set of spots. Here the set is drawn directly:
projection, sensor pattern at that place, and white noise of the mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ocmm_core.camera import CameraModel, Rig, on_sensor, project
from ocmm_core.geometry import Float, rotation_from_vector, unit
from ocmm_core.tracking import ProbeBody
from ocmm_sim.calibration_scenes import best_seen
from ocmm_sim.scene import WorldOptions, draw_world

Holds: TypeAlias = dict[tuple[float, ...], list[Float]]
_HOLDS, _HOLD_MM, _HAND_RAD = 4, 10.0, 0.03


class VirtualRests:
    """Virtual rig for one session, rest by rest.

    ``holds``: attitudes by place, shareable between sessions: finding one dominates the run time.
    """

    def __init__(
        self, rig: Rig, body: ProbeBody, seed: int, frames: int, holds: Holds | None = None
    ) -> None:
        self.rig, self.body = rig, body
        self.world = draw_world(rig, body, seed, WorldOptions())
        self.cameras: tuple[CameraModel, ...] = self.world.cameras
        """Current cameras; replaced to simulate a nudge."""
        self.tip_shift_probe = np.zeros(3)
        """Offset of the true tip: another stylus than in the record."""
        self.lifted_mm = 0.0
        """Distance of the ball from its seat in all axes: dirt, or a weak hand."""
        self._holds: Holds = {} if holds is None else holds
        self._rng = np.random.default_rng([seed, 61])
        self._white_px = rig.noise.white_px / np.sqrt(frames)

    def hold(self, tip_world: Float, normal_world: Float | None = None) -> Float:
        """Return an attitude (3, 3) in which the cameras see the probe well."""
        place = tuple(np.round(tip_world / _HOLD_MM).tolist())
        known = self._holds.setdefault(place, [])
        if len(known) < _HOLDS:
            volume = self.rig.volume_world
            vector = best_seen(tip_world, normal_world, self.world, self.body, volume, self._rng)
            known.append(rotation_from_vector(vector))
        # A hand varies the attitude.
        other = rotation_from_vector(_HAND_RAD * self._rng.standard_normal(3))
        return other @ known[int(self._rng.integers(len(known)))]

    def spots(self, tip_world: Float, rotation: Float) -> Float:
        """Return averaged spots (C, L, 2), px, of a ball centre (3,), mm; NaN if unseen."""
        world = self.world
        tip_probe = world.tip_probe + self.tip_shift_probe
        leds = tip_world + self.lifted_mm + (world.leds_probe - tip_probe) @ rotation.T
        light = self.body.led_directions_probe @ rotation.T
        uv = np.full((len(self.cameras), len(leds), 2), np.nan)
        for c, (camera, pattern) in enumerate(zip(self.cameras, world.patterns, strict=True)):
            towards = unit(camera.centre_world - leds)
            shines = np.sum(towards * light, axis=1) > np.cos(self.body.emission_half_angle)
            exact = project(camera, leds)
            seen = shines & on_sensor(camera, exact)
            uv[c, seen] = exact[seen] + _at(pattern.nodes, exact[seen] / pattern.step_px)
        white: Float = self._white_px * self._rng.standard_normal(uv.shape)
        return uv + white


def places_of_bar(ends_world: Float, nests: Sequence[float], scale: float = 1.0) -> Float:
    """Return the nests (n, 3), mm, of a bar from one end along its axis."""
    along = unit(ends_world[1] - ends_world[0])
    steps = scale * (np.array(nests) - nests[0])
    places: Float = ends_world[0] + steps[:, None] * along
    return places


def _at(nodes: Float, place: Float) -> Float:
    """Return a pattern (2, rows, columns) interpolated at (n, 2), columns first."""
    rows, columns = nodes.shape[1:]
    low = np.clip(np.floor(place).astype(np.int64), 0, [columns - 2, rows - 2])
    h, g = (place - low).T
    column, row = low.T
    found: Float = (
        (1.0 - g) * ((1.0 - h) * nodes[:, row, column] + h * nodes[:, row, column + 1])
        + g * ((1.0 - h) * nodes[:, row + 1, column] + h * nodes[:, row + 1, column + 1])
    ).T
    return found
