"""Best fit of measured points to their nominal places, free or with locked motions.

All points enter through the triangular factor of their homogeneous coordinates (4 x 4), which
preserves the sum of squares up to a constant: the iteration always works on four points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ocmm_core.alignment._rules import BestFit, LockedMotion, Relocation
from ocmm_core.errors import FitError
from ocmm_core.features.shapes import GEOMETRY_SIZE, POINT
from ocmm_core.geometry import Float, Points3, RigidTransform, rotation_from_vector, skew

MIN_TRIANGLE_MM = 5.0
"""Points closer to one line leave the rotation about it to noise."""

LEAST_HOLD = 1e-3
"""Least distance of the points from the axis of a free rotation, relative to their extent."""

MOTIONS: tuple[LockedMotion, ...] = ("rx", "ry", "rz", "x", "y", "z")
"""Motions of the part frame in the order of (6,): rotations, rad, then shifts, mm."""
_MOST_STEPS = 100
_CONVERGED = 1e-13
"""Step of a rotation, rad, and of a shift relative to the size of the point set."""


def best_fit(
    rule: BestFit,
    geometries: Mapping[str, Float],
    nominals: Mapping[str, Float],
    start: RigidTransform | None,
) -> RigidTransform:
    """Return the motion from world to part frame that fits centres to nominals.

    `rule`: points, weights, and motions fixed by ``start``. `geometries`, `nominals`: geometry
    vectors (12,), mm, world and part frame, by name. `start`: ``T_part_from_world`` of the
    preceding alignment. FitError: a nominal is missing, or the points leave a motion free.
    """
    missing = [name for name in rule.points if name not in nominals]
    if missing:
        raise FitError(
            "alignment.no_nominal",
            f"The best fit needs the nominal position of {missing[0]}, which is unknown.",
            f"Give {missing[0]} a nominal, or exclude it from the best fit.",
        )
    measured, wanted = _places(rule.points, geometries), _places(rule.points, nominals)
    weights = np.array(rule.weights) if rule.weights else np.ones(len(wanted))
    if start is None:
        return fit_points(measured, wanted, weights)
    return fit_points_locked(measured, wanted, weights, start, rule.locked)


def relocated(rule: Relocation, geometries: Mapping[str, Float]) -> RigidTransform:
    """Return the motion to the previous frame by control points; FitError: collinear, too far."""
    measured = np.array([geometries[item.feature][POINT] for item in rule.control])
    wanted = np.array([item.place for item in rule.control])
    T_frame_from_world = fit_points(measured, wanted, np.ones(len(wanted)))
    off = np.linalg.norm(T_frame_from_world.apply(measured) - wanted, axis=1)
    worst = int(np.argmax(off))
    if off[worst] > rule.limit:
        raise FitError(
            "alignment.relocation",
            f"After the best fit of the control points, {rule.control[worst].feature} is "
            f"{off[worst]:.3f} mm off; the limit is {rule.limit:.3f} mm.",
            "Re-probe the control points. If it persists, one of them has moved on the part.",
        )
    return T_frame_from_world


def fit_points(measured: Points3, wanted: Points3, weights: Float) -> RigidTransform:
    """Return the rigid motion of closest points, in closed form.

    Weighted orthogonal Procrustes with the determinant (S. Umeyama, IEEE PAMI 13, 1991).
    `measured`, `wanted`: (n, 3), mm, in two frames. `weights`: (n,), positive, of the squared
    distances. FitError: collinear points.
    """
    shares = weights / weights.sum()
    a, b = shares @ measured, shares @ wanted
    _check_spread(wanted - b)
    u, _, vt = np.linalg.svd((wanted - b).T @ (shares[:, None] * (measured - a)))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * sign) @ vt
    return RigidTransform(rotation, b - rotation @ a)


def fit_points_locked(
    measured: Points3,
    wanted: Points3,
    weights: Float,
    start: RigidTransform,
    locked: Sequence[LockedMotion],
) -> RigidTransform:
    """Return the best fit that differs from ``start`` by motions that are not locked.

    The difference is a rotation vector and a shift of the origin, both in the part frame, with
    locked entries zero. Gauss-Newton from ``start``. FitError: a motion is free, or no convergence.
    """
    free = [index for index, name in enumerate(MOTIONS) if name not in locked]
    if len(free) == len(MOTIONS):
        return fit_points(measured, wanted, weights)
    if not free:
        return start
    centre = wanted.mean(axis=0)
    size = max(float(np.sqrt(np.mean(np.sum((wanted - centre) ** 2, axis=1)))), 1.0)
    root = np.sqrt(weights / weights.sum())[:, None]
    before = start.apply(measured)
    orthogonal, factor = np.linalg.qr(root * np.hstack([before, np.ones((len(before), 1))]))
    points, ones = factor[:, :3], factor[:, 3]
    targets = orthogonal.T @ (root * wanted)

    motion = np.zeros(6)
    scale = np.array([1.0 / size] * 3 + [1.0] * 3)[free]
    least = np.inf
    for step_number in range(_MOST_STEPS):
        turned = points @ rotation_from_vector(motion[:3]).T
        off = (turned + np.outer(ones, motion[3:]) - targets).ravel()
        by_turn = np.vstack([-skew(point) for point in turned]) @ left_jacobian(motion[:3])
        by_motion = np.hstack([by_turn, np.kron(ones[:, None], np.eye(3))])[:, free] * scale
        if step_number == 0:
            _check_held(free, by_motion)
        step = np.linalg.lstsq(by_motion, -off)[0]
        length = float(np.abs(step).max()) / size
        motion[free] += step * scale
        # Rounding may keep the last steps from shrinking further.
        if length < _CONVERGED or (length < 1e3 * _CONVERGED and length >= least):
            break
        least = length
    else:
        raise FitError(
            "alignment.no_end",
            "The best fit with locked motions does not converge.",
            "Lock fewer motions, or start with an alignment closer to nominal.",
        )
    return RigidTransform(rotation_from_vector(motion[:3]), motion[3:]).compose(start)


def _places(names: Sequence[str], geometries: Mapping[str, Float]) -> Points3:
    """Return the points (n, 3) of many elements."""
    # Joining whole vectors is several times faster than slicing each first.
    joined = np.concatenate([geometries[name] for name in names])
    return joined.reshape(len(names), GEOMETRY_SIZE)[:, POINT]


def left_jacobian(vector: Float) -> Float:
    """Return d(rotation) / d(rotation vector), (3, 3), seen in the turned frame."""
    angle = float(np.linalg.norm(vector))
    cross = skew(vector)
    if angle < 1e-4:
        return np.eye(3) + 0.5 * cross + cross @ cross / 6.0
    jacobian: Float = (
        np.eye(3)
        + (1.0 - np.cos(angle)) / angle**2 * cross
        + (angle - np.sin(angle)) / angle**3 * (cross @ cross)
    )
    return jacobian


def _check_spread(arms: Points3) -> None:
    """Refuse collinear points, relative to their middle."""
    _, values, _ = np.linalg.svd(np.linalg.qr(arms, mode="r"))
    width = float(values[1]) / np.sqrt(len(arms)) if len(values) > 1 else 0.0
    if len(arms) < 3 or width < MIN_TRIANGLE_MM / np.sqrt(3.0):
        raise FitError(
            "alignment.points_on_line",
            f"The points of the best fit lie within {width:.1f} mm of one line.",
            "Take points that form a wide triangle.",
        )


def _check_held(free: Sequence[int], by_motion: Float) -> None:
    """Refuse a rotation not constrained by the points after elimination of shifts."""
    turns = [place for place, index in enumerate(free) if index < 3]
    if not turns:
        return
    rest = by_motion[:, turns]
    shifts = by_motion[:, len(turns) :]
    if shifts.shape[1]:
        basis, _ = np.linalg.qr(shifts)
        rest = rest - basis @ (basis.T @ rest)
    _, values, ways = np.linalg.svd(rest, full_matrices=False)
    if values[-1] < LEAST_HOLD:
        name = MOTIONS[free[turns[int(np.argmax(np.abs(ways[-1])))]]]
        raise FitError(
            "alignment.open",
            f"The points do not constrain the motion {name}.",
            f"Lock {name}, or take points that constrain it.",
        )
