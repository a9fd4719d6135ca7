"""Sizes by an association other than the feature's own (ISO 14405-1)."""

from __future__ import annotations

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.features.nominal import CRITERIA
from ocmm_core.features.shapes import RADIUS, Criterion, Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.associated import associated
from ocmm_core.tolerances.characteristic import Association, Characteristic
from ocmm_core.tolerances.evaluation import Evaluation
from ocmm_core.tolerances.surface import least_squares, own_fit

_OPPOSITE_DEG = 20.0
"""Two points further from opposite than this show no two-point size."""
_LEVEL_MM = 3.0
"""The same for their heights on a cylinder."""

LETTERS: dict[Association, str] = {
    "least squares": "GG",
    "minimum zone": "GC",
    "inscribed": "GX",
    "circumscribed": "GN",
    "two-point maximum": "LP SX",
    "two-point minimum": "LP SN",
    "two-point mean": "LP SA",
}
"""Symbols of ISO 14405-1."""


def size_words(association: Association) -> str:
    """Return how a size was associated, in the words of the report, with its symbol."""
    return f"{association} ({LETTERS[association]})"


def own_association(feature: ActualFeature) -> Association:
    """Return the association that a feature's geometry was made with."""
    words: dict[Criterion, Association] = {
        Criterion.LEAST_SQUARES: "least squares",
        Criterion.MINIMUM_ZONE: "minimum zone",
        Criterion.INSCRIBED: "inscribed",
        Criterion.CIRCUMSCRIBED: "circumscribed",
    }
    return words[feature.fit.criterion]


def associated_size(characteristic: Characteristic, feature: ActualFeature) -> Evaluation:
    """Return the diameter or radius of a circle, sphere or cylinder by the plan's association.

    Raises
    ------
    FitError
        The feature is constructed, no such element was found, or no two points are opposite.
    """
    association = characteristic.association
    factor = 2.0 if characteristic.kind == "diameter" else 1.0
    if association in CRITERIA:
        radius, gradient = _radius(feature, CRITERIA[association])
    else:
        radius, gradient = _two_point(feature, association)
    return Evaluation(factor * radius, factor * gradient, association=size_words(association))


def _radius(feature: ActualFeature, criterion: Criterion) -> tuple[float, Float]:
    # Ball centres lie on a parallel surface: their element and that of the part share the axis.
    touches = own_fit(feature)[0]
    start = least_squares(feature)
    fit = start
    if criterion is not Criterion.LEAST_SQUARES:
        fit = associated(start, touches.tips, criterion)
    sign = 1.0 if feature.nominal.side == "outer" else -1.0
    gradient = _spread(fit.jacobian[RADIUS], touches.places, feature.jacobian.shape[1])
    gradient[-1] -= sign
    return fit.radius - sign * touches.tip_radius, gradient


def _spread(by_own: Float, places: tuple[int, ...], coordinates: int) -> Float:
    gradient = np.zeros(coordinates)
    gradient[(3 * np.asarray(places)[:, None] + np.arange(3)).ravel()] = by_own
    return gradient


def _two_point(feature: ActualFeature, association: Association) -> tuple[float, Float]:
    """Return half of a two-point size by rank, and its gradient.

    Two points that are not quite opposite would show a chord. Their local radii add up instead,
    which for opposite points is their distance.
    """
    touches, raw = own_fit(feature)
    arms = touches.tips - raw.point
    heights = np.zeros(len(arms))
    if raw.shape is Shape.CYLINDER:
        heights = arms @ raw.direction
    if raw.shape is not Shape.SPHERE:
        arms = arms - np.outer(arms @ raw.direction, raw.direction)
    directions = arms / np.linalg.norm(arms, axis=1)[:, None]
    opposite = directions @ directions.T < -np.cos(np.deg2rad(_OPPOSITE_DEG))
    level = np.abs(heights[:, None] - heights) < _LEVEL_MM
    first, second = np.nonzero(np.triu(opposite & level))
    if not first.size:
        raise FitError(
            "characteristic.no_pairs",
            f"No two points of {feature.nominal.name} are opposite to each other.",
            "Take points in opposite pairs, at one height.",
        )
    sums = raw.residuals[first] + raw.residuals[second]
    by_residual = feature.residual_jacobian
    if association == "two-point mean":
        chosen = np.arange(len(sums))
    else:
        rank = np.argmax(sums) if association == "two-point maximum" else np.argmin(sums)
        chosen = np.array([int(rank)])
    gradient = feature.jacobian[RADIUS].copy()
    gradient += 0.5 * (by_residual[first[chosen]] + by_residual[second[chosen]]).mean(axis=0)
    return feature.fit.radius + 0.5 * float(sums[chosen].mean()), gradient
