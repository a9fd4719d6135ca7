"""Part frame by any alignment rule, from the geometry of measured features (3-2-1 and others).

Alignment by reference points (RPS): six exact conditions, each bringing one coordinate of one point
to its nominal place. They are six equations for the six motions of the part, solved by Newton's
method from a first alignment.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from ocmm_core.alignment import _rules as rules
from ocmm_core.alignment._best_fit import best_fit, fit_points, relocated
from ocmm_core.alignment._datum_frame import DatumFrame, datum_frame
from ocmm_core.alignment._freedom import Freedom, misfit_of_all
from ocmm_core.alignment._model_fit import model_fit
from ocmm_core.alignment._rules import DatumAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, POINT, Shape
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit

SHORTEST_MM = 1.0
LEAST_SINE = 0.05
"""Sine of the angle between primary and secondary direction below which x is undetermined."""

_PLAINLY = 0.5
"""Largest ratio of the misfit of the better choice of senses to that of any other."""

_HELD = Freedom(np.zeros((0, 3)), np.zeros(3), np.zeros((0, 3)))


def three_two_one(
    rule: DatumAlignment, geometries: Mapping[str, Float], bound: rules.BoundAlignment | None = None
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


def _rotation(
    up_name: rules.AxisName, up: Float, along_name: rules.AxisName, along: Float
) -> Float:
    """Return the rotation (3, 3) to the frame whose named axes are two unit world vectors."""
    rows = np.zeros((3, 3))
    places = []
    for name, vector in ((up_name, up), (along_name, along)):
        places.append("xyz".index(name[-1]))
        rows[places[-1]] = -vector if name.startswith("-") else vector
    third = 3 - sum(places)
    rows[third] = np.cross(rows[(third + 1) % 3], rows[(third + 2) % 3])
    return rows


def three_two_one_of_nominals(rule: DatumAlignment, bound: rules.BoundAlignment) -> RigidTransform:
    """Return the alignment of the nominals: from their frame to the part frame."""
    return _frame(rule, bound.nominals, bound.shapes, 1.0, 1.0)


def _misfit(
    rule: DatumAlignment,
    T_part_from_world: RigidTransform,
    geometries: Mapping[str, Float],
    bound: rules.BoundAlignment | None,
) -> float:
    if bound is None or any(name not in bound.nominals for name in rule.features):
        return 0.0
    # The nominals may be in another frame than the one of this alignment.
    T_part_from_nominal = three_two_one_of_nominals(rule, bound)
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


LEAST_HOLD = 0.01
"""Least ratio of the worst to the best held motion, rotations at the points' distance."""

_MOST_STEPS = 30
_CONVERGED = 1e-12
"""mm per metre of the size: tolerance of the conditions."""


def reference_points(
    rule: rules.ReferencePoints,
    geometries: Mapping[str, Float],
    nominals: Mapping[str, Float],
    start: RigidTransform | None,
) -> RigidTransform:
    """Return the motion from the world to the part frame that meets all conditions.

    `geometries`, `nominals`: geometry vectors (12,), mm, world and part frame, by name. `start`:
    ``T_part_from_world`` of the preceding alignment. FitError: a nominal is missing, the conditions
    leave a motion free or are contradictory, or no convergence.
    """
    names = list(dict.fromkeys(item.feature for item in rule.conditions))
    for name in names:
        if name not in nominals:
            raise FitError(
                "alignment.no_nominal",
                f"The reference points need the nominal position of {name}, which is unknown.",
                f"Give {name} a nominal.",
            )
    measured = np.array([geometries[item.feature][POINT] for item in rule.conditions])
    wanted = np.array([nominals[item.feature][POINT] for item in rule.conditions])
    directions = unit(np.array([item.direction for item in rule.conditions]))
    if start is None:
        # A point with three conditions counts once.
        firsts = [[item.feature for item in rule.conditions].index(name) for name in names]
        start = fit_points(measured[firsts], wanted[firsts], np.ones(len(firsts)))
    centre = wanted.mean(axis=0)
    size = max(float(np.linalg.norm(wanted - centre, axis=1).max()), 1.0)
    T = start
    for _ in range(_MOST_STEPS):
        placed = T.apply(measured)
        off = np.sum(directions * (placed - wanted), axis=1)
        rows = np.hstack([np.cross(placed - centre, directions) / size, directions])
        values = np.linalg.svd(rows, compute_uv=False)
        if values[-1] < LEAST_HOLD * values[0]:
            raise FitError(
                "alignment.open",
                f"The six conditions do not constrain the part: {_open_words(rows)}.",
                "Spread the points, or use another direction.",
            )
        if float(np.abs(off).max()) < _CONVERGED * max(size, 1000.0):
            return T
        step = np.linalg.solve(rows, -off)
        rotation = rotation_from_vector(step[:3] / size)
        T = RigidTransform(rotation, centre - rotation @ centre + step[3:]).compose(T)
    raise FitError(
        "alignment.no_end",
        "No position of the part meets all six conditions.",
        "Check the nominal positions and which feature was probed for which.",
    )


