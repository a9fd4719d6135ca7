"""Part frame by any alignment rule, from the geometry of measured features.

Alignment by reference points (RPS): six exact conditions, each bringing one coordinate of one point
to its nominal place. They are six equations for the six motions of the part, solved by Newton's
method from a first alignment.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ocmm_core.alignment._best_fit import best_fit, fit_points, relocated
from ocmm_core.alignment._datum_frame import DatumFrame, datum_frame
from ocmm_core.alignment._model_frame import model_fit
from ocmm_core.alignment._rules import (
    Alignment,
    AnyAlignment,
    BestFit,
    BoundAlignment,
    DatumAlignment,
    DatumReferenceFrame,
    ModelBestFit,
    PlaneAxisPoint,
    ReferencePoints,
    Relocation,
    SavedFrame,
)
from ocmm_core.alignment._three_two_one import nominal_frame as three_two_one_of_nominals
from ocmm_core.alignment._three_two_one import three_two_one
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import POINT
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit

LEAST_HOLD = 0.01
"""Least ratio of the worst to the best held motion, rotations at the points' distance."""

_MOST_STEPS = 30
_CONVERGED = 1e-12
"""mm per metre of the size: tolerance of the conditions."""


def reference_points(
    rule: ReferencePoints,
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
        about = RigidTransform(rotation, centre - rotation @ centre + step[3:])
        T = about.compose(T)
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
    rule: AnyAlignment,
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


def settled(bound: BoundAlignment, geometries: Mapping[str, Float]) -> BoundAlignment:
    """Return the alignment with senses of axes fixed by all features; raises as `frame_of`."""
    if isinstance(bound.rule, ModelBestFit):
        return replace(bound, choice=0)
    _, choice = _placed(bound.rule, bound, geometries)
    return replace(bound, choice=choice)


def nominal_frame(bound: BoundAlignment) -> RigidTransform:
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
    rule: PlaneAxisPoint | DatumReferenceFrame,
    geometries: Mapping[str, Float],
    bound: BoundAlignment,
) -> DatumFrame:
    """Return the datum frame of a rule, with its freedom."""
    return datum_frame(rule.features, geometries, bound.shapes, bound.nominals, bound.choice)


def _parts(rule: AnyAlignment) -> tuple[Alignment, BoundAlignment | None]:
    return (rule.rule, rule) if isinstance(rule, BoundAlignment) else (rule, None)


def _placed(
    rule: Alignment,
    bound: BoundAlignment | None,
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
        case SavedFrame():
            return RigidTransform(np.array(rule.rotation), np.array(rule.translation)), 0
        case PlaneAxisPoint() | DatumReferenceFrame():
            frame = datums_of(rule, geometries, _needed(rule, bound))
            return frame.T_frame_from_world, frame.choice
        case Relocation():
            return relocated(rule, geometries), 0
        case ModelBestFit():
            nominals = _needed(rule, bound).nominals
            return model_fit(rule, geometries, nominals, actual).T_part_from_world, 0
        case BestFit() | ReferencePoints():
            needed = _needed(rule, bound)
            start, choice = None, 0
            if rule.start is not None:
                start, choice = _placed(rule.start, bound, geometries)
                back = nominal_frame(replace(needed, rule=rule.start)).inverse()
                start = back.compose(start)
            if isinstance(rule, BestFit):
                return best_fit(rule, geometries, needed.nominals, start), choice
            return reference_points(rule, geometries, needed.nominals, start), choice


def _needed(rule: Alignment, bound: BoundAlignment | None) -> BoundAlignment:
    if bound is None:
        raise FitError(
            "alignment.no_nominal",
            f"The part frame of {', '.join(rule.features)} needs nominal geometry.",
            "Give the features their nominals.",
        )
    return bound
