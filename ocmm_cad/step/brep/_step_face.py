"""A surface of the model in numbers: one face, or the faces of one round surface."""

from __future__ import annotations

import msgspec
import numpy as np

from ocmm_core.geometry import Float

Triple = tuple[float, float, float]


LESS = "Export the model without parts and details that nobody measures."
"""Remedy for a model that is too large."""


class StepFace(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    shape: str
    """Word of `features.shapes.Shape`."""
    point: Triple
    direction: Triple
    across: Triple = (1.0, 0.0, 0.0)
    """`point`, `direction`, `across`: mm and unit: middle of the face, normal out of the material
    or axis, and direction of its length."""
    radius: float = 0.0
    second: float = 0.0
    half_angle: float = 0.0
    """`radius`, `second`, `half_angle`: As in `features.shapes.element`, mm and rad."""
    low: float = 0.0
    high: float = 0.0
    """`low`, `high`: mm: extent from ``point`` along ``direction`` (round), ``across`` (plane)."""
    width: float = 0.0
    """mm: extent of a plane perpendicular to ``across``."""
    inner: bool = False
    deviation_mm: float | None = None
    """Largest distance of a spline in the file from this surface; None for a native surface."""


def normals_of(face: StepFace, points: Float) -> Float:
    """Return the normals out of the material (n, 3) of a surface at points on it (n, 3), mm."""
    direction = np.array(face.direction)
    if face.shape == "Plane":
        return np.tile(direction, (len(points), 1))
    arms = points - np.array(face.point)
    across = arms - (arms @ direction)[:, None] * direction
    if face.shape == "Cone":
        # The axis leads from the tip into the cone: the normal is across, tilted back by the angle.
        round_it = across / _lengths(across)
        arms = np.cos(face.half_angle) * round_it - np.sin(face.half_angle) * direction
    elif face.shape == "Cylinder":
        arms = across
    elif face.shape == "Torus":
        arms = arms - face.radius * across / _lengths(across)
    normals: Float = arms / _lengths(arms)
    return -normals if face.inner else normals


def offsets_of(face: StepFace, points: Float) -> Float:
    """Return the distances of points (n, 3) out of the material of a surface (n,), mm."""
    arms = points - np.array(face.point)
    along: Float = arms @ np.array(face.direction)
    if face.shape == "Plane":
        return along
    across = np.linalg.norm(arms - along[:, None] * np.array(face.direction), axis=1)
    if face.shape == "Cylinder":
        away = across - face.radius
    elif face.shape == "Cone":
        away = across * np.cos(face.half_angle) - along * np.sin(face.half_angle)
    elif face.shape == "Torus":
        away = np.hypot(across - face.radius, along) - face.second
    else:
        away = np.linalg.norm(arms, axis=1) - face.radius
    offsets: Float = -away if face.inner else away
    return offsets


def _lengths(rows: Float) -> Float:
    found: Float = np.sqrt((rows * rows).sum(axis=1))[:, None]
    return found
