"""Widths of zones about true geometry, for surface points, centres and axes.

Every zone of ISO 1101 is one of two: points of a surface between two copies of the nominal surface,
or points of a centre or an axis within a sphere, a cylinder or two planes about the nominal place.
Degrees of freedom left by the datums are used to minimise it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ocmm_core.features.elements import nominal_distances
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, skew
from ocmm_core.measuring import DeviationRows, Rows
from ocmm_core.tolerances.zones._characteristic import Evaluation, FormNoise, Seen
from ocmm_core.tolerances.zones._surface import SurfacePoints, own_fit
from ocmm_core.tolerances.zones._zone_frame import (
    Smallest,
    ZoneFrame,
    smallest_length,
    smallest_zone,
)

_OUTER_STEPS = 6
_FOLLOWED = 1e-7
"""Relative effect of a motion that counts as zero."""
_SETTLED = 1e-5
"""Motion, mm, above which the linearisation is repeated at the new place."""


class SurfaceTouches(Protocol):
    """Touches of a surface with their true geometry."""

    @property
    def world(self) -> Float:
        """Return the relevant places (n, 3), mm, world."""
        ...

    @property
    def places(self) -> Sequence[int]:
        """Return the indices of the points in rows."""
        ...

    def deviations(self, points: Float) -> tuple[Float, Float]:
        """Return deviations (n,), mm, from true geometry, and their normals (n, 3).

        ``points`` (n, 3) are `world` in the frame of the zone.
        """
        ...

    def checked(self, points: Float, rotation: Float) -> tuple[Float, Float]:
        """Return final deviations, rotation (3, 3) world to zone; FitError if one is undefined."""
        ...

    def pull_back(self, weights: Float, normals: Float) -> Rows:
        """Return the gradient, one row, of the weighted sum of places; arguments (n, 3), world."""
        ...

    def by_radius(self, normals: Float) -> Float:
        """Return the derivatives (n,) of deviations by the ball radius; normals (n, 3), world."""
        ...

    def seen(self, values: Float, normals: Float) -> Seen:
        """Return deviations (n,) with normals (n, 3), world, for pictures."""
        ...


@dataclass(frozen=True, slots=True)
class Surface:
    """A surface with its true geometry."""

    measured: SurfacePoints
    shape: Shape
    nominal: Float
    """`shape`, `nominal`: Shape and geometry vector (12,) in the frame of the zone."""
    offset: float = 0.0
    """mm: offset of the zone's middle from the nominal surface, away from material."""

    @property
    def world(self) -> Float:
        """Return the contact points (n, 3), mm, world."""
        return self.measured.points

    @property
    def places(self) -> Sequence[int]:
        """Return the indices of the points in rows."""
        return own_fit(self.measured.feature)[0].places

    def deviations(self, points: Float) -> tuple[Float, Float]:
        """Return deviations (n,), mm, and normals (n, 3) of points in the frame of the zone."""
        distance, normal = nominal_distances(self.shape, self.nominal, points)
        return distance - _outwards(self) * self.offset, normal

    def checked(self, points: Float, rotation: Float) -> tuple[Float, Float]:
        """Return `deviations`: an element has a unique nearest place."""
        return self.deviations(points)

    def pull_back(self, weights: Float, normals: Float) -> Rows:
        """Return the gradient of the sum of contact points with weights (n, 3), world."""
        return self.measured.pull_back(weights)

    def by_radius(self, normals: Float) -> Float:
        """Return the derivatives (n,) of deviations by the ball radius."""
        answers: Float = -np.sum(normals * self.measured.normals, axis=1)
        return answers

    def seen(self, values: Float, normals: Float) -> Seen:
        """Return the deviations for pictures."""
        touches, name = own_fit(self.measured.feature)[0], self.measured.feature.nominal.name
        # The distance from a bore grows into its material.
        signs = np.where(np.sum(normals * self.measured.normals, axis=1) < 0.0, -1.0, 1.0)
        return Seen(
            (name,) * len(touches.numbers), touches.numbers, self.measured.points,
            signs[:, None] * normals, signs * values,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class DerivedPoint:
    """A centre, or one point of an axis."""

    point: Float
    """(3,), mm, world."""
    by_coordinates: Rows
    """3 rows."""


def surface_zone(surfaces: Sequence[SurfaceTouches], frame: ZoneFrame) -> Evaluation:
    """Return twice the greatest distance from true geometry; FitError without a solution."""
    worlds = [surface.world for surface in surfaces]

    def distances(at: ZoneFrame, *, checked: bool = False) -> tuple[Float, Float, Float]:
        values, normals = [], []
        for surface, world in zip(surfaces, worlds, strict=True):
            points = at.T_frame_from_world.apply(world)
            distance, normal = (
                surface.checked(points, at.T_frame_from_world.rotation)
                if checked
                else surface.deviations(points)
            )
            values.append(distance)
            normals.append(normal)
        at_points = at.T_frame_from_world.apply(np.vstack(worlds))
        return np.concatenate(values), np.vstack(normals), at_points

    def deviations(at: ZoneFrame) -> tuple[Float, Float]:
        values, normals, points = distances(at)
        return values, np.hstack([np.cross(points, normals), normals])

    frame, smallest = _searched(frame, np.vstack(worlds), deviations, smallest_zone)
    values, normals, points = distances(frame, checked=True)
    normals_world = normals @ frame.T_frame_from_world.rotation
    weights = 2.0 * smallest.shares[:, None] * normals_world
    twists = np.hstack([np.cross(points, normals), normals])
    gradient = 2.0 * smallest.shares @ twists @ frame.by_coordinates
    first = 0
    for surface in surfaces:
        own = slice(first, first + len(surface.world))
        first = own.stop
        gradient = gradient + surface.pull_back(weights[own], normals_world[own])
    free = twists @ frame.motions
    rows = _by_own_points(surfaces, normals_world).with_shared(twists, frame.by_coordinates)
    return Evaluation(
        2.0 * smallest.value,
        gradient,
        frame=frame.words,
        noise=form_noise(values, rows, free),
        seen=_all_seen(surfaces, values, normals_world),
    )


def _all_seen(surfaces: Sequence[SurfaceTouches], values: Float, normals: Float) -> Seen:
    found, first = [], 0
    for surface in surfaces:
        own = slice(first, first + len(surface.world))
        first = own.stop
        found.append(surface.seen(values[own], normals[own]))
    return Seen(
        tuple(name for one in found for name in one.features),
        tuple(number for one in found for number in one.numbers),
        np.vstack([one.points for one in found]),
        np.vstack([one.outward for one in found]),
        np.concatenate([one.deviations for one in found]),
    )


def form_noise(distances: Float, by_coordinates: DeviationRows, free: Float) -> FormNoise:
    """Return the noise of deviations (n,), mm, of a zone from its middle.

    ``by_coordinates``: of the n, nothing absorbed; ``free`` (n, k): by free motions of the zone.
    """
    n = len(distances)
    if free.shape[1]:
        u, strengths, _ = np.linalg.svd(free, full_matrices=False)
        followed = u[:, strengths > _FOLLOWED * max(float(strengths[0]), 1e-300)]
        by_coordinates = by_coordinates.without(followed)
        ones = np.ones(n)
        if float(np.linalg.norm(ones - followed @ (followed.T @ ones))) < _FOLLOWED * n:
            return FormNoise(distances, by_coordinates, free)
    return FormNoise(distances, by_coordinates, free, mirrored=True)


def _by_own_points(surfaces: Sequence[SurfaceTouches], normals: Float) -> DeviationRows:
    """Return derivatives of distances by their own ball centres and the ball."""
    places = [place for surface in surfaces for place in surface.places]
    by_radius, first = [], 0
    for surface in surfaces:
        own = slice(first, first + len(surface.world))
        first = own.stop
        by_radius.append(surface.by_radius(normals[own]))
    return DeviationRows.of_own(places, normals, np.concatenate(by_radius))


def derived_zone(
    points: Sequence[DerivedPoint], true_point: Float, rows: Float, frame: ZoneFrame
) -> Evaluation:
    """Return twice the greatest distance of centres or axis points from true geometry.

    ``true_point`` (3,), mm, frame, is the true centre, or a point of the true axis or plane.
    ``rows`` (d, 3) are orthonormal directions of the distance: three for a sphere, two across an
    axis, one across two planes.
    """
    world = np.array([item.point for item in points])

    def deviations(at: ZoneFrame) -> tuple[Float, Float]:
        places = at.T_frame_from_world.apply(world)
        twists = np.array([rows @ np.hstack([-skew(x), np.eye(3)]) for x in places])
        return (places - true_point) @ rows.T, twists

    frame, smallest = _searched(frame, world, deviations, smallest_length)
    places = frame.T_frame_from_world.apply(world)
    vectors = (places - true_point) @ rows.T
    jacobian = [
        rows @ frame.point_derivative(place, item.by_coordinates)
        for place, item in zip(places, points, strict=True)
    ]
    by_vectors = Rows.stacked(jacobian).reshaped(*vectors.shape)
    return _of_vectors(smallest, vectors, by_vectors, frame.words)


def vector_evaluation(components: Float, gradients: Rows, frame: str) -> Evaluation:
    """Return the evaluation of a value that is the length of a vector (d,)."""
    value = float(np.linalg.norm(components))
    if value > 0.0:
        gradient = (components @ gradients) / value
    else:
        # Any direction is valid: use the one of greatest response to the points.
        gradient = gradients[int(np.argmax(gradients.lengths()))]
    return Evaluation(
        value, gradient, components=components, component_gradients=gradients, frame=frame
    )


def _of_vectors(smallest: Smallest, vectors: Float, jacobian: Rows, words: str) -> Evaluation:
    """Return the evaluation of deviations (m, d) with their weights in the value."""
    lengths = np.linalg.norm(vectors, axis=1)
    held = np.flatnonzero(smallest.shares > 1e-9)
    first = vectors[held[np.argmax(lengths[held])]]
    along = vectors[held] @ first
    if np.all(np.abs(along) >= (1.0 - 1e-6) * lengths[held] * np.linalg.norm(first)):
        # All contacts are on one line: their sum is a vector that may cross zero.
        shares = 2.0 * smallest.shares[held] * np.where(along < 0.0, -1.0, 1.0)
        components = shares @ vectors[held]
        return vector_evaluation(components, shares @ jacobian[held], words)
    units = vectors[held] / np.maximum(lengths[held], 1e-300)[:, None]
    gradient = 2.0 * smallest.shares[held] @ jacobian[held].along(units)
    return Evaluation(2.0 * smallest.value, gradient, frame=words)


def _searched(
    frame: ZoneFrame,
    world: Float,
    deviations: Callable[[ZoneFrame], tuple[Float, Float]],
    search: Callable[[Callable[[Float], tuple[Float, Float]], int], Smallest],
) -> tuple[ZoneFrame, Smallest]:
    """Return the frame with the smallest zone of points (n, 3), mm, world, and its search.

    ``deviations`` are those in a frame, with their derivatives by its motion.
    """
    places = frame.T_frame_from_world.apply(world)
    moves = np.array([np.hstack([-skew(x), np.eye(3)]) @ frame.motions for x in places])
    # The largest displacement of the points, mm, by every free motion.
    scale = np.maximum(np.linalg.norm(moves, axis=1).max(axis=0), 1e-9)
    for _ in range(_OUTER_STEPS):
        start = frame

        def moved(motion: Float, start: ZoneFrame = start) -> tuple[Float, Float]:
            at = start.moved(motion / scale)
            values, twists = deviations(at)
            return values, twists @ (at.motions / scale)

        smallest = search(moved, len(scale))
        frame = start.moved(smallest.motion / scale)
        if not len(scale) or float(np.abs(smallest.motion).max()) < _SETTLED:
            break
    return frame, smallest


def _outwards(surface: Surface) -> float:
    """Return 1 if the distance grows away from the material, else -1."""
    if not surface.shape.spec.is_curved:
        return 1.0
    return 1.0 if surface.measured.feature.nominal.side == "outer" else -1.0
