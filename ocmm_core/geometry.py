"""Rigid transforms, rotations and the array aliases of the core.

Frames are named in the variable: ``T_world_from_probe`` takes a point from the probe frame
to the world frame. Lengths are millimetres, angles radians, arrays float64.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Float: TypeAlias = NDArray[np.float64]
"""Any float64 array; the docstring beside it says shape, unit and frame."""

Int: TypeAlias = NDArray[np.int64]
"""Any int64 array."""

Points3: TypeAlias = NDArray[np.float64]
"""Array (n, 3), mm."""

Pixels: TypeAlias = NDArray[np.float64]
"""Array (..., 2), px."""


@dataclass(frozen=True, slots=True)
class RigidTransform:
    """A proper rigid motion ``x_a = rotation @ x_b + translation``."""

    rotation: Float
    """(3, 3), determinant +1."""
    translation: Float
    """(3,), mm, in frame a."""

    @classmethod
    def identity(cls) -> RigidTransform:
        """Return the motion that leaves every point where it is."""
        return cls(np.eye(3), np.zeros(3))

    def apply(self, points: Float) -> Float:
        """Return ``points`` (..., 3), mm, of frame b expressed in frame a."""
        return points @ self.rotation.T + self.translation

    def inverse(self) -> RigidTransform:
        """Return the motion from frame a to frame b."""
        return RigidTransform(self.rotation.T, -self.rotation.T @ self.translation)

    def compose(self, other: RigidTransform) -> RigidTransform:
        """Return ``self`` after ``other``: a_from_b composed with b_from_c is a_from_c."""
        return RigidTransform(
            self.rotation @ other.rotation, self.rotation @ other.translation + self.translation
        )


def triple(values: Float) -> tuple[float, float, float]:
    """Return ``values`` (3,) as plain numbers, for documents and records."""
    x, y, z = values.tolist()
    return x, y, z


def skew(vector: Float) -> Float:
    """Return the matrix (3, 3) whose product with x is ``vector`` cross x."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_from_vector(vector: Float) -> Float:
    """Return the rotation (3, 3) about ``vector`` (3,) by its length in radians (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3) + skew(np.asarray(vector, dtype=np.float64))
    k = skew(np.asarray(vector, dtype=np.float64) / angle)
    rotation: Float = np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)
    return rotation


def rotation_xyz(alpha: float, beta: float, gamma: float) -> Float:
    """Return ``Rz(gamma) Ry(beta) Rx(alpha)`` in the active sense (thesis 3.2.1)."""
    ca, sa, cb, sb, cg, sg = (
        np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta), np.cos(gamma), np.sin(gamma)
    )  # fmt: skip
    rz = np.array([[cg, -sg, 0.0], [sg, cg, 0.0], [0.0, 0.0, 1.0]])
    ry = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    rx = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    product: Float = rz @ ry @ rx
    return product


def unit(vector: Float) -> Float:
    """Return ``vector`` (..., 3) scaled to length one; a zero vector raises ValueError."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    if np.any(length < 1e-300):
        msg = "a zero vector has no direction"
        raise ValueError(msg)
    scaled: Float = vector / length
    return scaled


def rigid_fit(reference: Float, measured: Float) -> tuple[Float, Float]:
    """Return rotation (3, 3) and translation (3,) that take ``reference`` to ``measured``.

    Orthogonal Procrustes (thesis 1.3.2), never a reflection; both arrays are (n, 3).
    """
    a, b = reference.mean(axis=0), measured.mean(axis=0)
    u, _, vt = np.linalg.svd((measured - b).T @ (reference - a))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation: Float = u @ sign @ vt
    return rotation, b - rotation @ a


def perpendicular_pair(direction: Float) -> tuple[Float, Float]:
    """Return two unit vectors (3,) that form a right-handed frame with ``direction``."""
    d = unit(np.asarray(direction, dtype=np.float64))
    helper = np.eye(3)[int(np.argmin(np.abs(d)))]
    first = unit(crossed(helper, d))
    return first, crossed(d, first)


def spiral(heights: Float) -> Float:
    """Return unit vectors (n, 3) at ``heights``, evenly spread about z (Fibonacci spiral)."""
    turn = np.pi * (1.0 + np.sqrt(5.0)) * (np.arange(len(heights)) + 0.5)
    ring = np.sqrt(1.0 - heights**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), heights], axis=1)


def crossed(a: Float, b: Float) -> Float:
    """Return what `np.cross` does of two vectors (3,), to the last bit, in a tenth of its time."""
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])
