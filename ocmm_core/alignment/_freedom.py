"""Free motions of a frame, and their reduction by datums.

The motions that leave some points, axes and planes in place form a group of one of few kinds (J. M.
Herve, Mechanism and Machine Theory 13, 1978): all, planar, cylindrical, spherical, turning,
sliding, none. Each is described by turning axes and sliding directions, so that every datum is
satisfied in closed form. The misfit of features from their nominals chooses the sense of axes
without one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.shapes import DIRECTION, POINT, Shape
from ocmm_core.geometry import Float, RigidTransform, crossed, rotation_from_vector, skew, unit

SAME_DIRECTION = 1e-6
"""Sine below which two nominal directions count as equal."""

NEARLY = 0.05
"""Sine between nominal directions below which noise, not the part, would determine the rotation."""

SHORTEST_MM = 1.0
"""Lever below which a point does not determine a rotation."""


@dataclass(frozen=True, slots=True)
class Freedom:
    """Motions of the frame that leave all preceding datums in place."""

    turn: Float
    """(0, 3), (1, 3) or (3, 3): free rotation axes: none, one, or any; unit, frame."""
    centre: Float
    """(3,), mm, frame: on the axes; meaningless if sliding square to them is also free."""
    slide: Float
    """(0 to 3, 3): orthonormal directions of free translations, frame."""

    @classmethod
    def full(cls) -> Freedom:
        """Return the freedom of an unconstrained part."""
        return cls(np.eye(3), np.zeros(3), np.eye(3))

    @property
    def count(self) -> int:
        """Return the number of free degrees of freedom, 0 to 6."""
        return len(self.turn) + len(self.slide)

    def motions(self) -> Float:
        """Return the small free motions (6, count): rotation, rad, over shift, mm."""
        turning = [np.append(axis, crossed(self.centre, axis)) for axis in self.turn]
        sliding = [np.append(np.zeros(3), direction) for direction in self.slide]
        return np.array(turning + sliding).reshape(-1, 6).T

    def names(self) -> tuple[str, ...]:
        """Return the free motions in words; empty if none."""
        if len(self.turn) == 3:
            turning = ["rotation about any axis"]
        else:
            turning = [f"rotation about {_axis_word(axis)}" for axis in self.turn]
        if len(self.slide) == 3:
            return (*turning, "translation in any direction")
        if len(self.slide) == 2:
            across = _axis_word(crossed(*self.slide))
            return (*turning, f"translation square to {across}")
        return (*turning, *(f"translation along {_axis_word(way)}" for way in self.slide))


@dataclass(frozen=True, slots=True)
class AlignedMotion:
    """A motion to the frame, with its remaining freedom."""

    T_frame_from_world: RigidTransform
    freedom: Freedom

    @classmethod
    def free(cls) -> AlignedMotion:
        """Return the start: identity, unconstrained."""
        return cls(RigidTransform.identity(), Freedom.full())


def turn_to(
    held: AlignedMotion, direction_world: Float, nominal: Float, sense: float, name: str
) -> AlignedMotion:
    """Return the frame turned, as far as free, until a measured direction is nominal.

    `direction_world`, `nominal`: (3,), unit: as measured in the world, and nominal in the frame.
    `sense`: 1.0, or -1.0 to reverse the measured direction. FitError: the direction is nearly
    parallel to the free rotation axis.
    """
    freedom = held.freedom
    direction = sense * (held.T_frame_from_world.rotation @ direction_world)
    if len(freedom.turn) == 3:
        turned = replace(freedom, turn=nominal[None])
        return _turned(held, rotation_between(direction, nominal), turned)
    if len(freedom.turn) == 0:
        return held
    axis = freedom.turn[0]
    lever = np.linalg.norm(crossed(axis, nominal))
    if lever < SAME_DIRECTION:
        return held
    if lever < NEARLY:
        raise _nearly(name)
    rotation = rotation_from_vector(angle_about(axis, direction, nominal) * axis)
    return _turned(held, rotation, replace(freedom, turn=np.zeros((0, 3))))


def move_to(
    held: AlignedMotion, point_world: Float, nominal: Float, rows: Float, name: str
) -> AlignedMotion:
    """Return the frame moved, as far as free, until a measured point is nominal.

    By sliding if possible, else by rotation about the centre. `point_world`, `nominal`: (3,), mm:
    as measured in the world, and nominal in the frame. `rows`: (m, 3): orthonormal located
    directions of the datum: one for a plane, two for an axis, three for a point. FitError: the
    datum hardly determines position or rotation of the part.
    """
    freedom = held.freedom
    fixed_centre = not _slides_square_to_turns(freedom)
    T = held.T_frame_from_world
    if len(freedom.slide):
        _, lengths, ways = np.linalg.svd(rows @ freedom.slide.T)
        locked = lengths > SAME_DIRECTION
        if np.any(lengths[locked] < NEARLY):
            raise _nearly(name)
        using = ways[: len(lengths)][locked] @ freedom.slide
        missing = rows @ (nominal - T.apply(point_world))
        shift = using.T @ np.linalg.lstsq(rows @ using.T, missing)[0]
        T = RigidTransform(T.rotation, T.translation + shift)
        rest = np.vstack([ways[: len(lengths)][~locked], ways[len(lengths) :]])
        freedom = replace(freedom, slide=rest @ freedom.slide)
        if not fixed_centre and not _slides_square_to_turns(freedom):
            return AlignedMotion(T, replace(freedom, centre=nominal))
    held = AlignedMotion(T, freedom)
    if not fixed_centre or not len(freedom.turn):
        return held
    lever, wanted = T.apply(point_world) - freedom.centre, nominal - freedom.centre
    if len(freedom.turn) == 3:
        if _lever_is_nothing(np.linalg.norm(wanted), name):
            return held
        towards = wanted / np.linalg.norm(wanted)
        if np.linalg.norm(lever) < SHORTEST_MM:
            raise _nearly(name)
        rotation = rotation_between(lever / np.linalg.norm(lever), towards)
        return _turned(held, rotation, replace(freedom, turn=towards[None]))
    axis = freedom.turn[0]
    square = square_pair(axis)
    if np.linalg.svd(rows @ square.T, compute_uv=False)[-1] < NEARLY or len(rows) < 2:
        return held
    if _lever_is_nothing(np.linalg.norm(square @ wanted), name):
        return held
    if np.linalg.norm(square @ lever) < SHORTEST_MM:
        raise _nearly(name)
    rotation = rotation_from_vector(angle_about(axis, lever, wanted) * axis)
    return _turned(held, rotation, replace(freedom, turn=np.zeros((0, 3))))


def rotation_between(first: Float, second: Float) -> Float:
    """Return the smallest rotation (3, 3) of two unit vectors; opposite ones via a half turn."""
    flip = np.eye(3)
    if first @ second < 0.0:
        across = square_pair(second)[0]
        flip = 2.0 * np.outer(across, across) - np.eye(3)
    start = flip @ first
    turn = skew(crossed(start, second))
    return (np.eye(3) + turn + turn @ turn / (1.0 + start @ second)) @ flip


def square_pair(direction: Float) -> Float:
    """Return two unit vectors (2, 3) square to a unit vector and to each other."""
    helper = np.zeros(3)
    helper[int(np.argmin(np.abs(direction)))] = 1.0
    first = crossed(helper, direction)
    first = first / math.sqrt(first @ first)
    return np.stack([first, crossed(direction, first)])


def _turned(held: AlignedMotion, rotation: Float, freedom: Freedom) -> AlignedMotion:
    centre = held.freedom.centre
    about = RigidTransform(rotation, centre - rotation @ centre)
    return AlignedMotion(about.compose(held.T_frame_from_world), freedom)


def angle_about(axis: Float, start: Float, end: Float) -> float:
    """Return the angle about ``axis`` from one vector to another, both seen along the axis."""
    sine = float(axis @ crossed(start, end))
    cosine = float(start @ end - (start @ axis) * (end @ axis))
    return float(np.arctan2(sine, cosine))


def _slides_square_to_turns(freedom: Freedom) -> bool:
    """Return whether every shift square to a free rotation is free, so no centre is fixed."""
    if len(freedom.turn) == 3:
        return len(freedom.slide) == 3
    if not len(freedom.turn):
        return False
    if len(freedom.slide) != 2:
        return len(freedom.slide) == 3
    along = abs(float(freedom.turn[0] @ crossed(*freedom.slide)))
    return along > 1.0 - SAME_DIRECTION


def _lever_is_nothing(lever: float | np.floating, name: str) -> bool:
    if lever < SAME_DIRECTION:
        return True
    if lever < SHORTEST_MM:
        raise _nearly(name)
    return False


def _axis_word(direction: Float) -> str:
    for letter, axis in zip("xyz", np.eye(3), strict=True):
        if abs(direction @ axis) > 1.0 - 1e-9:
            return letter
    return "(" + ", ".join(f"{value:.3f}" for value in direction) + ")"


def _nearly(name: str) -> FitError:
    return FitError(
        "alignment.degenerate",
        f"{name} hardly constrains the part: the motion it should fix stays nearly free.",
        "Choose a datum at a clear angle, or farther away.",
    )


LEVER_MM = 100.0
"""Lever, mm, that weights a direction error against a place error for the choice of senses."""


def misfit_of_all(
    T_frame_from_world: RigidTransform,
    free: Freedom,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
) -> float:
    """Return the squared misfit, mm^2, of all features in the constrained motions.

    Places by quantities invariant to rotation about free axes and shifts along free directions.
    """
    if len(free.turn) == 3:
        return 0.0
    T = T_frame_from_world
    names = [name for name in nominals if name in geometries]
    places = [name for name in names if shapes[name].spec.located != "along"]
    total = 0.0
    if places:
        measured = T.apply(np.array([geometries[name][POINT] for name in places]))
        wanted = np.array([nominals[name][POINT] for name in places])
        off = measured - wanted
        flat = [shapes[name].spec.is_flat for name in places]
        axes = np.array([nominals[name][DIRECTION] for name in places]) * np.array(flat)[:, None]
        off = off - np.sum(off * axes, axis=1, keepdims=True) * axes
        if len(free.turn):
            axis = free.turn[0]
            off = (off @ axis)[:, None] * axis
            if len(free.slide) < 2:
                rounds = [_from_axis(items, free.centre, axis) for items in (measured, wanted)]
                total += float(np.sum((rounds[0] - rounds[1]) ** 2))
        off = off - off.mean(axis=0) @ free.slide.T @ free.slide
        total += float(np.sum(off**2))
    for name in names:
        if not shapes[name].spec.has_sense:
            continue
        off = T.rotation @ geometries[name][DIRECTION] - unit(nominals[name][DIRECTION])
        if len(free.turn):
            off = free.turn[0] * (free.turn[0] @ off)
        total += LEVER_MM**2 * float(off @ off)
    return total


def _from_axis(points: Float, centre: Float, axis: Float) -> Float:
    distances: Float = np.linalg.norm(np.cross(points - centre, axis), axis=1)
    return distances
