"""Validity of a first-order uncertainty, and its second-order correction.

U is the first-order change of a value when all points move in the direction of greatest effect, by
their uncertainty and degrees of freedom. Here they are moved so, to both sides, and the elements
are refitted (`features.measured`). The remaining change is the second-order term of the fit at
the ends of the interval (compare the profiles of D. M. Bates and D. G. Watts, Nonlinear Regression
Analysis, 1988, chapter 6). A small term makes U slightly longer, so that both tails together keep
their probability; for a large one the first-order interval is meaningless, even if stretched.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeAlias

import numpy as np
import scipy
from numpy.linalg import norm

from ocmm_core.features.measured import ActualFeature, beyond_first_order
from ocmm_core.features.shapes import DIRECTION, RADIUS, Criterion, Fit, Shape
from ocmm_core.geometry import Float, Points3
from ocmm_core.measuring import PointFactors, Rows
from ocmm_core.tolerances.uncertainty._interval import TWO_SIDED
from ocmm_core.tolerances.uncertainty._sampling import FormSample, Widened, student_factor, widened

MOST_CURVED = 0.3
"""Second-order term at the ends of the interval, relative to U, beyond which U is refused."""

NOT_DETERMINED = (
    "No uncertainty: the points determine an element too weakly, as on a short arc or low band."
)
WHAT_TO_DO = "Take more points, spread over more of it."

CHANCE = 0.1
"""Probability of a scatter so great that it would refuse: defines a near refusal."""

NEAR_REFUSAL = 0.25
"""Remaining share of the probability beyond U near a refusal.

