"""What a few points on a surface that is not perfect leave open: form as a source of uncertainty.

An element through few points depends on which places of the surface were touched. The residuals of
the fit show how far the surface is from the element; what of them the noise of the points does not
explain is taken for the form of the surface, independent from place to place, and is propagated
through the fit like an error of the points along their normals. It is known from few residuals, so
the uncertainty is widened as Student's distribution demands, with the effective degrees of freedom
of Welch and Satterthwaite (GUM G.4).

The estimate for one feature comes out below zero as often as above where its surface has no form
that could be seen, and is kept so: what a value gets of the form of all its features is their sum,
and only that is not let below zero (F. E. Satterthwaite, Biometrics Bulletin 2, 1946: a variance
composed of mean squares, some with a negative sign). Each of them cut off at zero would add up to
form that is not there, the more the more features a value rests on.

What the noise of the points does to the residuals of a fit, summed up over them.

The derivative of n residuals by n points has n squared blocks, but it is a part of few rows: a
residual answers to the element, which is a dozen of numbers, and to its own point. With the element
J, the derivatives A by it and the own part D, the trace of (A J + D) C (A J + D)' is

    trace(A (J C J') A') + 2 sum_i A_i (J C)_i D_i' + sum_i D_i C_ii D_i'

and costs as much as there are points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtrit

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, ResidualSlopes, Touches
from ocmm_core.features.shapes import MINIMUM_POINTS, Criterion, Shape
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring import PointFactors, Rows
from ocmm_core.tolerances.uncertainty._interval import TWO_SIDED


def of_residuals(slopes: ResidualSlopes, factors: PointFactors) -> tuple[float, Float]:
    """Return the sum of the variances of n residuals, mm^2, and how each answers to its own point.

    Returns
    -------
    The sum of the variances, and (n, 3).
    """
    by_geometry, element, places = slopes.by_geometry, slopes.geometry, slopes.places
    of_points = element.at(places)
    # Points that the element does not rest on, as those of a plane, are in its own covariance only.
    moved = factors.moved(element)
    blocks, with_radius, radius = factors.blocks(places)
    normals, by_radius = slopes.normals, slopes.by_radius
    of_element = np.tensordot(element.by_points, moved.by_points, axes=((1, 2), (1, 2)))
    of_element += np.outer(element.by_radius, moved.by_radius)
    total = float(np.einsum("na,ab,nb->", by_geometry, of_element, by_geometry))
    shared = np.einsum("ani,ni->na", moved.at(places), normals) + by_radius * moved.by_radius
    total += 2.0 * float(np.sum(by_geometry * shared))
    total += float(np.einsum("ni,nij,nj->", normals, blocks, normals))
    total += float(
        np.sum(by_radius * (2.0 * np.sum(normals * with_radius, axis=1) + by_radius * radius))
    )
    return total, np.einsum("na,ani->ni", by_geometry, of_points) + normals


_COVERAGE = 2.0


def student_factor(degrees: float) -> float:
    """Return k, by which u becomes U (95.45 %): 2 with infinite degrees of freedom."""
    return float(stdtrit(degrees, 0.5 + 0.5 * TWO_SIDED)) if np.isfinite(degrees) else _COVERAGE


@dataclass(frozen=True, slots=True)
class FormSample:
    """What the points of one probed feature say about the form of its surface."""

    feature: str
    places: Int
    """(n,): of its points among all N of the job."""
    normals: Float
    """(n, 3, k): unit vectors of the k directions, 1 or 2, in which its deviations were seen."""
    scatter: float
    """Mean square of the residuals for each degree of freedom, mm^2."""
    variance: float
    """Of the form: the scatter less what the noise of the points explains, mm^2. An estimate from
    few residuals, which may come out below zero."""
    degrees: int
    """Of freedom of the scatter, at least one."""

    def jacobian(self, gradients: Rows) -> Float:
        """Return how k values answer to a deviation at each place, (k, n m)."""
        answers: Float = np.einsum("kni,nij->knj", gradients.at(self.places), self.normals)
        return answers.reshape(len(gradients), -1)


def form_samples(
    actual: Mapping[str, ActualFeature | FitError], factors: PointFactors
) -> tuple[FormSample, ...]:
    """Return what every feature with more points than its shape needs says about form.

    What is constructed has no surface of its own, and a single point no residuals.

    Parameters
    ----------
    actual
        Features as measured.
    factors
        Of all N ball centres and the tip radius.
    """
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
    if degrees < 1 or feature.fit.shape is Shape.POINT or not isinstance(slopes, ResidualSlopes):
        return None
    residuals = feature.fit.residuals
    if feature.fit.criterion is not Criterion.LEAST_SQUARES:
        # Other elements touch the points from one side or halve their range.
        residuals = residuals - residuals.mean()
    noise, own = of_residuals(slopes, factors)
    lengths = np.linalg.norm(own, axis=1)
    normals = own / np.maximum(lengths, 1e-12)[:, None]
    return sample_of(
        name, places, normals[:, :, None], float(residuals @ residuals), noise, degrees
    )


def _line_sample(
    name: str, feature: ActualFeature, touches: Touches, factors: PointFactors
) -> FormSample | None:
    """Return the sample of a line, whose points deviate in two directions across it."""
    places = np.array(touches.places, dtype=np.int64)
    n = len(places)
    degrees = 2 * n - 4
    if degrees < 1:
        return None
    direction = feature.fit.direction
    across = np.eye(3) - np.outer(direction, direction)
    along = (touches.tips - touches.tips.mean(axis=0)) @ direction
    # Of every move across the line, what a shift and a turn of it follow is no residual.
    followed = np.stack([np.full(n, 1.0 / np.sqrt(n)), along / np.linalg.norm(along)])
    rows = Rows.of_points(places, np.kron(followed, across))
    noise = float(np.einsum("nij,ij->", factors.blocks(places)[0], across))
    noise -= float(np.trace(factors.of(rows)))
    pair = np.linalg.svd(across)[0][:, :2]
    residuals = feature.fit.residuals
    return sample_of(
        name, places, np.tile(pair, (n, 1, 1)), float(residuals @ residuals), noise, degrees
    )


def sample_of(
    name: str, places: Int, normals: Float, squares: float, noise: float, degrees: int
) -> FormSample:
    """Return the sample of a feature whose squared residuals add up to ``squares``, mm^2.

    ``noise`` is the sum of their variances that the noise of the points makes, mm^2.
    """
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
    """Variance of values, with form and with the widening for few degrees of freedom."""

    covariance: Float
    """(k, k) of all that contributes."""
    of_form: Mapping[str, Float]
    """What the form of each feature adds, (k, k) by name, widening included."""
    degrees: float
    """Effective degrees of freedom; infinite where form adds nothing."""
    scales: Mapping[str, float] = field(default_factory=dict)
    """What of each feature's form is in it, mm^2: variance of a deviation at one of its places, by
    name, widening included."""


def widened(
    gradients: Rows, factors: PointFactors | None, samples: Sequence[FormSample]
) -> Widened:
    """Return the covariance (k, k) of values with ``gradients``, k rows, form included.

    Parameters
    ----------
    factors
        Of all but form. None where the noise of the points is not known: all
        that ``samples`` show is form then.
    """
    nothing_known = np.zeros((len(gradients), len(gradients)))
    plain = nothing_known if factors is None else factors.of(gradients)
    # Nothing is added to what is no covariance: whoever decides refuses it.
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
    # Those below zero take from the others: a row of a budget has no negative variance.
    kept = balance / sum(variances[name] * float(np.trace(of)) for name, of in squares_of.items())
    form = kept * sum((variances[k] * of for k, of in squares_of.items()), np.zeros_like(plain))
    total = plain + form
    degrees = float(np.trace(total)) ** 2 / doubt
    factor = (student_factor(degrees) / _COVERAGE) ** 2
    # The widening belongs to what is known badly: the budget then adds up.
    share = float(np.trace(form))
    extra = 1.0 + (factor - 1.0) * float(np.trace(total)) / share
    scales = {name: extra * kept * variance for name, variance in variances.items()}
    grown = {name: scales[name] * of for name, of in squares_of.items()}
    return Widened(plain + extra * form, grown, degrees, scales)
