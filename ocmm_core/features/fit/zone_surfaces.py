"""Distances of points from the elements that zones are built on, and how a step changes them.

An element stands in a frame of its own: its axis or normal is z, its place the origin. A step
shifts it by (u, v, w), leans its axis to (a, b, 1) and changes a size that only cone and torus
have. What merely widens the zone (radius of a cylinder, height of a plane) is no part of it.

Every formula holds for complex steps too, so that a step of 1e-30 i gives derivatives without
cancellation (W. Squire and G. Trapp, SIAM Review 40, 1998): second derivatives are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float, rotation_from_vector

Values = NDArray[Any]
"""float64, or complex128 where a derivative is taken."""

STEP_SIZE = 6
TINY = 1e-30


class Kind(Enum):
    """What the distance is measured from."""

    HEIGHT = "height above the plane"
    AXIS = "distance from the axis"
    CENTRE = "distance from the centre"
    SLOPE = "distance square to the flank of a cone"
    RING = "distance from the centre line of a torus"


@dataclass(frozen=True, slots=True)
class Surface:
    """A family of elements.

    Attributes
    ----------
    kind
        What distances are measured from.
    free
        Which of u, v, w, a, b and the size a step may change.
    lower
        The zone has a lower bound; without it the greatest distance alone is minimised.
    sign
        -1: distances count negative, so that the greatest minimised is the smallest maximised.
    """

    kind: Kind
    free: tuple[int, ...]
    lower: bool = True
    sign: float = 1.0


PLANE = Surface(Kind.HEIGHT, (3, 4))
FLAT_LINE = Surface(Kind.HEIGHT, (3,))
FLAT_CIRCLE = Surface(Kind.AXIS, (0, 1))
SPHERE = Surface(Kind.CENTRE, (0, 1, 2))
CYLINDER = Surface(Kind.AXIS, (0, 1, 3, 4))
CONE = Surface(Kind.SLOPE, (0, 1, 3, 4, 5))
TORUS = Surface(Kind.RING, (0, 1, 2, 3, 4, 5))


def circumscribed(surface: Surface) -> Surface:
    """Return the family whose greatest distance is minimised."""
    return replace(surface, lower=False)


def inscribed(surface: Surface) -> Surface:
    """Return the family whose smallest distance is maximised."""
    return replace(surface, lower=False, sign=-1.0)


@dataclass(frozen=True, slots=True)
class Placed:
    """Where an element stands among centred and scaled points.

    Attributes
    ----------
    frame
        (3, 3): columns x, y, z of the element; z is its axis or normal.
    origin
        (3,).
    size
        Half apex angle of a cone, rad; radius of the centre line of a torus; else zero.
    """

    frame: Float
    origin: Float
    size: float = 0.0

    def local(self, points: Float) -> Float:
        """Return ``points`` (n, 3) in the frame of the element."""
        arms: Float = (points - self.origin) @ self.frame
        return arms

    def moved(self, step: Float) -> Placed:
        """Return the element after ``step`` (6,), its origin at the foot of the points' centroid.

        The foot keeps the numbers small; for elements that a slide along the axis changes, it is
        left out by their own w.
        """
        axis = np.array([step[3], step[4], 1.0])
        axis /= np.linalg.norm(axis)
        lean = np.cross([0.0, 0.0, 1.0], axis)
        length = float(np.linalg.norm(lean))
        if length > 0.0:
            lean *= np.arcsin(min(length, 1.0)) / length
        frame = self.frame @ rotation_from_vector(lean)
        # Rounding of many turns must not bend the frame.
        frame, _ = np.linalg.qr(frame)
        frame = frame * np.where(np.sum(frame * (self.frame), axis=0) < 0.0, -1.0, 1.0)
        return Placed(frame, self.origin + self.frame @ step[:3], self.size + float(step[5]))


def distances(
    surface: Surface, local: Values, size: complex, step: Values | None = None
) -> tuple[Values, Values]:
    """Return distances (n,) and their slopes (n, 6) at ``step`` (6,) from the element.

    Parameters
    ----------
    surface
        The family.
    local
        (n, 3): points in the frame of the element.
    size
        See `Placed`.
    step
        (6,): where distances and slopes are taken, zero unless given.
    """
    if step is None:
        step = np.zeros(STEP_SIZE)
    arms = local - step[:3]
    axis = np.array([step[3], step[4], 1.0])
    square = step[3] * step[3] + step[4] * step[4] + 1.0
    slopes = np.zeros((len(local), STEP_SIZE), dtype=np.result_type(local, step))
    if surface.kind is Kind.CENTRE:
        found = np.sqrt(np.sum(arms * arms, axis=1))
        slopes[:, :3] = -arms / _above_zero(found)[:, None]
        return surface.sign * found, surface.sign * slopes
    along = arms @ axis / square
    length = np.sqrt(square)
    height = along * length
    across = arms - along[:, None] * axis
    if surface.kind is not Kind.AXIS:
        slopes[:, :3] = -axis / length
        slopes[:, 3:5] = across[:, :2] / length
        if surface.kind is Kind.HEIGHT:
            return surface.sign * height, surface.sign * slopes
    radius = np.sqrt(np.sum(across * across, axis=1))
    outward = across / _above_zero(radius)[:, None]
    radial = np.zeros_like(slopes)
    radial[:, :3] = -outward
    radial[:, 3:5] = -along[:, None] * outward[:, :2]
    if surface.kind is Kind.AXIS:
        return surface.sign * radius, surface.sign * radial
    size = size + step[5]
    if surface.kind is Kind.SLOPE:
        cosine, sine = np.cos(size), np.sin(size)
        slopes = cosine * radial - sine * slopes
        slopes[:, 5] = -radius * sine - height * cosine
        return radius * cosine - height * sine, slopes
    radial[:, 5] = -1.0
    beyond = radius - size
    found = np.sqrt(beyond * beyond + height * height)
    slopes = beyond[:, None] * radial + height[:, None] * slopes
    return found, slopes / _above_zero(found)[:, None]


def _above_zero(lengths: Values) -> Values:
    """Return ``lengths`` without zeros: a point on the axis itself has no side, hence no slope."""
    return np.where(np.abs(lengths) < 1e-200, 1e-200, lengths)


def second_derivatives(
    surface: Surface, local: Float, size: float, weights: Float
) -> tuple[Float, Float, Float]:
    """Return what the derivatives of weighted distances need, at a step of zero.

    Returns
    -------
    by_step
        (6, 6): second derivatives by the step of the sum of weighted distances.
    by_points
        (n, 3): d(distance) / d(point), in the frame of the element; not weighted.
    mixed
        (n, 6, 3): d(weighted slopes) / d(point), in the frame of the element.
    """
    by_step = np.zeros((STEP_SIZE, STEP_SIZE))
    by_points = np.zeros((len(local), 3))
    mixed = np.zeros((len(local), STEP_SIZE, 3))
    for j in range(STEP_SIZE):
        step = np.zeros(STEP_SIZE, dtype=np.complex128)
        step[j] = 1j * TINY
        by_step[j] = weights @ (distances(surface, local, size, step)[1].imag / TINY)
    for j in range(3):
        moved = local.astype(np.complex128)
        moved[:, j] += 1j * TINY
        value, slopes = distances(surface, moved, size)
        by_points[:, j] = value.imag / TINY
        mixed[:, :, j] = weights[:, None] * slopes.imag / TINY
    return by_step, by_points, mixed
