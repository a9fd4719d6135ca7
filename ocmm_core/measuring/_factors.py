"""The joint covariance of measured points as factors: shared and independent parts.

The covariance of N ball centres and the tip radius is never formed. It is

    C = S S' + own + pattern

where S (3 N + 1, m) holds the derivatives of all coordinates by m independent standard normal
quantities (cameras, probe, tip radius, temperature, a frame), own has a block for each point, and
the pattern of the sensors is a sparse sum of bumps (`_pattern_field`). Gradients G (`Rows`) of a
feature, frame or value give the row G S; variances and covariances are sums of products of such
rows. Time and memory are linear in the number of points.

It is propagated from the records of all points of a job at once (GUM 5.2.2):

- scatter of each point's window and undetected motion of the ball in it, independent between
  points;
- the position-dependent part of the spot error (pixel pattern, residual of the lens model): a
  Gaussian field on each sensor, shared by near points;
- calibration of the cameras and geometry of the probe: common to all points; with a probe design,
  that geometry's covariance includes thermal growth and sag
  (`calibration.probe_design.body_in_use`);
- the force of the hand, with a probe design (`_contributions`);
- the pose of a reference body, if used: its LEDs, and the noise of its first pose;
- the pose of a saved frame not measured in the job;
- the scale of a part reported at 20 °C (`_temperature`);
- the radius of the ball: common to all points, a last, separate quantity because it acts on
  features and not on ball centres.

Common parts cancel or not depending on the characteristic, which a covariance per point cannot
represent. `_contributions` has the named parts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.probe_design import ContactForce
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._contributions import (
    Contribution,
    FeatureUncertainty,
    FrameDoubt,
    contributions,
    systematic_contributions,
)
from ocmm_core.measuring._pattern_field import PatternField, joined_fields
from ocmm_core.measuring._point import MeasuredPoint
from ocmm_core.measuring._rows import DeviationRows, Rows
from ocmm_core.measuring._temperature import PartTemperature
from ocmm_core.tracking import ProbeBody, TipSensitivity

_BLOCK = 64
"""Deviations that are drawn with their correlation by the pattern."""
_DRAWN_TOGETHER = 601
"""Size of a set: 200 points and the tip radius. The root takes 3 MB and 0.1 s."""


@dataclass(frozen=True, slots=True)
class PointFactors:
    """Uncertainty of N ball centres, x1 y1 z1 x2 ... in mm, and, last, the tip radius."""

    shared: Float
    """(3 N + 1, m), mm: derivatives by m independent quantities in standard deviations."""
    own: Float
    """(N, 3, 3), mm^2: independent part of each point."""
    pattern: PatternField | None = None
    """Sensor pattern shared by near points; None if zero."""
    places: Int | None = None
    """(N,) int64, ascending: point numbers in rows; None for 0 to N - 1."""

    @property
    def count(self) -> int:
        return len(self.own)

    def kept(self, places: Sequence[int] | Int) -> PointFactors:
        """Return the factors of the points ``places``, renumbered from 0 in that order."""
        chosen = np.asarray(places, dtype=np.int64)
        if self.places is not None:
            chosen = np.searchsorted(self.places, chosen)
        columns = np.append((3 * chosen[:, None] + np.arange(3)).ravel(), 3 * self.count)
        pattern = None
        if self.pattern is not None and len(chosen):
            pattern = self.pattern.kept(chosen)
        return PointFactors(self.shared[columns], self.own[chosen], pattern)

    def at(self, places: Int) -> PointFactors:
        """Return the factors of points 0 to N - 1 as those of points ``places``, sorted by them."""
        order = np.argsort(places)
        ascending = np.array_equal(order, np.arange(len(places)))
        return replace(self if ascending else self.kept(order), places=places[order])

    def with_own(self, added: Float) -> PointFactors:
        """Return the factors with ``added`` (N, 3, 3), mm^2, in the independent parts."""
        return replace(self, own=self.own + added)

    def covariance_of(self, gradients: Rows | Float) -> Float:
        """Return the covariance (k, k) of values from their gradients: rows, or (k, 3 N + 1)."""
        rows = gradients if isinstance(gradients, Rows) else Rows.of_dense(gradients)
        inner, flat = self._at(rows.places), rows.by_points.reshape(len(rows), -1)
        alone = np.einsum("ani,nij->anj", rows.by_points, inner.own).reshape(len(rows), -1)
        answers = _answers(rows, inner.shared)
        total: Float = answers @ answers.T + alone @ flat.T
        if inner.pattern is not None:
            answers = inner.pattern.answers(rows)
            total += answers @ answers.T
        return total

    def of_deviations(self, rows: DeviationRows) -> Float:
        """Return the covariance (n, n), mm^2, of n deviations, in fewer than n^3 steps."""
        own = self.covariance_of(DeviationRows.of_own(rows.places, rows.own, rows.by_radius).rows)
        if not len(rows.shared):
            return own
        by = rows.by_shared
        of_shared, with_own = self.of_shared(rows)
        mixed = with_own @ by.T
        return by @ of_shared @ by.T + mixed + mixed.T + own

    def of_shared(self, rows: DeviationRows) -> tuple[Float, Float]:
        """Return the covariance (q, q) of the shared quantities, and theirs (n, q) with own parts.

        The own part of a deviation is that at constant shared quantities.
        """
        places = rows.touched
        shared = Rows(places, rows.shared.at(places), rows.shared.by_radius)
        moved = self.moved(shared)
        of_shared = np.tensordot(shared.by_points, moved.by_points, axes=((1, 2), (1, 2)))
        of_shared += np.outer(shared.by_radius, moved.by_radius)
        with_own = np.einsum("qni,ni->nq", moved.at(rows.places), rows.own)
        return of_shared, with_own + np.outer(rows.by_radius, moved.by_radius)

    def of_own(self, rows: DeviationRows) -> Float:
        """Return the variance of the own part of each deviation, (n,), mm^2."""
        inner = self._at(rows.places)
        own = inner.own if inner.pattern is None else inner.own + inner.pattern.own
        found: Float = np.einsum("ni,nij,nj->n", rows.own, own, rows.own)
        found += np.sum(_own_answers(rows, inner.shared) ** 2, axis=1)
        return found

    def drawn_deviations(self, rows: DeviationRows, rng: np.random.Generator, count: int) -> Float:
        """Return ``count`` draws of the errors of n deviations, (count, n), mm; linear in n.

        Own points share the pattern of the sensors with their neighbours in the order of the rows,
        not across blocks of them: along a path it ends after some millimetres. Their share in an
        element of the same points, some of n, counts as that of others.
        """
        places = rows.touched
        inner, at = self._at(places), np.searchsorted(places, rows.places)
        shared = Rows(np.arange(len(places)), rows.shared.at(places), rows.shared.by_radius)
        by = _own_answers(rows, self._at(rows.places).shared)
        by += rows.by_shared @ _answers(shared, inner.shared)
        alone = PointFactors(np.zeros((3 * inner.count + 1, 0)), inner.own, inner.pattern)
        if len(shared):
            by = np.hstack([by, rows.by_shared @ root_of(alone.covariance_of(shared))])
        draws: Float = rng.standard_normal((count, by.shape[1])) @ by.T
        for first in range(0, len(rows), _BLOCK):
            some = slice(first, first + _BLOCK)
            root = root_of(alone.covariance_of(DeviationRows.of_own(at[some], rows.own[some]).rows))
            draws[:, some] += rng.standard_normal((count, root.shape[1])) @ root.T
        return draws

    def moved(self, gradients: Rows) -> Rows:
        """Return the covariances of k values with the coordinates in their rows."""
        inner = self._at(gradients.places)
        # Most rows of an element are zero: a sphere has no direction.
        live = np.flatnonzero(gradients.moving())
        some = gradients if len(live) == len(gradients) else gradients[live]
        found = np.zeros(gradients.by_points.shape)
        together = np.zeros((len(gradients), 3 * inner.count + 1))
        together[live] = _answers(some, inner.shared) @ inner.shared.T
        found[live] = (some.by_points[:, :, None] @ inner.own)[:, :, 0]
        if inner.pattern is not None:
            found[live] += inner.pattern.moved(some)
        found += together[:, :-1].reshape(found.shape)
        return Rows(gradients.places, found, together[:, -1])

    def blocks(self, places: Int) -> tuple[Float, Float, float]:
        """Return the covariance blocks of single points, mm^2.

        (n, 3, 3) of each point, (n, 3) of each with the tip radius, and the variance of the radius.
        """
        inner = self._at(places)
        by_points, radius = inner.shared[:-1].reshape(len(places), 3, -1), inner.shared[-1]
        blocks = inner.own + by_points @ by_points.transpose(0, 2, 1)
        if inner.pattern is not None:
            blocks = blocks + inner.pattern.own
        return blocks, by_points @ radius, float(radius @ radius)

    def draws(self) -> Callable[[np.random.Generator, int], Float]:
        """Return a function that draws m sets of deviations (m, 3 N + 1), mm.

        Few points are drawn from the root of their covariance: 3 N + 1 numbers a set, where the sum
        of bumps takes some thousand. For many points that root would be larger.
        """
        numbers = 3 * self.count + 1
        if numbers <= _DRAWN_TOGETHER:
            root = root_of(self.covariance_of(np.eye(numbers)))
            return lambda rng, many: rng.standard_normal((many, root.shape[1])) @ root.T
        variances, vectors = np.linalg.eigh(self.own)
        alone = vectors * np.sqrt(np.maximum(variances, 0.0))[:, None, :]
        pattern = None if self.pattern is None else self.pattern.drawing()

        def drawn(rng: np.random.Generator, many: int) -> Float:
            moves: Float = rng.standard_normal((many, self.shared.shape[1])) @ self.shared.T
            places = np.einsum("nij,mnj->mni", alone, rng.standard_normal((many, self.count, 3)))
            if pattern is not None:
                bumps, by_pattern = pattern
                places = places + by_pattern(rng.standard_normal((many, 2, bumps)))
            moves[:, :-1] += places.reshape(many, -1)
            return moves

        return drawn

    def _at(self, places: Int) -> PointFactors:
        known = np.arange(self.count) if self.places is None else self.places
        return self if np.array_equal(places, known) else self.kept(places)


def _answers(rows: Rows, shared: Float) -> Float:
    """Return the derivatives of k values by the shared quantities, (k, m)."""
    answers: Float = rows.by_points.reshape(len(rows), len(shared) - 1) @ shared[:-1]
    answers += rows.by_radius[:, None] * shared[-1]
    return answers


def _own_answers(rows: DeviationRows, shared: Float) -> Float:
    """Return the derivatives of the own parts of n points by the shared quantities, (n, m)."""
    answers: Float = np.einsum("ni,nim->nm", rows.own, shared[:-1].reshape(len(rows), 3, -1))
    answers += np.outer(rows.by_radius, shared[-1])
    return answers


def factors_of(
    parts: Sequence[Contribution], count: int, root: Callable[[Float], Float] | None = None
) -> PointFactors:
    """Return the factors of ``count`` points; ``root`` replaces `root_of`, e.g. by a cache."""
    root = root or root_of
    own = np.zeros((count, 3, 3))
    pattern = None
    # Parts with equal derivatives are merged: separately, rounding may make one negative.
    alike: dict[int, tuple[Float, Float]] = {}
    for part in parts:
        if part.own is not None:
            own += part.own
        if part.field is not None:
            pattern = part.field
        if part.by is not None and part.covariance is not None:
            by, covariance = alike.get(id(part.by), (part.by, np.zeros_like(part.covariance)))
            alike[id(part.by)] = by, covariance + part.covariance
    roots = [(by, root(covariance)) for by, covariance in alike.values()]
    shared = np.empty((3 * count + 1, sum(half.shape[1] for _, half in roots)))
    blocks, end = shared[:-1].reshape(count, 3, shared.shape[1]), 0
    for by, half in roots:
        first, end = end, end + half.shape[1]
        # Point by point: the same bits for a point alone as among others.
        np.matmul(by[:-1].reshape(count, 3, len(half)), half, out=blocks[:, :, first:end])
        shared[-1, first:end] = by[-1] @ half
    return PointFactors(shared, own, pattern)


def joined_factors(parts: Sequence[PointFactors]) -> PointFactors:
    """Return the joined factors of disjoint parts, with ``places``, that share the quantities."""
    if len(parts) == 1:
        return parts[0]
    fields = [part.pattern for part in parts if part.pattern is not None]
    joined = PointFactors(
        np.concatenate([*(part.shared[:-1] for part in parts), parts[0].shared[-1:]]),
        np.concatenate([part.own for part in parts]),
        joined_fields(fields) if fields else None,
    )
    return joined.at(np.concatenate([part.places for part in parts if part.places is not None]))


def factors_of_matrix(covariance: Float) -> PointFactors:
    """Return the factors of a dense covariance (3 N + 1, 3 N + 1), mm^2."""
    count = (len(covariance) - 1) // 3
    return PointFactors(root_of(covariance), np.zeros((count, 3, 3)))


def root_of(covariance: Float) -> Float:
    """Return R (m, r) with R R' = ``covariance`` (m, m).

    Quantities of different units are first scaled to the same size. An invalid covariance, such as
    a negative variance, gives NaN throughout, to be refused by the caller.
    """
    if not np.all(np.isfinite(covariance)) or np.any(np.diagonal(covariance) < 0.0):
        return np.full_like(covariance, np.nan)
    scale = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    scale = np.where(scale > 0.0, scale, 1.0)
    variances, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = variances > 1e-15 * max(float(variances[-1]), 0.0)
    root: Float = scale[:, None] * vectors[:, kept] * np.sqrt(variances[kept])
    return root


COVERAGE_FACTOR = 2.0
"""k of every expanded uncertainty U = k u that the product states."""


def joint_factors(
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    contact: ContactForce | None = None,
    part: PartTemperature | None = None,
    common: Sequence[FrameDoubt | FeatureUncertainty] = (),
    root: Callable[[Float], Float] | None = None,
) -> PointFactors:
    """Return the factors of the covariance of all ball centres and the tip radius.

    Arguments as in `contributions`; ``root`` replaces `root_of`, for callers that cache results.
    """
    parts = contributions(points, sensitivities, rig, body, contact, part, None, common)
    return factors_of(parts, len(points), root)


def systematic_covariance(
    sensitivities: Sequence[TipSensitivity], rig: Rig, body: ProbeBody
) -> Float:
    """Return the dense covariance (3 N, 3 N), mm^2, that averaging does not remove; few points."""
    count = len(sensitivities)
    factors = factors_of(systematic_contributions(sensitivities, rig, body), count)
    return factors.covariance_of(np.eye(3 * count, 3 * count + 1))


def point_uncertainty(
    sensitivity: TipSensitivity, rig: Rig, body: ProbeBody, random_covariance: Float | None = None
) -> float:
    """Return U (k = 2), mm, of one point in its worst direction.

    Without ``random_covariance`` (3, 3), mm^2, it excludes the point's own window.
    """
    random = np.zeros((3, 3)) if random_covariance is None else random_covariance
    return float(point_uncertainties([sensitivity], rig, body, random[None])[0])


def point_uncertainties(
    sensitivities: Sequence[TipSensitivity], rig: Rig, body: ProbeBody, random_covariance: Float
) -> Float:
    """Return U (k = 2), mm, of points in their worst directions, (n,); random: (n, 3, 3), mm^2."""
    count = len(sensitivities)
    if not count:
        return np.zeros(0)
    factors = factors_of(systematic_contributions(sensitivities, rig, body), count)
    covariance = factors.blocks(np.arange(count))[0] + random_covariance
    worst = np.linalg.eigvalsh(covariance)[:, -1]
    return np.asarray(COVERAGE_FACTOR * np.sqrt(worst), dtype=np.float64)
