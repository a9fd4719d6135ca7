"""Wire shapes of the 3-D view (mm, world frame), and view directions of a rig."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from ocmm_core.camera import CameraModel, Rig
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_gui.scene import Orbit

_TURN = 48


def polyline(points: Float, *, closed: bool = False) -> Float:
    """Return the segments (n, 2, 3) between consecutive points (m, 3)."""
    segments = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    return segments if closed else segments[:-1]


def ring(centre: Float, normal: Float, radius: float) -> Float:
    """Return the corners (48, 3) of a circle."""
    first, second = perpendicular_pair(normal)
    angle = np.linspace(0.0, 2.0 * np.pi, _TURN, endpoint=False)[:, None]
    corners: Float = centre + radius * (np.cos(angle) * first + np.sin(angle) * second)
    return corners


def sphere(centre: Float, radius: float) -> Float:
    """Return a ball as three great circles and two parallels, segments (n, 2, 3)."""
    segments: Float = centre + radius * _unit_sphere()
    return segments


@cache
def _unit_sphere() -> Float:
    centre, up = np.zeros(3), np.eye(3)[2]
    circles = [ring(centre, axis, 1.0) for axis in np.eye(3)]
    circles += [ring(sign * np.sin(np.pi / 4.0) * up, up, np.cos(np.pi / 4.0)) for sign in (-1, 1)]
    return np.concatenate([polyline(corners, closed=True) for corners in circles])


def camera_pyramid(camera: CameraModel, depth: float) -> Float:
    """Return the camera's view as a pyramid of a given depth, segments (8, 2, 3)."""
    u = np.array([0.0, camera.width, camera.width, 0.0]) - camera.u0
    v = np.array([0.0, 0.0, camera.height, camera.height]) - camera.v0
    rays = np.stack(
        [u / camera.sx / camera.focal, v / camera.sy / camera.focal, np.ones(4)], axis=1
    )
    to_world = camera.T_camera_from_world.inverse()
    corners = to_world.apply(depth * rays)
    apex = np.broadcast_to(to_world.translation, corners.shape)
    return np.concatenate([np.stack([apex, corners], axis=1), polyline(corners, closed=True)])


def box(corners: Float) -> Float:
    """Return the twelve edges (12, 2, 3) of a box between two corners (2, 3)."""
    edges = []
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        for first in (0, 1):
            for second in (0, 1):
                edge = np.empty((2, 3))
                edge[:, axis] = corners[:, axis]
                edge[:, others[0]] = corners[first, others[0]]
                edge[:, others[1]] = corners[second, others[1]]
                edges.append(edge)
    return np.stack(edges)


def fitted_shape(fit: Fit, surface: Float) -> tuple[Float, Float]:
    """Return a fitted feature as segments (n, 2, 3) and the corners (m, 3) of a face.

    Compensated points ``surface`` (n, 3) bound lines, planes, cylinders. Either may be empty.
    """
    return DRAWN[fit.shape](fit, surface)


_NOTHING = np.empty((0, 3))


def _point(fit: Fit, surface: Float) -> tuple[Float, Float]:
    return np.empty((0, 2, 3)), _NOTHING


def _line(fit: Fit, surface: Float) -> tuple[Float, Float]:
    along = (surface - fit.point) @ fit.direction
    return (fit.point + np.outer(_stretched(along), fit.direction))[None], _NOTHING


def _circle(fit: Fit, surface: Float) -> tuple[Float, Float]:
    corners = ring(fit.point, fit.direction, fit.radius)
    return polyline(corners, closed=True), corners


def _sphere(fit: Fit, surface: Float) -> tuple[Float, Float]:
    return sphere(fit.point, fit.radius), _NOTHING


