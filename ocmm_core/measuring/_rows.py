"""Derivatives of values by the points of a job, sparse in the points.

A value depends on the points of one or a few features. Its other derivatives are zero and not
stored, so rows cost their content and not the size of the job.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ocmm_core.geometry import Float, Int


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Derivatives of values by ball centres and the tip radius.

    Rows are added, multiplied with numbers and, from the left, with matrices like the arrays (...,
    3 N + 1) that they represent; an index selects values.
    """

    places: Int
    """(p,) int64, ascending: of the points among all N of the job."""
    by_points: Float
    """(..., p, 3): by these ball centres; by all others it is zero."""
    by_radius: Float
    """(...): by the tip radius."""

    __array_ufunc__: ClassVar[None] = None
    """Makes arrays leave products to rows."""

    @classmethod
    def nothing(cls, *shape: int) -> Rows:
        """Return rows of constant values."""
        return cls(np.zeros(0, dtype=np.int64), np.zeros((*shape, 0, 3)), np.zeros(shape))

    @classmethod
    def of_points(cls, places: Sequence[int] | Int, by_points: Float) -> Rows:
        """Return rows from derivatives (k, 3 n) by ``n`` different points, in any order."""
        found = np.asarray(places, dtype=np.int64)
        blocks = by_points.reshape(*by_points.shape[:-1], len(found), 3)
        if np.any(found[1:] <= found[:-1]):
            order = np.argsort(found)
            found, blocks = found[order], blocks[..., order, :]
        return cls(found, blocks, np.zeros(blocks.shape[:-2]))

    @classmethod
    def of_dense(cls, gradients: Float) -> Rows:
        """Return rows from arrays (..., 3 N + 1), without points of zero derivative."""
        blocks = gradients[..., :-1].reshape(*gradients.shape[:-1], gradients.shape[-1] // 3, 3)
        rests = np.any(blocks != 0.0, axis=(*range(blocks.ndim - 2), blocks.ndim - 1))
        return cls(np.flatnonzero(rests), blocks[..., rests, :], gradients[..., -1])

    @classmethod
    def stacked(cls, parts: Sequence[Rows]) -> Rows:
        places = parts[0].places
        for part in parts[1:]:
            places = _together(places, part.places)
        return cls(
            places,
            np.concatenate([part.at(places) for part in parts]),
            np.concatenate([part.by_radius for part in parts]),
        )

    @property
    def shape(self) -> tuple[int, ...]:
        return self.by_radius.shape

    def at(self, places: Int) -> Float:
        """Return the derivatives (..., n, 3) by some points; zero for absent ones."""
        if places is self.places or np.array_equal(places, self.places):
            return self.by_points
        found = np.zeros((*self.shape, len(places), 3))
        if len(self.places):
            index = np.minimum(np.searchsorted(self.places, places), len(self.places) - 1)
            known = self.places[index] == places
            found[..., known, :] = self.by_points[..., index[known], :]
        return found

    def dense(self, count: int) -> Float:
        """Return the array (..., 3 N + 1) of a job of ``count`` points; for tests."""
        found = self.at(np.arange(count)).reshape(*self.shape, 3 * count)
        return np.concatenate([found, self.by_radius[..., None]], axis=-1)

    def moving(self) -> NDArray[np.bool_]:
        """Return which values have any nonzero derivative."""
        by_points = np.any(self.by_points != 0.0, axis=(-2, -1))
        moving: NDArray[np.bool_] = by_points | (self.by_radius != 0.0)
        return moving

    def greatest(self) -> float:
        """Return the largest magnitude of a derivative."""
        greatest = float(np.abs(self.by_radius).max(initial=0.0))
        return max(greatest, float(np.abs(self.by_points).max(initial=0.0)))

    def lengths(self) -> Float:
        """Return the norm of all derivatives of every value."""
        squares = np.sum(self.by_points**2, axis=(-2, -1)) + self.by_radius**2
        return np.asarray(np.sqrt(squares), dtype=np.float64)

    def reshaped(self, *shape: int) -> Rows:
        blocks = self.by_points.reshape(*shape, *self.by_points.shape[-2:])
        return Rows(self.places, blocks, self.by_radius.reshape(shape))

    def along(self, vectors: Float) -> Rows:
        """Return rows (m,) of the products of vectors (m, d) with vectors of these derivatives."""
        return Rows(
            self.places,
            np.einsum("md,mdpi->mpi", vectors, self.by_points),
            np.sum(vectors * self.by_radius, axis=1),
        )

    def outer(self, values: Float) -> Rows:
        """Return rows (k, ...): these, times each of ``values`` (k,)."""
        return Rows(
            self.places,
            np.multiply.outer(values, self.by_points),
            np.multiply.outer(values, self.by_radius),
        )

    def with_radius(self, added: Float | float) -> Rows:
        """Return the rows with ``added`` to the derivative by the tip radius."""
        return Rows(self.places, self.by_points, self.by_radius + added)

    def __len__(self) -> int:
        return int(self.by_radius.shape[0])

    def __getitem__(self, key: int | slice | Int | list[int] | None) -> Rows:
        if key is None:
            return Rows(self.places, self.by_points[None], self.by_radius[None])
        return Rows(self.places, self.by_points[key], np.asarray(self.by_radius[key]))

    def __rmatmul__(self, matrix: Float) -> Rows:
        blocks = np.tensordot(matrix, self.by_points, axes=1)
        radius = np.tensordot(matrix, self.by_radius, axes=1)
        return Rows(self.places, blocks, np.asarray(radius))

    def __matmul__(self, movement: Float) -> Float:
        """Return the derivatives (..., m) from those of coordinates and radius (3 N + 1, m)."""
        blocks = movement[:-1].reshape(-1, 3, *movement.shape[1:])[self.places]
        of_points = np.tensordot(self.by_points, blocks, axes=2)
        return np.asarray(of_points + np.multiply.outer(self.by_radius, movement[-1]))

    def __add__(self, other: Rows) -> Rows:
        places = _together(self.places, other.places)
        return Rows(places, self.at(places) + other.at(places), self.by_radius + other.by_radius)

    def __neg__(self) -> Rows:
        return Rows(self.places, -self.by_points, -self.by_radius)

    def __sub__(self, other: Rows) -> Rows:
        return self + -other

    def __mul__(self, factor: float) -> Rows:
        return Rows(self.places, factor * self.by_points, factor * self.by_radius)

    def __rmul__(self, factor: float) -> Rows:
        return self * factor

    def __truediv__(self, divisor: float) -> Rows:
        return self * (1.0 / divisor)


@dataclass(frozen=True, slots=True, eq=False)
class DeviationRows:
    """Derivatives of n deviations: by few quantities that all share, and each by its own point.

    As `Rows` they would be n squared blocks. An index selects deviations; weights (k, n) from the
    left give k rows of their sums.
    """

    __array_ufunc__: ClassVar[None] = None
    """Makes arrays leave products to rows."""

    by_shared: Float
    """(n, q): by the shared quantities, as the numbers of an element or frame."""
    shared: Rows
    """(q,): derivatives of those by the points."""
    places: Int
    """(n,): of the own point of each among all N of the job."""
    own: Float
    """(n, 3): by its ball centre, at constant shared quantities."""
    by_radius: Float
    """(n,): by the tip radius, likewise."""

    @classmethod
    def of_own(
        cls, places: Sequence[int] | Int, own: Float, by_radius: Float | float = 0.0
    ) -> DeviationRows:
        """Return deviations without shared quantities."""
        radius = np.broadcast_to(np.asarray(by_radius, dtype=np.float64), len(own))
        found = np.asarray(places, dtype=np.int64)
        return cls(np.zeros((len(own), 0)), Rows.nothing(0), found, own, radius)

    @classmethod
    def of_rows(cls, rows: Rows) -> DeviationRows:
        """Return deviations that depend on shared quantities only, as constructed centres do."""
        n = len(rows)
        return cls(np.eye(n), rows, np.repeat(rows.places[:1], n), np.zeros((n, 3)), np.zeros(n))

    @classmethod
    def stacked(cls, parts: Sequence[DeviationRows]) -> DeviationRows:
        """Return the deviations of several, one after another."""
        first, by_shared = 0, []
        whole = sum(len(part.shared) for part in parts)
        for part in parts:
            by_shared.append(np.zeros((len(part), whole)))
            by_shared[-1][:, first : first + len(part.shared)] = part.by_shared
            first += len(part.shared)
        return cls(
            np.concatenate(by_shared),
            Rows.stacked([part.shared for part in parts]),
            np.concatenate([part.places for part in parts]),
            np.concatenate([part.own for part in parts]),
            np.concatenate([part.by_radius for part in parts]),
        )

    def with_shared(self, by_shared: Float, shared: Rows) -> DeviationRows:
        """Return the deviations with further shared quantities: (n, r), and r rows."""
        return replace(
            self,
            by_shared=np.hstack([self.by_shared, by_shared]),
            shared=Rows.stacked([self.shared, shared]),
        )

    def without(self, followed: Float) -> DeviationRows:
        """Return the part of the deviations outside the orthonormal columns (n, k)."""
        return self.with_shared(-followed, followed.T @ self)

    @property
    def touched(self) -> Int:
        """Return the places of all points that they depend on, ascending."""
        known = self.shared.places
        return known if np.array_equal(known, self.places) else np.union1d(known, self.places)

    @property
    def rows(self) -> Rows:
        """Return n rows; n squared blocks."""
        places = self.touched
        blocks = np.tensordot(self.by_shared, self.shared.at(places), axes=1)
        blocks[np.arange(len(self)), np.searchsorted(places, self.places)] += self.own
        return Rows(places, blocks, self.by_shared @ self.shared.by_radius + self.by_radius)

    def __rmatmul__(self, weights: Float) -> Rows:
        own = (weights[:, :, None] * self.own).reshape(len(weights), 3 * len(self))
        alone = Rows.of_points(self.places, own).with_radius(weights @ self.by_radius)
        return (weights @ self.by_shared) @ self.shared + alone

    def __len__(self) -> int:
        return len(self.own)

    def __getitem__(self, key: slice | Int | list[int]) -> DeviationRows:
        return DeviationRows(
            self.by_shared[key], self.shared, self.places[key], self.own[key], self.by_radius[key]
        )


def _together(one: Int, other: Int) -> Int:
    if one is other or not len(other) or np.array_equal(one, other):
        return one
    return np.union1d(one, other) if len(one) else other
