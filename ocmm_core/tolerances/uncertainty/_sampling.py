"""Form as an uncertainty source: an element through few points of an imperfect surface.

Such an element depends on the touched places. The part of the residuals that the noise of the
points does not explain is attributed to form, independent between places, and propagated through
the fit like a normal error of the points. It is estimated from few residuals, so the uncertainty is
widened by Student's distribution with the effective degrees of freedom of Welch and Satterthwaite
(GUM G.4).

For a surface without visible form, the estimate of one feature is negative as often as positive,
and is kept so: only the sum over all features of a value is limited to zero (F. E. Satterthwaite,
Biometrics Bulletin 2, 1946: a variance composed of mean squares, some with a negative sign).
Truncating each would add up to nonexistent form, growing with the number of features.

Also: the sum of variances of fit residuals due to the noise of the points. The derivative of n
residuals by n points has n squared blocks, but low rank: a residual depends on the element (a dozen
of numbers) and on its own point. With the element J, the derivatives A by it and the own part D,
the trace of (A J + D) C (A J + D)' is

    trace(A (J C J') A') + 2 sum_i A_i (J C)_i D_i' + sum_i D_i C_ii D_i'

and costs linear time in the number of points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, Touches
from ocmm_core.features.shapes import MINIMUM_POINTS, Criterion, Shape
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring import DeviationRows, PointFactors, Rows
from ocmm_core.tolerances.uncertainty._interval import TWO_SIDED


def of_residuals(slopes: DeviationRows, factors: PointFactors) -> tuple[float, Float]:
    """Return the summed variances of n residuals, mm^2, with derivatives (n, 3) by own points."""
    by_geometry, of_points = slopes.by_shared, slopes.shared.at(slopes.places)
    of_element, with_own = factors.of_shared(slopes)
    total = float(np.sum((by_geometry.T @ by_geometry) * of_element))
    total += 2.0 * float(np.sum(by_geometry * with_own))
    total += float(np.sum(factors.of_own(slopes)))
    return total, np.einsum("na,ani->ni", by_geometry, of_points) + slopes.own


_COVERAGE = 2.0


def student_factor(degrees: float) -> float:
    """Return k, by which u becomes U (95.45 %): 2 with infinite degrees of freedom."""
    below = 0.5 + 0.5 * TWO_SIDED
    return float(scipy.special.stdtrit(degrees, below)) if np.isfinite(degrees) else _COVERAGE


@dataclass(frozen=True, slots=True)
class FormSample:
    """Form of the surface of one probed feature, estimated from its points."""

    feature: str
    places: Int
    """(n,): of its points among all N of the job."""
    normals: Float
    """(n, 3, k): unit vectors of the k directions, 1 or 2, of its observed deviations."""
    scatter: float
    """Mean square of the residuals for each degree of freedom, mm^2."""
    variance: float
    """Of the form, mm^2: scatter less the noise of the points; possibly negative."""
    degrees: int
    """Degrees of freedom of the scatter, at least one."""

    def jacobian(self, gradients: Rows) -> Float:
        """Return the derivatives of k values by a deviation at each place, (k, n m)."""
        answers: Float = np.einsum("kni,nij->knj", gradients.at(self.places), self.normals)
        return answers.reshape(len(gradients), -1)


def form_samples(
    actual: Mapping[str, ActualFeature | FitError], factors: PointFactors
) -> tuple[FormSample, ...]:
    """Return the form estimates of probed features with redundant points."""
    found = []
    for name, feature in actual.items():
        if not isinstance(feature, ActualFeature) or feature.touches is None:
            continue
        if feature.fit.shape is Shape.LINE:
            sample = _line_sample(name, feature, feature.touches, factors)
        else:
            sample = _sample(name, feature, feature.touches, factors)
        if sample is not None:
            found.append(sample)
    return tuple(found)


def _sample(
    name: str, feature: ActualFeature, touches: Touches, factors: PointFactors
) -> FormSample | None:
    places = np.array(touches.places, dtype=np.int64)
    degrees = len(places) - MINIMUM_POINTS[feature.fit.shape]
    slopes = feature.by_residuals
    if degrees < 1 or feature.fit.shape is Shape.POINT:
        return None
    residuals = feature.fit.residuals
    if feature.fit.criterion is not Criterion.LEAST_SQUARES:
        # Other elements touch the points from one side or halve their range.
        residuals = residuals - residuals.mean()
    noise, own = of_residuals(slopes, factors)
    lengths = np.linalg.norm(own, axis=1)
    normals = own / np.maximum(lengths, 1e-12)[:, None]
    made = sample_of(
        name, places, normals[:, :, None], float(residuals @ residuals), noise, degrees
    )
    if not touches.along_path:
        return made
    return with_neighbours(made, residuals, touches, slopes, factors)


def _line_sample(
    name: str, feature: ActualFeature, touches: Touches, factors: PointFactors
) -> FormSample | None:
    """Return the sample of a line: deviations in two directions across it, of an edge in one."""
    places = np.array(touches.places, dtype=np.int64)
    n, ways = len(places), 1 if feature.nominal.projection else 2
    degrees = ways * (n - 2)
    if degrees < 1:
        return None
    direction = feature.fit.direction
    across = np.eye(3) - np.outer(direction, direction)
    if ways == 1:
        # Approaches to an edge are square to the normal of its face.
        towards = across @ touches.directions.mean(axis=0)
        across = np.outer(towards, towards) / (towards @ towards)
    along = (touches.tips - touches.tips.mean(axis=0)) @ direction
    # The part of a transverse motion absorbed by shift and rotation of the line is not a residual.
    followed = np.stack([np.full(n, 1.0 / np.sqrt(n)), along / np.linalg.norm(along)])
    rows = Rows.of_points(places, np.kron(followed, across))
    noise = float(np.einsum("nij,ij->", factors.blocks(places)[0], across))
    noise -= float(np.trace(factors.covariance_of(rows)))
    pair = np.linalg.svd(across)[0][:, :ways]
    residuals = feature.fit.residuals
    return sample_of(
        name, places, np.tile(pair, (n, 1, 1)), float(residuals @ residuals), noise, degrees
    )


_MOST_PLACES, _LENGTHS = 120, 8
_AMOUNTS = (0.0, 0.2, 0.4, 0.6, 0.8, 0.95)
_LONGEST = 0.25
_SIZES = np.concatenate([[0.0], np.geomspace(0.02, 8.0, 40)])
"""Standard deviations of the form, in those of the residuals."""


def with_neighbours(
    sample: FormSample,
    residuals: Float,
    touches: Touches,
    slopes: DeviationRows,
    factors: PointFactors,
) -> FormSample:
    """Return the sample of points along a path, whose form is that of their neighbours.

    The part of ``residuals`` (n,) that no element follows has the errors of ``factors`` and a
    form of variance s^2 whose correlation at distance d is ``a exp(-d / L)``. The restricted
    likelihood (H. D. Patterson and R. Thompson, Biometrika 58, 1971) of s, a and L on a grid, all
    equally likely before, gives the mean standard deviation that counts: smooth effects on n points
    vary like those on n / f independent ones, where f is the mean sum of a row of the correlation
    matrix. Its mean includes that these are estimates.
    """
    n = len(residuals)
    some = np.unique(np.linspace(0, n - 1, min(n, _MOST_PLACES)).astype(np.int64))
    distances = scipy.spatial.distance.squareform(scipy.spatial.distance.pdist(touches.tips[some]))
    # Weaker columns are no freedom of the element, as the length of its direction.
    free = np.linalg.svd(slopes.by_shared[some])[0][:, n - sample.degrees :]
    # Without the part by the element, which has no share in them.
    own = DeviationRows.of_own(slopes.places[some], slopes.own[some], slopes.by_radius[some])
    known = free.T @ factors.of_deviations(own) @ free
    deviations = free.T @ residuals[some]
    farthest, square = float(distances.max(initial=0.0)), float(np.mean(deviations**2))
    if not square * farthest > 0.0 or not np.all(np.isfinite(known)):
        return sample
    jitter = 1e-9 * (square + float(np.mean(np.diagonal(known))))
    white = np.linalg.inv(np.linalg.cholesky(known + jitter * np.eye(len(known))))
    likelihoods, counting = [], []
    for length in np.geomspace(0.5 * farthest / len(some), _LONGEST * farthest, _LENGTHS):
        alike = np.exp(-distances / length)
        row = (float(alike.mean()) * len(some) - 1.0) / max(len(some) - 1, 1)
        for amount in _AMOUNTS:
            of_form = amount * alike + (1.0 - amount) * np.eye(len(some))
            variances, axes = np.linalg.eigh(white @ (free.T @ of_form @ free) @ white.T)
            squares = (axes.T @ (white @ deviations)) ** 2
            wide = 1.0 + square * _SIZES[:, None] ** 2 * np.maximum(variances, 0.0)
            likelihoods.append(-0.5 * np.sum(np.log(wide) + squares / wide, axis=1))
            counting.append(np.sqrt(square * (1.0 + amount * row * (n - 1))) * _SIZES)
    shares = np.exp(np.array(likelihoods) - np.max(likelihoods))
    variance = float(np.sum(shares * np.array(counting)) / np.sum(shares)) ** 2
    return replace(sample, scatter=variance, variance=variance)


def sample_of(
    name: str, places: Int, normals: Float, squares: float, noise: float, degrees: int
) -> FormSample:
    """Return a feature's sample; ``squares``, ``noise``: sums, mm^2, of residuals and variances."""
    return FormSample(
        feature=name,
        places=places,
        normals=normals,
        scatter=squares / degrees,
        variance=(squares - noise) / degrees,
        degrees=degrees,
    )


