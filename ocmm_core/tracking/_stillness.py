"""Test whether a ball moved during observation, against its noise.

Places are grouped into batches of time. In each batch and along each principal axis of the noise
the error has two parts: spot noise, independent between frames, and hand tremor, which neighbouring
batches share. Against this covariance all motions of a resting ball are estimated by generalised
least squares (a matched filter): a uniform drift, a slip at every moment, and a move out and back.
A motion counts

- if it is significant against noise and tremor, including the search over motions, and
- if it may be as long as the limit: its upper bound, in any direction, reaches it.

So a motion as long as the limit is found if noise permits. Otherwise the ball may have moved
undetected: `Stillness.covariance` bounds it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from ocmm_core.geometry import Float, Int, spiral

_BATCHES, _LEAST_BATCHES, _LEAST_FRAMES = 25, 5, 8
"""Ten milliseconds a batch for a quarter of a second; fewer batches for few frames."""

_TREMOR_HZ = np.linspace(8.0, 12.0, 5)
"""Physiological tremor of a hand (Lakie et al., J. Physiol. 593 (2015) 4411)."""

_TREMOR_MM = 0.002
"""Standard deviation per axis of a ball on a surface under a steady hand. At the tip of a free
instrument it is 0.038 mm in all (Singh and Riviere, IEEE EMBS/BMES 2002); the surface holds the
ball, which only rolls with the grip, by the ratio of its radius to the length of the probe."""

_WANDER_MM = 0.001
"""Standard deviation per axis of the wander of a ball held still during a window."""

_CHANCE_CHI2 = 14.0
"""Three degrees of freedom: exceeded by drift of a resting ball in 0.3 % of windows."""

_MANY = 6.0
"""Additional threshold of a slip, which is searched at many moments."""

_TREMOR_SIGMAS = 4.0
"""In units of the scatter of noise alone: tremor is certain beyond."""

_BOUND_SIGMAS = 2.4
"""One-sided, 99 %: a motion exceeds its upper bound in one case of 100."""

_HINT_CHI2 = 8.0
"""Three degrees of freedom: 5 %. A motion beyond it counts whole, however still the hand is."""

_HAND_MM2 = 0.004**2
"""Variance of the drift of a hand along each axis before the first touch."""


class MotionKind(Enum):
    """Kind of motion, as in messages."""

    DRIFTED = "drifted"
    SLIPPED = "slipped"
    SWAYED = "swayed"
    TREMBLED = "trembled"


_DIRECTIONS = spiral(1.0 - 2.0 * (np.arange(200) + 0.5) / 200)


@dataclass(frozen=True, slots=True)
class BallMotion:
    """A significant motion longer than the limit."""

    kind: MotionKind
    size_mm: float
    """Peak to peak; amplitude to either side for tremor."""


@dataclass(frozen=True, slots=True)
class Stillness:
    """Result of the stillness test."""

    motion: BallMotion | None
    """None if at rest within the noise."""
    covariance: Float
    """(3, 3), mm^2: possible distance of the mean from the ball's place due to an undetected
    motion. The place is that at the start for a drift, and the one occupied longer for a slip."""
    drift: Float
    variance: Float
    """`drift`, `variance`: (3,), mm and mm^2: uniform drift along the principal axes of the noise.
    """


@dataclass(frozen=True, slots=True)
class HandDrift:
    """How far the ball drifts in the accepted touches of a session (empirical Bayes).

    A drift that noise hides is as probable as the other touches of the session make it: most hands
    hold a ball stiller than noise permits to see in one touch (H. Robbins, Proc. 3rd Berkeley
    Symp. 1 (1956) 157).
    """

    squares: float = 3.0 / _HAND_MM2
    weight: float = 3.0 / _HAND_MM2**2
    doubt: float = 0.0
    """`squares`, `weight`, `doubt`: sums over axes and touches of the weighted squares of drifts
    less noise, of weights, and of the variances of the former; the default counts as one touch."""

    @property
    def variance(self) -> float:
        """Return the variance of the drift along each axis, mm^2, with one standard error."""
        return (max(self.squares, 0.0) + float(np.sqrt(self.doubt))) / self.weight

    def learnt(self, still: Stillness) -> HandDrift:
        """Return the drift with one more accepted touch."""
        weights = 1.0 / (still.variance + _HAND_MM2) ** 2
        return HandDrift(
            self.squares + float(weights @ (still.drift**2 - still.variance)),
            self.weight + float(np.sum(weights)),
            self.doubt + 2.0 * float(np.sum((weights * still.variance) ** 2)),
        )


@dataclass(frozen=True, slots=True)
class _Batches:
    """Means over time: m batches, along the principal axes of the noise."""

    times: Float
    """(m,), from 0 to 1."""
    span_s: float
    places: Float
    """(m, 3), mm."""
    noise: Float
    """(3, m, m), mm^2: covariance of spot noise along each axis."""
    variances: Float
    """(m, 3), mm^2: of spot noise about its mean."""
    axes: Float
    """(3, 3): the columns."""


@dataclass(frozen=True, slots=True)
class _Shapes:
    """Searched motions; k of them, as rows of their course over the batches."""

    kinds: list[MotionKind]
    courses: Float
    """(k, m), for a size of 1."""
    shares: Float
    """(k,): resulting distance of the mean from the ball's place."""


