"""Lazy mappings over many features: caches of results track only the features they use.

Also: features re-associated with their points under a constrained direction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import fit_oriented, fixed_direction, turned_direction
from ocmm_core.features.measured._actual import ActualFeature, Touches, compensated, fit_projected
from ocmm_core.features.search import unambiguous
from ocmm_core.features.shapes import Criterion, Fit, Shape
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows

V = TypeVar("V")


class Each(Mapping[str, V], Generic[V]):
    """Mapping of one property, given by ``of``, over all measured features, or errors."""

    def __init__(
        self, actual: Mapping[str, ActualFeature | FitError], of: Callable[[ActualFeature], V]
    ) -> None:
        self._actual, self._of = actual, of

    def __getitem__(self, name: str) -> V:
        feature = self._actual[name]
        if isinstance(feature, FitError):
            raise KeyError(name)
        return self._of(feature)

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._actual if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)


class Instead(Mapping[str, ActualFeature]):
    """Mapping view of ``actual`` with the features of ``others`` replaced."""

    def __init__(
        self, others: Mapping[str, ActualFeature], actual: Mapping[str, ActualFeature]
    ) -> None:
        self._others, self._actual = others, actual

    def __getitem__(self, name: str) -> ActualFeature:
        return self._others[name] if name in self._others else self._actual[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._actual)

    def __len__(self) -> int:
        return len(self._actual)


def measured_of(actual: Mapping[str, ActualFeature | FitError]) -> Each[ActualFeature]:
    """Return the measured features by name."""
    return Each(actual, lambda feature: feature)


def geometries_of(actual: Mapping[str, ActualFeature | FitError]) -> Each[Float]:
    """Return the geometry vectors (12,), mm, of the measured features by name."""
    return Each(actual, lambda feature: feature.fit.geometry)


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
