"""Lazy mappings over many features: caches of results track only the features they use."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Generic, TypeVar

from ocmm_core.errors import FitError
from ocmm_core.features.measured._actual import ActualFeature
from ocmm_core.geometry import Float

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
