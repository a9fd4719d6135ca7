"""Frame of a zone: pose, free motions, and derivatives by the points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, skew
from ocmm_core.measuring import Rows

BEST_FIT = "best fit"
"""Name of a frame set by the toleranced points alone."""


@dataclass(frozen=True, slots=True)
class ZoneFrame:
    """A frame with its derivatives by the points."""

    T_frame_from_world: RigidTransform
    by_coordinates: Rows
    """6 rows, rad over mm, by every coordinate: a point x moves by ``turn x x + shift``."""
    motions: Float
    """(6, k): free motions, in the same form."""
    words: str

    def moved(self, motion: Float) -> ZoneFrame:
        """Return the frame after an open motion (k,)."""
        twist = self.motions @ motion
        return self.after(RigidTransform(rotation_from_vector(twist[:3]), _shift(twist)))

    def after(self, further: RigidTransform) -> ZoneFrame:
        """Return the frame moved further, by a motion that preserves the free motions."""
        return ZoneFrame(
            further.compose(self.T_frame_from_world),
            _transported(further, self.by_coordinates),
            self.motions,
            self.words,
        )

    def point_derivative(self, point_frame: Float, by_coordinates_world: Rows) -> Rows:
        """Return the derivatives of a point in the frame, 3 rows, from those in the world."""
        rotation = self.T_frame_from_world.rotation
        by_frame = -skew(point_frame) @ self.by_coordinates[:3] + self.by_coordinates[3:]
        return rotation @ by_coordinates_world + by_frame

    def turning(self) -> ZoneFrame:
        """Return the rotational part of the frame, which acts on directions."""
        motions = self.motions.copy()
        motions[3:] = 0.0
        turns = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        return ZoneFrame(
            RigidTransform(self.T_frame_from_world.rotation, np.zeros(3)),
            turns @ self.by_coordinates,
            motions[:, np.any(motions != 0.0, axis=0)],
            self.words,
        )

    def with_shifts(self) -> ZoneFrame:
        """Return the frame with free shifts in all directions, for zones of orientation."""
        turning = self.motions[:, np.any(self.motions[:3] != 0.0, axis=0)].copy()
        turning[3:] = 0.0
        shifting = np.vstack([np.zeros((3, 3)), np.eye(3)])
        return ZoneFrame(
            self.T_frame_from_world, self.by_coordinates, np.hstack([turning, shifting]), self.words
        )


def _shift(twist: Float) -> Float:
    """Return the shift (3,) of a finite motion: the turn about the twist's own axis."""
    turn, shift = twist[:3], twist[3:]
    angle = float(np.linalg.norm(turn))
    k = skew(turn)
    if angle < 1e-6:
        return np.asarray(shift + 0.5 * k @ shift, dtype=np.float64)
    a = (1.0 - np.cos(angle)) / angle**2
    b = (angle - np.sin(angle)) / angle**3
    return np.asarray(shift + a * k @ shift + b * k @ k @ shift, dtype=np.float64)


def free_frame(T_frame_from_world: RigidTransform, middle_world: Float) -> ZoneFrame:
    """Return an unconstrained frame; its small rotations are about a point (3,), mm, world."""
    middle = T_frame_from_world.apply(middle_world)
    motions = np.eye(6)
    motions[3:, :3] = skew(middle)
    return ZoneFrame(T_frame_from_world, Rows.nothing(6), motions, BEST_FIT)


def moved_geometry(
    geometries: Mapping[str, Float], name: str, k: int, step: float
) -> dict[str, Float]:
    """Return the geometries with one entry of one changed; directions stay unit vectors."""
    moved = geometries[name].copy()
    moved[k] += step
    for part in (slice(3, 6), slice(9, 12)):
        length = float(np.linalg.norm(moved[part]))
        if part.start <= k < part.stop and length > 0.0:
            moved[part] /= length
    return {**geometries, name: moved}


def _transported(further: RigidTransform, twists: Rows) -> Rows:
    """Return small motions, 6 rows, as seen after a further motion of the frame."""
    rotation, nothing = further.rotation, np.zeros((3, 3))
    by_twist = np.block([[rotation, nothing], [skew(further.translation) @ rotation, rotation]])
    seen: Rows = by_twist @ twists
    return seen
