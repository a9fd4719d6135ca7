"""Conversion between fits and zone elements with their geometry vectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features import shapes
from ocmm_core.features.search import centred
from ocmm_core.features.zones import _surfaces as surfaces
from ocmm_core.features.zones._distance_kernel import (
    FIRST_SIZE,
    SECOND_SIZE,
    STEP_SIZE,
    TURN,
    Values,
)
from ocmm_core.geometry import Float, Points3, perpendicular_pair

ZONES = {
    shapes.Shape.LINE: surfaces.circumscribed(surfaces.CYLINDER),
    shapes.Shape.PLANE: surfaces.PLANE,
    shapes.Shape.CIRCLE: surfaces.FLAT_CIRCLE,
    shapes.Shape.SPHERE: surfaces.SPHERE,
    shapes.Shape.CYLINDER: surfaces.CYLINDER,
    shapes.Shape.CONE: surfaces.CONE,
    shapes.Shape.TORUS: surfaces.TORUS,
    shapes.Shape.ELLIPSE: surfaces.ELLIPSE,
    shapes.Shape.ROUND_SLOT: surfaces.ROUND_SLOT,
    shapes.Shape.SQUARE_SLOT: surfaces.RECTANGLE,
    shapes.Shape.RECTANGLE: surfaces.RECTANGLE,
}
"""Families of minimum zones. The zone of a line in space is a cylinder about it."""

CIRCLE_IN_SPACE = surfaces.circumscribed(surfaces.TORUS)
"""A tube about the circle, including its plane."""

BOUNDED = {
    (shape, criterion): side(ZONES[shape])
    for shape in shapes.shapes_where(lambda spec: shapes.Criterion.INSCRIBED in spec.criteria)
    for criterion, side in (
        (shapes.Criterion.INSCRIBED, surfaces.inscribed),
        (shapes.Criterion.CIRCUMSCRIBED, surfaces.circumscribed),
    )
}
"""Inscribed and circumscribed elements."""

LENGTHS = [*range(shapes.POINT.start, shapes.POINT.stop), shapes.RADIUS, shapes.SECOND]
"""Entries of the geometry vector in mm; the others have no unit."""


@dataclass(frozen=True, slots=True)
class ZoneTask:
    """Points and a start, centred and scaled, of one zone."""

    shape: shapes.Shape
    surface: surfaces.ElementFamily
    points: Float
    """(n, 3), about their centroid, divided by ``size``."""
    start: surfaces.ElementPose
    centroid: Float
    size: float
    """`centroid`: (3,), mm; `size`: mm."""

    @property
    def tube(self) -> bool:
        """Return whether the zone is a tube about a curve in space, without sides."""
        ring = self.surface.kind is surfaces.DistanceKind.RING
        return not self.surface.lower and (self.shape is shapes.Shape.LINE or ring)

    @property
    def noise(self) -> float:
        """Return the rounding of a distance from coordinate rounding; scaled."""
        return 4e-16 * (4.0 + float(np.abs(self.centroid).max()) / self.size)


def zone_surface(fit: shapes.Fit) -> surfaces.ElementFamily | None:
    """Return the family of the minimum zone of a fit, or None."""
    if fit.shape is shapes.Shape.LINE and fit.across.any():
        return surfaces.FLAT_LINE
    return CIRCLE_IN_SPACE if fit.free else ZONES.get(fit.shape)


def task_of(
    fit: shapes.Fit, points: Points3, surface: surfaces.ElementFamily, offset: float = 0.0
) -> ZoneTask:
    """Return the task from ``fit`` to points (n, 3), mm, of an ellipse ``offset``, mm, outside."""
    centroid, about, size = centred(fit.shape, points)
    across, z = fit.across, fit.direction
    if not z.any():
        frame = np.eye(3)
    elif surface.free == surfaces.FLAT_LINE.free:
        # The line runs along x, distances are along z, y is the plane's normal.
        frame = np.stack([z, np.cross(across, z), across], axis=1)
    elif surface.outline:
        frame = np.stack([across, np.cross(z, across), z], axis=1)
    else:
        frame = np.stack([*perpendicular_pair(z), z], axis=1)
    sizes = np.zeros(3)
    if fit.shape is shapes.Shape.CONE:
        sizes[0] = fit.half_angle
    elif surface.kind is surfaces.DistanceKind.RING:
        sizes[0] = fit.radius / size
    elif surface.outline:
        sizes[:] = fit.radius / size, fit.second / size, offset / size
    start = surfaces.ElementPose(frame, (fit.point - centroid) / size, sizes)
    return ZoneTask(fit.shape, surface, about, start, centroid, size)


def geometry_of(
    task: ZoneTask, placed: surfaces.ElementPose, step: Values, offset: complex, centroid: Values
) -> Values:
    """Return the geometry vector (12,), scaled, of an element after a step (8,).

    ``offset`` is the element's reference distance: a radius, the height of a plane, the tube of a
    torus. The foot of the ``centroid`` (3,) is the point of line, plane, cylinder and cone.
    """
    lean = np.array([step[3], step[4], 1.0])
    axis = placed.frame @ (lean / np.sqrt(lean @ lean))
    arm = placed.origin + placed.frame @ step[:3] - centroid
    foot = arm - axis * (arm @ axis)
    geometry = np.zeros(shapes.GEOMETRY_SIZE, dtype=np.result_type(axis, step, offset, centroid))
    geometry[shapes.DIRECTION] = axis
    size = placed.sizes[0] + step[FIRST_SIZE]
    if task.surface.free == surfaces.FLAT_LINE.free:
        forward = np.array([1.0, 0.0, -step[3]])
        geometry[shapes.POINT] = centroid + axis * (arm @ axis + offset)
        geometry[shapes.DIRECTION] = placed.frame @ (forward / np.sqrt(forward @ forward))
        geometry[shapes.ACROSS] = axis
        return geometry
    if task.surface.outline:
        ahead = np.array([np.cos(step[TURN]), np.sin(step[TURN]), 0.0])
        geometry[shapes.POINT], geometry[shapes.ACROSS] = centroid + foot, placed.frame @ ahead
        geometry[shapes.RADIUS], geometry[shapes.SECOND] = size, placed.sizes[1] + step[SECOND_SIZE]
        return geometry
    match task.shape:
        case shapes.Shape.CIRCLE if task.tube:
            geometry[shapes.POINT], geometry[shapes.RADIUS] = centroid + arm, size
        case shapes.Shape.PLANE:
            geometry[shapes.POINT] = centroid + axis * (arm @ axis + offset)
        case shapes.Shape.SPHERE:
            geometry[shapes.POINT] = centroid + arm
            geometry[shapes.DIRECTION] = 0.0
            geometry[shapes.RADIUS] = offset
        case shapes.Shape.TORUS:
            geometry[shapes.POINT] = centroid + arm
            geometry[shapes.RADIUS], geometry[shapes.SECOND] = size, offset
        case shapes.Shape.CONE:
            geometry[shapes.POINT] = centroid + foot
            geometry[shapes.RADIUS] = (offset - (arm @ axis) * np.sin(size)) / np.cos(size)
            geometry[shapes.HALF_ANGLE] = size
        case shapes.Shape.LINE:
            geometry[shapes.POINT] = centroid + foot
        case shapes.Shape.CIRCLE | shapes.Shape.CYLINDER:
            geometry[shapes.POINT] = centroid + foot
            geometry[shapes.RADIUS] = offset
        case _:
            raise TypeError(task.shape)
    return geometry


def geometry_derivatives(
    task: ZoneTask, placed: surfaces.ElementPose, offset: float
) -> tuple[Float, Float, Float, Float]:
    """Return geometry (12,), derivatives by step (., 8), offset (.,), centroid (., 3)."""
    none, middle = np.zeros(STEP_SIZE), np.zeros(3)
    geometry = np.asarray(geometry_of(task, placed, none, offset, middle).real)
    by_step, by_centroid = (
        np.zeros((shapes.GEOMETRY_SIZE, STEP_SIZE)),
        np.zeros((shapes.GEOMETRY_SIZE, 3)),
    )
    for j in range(STEP_SIZE):
        nudge = 1j * surfaces.TINY * np.eye(STEP_SIZE)[j]
        by_step[:, j] = geometry_of(task, placed, nudge, offset, middle).imag / surfaces.TINY
    for j in range(3):
        nudge = 1j * surfaces.TINY * np.eye(3)[j]
        by_centroid[:, j] = geometry_of(task, placed, none, offset, nudge).imag / surfaces.TINY
    by_offset = (
        geometry_of(task, placed, none, offset + 1j * surfaces.TINY, middle).imag / surfaces.TINY
    )
    return geometry, by_step, np.asarray(by_offset), by_centroid


def unscaled(task: ZoneTask, geometry: Float, by_points: Float) -> tuple[Float, Float]:
    """Return geometry (12,) in mm and its derivatives (12, 3 n) by points in mm."""
    in_mm = geometry.copy()
    in_mm[LENGTHS] *= task.size
    in_mm[shapes.POINT] += task.centroid
    by_mm = by_points / task.size
    by_mm[LENGTHS] *= task.size
    return in_mm, by_mm
