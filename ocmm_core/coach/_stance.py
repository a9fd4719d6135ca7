"""Position of the inspector, which defines left and right.

He faces the cameras at the part, with his hand behind the LEDs and his body out of the light; the
screen is beside the cameras. Left and right, towards and away are his; the picture of the probe is
his view and says so (decision 74).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, unit

UP_WORLD = (0.0, 0.0, 1.0)
"""The Z axis of every rig document points up."""
_LEAST = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """The directions of the inspector, (3,), unit, world."""

    right: Float
    up: Float
    away: Float
    """`away` leads towards the cameras. (right, away, up) is right-handed."""

    def flat(self, vectors: Float) -> Float:
        """Return his view of vectors (..., 3), mm, world: (..., 2), to the right and up."""
        seen: Float = np.stack([vectors @ self.right, vectors @ self.up], axis=-1)
        return seen


def stance_at(rig: Rig) -> Stance:
    """Return his directions before the cameras of a rig."""
    up = np.array(UP_WORLD)
    middle = rig.volume_world.mean(axis=0)
    towards = np.mean([camera.centre_world for camera in rig.cameras], axis=0) - middle
    level = towards - (towards @ up) * up
    # With cameras straight above the part, every direction is equally good.
    away = unit(level) if np.linalg.norm(level) > _LEAST else np.array([0.0, -1.0, 0.0])
    return Stance(np.cross(away, up), up, away)
