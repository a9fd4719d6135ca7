"""Best fit of ball centres to model faces, minimising the foot distances.

Gauss-Newton with exact feet in every step: to first order a distance only depends on motion along
the face normal, so a step needs only normals and arms. Freedom left by the touched faces (all
rotations about the centre of a sphere; shifts along a plane and the rotation about its normal) is
named and the fit refused, as the frame would otherwise be arbitrary. The part frame of the fit has
derivatives by the touches.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment._best_fit import LEAST_HOLD, MOTIONS, fit_points, left_jacobian
from ocmm_core.alignment._rules import ModelBestFit
from ocmm_core.errors import FitError
from ocmm_core.features.measured import SAME_RADIUS, ActualFeature, Touches
from ocmm_core.features.shapes import POINT
from ocmm_core.geometry import Float, Points3, RigidTransform, rotation_from_vector, skew
from ocmm_core.measuring import Rows
from ocmm_core.part_model import Feet, SearchedFace, followed_feet, nearest_feet, searched

_MOST_STEPS = 60
_CONVERGED_MM = 1e-9
_AGAIN = 5
"""Searches over all faces: a foot may move to another face."""


@dataclass(frozen=True, slots=True, eq=False)
class ModelFit:
    """Pose of the part by faces of its model, with residuals."""

    T_part_from_world: RigidTransform
    residuals: Float
    """(n,), mm: distance of each ball from its face, positive outside."""
    faces: tuple[int, ...]
    """(n,): model face number of each point."""
    by_tips: Float
    """(6, 3 n): rad over mm, by ball centres, world; without residuals and curvature of faces."""
    by_radius: Float
    """(6,): the same by a common change of the ball radius."""
    normals: Float
    """(n, 3): of the faces at the feet, part frame."""


def fit_to_faces(
    tips_world: Points3,
    tip_radius: float,
    faces: Sequence[SearchedFace],
    start: RigidTransform,
    names: Sequence[str] = (),
) -> ModelFit:
    """Return the motion of least distances of ball centres from one radius outside faces.

    Parameters
    ----------
    tips_world
        (n, 3), mm, ball centres.
    start
        ``T_part_from_world``, close enough for each ball to be nearest to its touched face.
    names
        Point names for errors; default their numbers.

    Raises
    ------
    FitError
        The faces leave a motion free, a point has no valid foot, too few points, or no convergence.
    """
    n = len(tips_world)
    if n <= len(MOTIONS):
        raise FitError(
            "alignment.model_few_points",
            f"The best fit to faces of the model has {n} points for {len(MOTIONS)} motions.",
            f"Take at least {len(MOTIONS) + 1} points.",
        )
    before = start.apply(tips_world)
    centre = before.mean(axis=0)
    size = max(float(np.sqrt(np.mean(np.sum((before - centre) ** 2, axis=1)))), 1.0)
    scale = np.array([1.0 / size] * 3 + [1.0] * 3)
    motion = np.zeros(6)
    points, feet = before, nearest_feet(before, faces)
    for _ in range(_AGAIN):
        for _ in range(_MOST_STEPS):
            rows = _slopes(points, feet.normals, motion) * scale
            _check_open(rows, scale, centre)
            step = np.linalg.lstsq(rows, tip_radius - feet.distances)[0]
            motion += step * scale
            points = before @ rotation_from_vector(motion[:3]).T + motion[3:]
            feet = followed_feet(points, faces, feet)
            if float(np.abs(step).max()) < _CONVERGED_MM:
                break
        else:
            feet = nearest_feet(points, faces)
            break
        whole = nearest_feet(points, faces)
        same = bool(np.all(np.abs(whole.distances - feet.distances) < 1e-7))
        feet = whole
        if same:
            _check_feet(feet, names)
            rows = _slopes(points, feet.normals, motion) * scale
            change = RigidTransform(rotation_from_vector(motion[:3]), motion[3:])
            found = change.compose(start)
            answers = -scale[:, None] * np.linalg.pinv(rows)
            by_motion = answers[:, :, None] * (feet.normals @ found.rotation)
            twist = _as_twist(motion)
            return ModelFit(
                found,
                feet.distances - tip_radius,
                tuple(faces[place].number for place in feet.faces.tolist()),
                twist @ by_motion.reshape(len(MOTIONS), 3 * n),
                # A larger ball shortens every distance like an inward shift.
                -twist @ answers.sum(axis=1),
                feet.normals,
            )
    _check_feet(feet, names)
    raise FitError(
        "alignment.model_no_end",
        "The best fit to faces of the model does not come to rest.",
        "Start from an alignment that is nearer, or leave out points near edges.",
    )


def _check_feet(feet: Feet, names: Sequence[str]) -> None:
    for place, doubt in enumerate(feet.doubts):
        if doubt:
            name = names[place] if names else f"Point {place + 1}"
            raise FitError(
                "alignment.model_foot",
                f"{name} of the best fit to faces of the model does not count: {doubt}.",
                "Leave it out, or touch again inside the face.",
            )


def _as_twist(motion: Float) -> Float:
    """Return the derivative of rotation and shift of the frame by a motion, (6, 6).

    A point p = R x + t moves by turn x (p - t) + dt, which is turn x p + (dt + t x turn).
    """
    turn = left_jacobian(motion[:3])
    return np.block([[turn, np.zeros((3, 3))], [skew(motion[3:]) @ turn, np.eye(3)]])


def _slopes(points: Points3, normals: Points3, motion: Float) -> Float:
    """Return d(distance) / d(motion), (n, 6)."""
    turned = points - motion[3:]
    by_turn = np.einsum(
        "ni,nij->nj", normals, np.array([-skew(point) for point in turned])
    ) @ left_jacobian(motion[:3])
    return np.hstack([by_turn, normals])


def _check_open(rows: Float, scale: Float, centre: Float) -> None:
    """Refuse faces that leave a motion free, and name it."""
    # Rotations about the middle of the points: the part absorbed by shifts is no constraint.
    about = rows.copy()
    about[:, :3] += scale[:3] * (rows[:, 3:] @ np.cross(centre, np.eye(3)).T)
    _, values, ways = np.linalg.svd(about / np.sqrt(len(rows)))
    lost = ways[values < LEAST_HOLD]
    if len(lost):
        far = np.linalg.norm(lost, axis=0) > 0.3
        words = ", ".join(name for name, open_ in zip(MOTIONS, far, strict=True) if open_)
        raise FitError(
            "alignment.model_open",
            f"The faces that were touched leave open: {words}.",
            "Take points on faces that hold them.",
        )


FAR_MM = 5.0
"""A touch farther from the faces belongs to others."""


def model_fit(
    rule: ModelBestFit,
    geometries: Mapping[str, Float],
    nominals: Mapping[str, Float],
    actual: Mapping[str, ActualFeature] | None,
) -> ModelFit:
    """Return the fit of touches to faces of the model.

    `geometries`, `nominals`: geometry vectors (12,), mm, world and frame of the nominals, by name.
    `actual`: the features as touched. None if only geometry is available, as for a nominal part:
    then its points are compared with the faces, which is equivalent for points on them. FitError: a
    nominal is missing, two balls were used, a touch is on none of the faces, or the faces leave a
    motion free.
    """
    missing = [name for name in rule.points if name not in nominals]
    if missing:
        raise FitError(
            "alignment.no_nominal",
            f"The best fit to the model needs the nominal place of {missing[0]}, which is unknown.",
            f"Give {missing[0]} a nominal, or leave it out of the best fit.",
        )
    measured = np.array([geometries[name][POINT] for name in rule.points])
    wanted = np.array([nominals[name][POINT] for name in rule.points])
    start = fit_points(measured, wanted, np.ones(len(wanted)))
    tips, radius = measured, 0.0
    if actual is not None:
        touched = [_only_touch(name, actual[name]) for name in rule.points]
        tips = np.array([one.tips[0] for one in touched])
        radius = touched[0].tip_radius
        if max(abs(one.tip_radius - radius) for one in touched) > SAME_RADIUS:
            raise FitError(
                "alignment.two_balls",
                "The points of the best fit to the model were touched with balls of two sizes.",
                "Touch all of them with one tip.",
            )
    faces = [searched(face) for face in rule.faces]
    # A misplaced one would distort the fit until others appear wrong.
    _check_near(rule, nearest_feet(start.apply(tips), faces).distances - radius, "Before")
    found = fit_to_faces(tips, radius, faces, start, rule.points)
    _check_near(rule, found.residuals, "After")
    return found


def _check_near(rule: ModelBestFit, residuals: Float, when: str) -> None:
    worst = int(np.argmax(np.abs(residuals)))
    if abs(residuals[worst]) > FAR_MM:
        name = rule.points[worst]
        raise FitError(
            "alignment.model_far",
            f"{when} the best fit to the model, {name} is {residuals[worst]:+.1f} mm off its "
            "faces.",
            f"Touch {name} again where it belongs, or name its face.",
        )


def model_frame_slopes(
    rule: ModelBestFit, found: ModelFit, actual: Mapping[str, ActualFeature]
) -> Rows:
    """Return the derivatives of the frame of a face fit by the points of the job, 6 rows."""
    places = [_only_touch(name, actual[name]).places[0] for name in rule.points]
    return Rows.of_points(places, found.by_tips).with_radius(found.by_radius)


def _only_touch(name: str, feature: ActualFeature) -> Touches:
    touches = feature.touches
    if touches is None or len(touches.tips) != 1:
        raise FitError(
            "alignment.model_points",
            f"The best fit to the model needs one touch of {name}, which is no single point.",
            f"Leave {name} out of the best fit.",
        )
    return touches
