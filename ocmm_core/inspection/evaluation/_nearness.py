"""How far a ball is from the nominal surface of a feature, one function a kind of surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.shapes import NominalFeature
from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_core.inspection.evaluation._places import Places, across_of

_DEEP_MM = 10.0


@dataclass(frozen=True, slots=True)
class Nearness:
    """How a ball lies to a nominal surface."""

    gap: float
    """mm: from the ball's surface to the nominal one; zero where it touches."""
    normal: Float
    """(3,), unit: from the material towards the probe, at the nearest place; zero for a line."""


def near_point(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a point."""
    return Nearness(float(np.linalg.norm(arm - radius * axis)), axis)


def near_line(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a line, on whichever face."""
    height, reach, _ = _about_axis(arm, axis)
    beyond = _beyond(abs(height), 0.5 * nominal.length)
    return Nearness(float(np.hypot(abs(reach - radius), beyond)), np.zeros(3))


def near_plane(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a plane, as far as the plan says it reaches."""
    height = float(arm @ axis)
    along = across_of(nominal)
    beyond_u = _beyond(abs(float(arm @ along)), 0.5 * nominal.length)
    beyond_v = _beyond(abs(float(arm @ np.cross(axis, along))), 0.5 * nominal.width)
    return Nearness(float(np.linalg.norm([height - radius, beyond_u, beyond_v])), axis)


def near_axis(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a circle, cylinder or cone."""
    height, reach, outward = _about_axis(arm, axis)
    half, flat = np.radians(0.5 * nominal.angle_deg), nominal.shape.spec.is_flat
    free = _DEEP_MM if flat else 0.5 * nominal.length + radius
    beyond = _beyond(abs(height), free) if flat or nominal.length > 0.0 else 0.0
    surface = 0.5 * nominal.diameter + height * np.tan(half)
    gap = (reach - surface) * np.cos(half) - sign * radius
    normal = sign * (np.cos(half) * outward - np.sin(half) * axis)
    return Nearness(float(np.hypot(gap, beyond)), normal)


def near_sphere(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to a sphere."""
    far = float(np.linalg.norm(arm))
    gap = far - 0.5 * nominal.diameter - sign * radius
    return Nearness(abs(gap), sign * arm / max(far, 1e-9))


def near_torus(
    nominal: NominalFeature, arm: Float, axis: Float, sign: float, radius: float
) -> Nearness:
    """Return how a ball lies to the tube of a torus."""
    ring = arm - 0.5 * nominal.diameter * _about_axis(arm, axis)[2]
    far = float(np.linalg.norm(ring))
    return Nearness(abs(far - 0.5 * nominal.width - sign * radius), sign * ring / max(far, 1e-9))


def near_places(places: Places, arm: Float, axis: Float, radius: float) -> Nearness:
    """Return how a ball lies to an outline that is known by many places on it.

    Parameters
    ----------
    places
        About the point of the feature.
    """
    height = float(arm @ axis)
    offsets = arm - height * axis - (places.points + radius * places.normals)
    nearest = int(np.argmin(np.sum(offsets**2, axis=1)))
    beyond = _beyond(abs(height), _DEEP_MM)
    gap = float(np.hypot(np.linalg.norm(offsets[nearest]), beyond))
    return Nearness(gap, places.normals[nearest])


def _about_axis(arm: Float, axis: Float) -> tuple[float, float, Float]:
    """Return height along an axis, distance from it, and the unit vector (3,) away from it."""
    height = float(arm @ axis)
    flat = arm - height * axis
    reach = float(np.linalg.norm(flat))
    outward: Float = flat / reach if reach > 1e-9 else perpendicular_pair(axis)[0]
    return height, reach, outward


def _beyond(distance: float, half: float) -> float:
    """Return how far outside a stretch of half length ``half`` something is; 0 unbounded."""
    return max(distance - half, 0.0) if half > 0.0 else 0.0
