"""The joint covariance of measured points as factors: what is shared, and what each has alone.

The covariance C of N ball centres and the tip radius is never formed. It is

    C = S S' + own + pattern

where S (3 N + 1, m) says how all coordinates answer to m independent standard normal quantities
(cameras, probe, tip radius, temperature, a frame), own is a block for each point, and the pattern
of the sensors is a sparse sum of bumps (`_pattern_field`). A feature, a frame or a value with the
gradients G has the row G S, and its variances and covariances are sums of products of such rows.
Time and memory grow with the number of points, not with its square.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._contributions import Contribution
from ocmm_core.measuring._pattern_field import PatternField


@dataclass(frozen=True, slots=True)
class PointFactors:
    """Uncertainty of N ball centres, x1 y1 z1 x2 ... in mm, and, as last, of the tip radius.

    Attributes
    ----------
    shared
        (3 N + 1, m), mm: how all answer to m independent quantities, one standard deviation each.
    own
        (N, 3, 3), mm^2: what each point has alone.
    pattern
        What near points share; None where nothing.
    """

    shared: Float
    own: Float
    pattern: PatternField | None = None

    @property
    def count(self) -> int:
        """Return the number of points N."""
        return len(self.own)

    def kept(self, places: Sequence[int] | Int) -> PointFactors:
        """Return the factors of some of the points, in the order of ``places``."""
        chosen = np.asarray(places, dtype=np.int64)
        columns = np.append((3 * chosen[:, None] + np.arange(3)).ravel(), 3 * self.count)
        pattern = None
        if self.pattern is not None and len(chosen):
            pattern = self.pattern.kept(chosen)
        return PointFactors(self.shared[columns], self.own[chosen], pattern)

    def with_own(self, added: Float) -> PointFactors:
        """Return them with ``added`` (N, 3, 3), mm^2, to what each point has alone."""
        return replace(self, own=self.own + added)

    def of(self, gradients: Float) -> Float:
        """Return the covariance (k, k) of values from their gradients (k, 3 N + 1)."""
        used, inner = self._used(gradients)
        of_points = gradients[:, :-1].reshape(len(gradients), -1, 3)[:, used]
        rows = of_points.reshape(len(gradients), -1) @ inner.shared[:-1]
        rows += gradients[:, -1:] * inner.shared[-1]
        if inner.pattern is not None:
            rows = np.hstack([rows, inner.pattern.answers(of_points)])
        alone = np.einsum("ani,nij->anj", of_points, inner.own).reshape(len(gradients), -1)
        total: Float = rows @ rows.T + alone @ of_points.reshape(len(gradients), -1).T
        return total

    def moved(self, gradient: Float) -> Float:
        """Return the covariance (3 N + 1,) of a value with the coordinates that it rests on.

        ``gradient`` (3 N + 1,) is that of the value; other coordinates have zero.
        """
        used, inner = self._used(gradient[None])
        of_points = gradient[:-1].reshape(-1, 3)[used]
        of_used = np.append(of_points.ravel(), gradient[-1])
        together = inner.shared @ (inner.shared.T @ of_used)
        places = together[:-1].reshape(-1, 3) + np.einsum("nij,nj->ni", inner.own, of_points)
        if inner.pattern is not None:
            places = places + inner.pattern.moved(of_points)
        found = np.zeros_like(gradient)
        found[:-1].reshape(-1, 3)[used] = places
        found[-1] = together[-1]
        found[gradient == 0.0] = 0.0
        return found

    def draws(self) -> Callable[[np.random.Generator, int], Float]:
        """Return what draws m sets of deviations (m, 3 N + 1), mm, from a generator."""
        variances, vectors = np.linalg.eigh(self.own)
        alone = vectors * np.sqrt(np.maximum(variances, 0.0))[:, None, :]
        pattern = self.pattern
        bumps = None if pattern is None else pattern.bumps()

        def drawn(rng: np.random.Generator, many: int) -> Float:
            moves: Float = rng.standard_normal((many, self.shared.shape[1])) @ self.shared.T
            places = np.einsum("nij,mnj->mni", alone, rng.standard_normal((many, self.count, 3)))
            if pattern is not None and bumps is not None:
                normal = rng.standard_normal((many, 2, bumps.shape[1]))
                places = places + pattern.drawn(normal, bumps)
            moves[:, :-1] += places.reshape(many, -1)
            return moves

        return drawn

    def _used(self, gradients: Float) -> tuple[Int, PointFactors]:
        """Return the places of the points that the values rest on, and their factors."""
        rests = np.any(gradients[:, :-1].reshape(len(gradients), -1, 3) != 0.0, axis=(0, 2))
        if rests.all():
            return np.arange(self.count), self
        used = np.flatnonzero(rests)
        return used, self.kept(used)


def factors_of(parts: Sequence[Contribution], count: int) -> PointFactors:
    """Return the factors of ``count`` points that the parts make together."""
    own = np.zeros((count, 3, 3))
    pattern = None
    # Parts that the points answer to alike are one: told apart, one may be below zero by rounding.
    alike: dict[int, tuple[Float, Float]] = {}
    for part in parts:
        if part.own is not None:
            own += part.own
        if part.field is not None:
            pattern = part.field
        if part.by is not None and part.covariance is not None:
            by, covariance = alike.get(id(part.by), (part.by, np.zeros_like(part.covariance)))
            alike[id(part.by)] = by, covariance + part.covariance
    rows = [by @ root_of(covariance) for by, covariance in alike.values()]
    return PointFactors(np.hstack([np.zeros((3 * count + 1, 0)), *rows]), own, pattern)


def factors_of_matrix(covariance: Float) -> PointFactors:
    """Return the factors of a covariance (3 N + 1, 3 N + 1), mm^2, that is known as a whole."""
    count = (len(covariance) - 1) // 3
    return PointFactors(root_of(covariance), np.zeros((count, 3, 3)))


def root_of(covariance: Float) -> Float:
    """Return R with R R' = ``covariance`` (m, m): its quantities from independent ones, (m, r).

    Quantities of different units are brought to the same size first. Of what is no covariance, as a
    variance below zero, nothing is known: all is NaN, and whoever decides refuses it.
    """
    if not np.all(np.isfinite(covariance)) or np.any(np.diagonal(covariance) < 0.0):
        return np.full_like(covariance, np.nan)
    scale = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    scale = np.where(scale > 0.0, scale, 1.0)
    variances, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = variances > 1e-15 * max(float(variances[-1]), 0.0)
    root: Float = scale[:, None] * vectors[:, kept] * np.sqrt(variances[kept])
    return root