@dataclass(frozen=True, slots=True)
class _Fits:
    """Sizes (k, 3), mm, of the motions along the axes, and their variances, mm^2."""

    sizes: Float
    variances: Float

    def score(self, own_mm: float = 0.0) -> Float:
        """Return the improvement of each motion over rest (k,), less the chance allowance.

        In units of chi-square of three degrees of freedom; ``own_mm`` is a standard deviation per
        axis that counts as rest.
        """
        found: Float = np.sum(self.sizes**2 / (self.variances + own_mm**2), axis=1)
        found[1:] -= _MANY
        return found


def wildness(times_s: Float, places: Float, covariances: Float) -> Float:
    """Return the distance of each place from its neighbours, (n,), in standard deviations.

    From interpolated medians of batches: motion is no outlier. As `judge_stillness`.
    """
    labels = batch_labels(times_s)
    numbers = np.unique(labels)
    at = np.array([times_s[labels == number].mean() for number in numbers])
    medians = np.array([np.median(places[labels == number], axis=0) for number in numbers])
    # The line between two batches also extends beyond their middles at both ends.
    left = np.clip(np.searchsorted(at, times_s) - 1, 0, len(at) - 2)
    share = ((times_s - at[left]) / (at[left + 1] - at[left]))[:, None]
    centre = (1.0 - share) * medians[left] + share * medians[left + 1]
    inverse = np.linalg.inv(covariances)
    apart: Float = np.sqrt(np.einsum("ni,nij,nj->n", places - centre, inverse, places - centre))
    return apart


def judge_stillness(
    times_s: Float,
    places: Float,
    covariances: Float,
    limit_mm: float,
    slow: Float | None = None,
    hand: HandDrift | None = None,
) -> Stillness:
    """Judge whether a ball rested.

    Parameters
    ----------
    times_s
        (n,), s, ascending; at least ten.
    places
        (n, 3), mm.
    covariances
        (n, 3, 3), mm^2: independent noise of each. Increased if consecutive places scatter more,
        never decreased.
    limit_mm
        Shortest length that counts as motion.
    slow
        (m, m): covariance of slow noise between the batches of `batch_labels`, relative to the
        variance of a frame (`SpotSpectrum.between`); None if frames are independent.
    hand
        Drift of the hand in other touches; None if unknown: the observed motion then counts whole.
    """
    batches = _batch(times_s, places, covariances, slow)
    shapes = _shapes(batches.times)
    tremor = np.full(3, _TREMOR_MM**2)
    fits = _fit(batches, shapes, tremor)
    rest = _rest(batches, shapes, fits)
    trembling = np.mean(rest**2 - batches.variances, axis=0)
    tremor = np.maximum(tremor, trembling)
    fits = _fit(batches, shapes, tremor)
    motion = _found(shapes, fits, limit_mm) or _trembled(batches, trembling, limit_mm)
    score = fits.score()
    best = int(np.argmax(score))
    bias, variance = shapes.shares[best] * fits.sizes[best], fits.variances[0]
    if hand is not None and score[best] < _HINT_CHI2:
        # The posterior of a normal drift: its mean and its variance shrink by the same share.
        bias = bias * hand.variance / (hand.variance + fits.variances[best])
        variance = variance * hand.variance / (hand.variance + variance)
    own = np.outer(bias, bias) + np.diag(shapes.shares[0] ** 2 * variance)
    covariance = batches.axes @ own @ batches.axes.T
    return Stillness(motion, covariance, fits.sizes[0], fits.variances[0])


