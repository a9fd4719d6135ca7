"""Sizes by an association other than the feature's own (ISO 14405-1)."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import CRITERIA, RADIUS, Criterion
from ocmm_core.geometry import Float
from ocmm_core.tolerances.zones import (
    Association,
    Characteristic,
    Evaluation,
    Ranked,
    across_slot,
    around,
    associated,
    between_faces,
    least_squares,
    own_fit,
)

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
    """Return the size of one feature by the plan's association.

    Diameter or radius of circle, sphere and cylinder; length or width of slot and rectangle.

    Raises
    ------
    FitError
        The feature is constructed, no such element was found, or no two points are opposite.
    """
    association = characteristic.association
    if characteristic.kind in ("length", "width"):
        lengthwise = characteristic.kind == "length"
        return _of_rank(*across_slot(feature, association, lengthwise=lengthwise), association)
    factor = 2.0 if characteristic.kind == "diameter" else 1.0
    if association not in CRITERIA:
        halves, gradients = around(feature, association)
        return _of_rank(factor * halves, factor * gradients, association)
    radius, gradient = _radius(feature, CRITERIA[association])
    return Evaluation(factor * radius, factor * gradient, association=size_words(association))


def distance_of_faces(
    characteristic: Characteristic, first: ActualFeature, second: ActualFeature
) -> Evaluation:
    """Return the two-point size between two opposite faces.

    Raises
    ------
    FitError
        As `two_point.between_faces`.
    """
    association = characteristic.association
    return _of_rank(*between_faces(first, second, association), association)


def _of_rank(sizes: Float, gradients: Float, association: Association) -> Evaluation:
    """Return the size that a rank takes of two-point sizes, the foremost of which is the first."""
    words = size_words(association)
    if association == "two-point mean":
        return Evaluation(float(sizes.mean()), gradients.mean(axis=0), association=words)
    ranked = Ranked(sizes, gradients, association == "two-point maximum")
    return Evaluation(float(sizes[0]), gradients[0], ranked=ranked, association=words)


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
