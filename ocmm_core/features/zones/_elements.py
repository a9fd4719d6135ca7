"""Conversion between fits and zone elements with their geometry vectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.search import centred
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    GEOMETRY_SIZE,
    HALF_ANGLE,
    POINT,
    RADIUS,
    SECOND,
    Criterion,
    Fit,
    Shape,
    shapes_where,
)
from ocmm_core.features.zones._steps import FIRST_SIZE, SECOND_SIZE, STEP_SIZE, TURN, Values
from ocmm_core.features.zones._surfaces import (
    CONE,
    CYLINDER,
    ELLIPSE,
    FLAT_CIRCLE,
    FLAT_LINE,
    PLANE,
    RECTANGLE,
    ROUND_SLOT,
    SPHERE,
    TINY,
    TORUS,
    DistanceKind,
    ElementFamily,
    ElementPose,
    circumscribed,
    inscribed,
)
from ocmm_core.geometry import Float, Points3, perpendicular_pair

ZONES = {
    Shape.LINE: circumscribed(CYLINDER),
    Shape.PLANE: PLANE,
    Shape.CIRCLE: FLAT_CIRCLE,
    Shape.SPHERE: SPHERE,
    Shape.CYLINDER: CYLINDER,
    Shape.CONE: CONE,
    Shape.TORUS: TORUS,
    Shape.ELLIPSE: ELLIPSE,
    Shape.ROUND_SLOT: ROUND_SLOT,
    Shape.SQUARE_SLOT: RECTANGLE,
    Shape.RECTANGLE: RECTANGLE,
}
"""Families of minimum zones. The zone of a line in space is a cylinder about it."""

CIRCLE_IN_SPACE = circumscribed(TORUS)
"""A tube about the circle, including its plane."""

BOUNDED = {
    (shape, criterion): side(ZONES[shape])
    for shape in shapes_where(lambda spec: Criterion.INSCRIBED in spec.criteria)
    for criterion, side in (
        (Criterion.INSCRIBED, inscribed),
        (Criterion.CIRCUMSCRIBED, circumscribed),
    )
}
"""Inscribed and circumscribed elements."""

LENGTHS = [*range(POINT.start, POINT.stop), RADIUS, SECOND]
"""Entries of the geometry vector in mm; the others have no unit."""


@dataclass(frozen=True, slots=True)
class ZoneTask:
    """Points and a start, centred and scaled, of one zone."""

    shape: Shape
    surface: ElementFamily
    points: Float
    """(n, 3), about their centroid, divided by ``size``."""
    start: ElementPose
    centroid: Float
    size: float
    """`centroid`: (3,), mm; `size`: mm."""

    @property
    def tube(self) -> bool:
        """Return whether the zone is a tube about a curve in space, without sides."""
        ring = self.surface.kind is DistanceKind.RING
        return not self.surface.lower and (self.shape is Shape.LINE or ring)

    @property
    def noise(self) -> float:
        """Return the rounding of a distance from coordinate rounding; scaled."""
        return 4e-16 * (4.0 + float(np.abs(self.centroid).max()) / self.size)


def zone_surface(fit: Fit) -> ElementFamily | None:
    """Return the family of the minimum zone of a fit, or None."""
    if fit.shape is Shape.LINE and fit.across.any():
        return FLAT_LINE
    return CIRCLE_IN_SPACE if fit.free else ZONES.get(fit.shape)


def task_of(fit: Fit, points: Points3, surface: ElementFamily, offset: float = 0.0) -> ZoneTask:
    """Return the task from ``fit`` to points (n, 3), mm, of an ellipse ``offset``, mm, outside."""
    centroid, about, size = centred(fit.shape, points)
    across, z = fit.across, fit.direction
    if not z.any():
        frame = np.eye(3)
    elif surface.free == FLAT_LINE.free:
        # The line runs along x, distances are along z, y is the plane's normal.
        frame = np.stack([z, np.cross(across, z), across], axis=1)
    elif surface.outline:
        frame = np.stack([across, np.cross(z, across), z], axis=1)
    else:
        frame = np.stack([*perpendicular_pair(z), z], axis=1)
    sizes = np.zeros(3)
    if fit.shape is Shape.CONE:
        sizes[0] = fit.half_angle
    elif surface.kind is DistanceKind.RING:
        sizes[0] = fit.radius / size
    elif surface.outline:
        sizes[:] = fit.radius / size, fit.second / size, offset / size
    start = ElementPose(frame, (fit.point - centroid) / size, sizes)
    return ZoneTask(fit.shape, surface, about, start, centroid, size)


def geometry_of(
    task: ZoneTask, placed: ElementPose, step: Values, offset: complex, centroid: Values
) -> Values:
    """Return the geometry vector (12,), scaled, of an element after a step (8,).

    ``offset`` is the element's reference distance: a radius, the height of a plane, the tube of a
    torus. The foot of the ``centroid`` (3,) is the point of line, plane, cylinder and cone.
    """
    lean = np.array([step[3], step[4], 1.0])
    axis = placed.frame @ (lean / np.sqrt(lean @ lean))
    arm = placed.origin + placed.frame @ step[:3] - centroid
    foot = arm - axis * (arm @ axis)
    geometry = np.zeros(GEOMETRY_SIZE, dtype=np.result_type(axis, step, offset, centroid))
    geometry[DIRECTION] = axis
    size = placed.sizes[0] + step[FIRST_SIZE]
    if task.surface.free == FLAT_LINE.free:
        forward = np.array([1.0, 0.0, -step[3]])
        geometry[POINT] = centroid + axis * (arm @ axis + offset)
        geometry[DIRECTION] = placed.frame @ (forward / np.sqrt(forward @ forward))
        geometry[ACROSS] = axis
        return geometry
    if task.surface.outline:
        ahead = np.array([np.cos(step[TURN]), np.sin(step[TURN]), 0.0])
        geometry[POINT], geometry[ACROSS] = centroid + foot, placed.frame @ ahead
        geometry[RADIUS], geometry[SECOND] = size, placed.sizes[1] + step[SECOND_SIZE]
        return geometry
    match task.shape:
        case Shape.CIRCLE if task.tube:
            geometry[POINT], geometry[RADIUS] = centroid + arm, size
        case Shape.PLANE:
            geometry[POINT] = centroid + axis * (arm @ axis + offset)
        case Shape.SPHERE:
            geometry[POINT] = centroid + arm
            geometry[DIRECTION] = 0.0
            geometry[RADIUS] = offset
        case Shape.TORUS:
            geometry[POINT] = centroid + arm
            geometry[RADIUS], geometry[SECOND] = size, offset
        case Shape.CONE:
            geometry[POINT] = centroid + foot
            geometry[RADIUS] = (offset - (arm @ axis) * np.sin(size)) / np.cos(size)
            geometry[HALF_ANGLE] = size
        case Shape.LINE:
            geometry[POINT] = centroid + foot
        case Shape.CIRCLE | Shape.CYLINDER:
            geometry[POINT] = centroid + foot
            geometry[RADIUS] = offset
        case _:
            raise TypeError(task.shape)
    return geometry


def geometry_derivatives(
    task: ZoneTask, placed: ElementPose, offset: float
) -> tuple[Float, Float, Float, Float]:
    """Return geometry (12,), derivatives by step (., 8), offset (.,), centroid (., 3)."""
    none, middle = np.zeros(STEP_SIZE), np.zeros(3)
    geometry = np.asarray(geometry_of(task, placed, none, offset, middle).real)
    by_step, by_centroid = np.zeros((GEOMETRY_SIZE, STEP_SIZE)), np.zeros((GEOMETRY_SIZE, 3))
    for j in range(STEP_SIZE):
        nudge = 1j * TINY * np.eye(STEP_SIZE)[j]
        by_step[:, j] = geometry_of(task, placed, nudge, offset, middle).imag / TINY
    for j in range(3):
        nudge = 1j * TINY * np.eye(3)[j]
        by_centroid[:, j] = geometry_of(task, placed, none, offset, nudge).imag / TINY
    by_offset = geometry_of(task, placed, none, offset + 1j * TINY, middle).imag / TINY
    return geometry, by_step, np.asarray(by_offset), by_centroid


def unscaled(task: ZoneTask, geometry: Float, by_points: Float) -> tuple[Float, Float]:
    """Return geometry (12,) in mm and its derivatives (12, 3 n) by points in mm."""
    in_mm = geometry.copy()
    in_mm[LENGTHS] *= task.size
    in_mm[POINT] += task.centroid
    by_mm = by_points / task.size
    by_mm[LENGTHS] *= task.size
    return in_mm, by_mm
