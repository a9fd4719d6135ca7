"""Cached minimum zones and bounding elements of ball centres: a search takes 0.1 s."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from ocmm_core.features.shapes import Criterion, Fit
from ocmm_core.features.zones import fit_bounded, fit_zone
from ocmm_core.geometry import Points3

_KEPT = 100
"""Cache size: more than a job has characteristics of form."""


def associated(start: Fit, points: Points3, criterion: Criterion, offset: float = 0.0) -> Fit:
    """Return the element of points (n, 3), mm, by a criterion other than least squares.

    ``start`` is their least-squares fit; ``offset``, mm, the distance of the points outside an
    ellipse, for its minimum zone. FitError as `features.zones.fit_zone` and `fit_bounded`.
    """
    return _searched(_Search(start, points, criterion, offset))


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """Cache key of a search; equal if all numbers are."""

    start: Fit
    points: Points3
    criterion: Criterion
    offset: float

    def _key(self) -> tuple[str, str, bytes, bytes, float]:
        return (
            self.criterion.value,
            self.start.shape.value,
            self.start.geometry.tobytes(),
            self.points.tobytes(),
            self.offset,
        )

    def __hash__(self) -> int:
        return hash(self._key())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Search) and self._key() == other._key()


@lru_cache(maxsize=_KEPT)
def _searched(search: _Search) -> Fit:
    if search.criterion is Criterion.MINIMUM_ZONE:
        return fit_zone(search.start, search.points, search.offset)
    return fit_bounded(search.start, search.points, search.criterion)