def batch_labels(times_s: Float) -> Int:
    """Return the batch of each frame, (n,), by its time (n,), s, ascending."""
    count = int(np.clip(len(times_s) // _LEAST_FRAMES, _LEAST_BATCHES, _BATCHES))
    span = times_s[-1] - times_s[0]
    part = (times_s - times_s[0]) / span * count
    labels: Int = np.minimum(part.astype(np.int64), count - 1)
    return labels


def _batch(times_s: Float, places: Float, covariances: Float, slow: Float | None) -> _Batches:
    values, axes = np.linalg.eigh(covariances.mean(axis=0))
    along = (places - places.mean(axis=0)) @ axes
    # Between consecutive frames hand motion is negligible: the differences are noise.
    seen = 0.5 * np.mean(np.diff(along, axis=0) ** 2, axis=0)
    values = np.maximum(values, seen)
    labels = batch_labels(times_s)
    numbers, counts = np.unique(labels, return_counts=True)
    span = float(times_s[-1] - times_s[0])
    relative = np.diag(1.0 / counts)
    about_mean = relative
    if slow is not None:
        relative = relative + slow
        about_mean = relative - slow.mean(axis=0) - slow.mean(axis=1)[:, None] + slow.mean()
    return _Batches(
        times=np.array([(times_s[labels == k].mean() - times_s[0]) / span for k in numbers]),
        span_s=span,
        places=np.array([along[labels == k].mean(axis=0) for k in numbers]),
        noise=values[:, None, None] * relative,
        variances=np.outer(np.diagonal(about_mean), values),
        axes=axes,
    )


def _shapes(times: Float) -> _Shapes:
    borders = 0.5 * (times[1:] + times[:-1])
    steps = (times > borders[:, None]).astype(np.float64)
    bow = 4.0 * times * (1.0 - times)
    return _Shapes(
        [MotionKind.DRIFTED, MotionKind.SWAYED, *([MotionKind.SLIPPED] * len(steps))],
        np.vstack([times, bow, steps]),
        np.concatenate([[0.5, 2.0 / 3.0], np.minimum(borders, 1.0 - borders)]),
    )


def _fit(batches: _Batches, shapes: _Shapes, tremor: Float) -> _Fits:
    """Estimate every motion alone, with an unknown place; ``tremor`` (3,), mm^2."""
    apart_s = batches.span_s * (batches.times[:, None] - batches.times)
    shared = np.cos(2.0 * np.pi * _TREMOR_HZ[:, None, None] * apart_s).mean(axis=0)
    sizes, variances = np.empty((2, len(shapes.courses), 3))
    for axis in range(3):
        covariance = batches.noise[axis] + tremor[axis] * shared
        factor = np.linalg.cholesky(covariance)
        columns = np.column_stack(
            [np.ones(len(batches.times)), batches.places[:, axis], shapes.courses.T]
        )
        white = np.linalg.solve(factor, columns)
        one = white[:, 0] / np.linalg.norm(white[:, 0])
        white -= np.outer(one, one @ white)
        data, courses = white[:, 1], white[:, 2:]
        variances[:, axis] = 1.0 / np.sum(courses**2, axis=0)
        sizes[:, axis] = data @ courses * variances[:, axis]
    return _Fits(sizes, variances)


def _rest(batches: _Batches, shapes: _Shapes, fits: _Fits) -> Float:
    """Return the residuals of the best motion, (m, 3), mm."""
    best = int(np.argmax(fits.score()))
    rest = batches.places - shapes.courses[best][:, None] * fits.sizes[best]
    weights = 1.0 / batches.variances
    mean = np.sum(weights * rest, axis=0) / np.sum(weights, axis=0)
    return np.asarray(rest - mean)


def _found(shapes: _Shapes, fits: _Fits, limit_mm: float) -> BallMotion | None:
    """Return the most significant motion that counts."""
    score = fits.score(_WANDER_MM)
    longest = np.max(
        np.abs(fits.sizes @ _DIRECTIONS.T)
        + _BOUND_SIGMAS * np.sqrt(fits.variances @ _DIRECTIONS.T**2),
        axis=1,
    )
    counts = (score > _CHANCE_CHI2) & (longest > limit_mm)
    if not np.any(counts):
        return None
    clearest = int(np.argmax(np.where(counts, fits.score(), -np.inf)))
    # Noise increases a length: report the significant part, in the direction between the longest
    # and the most significant one.
    size, variance = fits.sizes[clearest], fits.variances[clearest] + _WANDER_MM**2
    towards = size / variance ** np.linspace(0.0, 1.0, 5)[:, None]
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    along = towards @ size
    clear = along**2 > _CHANCE_CHI2 * (towards**2 @ variance)
    return BallMotion(shapes.kinds[clearest], float(np.max(along, where=clear, initial=along[-1])))


def _trembled(batches: _Batches, trembling: Float, limit_mm: float) -> BallMotion | None:
    chance = _TREMOR_SIGMAS * np.sqrt(2.0 / len(batches.times)) * batches.variances.mean(axis=0)
    worst = int(np.argmax(trembling - chance))
    amplitude = float(np.sqrt(2.0 * max(trembling[worst], 0.0)))
    if amplitude > limit_mm and trembling[worst] > chance[worst]:
        return BallMotion(MotionKind.TREMBLED, amplitude)
    return None
