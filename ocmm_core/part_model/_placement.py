"""Placement of a part in the measuring volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Placement of a part before the cameras."""

    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """(3,): direction of the model that points up."""
    turn_deg: float = 0.0
    """Rotation about the vertical, applied after ``up``."""
    offset_world: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """(3,), mm: of the middle of the part from that of the volume."""

    def pose(self, middle_part: Float, middle_world: Float) -> RigidTransform:
        """Return world from part, for the middles (3,), mm, of the part and of the volume."""
        up = unit(np.array(self.up))
        axis = np.cross(up, [0.0, 0.0, 1.0])
        size = float(np.linalg.norm(axis))
        angle = float(np.arctan2(size, up[2]))
        axis = axis / size if size > 1e-12 else np.array([1.0, 0.0, 0.0])
        turn = rotation_from_vector(np.array([0.0, 0.0, np.radians(self.turn_deg)]))
        rotation = turn @ rotation_from_vector(angle * axis)
        return RigidTransform(
            rotation, middle_world + np.array(self.offset_world) - rotation @ middle_part
        )