def _open_words(rows: Float) -> str:
    way = np.linalg.svd(rows)[2][-1]
    turn, shift = way[:3], way[3:]
    most = int(np.argmax(np.abs(way)))
    if most < 3:
        return f"rotation about {'xyz'[int(np.argmax(np.abs(turn)))]}"
    return f"translation along {'xyz'[int(np.argmax(np.abs(shift)))]}"


__all__ = ["DatumAlignment", "datums_of", "frame_of", "nominal_frame", "settled"]


def frame_of(
    rule: rules.AnyAlignment,
    geometries: Mapping[str, Float],
    actual: Mapping[str, ActualFeature] | None = None,
) -> RigidTransform:
    """Return the motion from the world to the part frame, ``T_part_from_world``.

    It depends only on the features named in the rule, except for the choice of axis senses. Datums
    are used as given; `precedence.part_frame` re-associates those after the first.

    Parameters
    ----------
    rule
        Alignment rule; bound to nominals if its kind needs them.
    geometries
        Geometry vectors (12,) of the features, mm, world frame (`features.shapes.Fit`).
    actual
        Touched features: a best fit to the model needs the balls.

    Raises
    ------
    FitError
        A feature is not measured or has no nominal, or the features do not determine the frame or
        contradict the nominals.
    """
    return _placed(*_parts(rule), geometries, actual)[0]


def settled(bound: rules.BoundAlignment, geometries: Mapping[str, Float]) -> rules.BoundAlignment:
    """Return the alignment with senses of axes fixed by all features; raises as `frame_of`."""
    if isinstance(bound.rule, rules.ModelBestFit):
        return replace(bound, choice=0)
    _, choice = _placed(bound.rule, bound, geometries)
    return replace(bound, choice=choice)


def nominal_frame(bound: rules.BoundAlignment) -> RigidTransform:
    """Return the motion from the frame of the nominals to the part frame.

    For a 3-2-1 alignment it is the alignment of the nominals themselves, which may be in another
    frame; every other kind brings the part to its nominals. Raises FitError if undetermined.
    """
    if not isinstance(bound.rule, DatumAlignment):
        return RigidTransform.identity()
    for name in bound.features:
        if name not in bound.nominals:
            raise FitError(
                "alignment.no_nominal",
                f"The nominal geometry of {name} is unknown.",
                f"Give {name} a nominal point and direction.",
            )
    return three_two_one_of_nominals(bound.rule, bound)


def datums_of(
    rule: rules.PlaneAxisPoint | rules.DatumReferenceFrame,
    geometries: Mapping[str, Float],
    bound: rules.BoundAlignment,
) -> DatumFrame:
    """Return the datum frame of a rule, with its freedom."""
    return datum_frame(rule.features, geometries, bound.shapes, bound.nominals, bound.choice)


def _parts(rule: rules.AnyAlignment) -> tuple[rules.Alignment, rules.BoundAlignment | None]:
    return (rule.rule, rule) if isinstance(rule, rules.BoundAlignment) else (rule, None)


def _placed(
    rule: rules.Alignment,
    bound: rules.BoundAlignment | None,
    geometries: Mapping[str, Float],
    actual: Mapping[str, ActualFeature] | None = None,
) -> tuple[RigidTransform, int]:
    """Return the motion to the part frame, and the choice of senses."""
    missing = [name for name in rule.features if name not in geometries]
    if missing:
        raise FitError(
            "alignment.datum",
            f"The part frame needs {missing[0]}, which is not measured.",
            f"Measure {missing[0]}.",
        )
    match rule:
        case DatumAlignment():
            return three_two_one(rule, geometries, bound)
        case rules.SavedFrame():
            return RigidTransform(np.array(rule.rotation), np.array(rule.translation)), 0
        case rules.PlaneAxisPoint() | rules.DatumReferenceFrame():
            frame = datums_of(rule, geometries, _needed(rule, bound))
            return frame.T_frame_from_world, frame.choice
        case rules.Relocation():
            return relocated(rule, geometries), 0
        case rules.ModelBestFit():
            nominals = _needed(rule, bound).nominals
            return model_fit(rule, geometries, nominals, actual).T_part_from_world, 0
        case rules.BestFit() | rules.ReferencePoints():
            needed = _needed(rule, bound)
            start, choice = None, 0
            if rule.start is not None:
                start, choice = _placed(rule.start, bound, geometries)
                back = nominal_frame(replace(needed, rule=rule.start)).inverse()
                start = back.compose(start)
            if isinstance(rule, rules.BestFit):
                return best_fit(rule, geometries, needed.nominals, start), choice
            return reference_points(rule, geometries, needed.nominals, start), choice


def _needed(rule: rules.Alignment, bound: rules.BoundAlignment | None) -> rules.BoundAlignment:
    if bound is None:
        raise FitError(
            "alignment.no_nominal",
            f"The part frame of {', '.join(rule.features)} needs nominal geometry.",
            "Give the features their nominals.",
        )
    return bound
