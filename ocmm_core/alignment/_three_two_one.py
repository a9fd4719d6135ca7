"""The part frame from measured datum features (3-2-1)."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from ocmm_core.alignment._freedom import Freedom
from ocmm_core.alignment._misfit import misfit_of_all
from ocmm_core.alignment._rules import AxisName, BoundAlignment, DatumAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.shapes import DIRECTION, POINT, Shape
from ocmm_core.geometry import Float, RigidTransform

SHORTEST_MM = 1.0
LEAST_SINE = 0.05
"""Sine of the angle between primary and secondary direction below which x is undetermined."""

_PLAINLY = 0.5
"""Largest ratio of the misfit of the better choice of senses to that of any other."""

_HELD = Freedom(np.zeros((0, 3)), np.zeros(3), np.zeros((0, 3)))


def three_two_one(
    rule: DatumAlignment, geometries: Mapping[str, Float], bound: BoundAlignment | None = None
) -> tuple[RigidTransform, int]:
    """Return the motion from the world to the part frame, and the choice of senses.

    The motion is ``T_part_from_world``; the choice is in the form of `BoundAlignment.choice`.
    `geometries`: geometry vectors (12,) of the features, mm, world frame. `bound`: shapes and
    nominals. Optional only for a plane as primary with two centres: a measured axis has no sense,
    which the nominals define. FitError: the datums give no direction, or its sense is undetermined.
    """
    shapes = {} if bound is None else bound.shapes
    senses = list(product(_senses_up(rule, shapes), _senses_along(rule, shapes)))
    choice = 0 if len(senses) == 1 else None if bound is None else bound.choice
    if choice is not None:
        return _frame(rule, geometries, shapes, *senses[choice]), choice
    frames = [_frame(rule, geometries, shapes, *both) for both in senses]
    misfits = np.array([_misfit(rule, frame, geometries, bound) for frame in frames])
    best, second = np.sort(misfits)[:2]
    if not best < _PLAINLY * second:
        raise FitError(
            "alignment.no_sense",
            f"The direction of the axes along {', '.join(rule.features)} is undefined.",
            "Name a feature on the positive side of x as 'towards' in the alignment, or give "
            "the features nominals in the part frame.",
        )
    choice = int(np.argmin(misfits))
    return frames[choice], choice


def _senses_up(rule: DatumAlignment, shapes: Mapping[str, Shape]) -> tuple[float, ...]:
    shape = shapes.get(rule.primary, Shape.PLANE)
    return (1.0,) if shape.spec.has_sense else (1.0, -1.0)


def _senses_along(rule: DatumAlignment, shapes: Mapping[str, Shape]) -> tuple[float, ...]:
    if len(rule.secondary) == 2 or rule.towards:
        return (1.0,)
    secondary = shapes.get(rule.secondary[0])
    has_sense = secondary is not None and secondary.spec.has_sense
    return (1.0,) if has_sense else (1.0, -1.0)


def _frame(
    rule: DatumAlignment,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    up: float,
    sense: float,
) -> RigidTransform:
    primary, first = geometries[rule.primary], geometries[rule.secondary[0]]
    z = up * primary[DIRECTION] / np.linalg.norm(primary[DIRECTION])
    pair = len(rule.secondary) == 2
    along = geometries[rule.secondary[1]][POINT] - first[POINT] if pair else first[DIRECTION]
    along = sense * (along - (along @ z) * z)
    length = float(np.linalg.norm(along))
    if length < (SHORTEST_MM if pair else LEAST_SINE):
        raise _no_direction(rule)
    x = along / length
    if rule.towards and not pair:
        x = x * _side(rule, geometries, x)
    origin = geometries[rule.origin][POINT]
    if shapes.get(rule.primary, Shape.PLANE) is Shape.PLANE:
        origin = origin - ((origin - primary[POINT]) @ z) * z
        if not pair:
            # A line or axis is located across its direction, a plane along its normal.
            across = x if shapes.get(rule.secondary[0]) is Shape.PLANE else np.cross(z, x)
            origin = origin - ((origin - first[POINT]) @ across) * across
    else:
        origin = primary[POINT] + ((origin - primary[POINT]) @ z) * z
    rotation = _rotation(rule.primary_axis, z, rule.secondary_axis, x)
    return RigidTransform(rotation, -rotation @ origin)


def _side(rule: DatumAlignment, geometries: Mapping[str, Float], x: Float) -> float:
    side = float((geometries[rule.towards][POINT] - geometries[rule.origin][POINT]) @ x)
    if abs(side) < SHORTEST_MM:
        raise FitError(
            "alignment.no_sense",
            f"{rule.towards} is beside {rule.origin}, not along {rule.secondary[0]}.",
            "Name a feature as 'towards' that is clearly on the positive side.",
        )
    return float(np.sign(side))


def _rotation(up_name: AxisName, up: Float, along_name: AxisName, along: Float) -> Float:
    """Return the rotation (3, 3) to the frame whose named axes are two unit world vectors."""
    rows = np.zeros((3, 3))
    places = []
    for name, vector in ((up_name, up), (along_name, along)):
        places.append("xyz".index(name[-1]))
        rows[places[-1]] = -vector if name.startswith("-") else vector
    third = 3 - sum(places)
    rows[third] = np.cross(rows[(third + 1) % 3], rows[(third + 2) % 3])
    return rows


def nominal_frame(rule: DatumAlignment, bound: BoundAlignment) -> RigidTransform:
    """Return the alignment of the nominals: from their frame to the part frame."""
    return _frame(rule, bound.nominals, bound.shapes, 1.0, 1.0)


def _misfit(
    rule: DatumAlignment,
    T_part_from_world: RigidTransform,
    geometries: Mapping[str, Float],
    bound: BoundAlignment | None,
) -> float:
    if bound is None or any(name not in bound.nominals for name in rule.features):
        return 0.0
    # The nominals may be in another frame than the one of this alignment.
    T_part_from_nominal = nominal_frame(rule, bound)
    T_nominal_from_world = T_part_from_nominal.inverse().compose(T_part_from_world)
    return misfit_of_all(T_nominal_from_world, _HELD, geometries, bound.shapes, bound.nominals)


def _no_direction(rule: DatumAlignment) -> FitError:
    if len(rule.secondary) == 2:
        return FitError(
            "alignment.degenerate",
            f"{rule.secondary[0]} and {rule.secondary[1]} give no direction along the plane "
            f"{rule.primary}.",
            "Choose two features that lie side by side on the plane.",
        )
    return FitError(
        "alignment.degenerate",
        f"{rule.secondary[0]} is nearly parallel to {rule.primary} and gives no second direction.",
        "Choose a feature across the first one.",
    )
