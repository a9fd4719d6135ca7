"""Views of many features that look up what somebody asks for, and nothing else.

Whoever keeps what was computed from features has to know of which. Copies of all of them into
dictionaries would say: of all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Generic, TypeVar

from ocmm_core.errors import FitError
from ocmm_core.features.measured._actual import ActualFeature
from ocmm_core.geometry import Float

V = TypeVar("V")


class Each(Mapping[str, V], Generic[V]):
    """One thing of every feature that is measured.

    Parameters
    ----------
    actual
        Features as measured, or why they are not.
    of
        What is wanted of one.
    """

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
    """Features, some of them others than they were.

    Parameters
    ----------
    others
        By names that ``actual`` has, too.
    actual
        All of them.
    """

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
    """Return the features that are measured, by name."""
    return Each(actual, lambda feature: feature)


def geometries_of(actual: Mapping[str, ActualFeature | FitError]) -> Each[Float]:
    """Return the geometry vectors (12,), mm, of the features that are measured, by name."""
    return Each(actual, lambda feature: feature.fit.geometry)
