"""The frame of the part by any rule of alignment, from the geometry of measured features."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment.datum_frame import DatumFrame, datum_frame
from ocmm_core.alignment.rules import (
    Alignment,
    AnyAlignment,
    BoundAlignment,
    DatumAlignment,
    DatumReferenceFrame,
    PlaneAxisPoint,
    SavedFrame,
)
from ocmm_core.alignment.three_two_one import three_two_one
from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.geometry import Float, RigidTransform

__all__ = ["DatumAlignment", "datums_of", "frame_of", "part_frame"]


def part_frame(rule: AnyAlignment, features: Mapping[str, ActualFeature]) -> RigidTransform:
    """Return the motion from the world to the part frame; see `frame_of`."""
    return frame_of(rule, {name: feature.fit.geometry for name, feature in features.items()})


def frame_of(rule: AnyAlignment, geometries: Mapping[str, Float]) -> RigidTransform:
    """Return the motion from the world to the part frame, ``T_part_from_world``.

    It rests on the features that the rule names and on no others, but for the choice of which way
    an axis runs.

    Parameters
    ----------
    rule
        Which features say where the part is; bound to nominals where its kind needs them.
    geometries
        Geometry vectors (12,) of the features, mm, world frame (`features.shapes.Fit`).

    Raises
    ------
    FitError
        A feature is not measured or has no nominal, the features do not say where the part is, or
        it lies otherwise than they should.
    """
    bound = rule if isinstance(rule, BoundAlignment) else None
    kind = rule.rule if isinstance(rule, BoundAlignment) else rule
    for name in kind.features:
        if name not in geometries:
            raise FitError(
                "alignment.datum",
                f"The part frame needs {name}, which is not measured.",
                f"Measure {name}.",
            )
    return _frame(kind, geometries, bound)


def _frame(
    rule: Alignment, geometries: Mapping[str, Float], bound: BoundAlignment | None
) -> RigidTransform:
    match rule:
        case DatumAlignment():
            return three_two_one(rule, geometries, bound)
        case SavedFrame():
            return RigidTransform(np.array(rule.rotation), np.array(rule.translation))
        case PlaneAxisPoint() | DatumReferenceFrame():
            return datums_of(rule, geometries, _needed(rule, bound)).T_frame_from_world
    raise NotImplementedError


def datums_of(
    rule: PlaneAxisPoint | DatumReferenceFrame,
    geometries: Mapping[str, Float],
    bound: BoundAlignment,
) -> DatumFrame:
    """Return the datum frame of a rule, with what it leaves open."""
    return datum_frame(rule.features, geometries, bound.shapes, bound.nominals)


def _needed(rule: Alignment, bound: BoundAlignment | None) -> BoundAlignment:
    if bound is None:
        raise FitError(
            "alignment.no_nominal",
            f"The part frame of {', '.join(rule.features)} needs nominal geometry.",
            "Give the features their nominals.",
        )
    return bound