@dataclass(frozen=True, slots=True)
class Widened:
    """Variance of values, with form and widening for few degrees of freedom."""

    covariance: Float
    """(k, k): total."""
    of_form: Mapping[str, Float]
    """Contribution of the form of each feature, (k, k) by name, including widening."""
    degrees: float
    """Effective degrees of freedom; infinite without a contribution of form."""
    scales: Mapping[str, float] = field(default_factory=dict)
    """Variance of a form deviation at one place, mm^2, by feature name, including widening."""


def widened(
    gradients: Rows, factors: PointFactors | None, samples: Sequence[FormSample]
) -> Widened:
    """Return the covariance (k, k) of values with ``gradients``, k rows, form included.

    ``factors`` are all contributions but form. None if the noise of the points is unknown: all
    scatter of ``samples`` then counts as form.
    """
    nothing_known = np.zeros((len(gradients), len(gradients)))
    plain = nothing_known if factors is None else factors.covariance_of(gradients)
    # An invalid covariance is left unchanged, so that the caller can refuse it.
    nothing = factors is not None and float(np.trace(plain)) <= 0.0
    if not np.all(np.isfinite(plain)) or nothing:
        return Widened(plain, {}, np.inf)
    squares_of: dict[str, Float] = {}
    variances: dict[str, float] = {}
    doubt = balance = 0.0
    for sample in samples:
        jacobian = sample.jacobian(gradients)
        if not np.any(jacobian):
            continue
        squares = jacobian @ jacobian.T
        balance += sample.variance * float(np.trace(squares))
        doubt += (sample.scatter * float(np.trace(squares))) ** 2 / sample.degrees
        if sample.variance > 0.0:
            squares_of[sample.feature] = squares
            variances[sample.feature] = sample.variance
    if balance <= 0.0:
        return Widened(plain, {}, np.inf)
    # Negative ones reduce the others: a row of a budget has no negative variance.
    kept = balance / sum(variances[name] * float(np.trace(of)) for name, of in squares_of.items())
    form = kept * sum((variances[k] * of for k, of in squares_of.items()), np.zeros_like(plain))
    total = plain + form
    degrees = float(np.trace(total)) ** 2 / doubt
    factor = (student_factor(degrees) / _COVERAGE) ** 2
    # Widening is attributed to poorly determined contributions, so that the budget adds up.
    share = float(np.trace(form))
    extra = 1.0 + (factor - 1.0) * float(np.trace(total)) / share
    scales = {name: extra * kept * variance for name, variance in variances.items()}
    grown = {name: scales[name] * of for name, of in squares_of.items()}
    return Widened(plain + extra * form, grown, degrees, scales)