The scatter itself decides on U: among often refused fits, those with accidentally small scatter
remain, which include nearly all with too small a U.
"""

MOST_TILTED = 0.3
"""Expanded uncertainty of a direction, rad, beyond which no value about it has an uncertainty."""

_LINEAR = 1e-3
"""Second-order term, relative to U, below which a value does not share a refusal of others."""

_SMALL = 1e-6
"""Share of the greatest variance below which a component of a vector is ignored."""

_LONGEST, _HALVINGS = 10.0, 30

Follow: TypeAlias = Callable[[Rows], Float]
"""From m moves of the points, as rows, to the changes of k values beyond first order, (m, k)."""


def second_order(
    gradients: Rows,
    factors: PointFactors | None,
    samples: Sequence[FormSample],
    found: Widened,
    follow: Follow,
) -> Float:
    """Return the changes beyond first order at the ends of the interval, in U, (m, 2).

    Each row is one principal axis of the values: ahead and behind. No rows if nothing varies.
    ``found`` is the result of `sampling.widened` for the first arguments; ``follow`` refits the
    elements.
    """
    if not np.all(np.isfinite(found.covariance)):
        return np.zeros((0, 2))
    variances, vectors = np.linalg.eigh(found.covariance)
    greatest = float(variances[-1])
    if greatest <= 0.0:
        return np.zeros((0, 2))
    asked = [i for i, variance in enumerate(variances) if variance > _SMALL * greatest]
    moves = []
    for i in asked:
        along = gradients if len(gradients) == 1 else vectors[:, i : i + 1].T @ gradients
        # Irrelevant points move along.
        move = Rows.nothing(1)
        if factors is not None:
            moved = factors.moved(along).by_points
            move = Rows(along.places, np.where(along.by_points != 0.0, moved, 0.0), np.zeros(1))
        for sample in samples:
            scale = found.scales.get(sample.feature, 0.0)
            if scale > 0.0:
                slopes = sample.jacobian(along).reshape(len(sample.places), -1)
                of_form = scale * np.einsum("nij,nj->ni", sample.normals, slopes)
                move += Rows.of_points(sample.places, of_form.reshape(1, -1))
        far = 2.0 / math.sqrt(float(variances[i])) * move
        moves += [far, -far]
    changes = follow(Rows.stacked(moves))
    reach = 2.0 * math.sqrt(greatest)
    along_axes = np.einsum("msk,km->ms", changes.reshape(len(asked), 2, -1), vectors[:, asked])
    answer: Float = along_axes * np.array([1.0, -1.0]) / reach
    return answer


def growth(changes: Float, degrees: float, stretch: float = 1.0, related: float = 0.0) -> float:
    """Return the factor by which U grows, 1 and more; infinite if U is refused.

    ``changes`` are those of `second_order`, with their effective degrees of freedom. The test is
    for a scatter greater by ``stretch``. ``related`` is the greatest tested term of all numbers of
    the same fit: they are refused by the same scatter.
    """
    return max(
        (_both_tails(float(a), float(b), degrees, stretch, related) for a, b in changes),
        default=1.0,
    )


def follow_features(gradients: Rows, features: Iterable[ActualFeature]) -> Follow | None:
    """Return the nonlinear response of values to points; None if all is linear.

    Covers the probed least-squares elements. From elements to values, linearity is assumed: zones
    and lengths have their own statements (`interval`). ``gradients`` are k rows by the points.
    """
    parts = []
    for feature in features:
        raw, touches = feature.raw, feature.touches
        if raw is None or touches is None or not raw.shape.spec.is_curved:
            continue
        if raw.criterion is not Criterion.LEAST_SQUARES:
            continue
        places = np.array(touches.places)
        own = gradients.at(places)
        if not np.any(own):
            continue
        # Most rows of an element are zero: a sphere has no direction.
        live = np.any(raw.jacobian, axis=1)
        by_geometry = np.zeros((len(gradients), len(live)))
        inverse = np.linalg.pinv(raw.jacobian[live], 1e-10)
        by_geometry[:, live] = own.reshape(len(gradients), -1) @ inverse
        sign = 1.0 if feature.nominal.side == "outer" else -1.0
        parts.append((raw, touches.tips, places, by_geometry.T, sign * touches.tip_radius))
    if not parts:
        return None

    def follow(moves: Rows) -> Float:
        total: Float = np.zeros((len(moves), len(gradients)))
        for raw, tips, places, by_geometry, offset in parts:
            total += beyond_first_order(raw, tips, moves.at(places), offset) @ by_geometry
        return total

    return follow


def tilted(
    gradients: Rows, actual: Mapping[str, ActualFeature], factors: PointFactors,
    samples: Sequence[FormSample], found: Widened, *, is_angle: bool,
) -> float:  # fmt: skip
    """Return the factor by which U grows for tilts of elements; infinite if U is refused.

    A tilt by t moves a point at distance d from the element by ``d t`` in first order, which
    vanishes across it, and by ``d t^2 / 2`` beyond. ``found`` is the result of `sampling.widened`
    for a value in mm, or in degrees if ``is_angle``.
    """
    reach = 2.0 * math.sqrt(max(float(np.trace(found.covariance)), 0.0))
    probed = {
        name: (item.touches, item.fit)
        for name, item in actual.items()
        if item.touches is not None and np.any(gradients.at(np.array(item.touches.places)))
    }
    grown = 1.0
    for name, (touches, fit) in probed.items():
        others = [item.tips for other, (item, _) in probed.items() if other != name]
        if not others or fit.shape not in _DIRECTED or not reach > 0.0:
            continue
        own = [one for one in samples if one.feature == name]
        both = widened(actual[name].jacobian[_TURNED], factors, own).covariance
        size = 2.0 * math.sqrt(max(float(np.linalg.eigvalsh(both[:3, :3])[-1]), 0.0))
        kept = both[3, 3] - both[3, :3] @ np.linalg.pinv(both[:3, :3], 1e-9) @ both[:3, 3]
        wider = fit.shape in _ROUND and _low_band(fit, touches.tips, math.sqrt(max(kept, 0.0)))
        reached = np.concatenate(others) - fit.point
        # Along a plane the effect of its tilt is linear: only the distance from it is curved.
        flat = fit.shape is Shape.PLANE
        far = float((abs(reached @ fit.direction) if flat else norm(reached, axis=1)).max())
        curved = 0.5 * (180.0 / math.pi if is_angle else far) * size**2 / reach
        if wider or size > MOST_TILTED or not curved <= MOST_CURVED:
            return math.inf
        grown = max(grown, 1.0 + curved)
    return grown


def _low_band(fit: Fit, tips: Points3, sigma: float) -> bool:
    """Return whether the noise tilts an axis so far that its element is wider by its U or half.

    ``sigma``, mm, is that of the radius with a known axis. Noise alone may tilt the axis of a low
    band: its height is then that of the points square to their plane, not along the axis.
    """
    centred = tips - tips.mean(axis=0)
    _, spans, axes = np.linalg.svd(centred, full_matrices=False)
    height = float(np.linalg.norm(centred @ fit.direction))
    if abs(axes[2] @ fit.direction) > _ALONG:
        height = min(height, float(spans[2]))
    tilt = 2.0 * sigma * math.sqrt(2.0 * len(tips)) / max(height, 1e-12)
    return bool(0.5 * fit.radius * tilt**2 > sigma)


_ALONG = 0.95
_ROUND = (Shape.CYLINDER, Shape.CONE)
_DIRECTED = (Shape.LINE, Shape.PLANE, *_ROUND)
_TURNED = np.r_[DIRECTION, RADIUS]


def _both_tails(
    ahead: float, behind: float, degrees: float, stretch: float, related: float
) -> float:
    """Return the growth of U that keeps both tails' probability; changes beyond U, in U."""
    most = stretch * max(abs(ahead), abs(behind))
    # A failed refit is not a number, on either side.
    if not (abs(ahead + behind) < math.inf and most <= MOST_CURVED):
        return math.inf
    k, outside, doubt = student_factor(degrees), 1.0 - TWO_SIDED, 1.0
    if math.isfinite(degrees):
        # Both the scatter and its expectation are estimates: the latter is known slightly better.
        doubt = math.sqrt(float(scipy.special.fdtri(degrees, degrees + 1.0, 1.0 - CHANCE)))
    if doubt * (most if most < _LINEAR else max(most, related)) > MOST_CURVED:
        outside *= NEAR_REFUSAL

    def tail(curved: float, grown: float) -> float:
        root = 1.0 + 4.0 * curved * grown
        if root < 0.0:
            return 0.0
        share = 2.0 * grown / (1.0 + math.sqrt(root))
        if math.isfinite(degrees):
            return float(scipy.special.stdtr(degrees, -share * k))
        return float(scipy.special.ndtr(-share * k))

    if tail(ahead, 1.0) + tail(behind, 1.0) <= outside:
        return 1.0
    low, high = 1.0, _LONGEST
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if tail(ahead, middle) + tail(behind, middle) > outside:
            low = middle
        else:
            high = middle
    return high
