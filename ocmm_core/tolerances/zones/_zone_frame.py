"""The frame in which a zone stands: where it is, what it leaves open, how the points move it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, skew
from ocmm_core.measuring import Rows

BEST_FIT = "best fit"
"""Word for a frame that the toleranced points set alone."""


@dataclass(frozen=True, slots=True)
class ZoneFrame:
    """A frame, and how it answers to the points."""

    T_frame_from_world: RigidTransform
    """Where nominal geometry is."""
    by_coordinates: Rows
    """6 rows: turn, rad, over shift, mm, of the frame by every coordinate: a point x of the frame
    moves by ``turn x x + shift``."""
    motions: Float
    """(6, k): what is open, in the same form."""
    words: str
    """Name of the frame for the report."""

    def moved(self, motion: Float) -> ZoneFrame:
        """Return the frame after an open motion (k,)."""
        twist = self.motions @ motion
        return self.after(RigidTransform(rotation_from_vector(twist[:3]), _shift(twist)))

    def after(self, further: RigidTransform) -> ZoneFrame:
        """Return the frame moved further, by a motion that leaves what is open as it is."""
        return ZoneFrame(
            further.compose(self.T_frame_from_world),
            _transported(further, self.by_coordinates),
            self.motions,
            self.words,
        )

    def point_derivative(self, point_frame: Float, by_coordinates_world: Rows) -> Rows:
        """Return how a point answers in the frame, 3 rows, from how it does in the world."""
        rotation = self.T_frame_from_world.rotation
        by_frame = -skew(point_frame) @ self.by_coordinates[:3] + self.by_coordinates[3:]
        return rotation @ by_coordinates_world + by_frame

    def turning(self) -> ZoneFrame:
        """Return what of the frame acts on directions: no shifts."""
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
        """Return the frame free to shift in every direction, as zones of orientation are."""
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
    """Return a frame that nothing holds; its small turns are about a point (3,), mm, world."""
    middle = T_frame_from_world.apply(middle_world)
    motions = np.eye(6)
    motions[3:, :3] = skew(middle)
    return ZoneFrame(T_frame_from_world, Rows.nothing(6), motions, BEST_FIT)


def moved_geometry(
    geometries: Mapping[str, Float], name: str, k: int, step: float
) -> dict[str, Float]:
    """Return the geometries with one number of one of them moved; directions stay unit vectors."""
    moved = geometries[name].copy()
    moved[k] += step
    for part in (slice(3, 6), slice(9, 12)):
        length = float(np.linalg.norm(moved[part]))
        if part.start <= k < part.stop and length > 0.0:
            moved[part] /= length
    return {**geometries, name: moved}


def _transported(further: RigidTransform, twists: Rows) -> Rows:
    """Return small motions, 6 rows, seen after a further motion of the frame."""
    rotation, nothing = further.rotation, np.zeros((3, 3))
    by_twist = np.block([[rotation, nothing], [skew(further.translation) @ rotation, rotation]])
    seen: Rows = by_twist @ twists
    return seen
