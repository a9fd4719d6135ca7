"""Scenes of `calibrating` for tip qualification and checks, also with faulty tips."""

from __future__ import annotations

import msgspec
import numpy as np

from ocmm_core.camera import Vector3
from ocmm_core.geometry import Float, unit


class TipFault(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Faults of the mounted tip; none by default."""

    diameter_mm: float = 0.0
    length_mm: float = 0.0
    """Excess length away from the handle (probe frame, against z)."""
    sideways_mm: float = 0.0
    """Sideways offset (probe frame, along x)."""
    worn_mm: float = 0.0
    """Depth of a worn place on the side of the ball (probe frame, along x)."""

    @property
    def shift_probe(self) -> Float:
        """Return the ball offset, (3,), mm, probe frame."""
        return np.array([self.sideways_mm, 0.0, -self.length_mm])


class TouchWithTip(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The sphere is touched along outward normals, then the ball is held in the cone."""

    centre: Vector3
    diameter: float
    """`centre`, `diameter`: sphere, mm, world."""
    normals: tuple[Vector3, ...]
    cone: Vector3
    """Final ball centre, mm, world."""
    handles: tuple[Vector3, ...]
    """Directions from ball to handle, world, one per attitude."""
    seed: int
    fault: TipFault = TipFault()


_WORN_RAD = np.radians(35.0)


def reach_of(scene: TouchWithTip, radius: float, rotation: Float, normal: Float) -> float:
    """Return the distance of the ball centre from the sphere centre at a touch, mm.

    ``radius``: documented ball radius plus its true error, mm; ``rotation`` (3, 3), world from
    probe; ``normal`` (3,): outward, unit, world.
    """
    fault = scene.fault
    touching_probe = rotation.T @ -normal
    angle = float(np.arccos(np.clip(touching_probe[0], -1.0, 1.0)))
    worn = fault.worn_mm * max(0.0, 1.0 - (angle / _WORN_RAD) ** 2)
    return float(0.5 * (scene.diameter + fault.diameter_mm) + radius - worn)


def unit_vectors(vectors: tuple[Vector3, ...]) -> list[Float]:
    """Return directions of length one."""
    return [unit(np.array(one)) for one in vectors]
