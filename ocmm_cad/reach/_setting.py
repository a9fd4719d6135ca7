"""Probe, cameras and placement of the part."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ocmm_cad.reach._probe_solid import frame_of, solid_of
from ocmm_core.calibration.probe_design import ProbeDesign
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair, unit
from ocmm_core.part_model import Placement
from ocmm_core.tracking import ProbeBody, satisfies_rules

TILT_DEG = 100.0
"""Maximum usual angle of the handle from upright."""
_TILT_STEP_DEG = 15.0
_ROUND = 12
"""Directions of the handle at each tilt."""
_YAWS_DEG = (0.0, 20.0, -20.0, 40.0, -40.0)
_RULE_MARGIN_DEG = 12.0
"""Identification refuses attitudes within 10 degrees of one excluded by a rule."""
_FROM_THE_FRONT = (0.0, -1.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    body: ProbeBody
    design: ProbeDesign | None = None
    """None if unknown."""
    rig: Rig | None = None
    """The cameras; None to ignore sight."""
    placement: Placement = field(default_factory=Placement)
    ball_mm: float | None = None
    """Diameter of the ball; None for that of the probe."""
    tilt_deg: float = TILT_DEG
    """Largest angle of the handle from upright."""

    @property
    def ball_radius(self) -> float:
        return self.body.tip_radius if self.ball_mm is None else 0.5 * self.ball_mm

    def solid(self) -> Float:
        """Return the bodies of the probe, see `solid_of`."""
        return solid_of(replace(self.body, tip_radius=self.ball_radius), self.design)

    def pose(self, middle_part: Float) -> RigidTransform:
        """Return world from part, for the middle (3,), mm, of the part."""
        middle = np.zeros(3) if self.rig is None else self.rig.volume_world.mean(axis=0)
        return self.placement.pose(middle_part, middle)


def handle_directions(tilt_deg: float, more_world: Float) -> Float:
    """Return directions of the handle (d, 3), world, within the tilt: upright, ``more_world``."""
    tilts = np.radians(np.arange(_TILT_STEP_DEG, tilt_deg + 1e-9, _TILT_STEP_DEG))
    around = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    grid = np.stack(
        [
            np.sin(tilts)[:, None] * np.cos(around),
            np.sin(tilts)[:, None] * np.sin(around),
            np.broadcast_to(np.cos(tilts)[:, None], (len(tilts), _ROUND)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    more = more_world.reshape(-1, 3)
    more = more[more[:, 2] >= np.cos(np.radians(tilt_deg)) - 1e-9]
    every: Float = np.concatenate([[[0.0, 0.0, 1.0]], grid, more])
    return every


def attitudes(setting: Setting, directions_world: Float, middle_world: Float) -> Float:
    """Return rotations world from probe (d, y, 3, 3): LEDs towards the cameras, and nearby.

    NaN if excluded by a rule of the probe, and all of a direction if its first is.
    `directions_world`: (d, 3), unit, of the handle. `middle_world`: (3,), mm, of the part.
    """
    towards = np.array(_FROM_THE_FRONT)
    if setting.rig is not None:
        centres = np.array([camera.centre_world for camera in setting.rig.cameras])
        towards = unit(centres.mean(axis=0) - middle_world)
    frame = frame_of(setting.body, setting.design)
    turns = np.empty((len(directions_world), len(_YAWS_DEG), 3, 3))
    for row, handle in enumerate(directions_world):
        looks = towards - (towards @ handle) * handle
        size = float(np.linalg.norm(looks))
        looks = looks / size if size > 0.1 else perpendicular_pair(handle)[0]
        for column, yaw in enumerate(np.radians(_YAWS_DEG)):
            turned = np.cos(yaw) * looks + np.sin(yaw) * np.cross(handle, looks)
            world = np.array([np.cross(turned, handle), turned, handle])
            turns[row, column] = world.T @ frame
    margin = np.sin(np.radians(_RULE_MARGIN_DEG))
    allowed = satisfies_rules(setting.body, turns)
    for axis, world in setting.body.rules:
        allowed &= (turns @ axis) @ world > margin
    turns[~allowed] = np.nan
    turns[~allowed[:, 0]] = np.nan
    return turns
