"""World frame after a relocation, and its effect on the covariance.

Anchors (touched seats, or points fixed to the cameras) define the free world; their uncertainty
makes it, and the cameras in it, uncertain (S-transformation, Baarda 1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.bundle import BundleState
from ocmm_core.calibration.relocation._data import KeptByCameras, SetByPoints, WorldFrame
from ocmm_core.camera import CameraModel
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, RigidTransform, rigid_fit, skew, unit

LEAST_ANCHORS = 3

_MIN_TRIANGLE_MM = 20.0
"""Three points closer to one line leave the rotation about it undetermined."""

_THREE_TWO_ONE = [0, 1, 2, 4, 5, 8]
"""x, y and z of the first point, y and z of the second, z of the third."""


@dataclass(frozen=True, slots=True)
class Anchors:
    """Points that define the world."""

    points: Points3
    """(m, 3), mm, in the state."""
    follow: Float
    """(3 m, k): derivatives by the common unknowns."""
    targets: Points3
    """(m, 3), mm, nominal."""
    held: Float | None
    """(h, 3 m): sums of coordinates moved onto their targets; None for the best fit of all."""
    sigma: float
    """mm per axis: standard uncertainty of the targets."""


def check_world(world: WorldFrame, seats: Sequence[str]) -> None:
    """Raise CalibrationError if a seat is unknown, or there are fewer than three."""
    if isinstance(world, KeptByCameras):
        return
    if isinstance(world, SetByPoints):
        names = [world.origin, world.on_x, world.in_xy]
    else:
        names = list(world.positions_world)
    unknown = [name for name in names if name not in seats]
    if unknown:
        raise CalibrationError(
            "relocation.unknown_seat",
            f"The world frame depends on '{unknown[0]}', which was not touched.",
            f"Touch it, or choose from {', '.join(seats) or 'seats that were touched'}.",
        )
    if len(set(names)) < LEAST_ANCHORS:
        raise CalibrationError(
            "relocation.few_seats",
            f"The world frame depends on {len(set(names))} point(s).",
            "Touch three points that do not lie on one line.",
        )


def motion_to_world(
    world: WorldFrame, seats: Sequence[str], state: BundleState, start: Sequence[CameraModel]
) -> RigidTransform:
    """Return the motion to the chosen world; CalibrationError if its points lie on one line."""
    if isinstance(world, SetByPoints):
        origin, on_x, in_xy = _seats(state, seats, (world.origin, world.on_x, world.in_xy))
        _check_triangle(np.stack([origin, on_x, in_xy]))
        x = unit(on_x - origin)
        z = unit(np.cross(x, in_xy - origin))
        rotation = np.stack([x, np.cross(z, x), z])
        return RigidTransform(rotation, -rotation @ origin)
    anchors = anchors_of(world, seats, state, start)
    _check_triangle(anchors.points)
    return RigidTransform(*rigid_fit(anchors.points, anchors.targets))


def anchors_of(
    world: WorldFrame, seats: Sequence[str], state: BundleState, start: Sequence[CameraModel]
) -> Anchors:
    """Return the anchors; for a world set by points, already in that world."""
    if isinstance(world, KeptByCameras):
        return _camera_anchors(state, start)
    if isinstance(world, SetByPoints):
        names: tuple[str, ...] = (world.origin, world.on_x, world.in_xy)
        points = _seats(state, seats, names)
        held = np.eye(9)[_THREE_TWO_ONE]
        return Anchors(points, _seat_rows(state, seats, names), points, held, 0.0)
    names = tuple(world.positions_world)
    targets = np.array([world.positions_world[name] for name in names])
    rows = _seat_rows(state, seats, names)
    return Anchors(_seats(state, seats, names), rows, targets, None, world.sigma)


def jacobian_of_world(state: BundleState, anchors: Anchors) -> tuple[Float, Float]:
    """Return the derivatives of the common unknowns in the anchored world.

    By the unknowns in any world that differs by a small motion, (k, k), and by anchors per sigma.
    """
    motions = state.world_motions()
    carried = np.vstack([np.hstack([-skew(point), np.eye(3)]) for point in anchors.points])
    held = carried.T if anchors.held is None else anchors.held
    answer = motions @ np.linalg.solve(held @ carried, held)
    return np.eye(len(motions)) - answer @ anchors.follow, anchors.sigma * answer


def _camera_anchors(state: BundleState, start: Sequence[CameraModel]) -> Anchors:
    """Return four points a camera, one object distance apart, to weight rotation and shift."""
    columns = state.columns
    centre = np.mean(state.origins, axis=0)
    points, targets, follow = [], [], []
    for index, (now, before) in enumerate(zip(state.cameras, start, strict=True)):
        pose = now.T_camera_from_world
        reach = float(np.linalg.norm(pose.apply(centre)))
        fixed = reach * np.vstack([np.zeros(3), np.eye(3)])
        points.append(pose.inverse().apply(fixed))
        targets.append(before.T_camera_from_world.inverse().apply(fixed))
        for point in fixed:
            rows = np.zeros((3, columns.count))
            part = rows[:, columns.camera(index)]
            part[:, 0:3] = pose.rotation.T @ skew(point - pose.translation)
            part[:, 3:6] = -pose.rotation.T
            follow.append(rows)
    return Anchors(np.vstack(points), np.vstack(follow), np.vstack(targets), None, 0.0)


def _seats(state: BundleState, seats: Sequence[str], names: Sequence[str]) -> Points3:
    return state.seats[[seats.index(name) for name in names]]


def _seat_rows(state: BundleState, seats: Sequence[str], names: Sequence[str]) -> Float:
    columns = state.columns
    rows = np.zeros((3 * len(names), columns.count))
    for row, name in enumerate(names):
        first = columns.of_seats.start + 3 * seats.index(name)
        rows[3 * row : 3 * row + 3, first : first + 3] = np.eye(3)
    return rows


def _check_triangle(points: Points3) -> None:
    width = np.linalg.svd(points - points.mean(axis=0))[1][1]
    if width < _MIN_TRIANGLE_MM:
        raise CalibrationError(
            "relocation.points_on_line",
            f"The points that define the world frame lie within {width:.1f} mm of one line.",
            "Touch three points that form a wide triangle.",
        )