def _tube(fit: Fit, surface: Float) -> tuple[Float, Float]:
    """Return a cylinder or cone as both its ends, its sides and its axis."""
    along = (surface - fit.point) @ fit.direction
    ends = fit.point + np.outer(_stretched(along), fit.direction)
    # The radius of a cone grows along its direction; that of a cylinder is constant.
    growth = np.tan(fit.half_angle) * _stretched(along)
    rings = [
        ring(end, fit.direction, max(fit.radius + float(more), 0.0))
        for end, more in zip(ends, growth, strict=True)
    ]
    sides = np.stack(rings, axis=1)[:: _TURN // 12]
    hoops = [polyline(corners, closed=True) for corners in rings]
    return np.concatenate([*hoops, sides, ends[None]]), _NOTHING


def _angles() -> Float:
    angles: Float = np.linspace(0.0, 2.0 * np.pi, _TURN, endpoint=False)
    return angles


def _ellipse(fit: Fit, surface: Float) -> tuple[Float, Float]:
    angle = _angles()
    return _outline(fit, np.stack([fit.radius * np.cos(angle), fit.second * np.sin(angle)], axis=1))


def _round_slot(fit: Fit, surface: Float) -> tuple[Float, Float]:
    angle, half, wide = _angles(), fit.radius, fit.second
    middle = np.where(np.cos(angle) >= 0.0, half - wide, wide - half)
    return _outline(fit, np.stack([middle + wide * np.cos(angle), wide * np.sin(angle)], axis=1))


def _rectangle(fit: Fit, surface: Float) -> tuple[Float, Float]:
    half, wide = fit.radius, fit.second
    return _outline(fit, np.array([[half, wide], [-half, wide], [-half, -wide], [half, -wide]]))


def _outline(fit: Fit, flat: Float) -> tuple[Float, Float]:
    """Return an ellipse, slot or rectangle by its corners (n, 2) in its plane."""
    corners = fit.point + flat @ np.stack([fit.across, np.cross(fit.direction, fit.across)])
    return polyline(corners, closed=True), corners


def _torus(fit: Fit, surface: Float) -> tuple[Float, Float]:
    """Return a torus as largest, smallest and highest circles and eight of its tube."""
    lift = fit.second * fit.direction
    circles = [
        ring(fit.point, fit.direction, fit.radius + fit.second),
        ring(fit.point, fit.direction, max(fit.radius - fit.second, 0.0)),
        ring(fit.point + lift, fit.direction, fit.radius),
        ring(fit.point - lift, fit.direction, fit.radius),
    ]
    for middle in ring(fit.point, fit.direction, fit.radius)[:: _TURN // 8]:
        outward = (middle - fit.point) / max(fit.radius, 1e-9)
        circles.append(ring(middle, np.cross(fit.direction, outward), fit.second))
    return np.concatenate([polyline(corners, closed=True) for corners in circles]), _NOTHING


def _plane(fit: Fit, surface: Float) -> tuple[Float, Float]:
    first, second = perpendicular_pair(fit.direction)
    flat = (surface - fit.point) @ np.stack([first, second], axis=1)
    # The rectangle follows the principal spread of the points.
    _, _, turn = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=True)
    spread = flat @ turn.T
    (low_x, high_x), (low_y, high_y) = (_stretched(spread[:, i]) for i in (0, 1))
    corners_flat = np.array([[low_x, low_y], [high_x, low_y], [high_x, high_y], [low_x, high_y]])
    corners = fit.point + corners_flat @ turn @ np.stack([first, second])
    return polyline(corners, closed=True), corners


def _stretched(values: Float) -> Float:
    low, high = float(values.min()), float(values.max())
    more = max(0.12 * (high - low), 1.5)
    return np.array([low - more, high + more])


DRAWN: dict[Shape, Callable[[Fit, Float], tuple[Float, Float]]] = {
    Shape.POINT: _point,
    Shape.LINE: _line,
    Shape.PLANE: _plane,
    Shape.CIRCLE: _circle,
    Shape.SPHERE: _sphere,
    Shape.CYLINDER: _tube,
    Shape.ELLIPSE: _ellipse,
    Shape.ROUND_SLOT: _round_slot,
    Shape.SQUARE_SLOT: _rectangle,
    Shape.RECTANGLE: _rectangle,
    Shape.CONE: _tube,
    Shape.TORUS: _torus,
}
"""Drawing function per shape, see `fitted_shape`."""


def upright(rig: Rig) -> Float:
    """Return the upright world axis: opposite to the sensors' columns, (3,), unit."""
    columns = np.mean([camera.T_camera_from_world.rotation[1] for camera in rig.cameras], axis=0)
    axis = int(np.argmax(np.abs(columns)))
    up: Float = -np.sign(columns[axis]) * np.eye(3)[axis]
    return up


def seen_from(rig: Rig, up: Float) -> Orbit:
    """Return a view from the cameras' side, turned and raised to show depth."""
    start = Orbit(np.zeros(3), 0.0, 0.0, 200.0, up)
    centre = rig.volume_world.mean(axis=0)
    seat = np.mean([camera.centre_world for camera in rig.cameras], axis=0) - centre
    right, _, outward = start.axes()
    azimuth = float(np.arctan2(seat @ right, seat @ outward))
    return start.turned(azimuth + np.radians(25.0), np.radians(25.0))


def mean_distance(rig: Rig) -> float:
    """Return the mean distance of the cameras from the middle of the volume, mm."""
    centre = rig.volume_world.mean(axis=0)
    return float(np.mean([np.linalg.norm(c.centre_world - centre) for c in rig.cameras]))
