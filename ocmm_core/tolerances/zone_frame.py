"""The frame in which a zone stands: where it is, what it leaves open, how the points move it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.alignment.datum_frame import MOST_DATUMS, datum_frame
from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.features.nominal import nominal_geometry
from ocmm_core.features.shapes import GEOMETRY_SIZE, Shape
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, skew

_STEP = 1e-5
"""Step of the central differences over geometry: mm, and of directions a fraction of one."""

BEST_FIT = "best fit"
"""Word for a frame that the toleranced points set alone."""

_UNSTEADY = 1.0
"""A frame that turns by more radians or moves by more fold than a datum jumps, and has none."""


@dataclass(frozen=True, slots=True)
class ZoneFrame:
    """A frame, and how it answers to the points.

    Attributes
    ----------
    T_frame_from_world
        Where nominal geometry is.
    by_coordinates
        (6, 3 N + 1): turn, rad, over shift, mm, of the frame by every coordinate: a point x of the
        frame moves by ``turn x x + shift``.
    motions
        (6, k): what is open, in the same form.
    words
        Name of the frame for the report.
    """

    T_frame_from_world: RigidTransform
    by_coordinates: Float
    motions: Float
    words: str

    def moved(self, motion: Float) -> ZoneFrame:
        """Return the frame after an open motion (k,)."""
        twist = self.motions @ motion
        further = RigidTransform(rotation_from_vector(twist[:3]), _shift(twist))
        return ZoneFrame(
            further.compose(self.T_frame_from_world),
            _transported(further, self.by_coordinates),
            self.motions,
            self.words,
        )

    def point_derivative(self, point_frame: Float, by_coordinates_world: Float) -> Float:
        """Return how a point answers in the frame, (3, 3 N + 1), from how it does in the world."""
        rotation = self.T_frame_from_world.rotation
        by_frame = -skew(point_frame) @ self.by_coordinates[:3] + self.by_coordinates[3:]
        return np.asarray(rotation @ by_coordinates_world + by_frame, dtype=np.float64)

    def with_shifts(self) -> ZoneFrame:
        """Return the frame free to shift in every direction, as zones of orientation are."""
        turning = self.motions[:, np.any(self.motions[:3] != 0.0, axis=0)].copy()
        turning[3:] = 0.0
        shifting = np.vstack([np.zeros((3, 3)), np.eye(3)])
        return ZoneFrame(
            self.T_frame_from_world,
            self.by_coordinates,
            np.hstack([turning, shifting]),
            self.words,
        )


def _shift(twist: Float) -> Float:
    """Return the shift (3,) of a finite motion: the turn about the twist's own axis."""
    turn, shift = twist[:3], twist[3:]
    angle = float(np.linalg.norm(turn))
    k = skew(turn)
    if angle < 1e-6:
        return np.asarray(shift + 0.5 * k @ shift, dtype=np.float64)
    a = (1.0 - np.cos(angle)) / angle**2
    b = (angle - np.sin(angle)) / angle**3
    return np.asarray(shift + a * k @ shift + b * k @ k @ shift, dtype=np.float64)


def frame_of_datums(
    datums: Sequence[str], features: Sequence[str], actual: Mapping[str, ActualFeature]
) -> ZoneFrame:
    """Return the frame of datums in their precedence, of none or up to three.

    What the datums leave open is set by the toleranced features, so that the search for the
    smallest zone starts near it.

    Raises
    ------
    FitError
        A datum hardly says how the part lies.
    """
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    shapes = {name: feature.nominal.shape for name, feature in actual.items()}
    nominals = {name: nominal_geometry(feature.nominal) for name, feature in actual.items()}
    coordinates = next(iter(actual.values())).jacobian.shape[1]

    started = _started(datums, features, geometries, shapes, nominals)
    if not datums:
        points = np.array([actual[name].fit.point for name in features])
        return free_frame(started, points.mean(axis=0), coordinates)

    def held(moved: Mapping[str, Float]) -> RigidTransform:
        return datum_frame(datums, moved, shapes, nominals).T_frame_from_world

    frame = datum_frame(datums, geometries, shapes, nominals)
    by_datums = _by_coordinates(held, datums, geometries, actual)
    further = started.compose(frame.T_frame_from_world.inverse())
    return ZoneFrame(
        started, _transported(further, by_datums), frame.free.motions(), "|".join(datums)
    )


