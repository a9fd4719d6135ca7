"""Whether a ball moved while it was watched, against what the noise of its places allows.

The places go into batches of time. In each batch and along each principal axis of the noise the
error has two parts: spot noise, independent from frame to frame, and the trembling of a hand, which
neighbouring batches share. Against this covariance every motion that a resting ball can make is
estimated by generalised least squares (a matched filter): an even drift, a slip at every moment,
and a way out and back. A motion counts

- if it is more than noise and trembling show by chance, wherever one looks for it, and
- if it may be as long as the limit: its upper bound, in whichever direction, reaches it.

So a motion as long as the limit is found wherever noise lets it be told. Where it does not, the
ball may have moved all the same: `Stillness.covariance` says how far.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from ocmm_core.geometry import Float, Int

_BATCHES, _LEAST_BATCHES, _LEAST_FRAMES = 25, 5, 8
"""Ten milliseconds a batch in a quarter of a second; fewer where frames are few."""

_TREMOR_HZ = np.linspace(8.0, 12.0, 5)
"""Physiological tremor of a hand (Lakie et al., J. Physiol. 593 (2015) 4411)."""

_TREMOR_MM = 0.002
"""Standard deviation per axis of a ball on a surface under a steady hand. At the tip of a free
instrument it is 0.038 mm in all (Singh and Riviere, IEEE EMBS/BMES 2002); the surface holds the
ball, which only rolls with the grip, by the ratio of its radius to the length of the probe."""

_WANDER_MM = 0.001
"""Standard deviation per axis of what a ball that is held still wanders in a window."""

_CHANCE_CHI2 = 14.0
"""Of three degrees of freedom: a ball at rest drifts by more than this in 0.3 % of windows."""

_MANY = 6.0
"""What a slip must have beyond that: it is looked for at many moments."""

_TREMOR_SIGMAS = 4.0
"""Of the scatter that noise alone leaves: beyond them a hand trembles for certain."""

_BOUND_SIGMAS = 2.4
"""One-sided, 99 %: a motion is longer than its upper bound in one case of 100."""


class MotionKind(Enum):
    """How a ball moved; the words of messages."""

    DRIFTED = "drifted"
    SLIPPED = "slipped"
    SWAYED = "swayed"
    TREMBLED = "trembled"


def _sphere(count: int) -> Float:
    """Return unit vectors (count, 3), evenly spread (a Fibonacci lattice)."""
    numbers = np.arange(count) + 0.5
    z = 1.0 - 2.0 * numbers / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * numbers
    ring = np.sqrt(1.0 - z**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)


_DIRECTIONS = _sphere(200)


@dataclass(frozen=True, slots=True)
class BallMotion:
    """A motion that is more than noise and more than the limit."""

    kind: MotionKind
    """How."""
    size_mm: float
    """From one end to the other; of trembling the amplitude, to either side."""


@dataclass(frozen=True, slots=True)
class Stillness:
    """What is known of the motion of a ball."""

    motion: BallMotion | None
    """None where the ball rested as far as noise lets it be told."""
    covariance: Float
    """(3, 3), mm^2: how far the mean may lie from where the ball was, for a motion that was not
    found. With a drift that is where it was at the beginning; with a slip, where it lay longer."""


@dataclass(frozen=True, slots=True)
class _Batches:
    """Means over time: m batches, along the principal axes of the noise."""

    times: Float
    """(m,), from 0 to 1."""
    span_s: float
    """How long that is."""
    places: Float
    """(m, 3), mm."""
    variances: Float
    """(m, 3), mm^2: of spot noise."""
    axes: Float
    """(3, 3): the columns."""


@dataclass(frozen=True, slots=True)
class _Shapes:
    """Motions that are looked for; k of them, as rows of their course over the batches."""

    kinds: list[MotionKind]
    courses: Float
    """(k, m), for a size of 1."""
    shares: Float
    """(k,): how far the mean then lies from where the ball was."""


@dataclass(frozen=True, slots=True)
class _Fits:
    """Sizes (k, 3), mm, of the motions along the axes, and their variances, mm^2."""

    sizes: Float
    variances: Float

    def score(self, own_mm: float = 0.0) -> Float:
        """Return how much better each motion fits than rest (k,), less what chance is granted.

        In units of chi-square of three degrees of freedom; ``own_mm`` is a standard deviation per
        axis that counts as rest.
        """
        found: Float = np.sum(self.sizes**2 / (self.variances + own_mm**2), axis=1)
        found[1:] -= _MANY
        return found


def wildness(times_s: Float, places: Float, covariances: Float) -> Float:
    """Return how far each place lies from its neighbours, (n,), in standard deviations.

    The centre is the median of a batch, and a line between batches: a ball that moves is not wild.
    Parameters as of `judge_stillness`.
    """
    labels = _labels(times_s)
    numbers = np.unique(labels)
    at = np.array([times_s[labels == number].mean() for number in numbers])
    medians = np.array([np.median(places[labels == number], axis=0) for number in numbers])
    # The line between two batches also leads to the frames beyond their middles, at both ends.
    left = np.clip(np.searchsorted(at, times_s) - 1, 0, len(at) - 2)
    share = ((times_s - at[left]) / (at[left + 1] - at[left]))[:, None]
    centre = (1.0 - share) * medians[left] + share * medians[left + 1]
    inverse = np.linalg.inv(covariances)
    apart: Float = np.sqrt(np.einsum("ni,nij,nj->n", places - centre, inverse, places - centre))
    return apart


def judge_stillness(
    times_s: Float, places: Float, covariances: Float, limit_mm: float
) -> Stillness:
    """Judge whether a ball rested.

    Parameters
    ----------
    times_s
        (n,), s, ascending; at least ten.
    places
        (n, 3), mm.
    covariances
        (n, 3, 3), mm^2: of independent noise in each. What the places show more from one to the
        next is believed, less is not.
    limit_mm
        A motion of this length is one.
    """
    batches = _batch(times_s, places, covariances)
    shapes = _shapes(batches.times)
    tremor = np.full(3, _TREMOR_MM**2)
    fits = _fit(batches, shapes, tremor)
    rest = _rest(batches, shapes, fits)
    trembling = np.mean(rest**2 - batches.variances, axis=0)
    tremor = np.maximum(tremor, trembling)
    fits = _fit(batches, shapes, tremor)
    motion = _found(shapes, fits, limit_mm) or _trembled(batches, trembling, limit_mm)
    best = int(np.argmax(fits.score()))
    bias = shapes.shares[best] * fits.sizes[best]
    own = np.outer(bias, bias) + np.diag(shapes.shares[0] ** 2 * fits.variances[0])
    return Stillness(motion, batches.axes @ own @ batches.axes.T)


def _labels(times_s: Float) -> Int:
    count = int(np.clip(len(times_s) // _LEAST_FRAMES, _LEAST_BATCHES, _BATCHES))
    span = times_s[-1] - times_s[0]
    part = (times_s - times_s[0]) / span * count
    labels: Int = np.minimum(part.astype(np.int64), count - 1)
    return labels


def _batch(times_s: Float, places: Float, covariances: Float) -> _Batches:
    values, axes = np.linalg.eigh(covariances.mean(axis=0))
    along = (places - places.mean(axis=0)) @ axes
    # From one frame to the next a hand hardly moves: what is seen there is noise.
    seen = 0.5 * np.mean(np.diff(along, axis=0) ** 2, axis=0)
    values = np.maximum(values, seen)
    labels = _labels(times_s)
    numbers, counts = np.unique(labels, return_counts=True)
    span = float(times_s[-1] - times_s[0])
    return _Batches(
        times=np.array([(times_s[labels == k].mean() - times_s[0]) / span for k in numbers]),
        span_s=span,
        places=np.array([along[labels == k].mean(axis=0) for k in numbers]),
        variances=values / counts[:, None],
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
    """Estimate every motion by itself, beside an unknown place; ``tremor`` (3,), mm^2."""
    apart_s = batches.span_s * (batches.times[:, None] - batches.times)
    shared = np.cos(2.0 * np.pi * _TREMOR_HZ[:, None, None] * apart_s).mean(axis=0)
    sizes, variances = np.empty((2, len(shapes.courses), 3))
    for axis in range(3):
        covariance = np.diag(batches.variances[:, axis]) + tremor[axis] * shared
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
    """Return what the best motion leaves, (m, 3), mm."""
    best = int(np.argmax(fits.score()))
    rest = batches.places - shapes.courses[best][:, None] * fits.sizes[best]
    weights = 1.0 / batches.variances
    mean = np.sum(weights * rest, axis=0) / np.sum(weights, axis=0)
    return np.asarray(rest - mean)


def _found(shapes: _Shapes, fits: _Fits, limit_mm: float) -> BallMotion | None:
    """Return the clearest of the motions that count."""
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
    # Noise makes a length too great: said is what is clear, from the direction in which the motion
    # is longest to that in which it is clearest.
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
