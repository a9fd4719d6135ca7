"""Distances of points from zone elements, and their derivatives by a step.

An element has its own frame: its axis or normal is z, its place the origin. A step shifts it by (u,
v, w), tilts its axis to (a, b, 1), changes its sizes and turns it about its axis. Parameters that
only widen the zone (radius of a cylinder, height of a plane) are excluded.

All formulas also hold for complex steps, so that a step of 1e-30 i gives derivatives without
cancellation (W. Squire and G. Trapp, SIAM Review 40, 1998): second derivatives are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from ocmm_core.features.zones._distance_kernel import ELLIPSE as ELLIPSE_CODE
from ocmm_core.features.zones._distance_kernel import (
    FIRST_SIZE,
    SECOND_SIZE,
    STEP_SIZE,
    TURN,
    Values,
    move_zone,
    possible_sizes,
    zone_distances,
)
from ocmm_core.geometry import Float, Int

TINY = 1e-30
ANGLES = (3, 4, FIRST_SIZE)
"""Entries of a step that are angles or, for a torus, equally sensitive."""


class DistanceKind(Enum):
    """Definition of the distance."""

    HEIGHT = "height above the plane"
    AXIS = "distance from the axis"
    CENTRE = "distance from the centre"
    SLOPE = "distance square to the flank of a cone"
    RING = "distance from the centre line of a torus"
    ELLIPSE = "distance from an ellipse in its plane"
    ROUND_ENDS = "distance from a slot with round ends in its plane"
    SQUARE_ENDS = "distance from a rectangle in its plane"


_CODES = {kind: code for code, kind in enumerate(DistanceKind)}
"""Codes of `_distance_kernel`."""


@dataclass(frozen=True, slots=True)
class ElementFamily:
    kind: DistanceKind
    free: tuple[int, ...]
    """Free entries of a step: indices of u, v, w, a, b, the two sizes and the turn."""
    lower: bool = True
    """The zone has an independent lower bound; else the greatest distance alone is minimised."""
    sign: float = 1.0
    """-1: distances are negated, so that the smallest is maximised."""
    even: bool = False
    """The zone is symmetric about the element: the greatest absolute distance is minimised. A
    parallel curve of an ellipse is no ellipse, so its zone cannot be shifted to one side."""

    @property
    def outline(self) -> bool:
        """Return whether it is a planar outline with two sizes and a length direction."""
        return self.code >= ELLIPSE_CODE

    @property
    def rows(self) -> Int:
        """Return the free entries in kernel form."""
        return np.array(self.free, dtype=np.int64)

    @property
    def code(self) -> int:
        return _CODES[self.kind]


PLANE = ElementFamily(DistanceKind.HEIGHT, (3, 4))
FLAT_LINE = ElementFamily(DistanceKind.HEIGHT, (3,))
FLAT_CIRCLE = ElementFamily(DistanceKind.AXIS, (0, 1))
SPHERE = ElementFamily(DistanceKind.CENTRE, (0, 1, 2))
CYLINDER = ElementFamily(DistanceKind.AXIS, (0, 1, 3, 4))
CONE = ElementFamily(DistanceKind.SLOPE, (0, 1, 3, 4, FIRST_SIZE))
TORUS = ElementFamily(DistanceKind.RING, (0, 1, 2, 3, 4, FIRST_SIZE))
_IN_PLANE = (0, 1, FIRST_SIZE, SECOND_SIZE, TURN)
ELLIPSE = ElementFamily(DistanceKind.ELLIPSE, _IN_PLANE, lower=False, even=True)
ROUND_SLOT = ElementFamily(DistanceKind.ROUND_ENDS, _IN_PLANE, lower=False, even=True)
RECTANGLE = ElementFamily(DistanceKind.SQUARE_ENDS, _IN_PLANE, lower=False, even=True)


def circumscribed(surface: ElementFamily) -> ElementFamily:
    """Return the family whose greatest distance is minimised."""
    return replace(surface, lower=False)


def inscribed(surface: ElementFamily) -> ElementFamily:
    """Return the family whose smallest distance is maximised."""
    return replace(surface, lower=False, sign=-1.0)


@dataclass(frozen=True, slots=True)
class ElementPose:
    """Position of an element among centred and scaled points."""

    frame: Float
    """(3, 3): columns x, y, z of the element; z is its axis or normal, x the direction of the
    length of an outline."""
    origin: Float
    """(3,)."""
    sizes: Float = field(default_factory=lambda: np.zeros(3))
    """(3,): half apex angle of a cone, rad; radius of the centre line of a torus; half length and
    half width of an outline, and the offset of the points outside an ellipse, which no step
    changes. Others are zero."""

    def local(self, points: Float) -> Float:
        """Return ``points`` (n, 3) in the frame of the element."""
        return (points - self.origin) @ self.frame

    def moved(self, step: Float) -> ElementPose:
        """Return the element after ``step`` (8,), its origin at the foot of the centroid.

        The foot keeps numbers small; w of elements that depend on it is subtracted.
        """
        frame, origin, sizes = np.empty((3, 3)), np.empty(3), np.empty(3)
        own = np.ascontiguousarray(self.frame)
        move_zone(own, self.origin, self.sizes, step, frame, origin, sizes)
        return ElementPose(frame, origin, sizes)


def possible(surface: ElementFamily, placed: ElementPose) -> bool:
    return bool(possible_sizes(surface.code, placed.sizes))


def full_step(surface: ElementFamily, free_step: Float) -> Float:
    """Return the step (8,) from the free entries (k,) of a family."""
    step = np.zeros(STEP_SIZE)
    step[list(surface.free)] = free_step
    return step


def distances(
    surface: ElementFamily, local: Values, sizes: Float, step: Values | None = None
) -> tuple[Values, Values]:
    """Return distances (n,) and their jacobian (n, 8) at ``step`` (8,) from the element.

    ``local`` (n, 3) are points in its frame; ``sizes`` (3,) see `ElementPose`.
    """
    step = np.zeros(STEP_SIZE) if step is None else step
    kind = np.result_type(local, step)
    found, jacobian = (
        np.empty(len(local), dtype=kind),
        np.empty((len(local), STEP_SIZE), dtype=kind),
    )
    zone_distances(
        surface.code, surface.sign, np.ascontiguousarray(local, dtype=kind), sizes,
        step.astype(kind), found, jacobian,
    )  # fmt: skip
    return found, jacobian


def second_derivatives(
    surface: ElementFamily, local: Float, sizes: Float, weights: Float
) -> tuple[Float, Float, Float]:
    """Return second derivatives of weighted distances at a step of zero.

    ``by_step`` (8, 8), of their sum by the step, with zero rows and columns of fixed entries; in
    the frame of the element ``by_points`` (n, 3), d(distance) / d(point), not weighted, and
    ``mixed`` (n, 8, 3), d(weighted jacobian) / d(point).
    """
    by_step = np.zeros((STEP_SIZE, STEP_SIZE))
    by_points = np.zeros((len(local), 3))
    mixed = np.zeros((len(local), STEP_SIZE, 3))
    for j in surface.free:
        step = np.zeros(STEP_SIZE, dtype=np.complex128)
        step[j] = 1j * TINY
        by_step[j] = weights @ (distances(surface, local, sizes, step)[1].imag / TINY)
    for j in range(3):
        moved = local.astype(np.complex128)
        moved[:, j] += 1j * TINY
        value, jacobian = distances(surface, moved, sizes)
        by_points[:, j] = value.imag / TINY
        mixed[:, :, j] = weights[:, None] * jacobian.imag / TINY
    return by_step, by_points, mixed