def free_frame(
    T_frame_from_world: RigidTransform, middle_world: Float, coordinates: int
) -> ZoneFrame:
    """Return a frame that nothing holds; its small turns are about a point (3,), mm, world."""
    middle = T_frame_from_world.apply(middle_world)
    motions = np.eye(6)
    motions[3:, :3] = skew(middle)
    return ZoneFrame(T_frame_from_world, np.zeros((6, coordinates)), motions, BEST_FIT)


def frame_of_part(
    T_part_from_world: Callable[[Mapping[str, Float]], RigidTransform],
    features: Sequence[str],
    actual: Mapping[str, ActualFeature],
    words: str,
) -> ZoneFrame:
    """Return the part frame of an alignment that rests on ``features``, and leaves nothing open."""
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    by_coordinates = _by_coordinates(T_part_from_world, features, geometries, actual)
    return ZoneFrame(T_part_from_world(geometries), by_coordinates, np.zeros((6, 0)), words)


def _started(
    datums: Sequence[str],
    features: Sequence[str],
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
) -> RigidTransform:
    """Return the frame of the datums with what they leave open set by the features."""
    least = max(len(datums), 1)
    names = tuple(dict.fromkeys((*datums, *features)))[: max(MOST_DATUMS, least)]
    for count in range(len(names), least, -1):
        try:
            return datum_frame(names[:count], geometries, shapes, nominals).T_frame_from_world
        except FitError:
            # A further feature that hardly turns the frame leaves it where it is.
            continue
    return datum_frame(names[:least], geometries, shapes, nominals).T_frame_from_world


def _by_coordinates(
    transform: Callable[[Mapping[str, Float]], RigidTransform],
    names: Sequence[str],
    geometries: Mapping[str, Float],
    actual: Mapping[str, ActualFeature],
) -> Float:
    """Return how a frame answers to every coordinate, (6, 3 N + 1), by central differences."""
    now = transform(geometries)
    total = np.zeros((6, next(iter(actual.values())).jacobian.shape[1]))
    for name in dict.fromkeys(names):
        jacobian = actual[name].jacobian
        slopes = np.zeros((6, GEOMETRY_SIZE))
        for k in range(GEOMETRY_SIZE):
            if np.any(jacobian[k]):
                sides = [
                    _twist(now, transform(moved_geometry(geometries, name, k, step)))
                    for step in (_STEP, -_STEP)
                ]
                slopes[:, k] = (sides[0] - sides[1]) / (2.0 * _STEP)
        total += slopes @ jacobian
    return total


def moved_geometry(
    geometries: Mapping[str, Float], name: str, k: int, step: float
) -> dict[str, Float]:
    """Return the geometries with one number of one of them moved; directions stay unit vectors."""
    moved = geometries[name].copy()
    moved[k] += step
    for part in (slice(3, 6), slice(9, 12)):
        length = float(np.linalg.norm(moved[part]))
        if part.start <= k < part.stop and length > 0.0:
            moved[part] /= length
    return {**geometries, name: moved}


def _twist(now: RigidTransform, moved: RigidTransform) -> Float:
    """Return the small motion (6,) from one frame to another: turn over shift."""
    change = moved.compose(now.inverse())
    turn = 0.5 * np.array(
        [
            change.rotation[2, 1] - change.rotation[1, 2],
            change.rotation[0, 2] - change.rotation[2, 0],
            change.rotation[1, 0] - change.rotation[0, 1],
        ]
    )
    if float(np.linalg.norm(turn)) > _UNSTEADY or float(np.trace(change.rotation)) < 1.0:
        raise FitError(
            "characteristic.frame",
            "The frame of the datums jumps when a datum moves a little.",
            "Name datums that hold the part, or give the features their nominal places.",
        )
    return np.concatenate([turn, change.translation])


def _transported(further: RigidTransform, twists: Float) -> Float:
    """Return small motions (6, m) seen after a further motion of the frame."""
    turned = further.rotation @ twists[:3]
    shifted = further.rotation @ twists[3:]
    shifted += np.cross(further.translation, turned, axis=0)
    return np.vstack([turned, shifted])
