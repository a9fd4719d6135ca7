"""Where the inspector stands, and what left and right mean to him.

He stands at the part with his face to the cameras: his hand is behind the LEDs, his body nowhere in
the way of the light, and the screen stands by the cameras. Left and right, towards and away are
his. The picture of the probe is what he sees from there, and says so (decision 93).
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
    """`right`, `up`, `away`: To his right, up, and away from him: towards the cameras. A
    right-handed frame is (right, away, up)."""

    def flat(self, vectors: Float) -> Float:
        """Return what he sees of vectors (..., 3), mm, world: (..., 2), to the right and up."""
        seen: Float = np.stack([vectors @ self.right, vectors @ self.up], axis=-1)
        return seen


def stance_at(rig: Rig) -> Stance:
    """Return how he stands before the cameras of a rig."""
    up = np.array(UP_WORLD)
    middle = rig.volume_world.mean(axis=0)
    towards = np.mean([camera.centre_world for camera in rig.cameras], axis=0) - middle
    level = towards - (towards @ up) * up
    # Cameras straight above the part: every place at the table is as good as another.
    away = unit(level) if np.linalg.norm(level) > _LEAST else np.array([0.0, -1.0, 0.0])
    return Stance(np.cross(away, up), up, away)
