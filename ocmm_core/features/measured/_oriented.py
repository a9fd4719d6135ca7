"""Measured features re-associated with their points under a constrained direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.elements import fit_oriented, fixed_direction, turned_direction
from ocmm_core.features.measured._actual import ActualFeature, Touches, compensated, fit_projected
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows


@dataclass(frozen=True, slots=True)
class Orientation:
    """Permitted directions of an element."""

    direction: Float
    """(3,), unit, world: the direction, or one of them."""
    about: Float | None
    """(3,), unit, world: axis of free rotation, or None."""
    by_coordinates: Rows
    """(3,): rotation of all of it, rad, by the points of the job."""


def can_be_oriented(feature: ActualFeature) -> bool:
    """Return whether a feature has a direction and points of its own."""
    shape = feature.fit.shape
    if feature.touches is None or feature.raw is None or not shape.spec.has_direction:
        return False
    return shape is not Shape.LINE or feature.raw.criterion is Criterion.LEAST_SQUARES


def oriented_feature(feature: ActualFeature, orientation: Orientation) -> ActualFeature:
    """Return a probed feature with a permitted direction, nearest to its points.

    Criterion and sense of the direction are kept. FitError if constructed or undetermined.
    """
    touches, raw = feature.touches, feature.raw
    if touches is None or raw is None:
        raise TypeError(feature.nominal.name)
    if raw.shape.spec.is_flat and raw.criterion is Criterion.LEAST_SQUARES:
        fit, by_turn = _outline(feature, touches, raw, orientation)
    else:
        fit, by_turn = fit_oriented(raw, touches.tips, orientation.direction, orientation.about)
    by_all = Rows.of_points(touches.places, fit.jacobian)
    by_all += by_turn @ orientation.by_coordinates
    return compensated(feature.nominal, touches, fit, by_all)


def _outline(
    feature: ActualFeature, touches: Touches, raw: Fit, orientation: Orientation
) -> tuple[Fit, Float]:
    """Return the outline in the permitted plane nearest to its points."""
    direction, about = orientation.direction, orientation.about
    turned = (
        fixed_direction(direction, len(touches.tips))
        if about is None
        else turned_direction(raw.shape, touches.tips, direction, about)
    )
    fit, by_normal = fit_projected(feature.nominal, touches, turned.direction)
    fit = unambiguous(fit)
    return (
        Fit(
            fit.shape, fit.geometry, fit.jacobian + by_normal @ turned.by_points, fit.residuals,
            fit.rms, fit.form, fit.criterion, fit.contacts,
        ),
        np.asarray(by_normal @ turned.by_turn, dtype=np.float64),
    )  # fmt: skip
