"""Compiled decision among all valid poses: selection, and the effect of a single false LED."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _small_algebra as small_algebra
from ocmm_core.tracking.kernels._kernel import Bool, normal_equations
from ocmm_core.tracking.kernels._small_algebra import backward, cholesky, forward

FOUND, FEW, NO_FIT, AMBIGUOUS, CONFUSED, THIN, NEAR_RULE = range(7)
"""Outcomes: labelled; fewer than three targets; no fit; several labellings fit; too many
candidates; too few LEDs for certainty; too close to the limit of an orientation rule.
"""

# Squared standard deviations of the pose: a single false LED may have moved it by up to seven of
# them, and the ball, carried by the pose, by at most as much. Beyond that a tip counts as wrong
# (`benchmarks.labels`): at nine, one of 1.2 million tips was.
MAX_DOUBT = 49.0
"""Largest ambiguity (`ambiguity_score`). Three LEDs may be two LEDs and a reflection
that matches by chance in one of some ten thousand such scenes; so every LED must be confirmed by
the others. Three identified by a strobe code suffice.
"""


@compiled()
def merge(poses: Int, start: int, held: int, certain: Bool, doubt: Float) -> int:
    """Keep the last pose unless already held; return the number held."""
    for pose in range(start, held):
        same, conflicts, more = 0, 0, 0
        for c in range(poses.shape[1]):
            for led in range(poses.shape[2]):
                one, other = poses[pose, c, led], poses[held, c, led]
                same += one >= 0 and one == other
                conflicts += one >= 0 and other >= 0 and one != other
                more += int(other >= 0) - int(one >= 0)
        # The same three LEDs at the same spots without contradiction: one pose grown from two
        # triples. The one that explains more spots is kept, with its own ambiguity.
        if conflicts == 0 and same >= 6:
            if more > 0:
                copy_labels(poses[held], poses[pose])
                certain[pose], doubt[pose] = certain[held], doubt[held]
            return held
    return held + 1


@compiled()
def decide(
    poses: Int, owner: Int, certain: Bool, doubt: Float, held: int, body: int, coded: bool,
    weak: int, status: NDArray[np.uint8], labels: Int,
) -> None:  # fmt: skip
    """Choose among all poses; write the status of ``body`` and its labels (C, 8).

    The best one must explain more than any other, of this body or of one that claims its spots, by
    more than one light in space could add; ``weak`` is the most explained by one not held.
    """
    n_cameras = poses.shape[1]
    best, most = -1, -1
    for pose in range(held):
        if owner[pose] == body and spots_of(poses[pose]) > most:
            best, most = pose, spots_of(poses[pose])
    # Poses with too few LEDs to be held may still explain as much.
    if weak > 0 and weak >= most - n_cameras:
        status[body] = AMBIGUOUS
        return
    for pose in range(held):
        # A single light in space gives at most one spot in every camera, so n_cameras additional
        # spots can be due to one reflection. A rival close in number makes the result ambiguous.
        if pose == best or spots_of(poses[pose]) < most - n_cameras:
            continue
        if owner[pose] == body or _share(poses[best], poses[pose]):
            status[body] = AMBIGUOUS
            return
    # A strobe code identifies each LED; three LEDs with it need no fourth for confirmation.
    if doubt[best] > MAX_DOUBT and not (coded and in_sight(poses[best]) == 3):
        status[body] = THIN
    elif not certain[best]:
        status[body] = NEAR_RULE
    else:
        copy_labels(poses[best], labels)


@compiled()
def in_sight(labels: Int) -> int:
    """Return the number of labelled LEDs."""
    count = 0
    for led in range(labels.shape[1]):
        seen = False
        for c in range(labels.shape[0]):
            seen = seen or labels[c, led] >= 0
        count += int(seen)
    return count


@compiled()
def clear(labels: Int) -> None:
    """Mark all LEDs as unlabelled."""
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            labels[c, led] = -1


@compiled()
def copy_labels(labels: Int, to: Int) -> None:
    """Copy labels to an array for as many LEDs or more."""
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            to[c, led] = labels[c, led]


@compiled()
def spots_of(labels: Int) -> int:
    """Return the number of labelled spots."""
    count = 0
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            count += int(labels[c, led] >= 0)
    return count


@compiled()
def _share(one: Int, other: Int) -> bool:
    for c in range(one.shape[0]):
        for led in range(one.shape[1]):
            for second in range(other.shape[1]):
                # A slot claimed by both poses, for any LED.
                if one[c, led] >= 0 and one[c, led] == other[c, second]:
                    return True
    return False


# A straight line over chi-square with 2 degrees of freedom a view: 19, 24, 29 and 34 for one to
# four views are exceeded by true LEDs once in 13000, 13000, 16000 and 25000 times.
FALSE_CHI2, FALSE_CHI2_PER_VIEW = 14.0, 5.0
"""An LED that agrees less is false: a true one does so once in ten thousand times."""

# The same line lower: 6.5, 9, 11.5 and 14 are exceeded in 3.9, 6.1, 7.4 and 8.2 of 100 times.
ODD_CHI2, ODD_CHI2_PER_VIEW = 4.0, 2.5
"""An LED that agrees less is slightly odd: one in twenty is."""

GROWTH_WEIGHT = 0.5


@compiled(kernel, small_algebra)
def ambiguity_score(
    led_ideal: Float, led_jacobian: Float, seen: Bool, cams: Float, leds: Float,
    rotation: Float, origin: Float, sigma: float,
) -> float:  # fmt: skip
    """Return the largest effect of a false LED on the pose, in squared standard deviations.

    Every LED is left out in turn. Infinite if the others leave the pose undetermined, or predict
    the LED away from its spots. Otherwise the greater of the squared pose change without a slightly
    odd LED (any LED, if only three are seen by two cameras), in units of the stated covariance, and
    of the weighted variance increase without an LED, in the same units: a poorly confirmed light
    moves the pose long before it appears odd.
    """
    h = np.empty((6, 6))
    g = np.empty(6)
    own = np.empty((6, 6))
    own_g = np.empty(6)
    rest = np.empty((6, 6))
    change = np.empty(6)
    column = np.empty(6)
    # H = J'J and g = J'r (observed minus predicted) of all spots at the common pose. Both are sums
    # over LEDs, so that leaving one out is a subtraction without a refit.
    normal_equations(led_ideal, led_jacobian, seen, cams, leds, rotation, origin, h, g)
    _fill_upper(h)
    n_cameras, n_leds = seen.shape
    only = np.zeros((n_cameras, n_leds), np.bool_)
    located = 0
    for led in range(n_leds):
        located += int(_views(seen, led) >= 2)
    worst = 0.0
    for led in range(n_leds):
        views = _views(seen, led)
        if views == 0:
            continue
        for c in range(n_cameras):
            only[c, led] = seen[c, led]
        misfit = normal_equations(
            led_ideal, led_jacobian, only, cams, leds, rotation, origin, own, own_g
        )
        _fill_upper(own)
        # Reset at once: an unseen LED ends its turn before this, and flags still set would be left
        # out together with the next.
        for c in range(n_cameras):
            only[c, led] = False
        for i in range(6):
            # Gradient of the other LEDs alone. At the minimum g is zero and this is minus the LED's
            # own part.
            change[i] = g[i] - own_g[i]
            for j in range(6):
                rest[i, j] = h[i, j] - own[i, j]
        # The others leave the pose undetermined: the LED is unconfirmed.
        if not cholesky(rest):
            return np.inf
        # With rest = L L', L^-1 change; its square is the gain of the others at their own minimum,
        # and to first order the additional miss of the LED there: r'r of the LED at the common pose
        # plus this is the chi-square of adding it to the others.
        forward(rest, change)
        for i in range(6):
            misfit += change[i] * change[i]
        misfit /= sigma * sigma
        if misfit > FALSE_CHI2 + FALSE_CHI2_PER_VIEW * views:
            return np.inf
        # Step of the pose to the minimum of the others, (rad, mm).
        backward(rest, change)
        # H / sigma^2 is the inverse of the stated covariance: squared Mahalanobis length of that
        # step.
        moved = 0.0
        grown = 0.0
        for i in range(6):
            for j in range(6):
                moved += change[i] * h[i, j] * change[j] / (sigma * sigma)
            for j in range(6):
                column[j] = 1.0 if i == j else 0.0
            # Column i of rest^-1. Its products with the LED's own part sum up to trace(rest^-1
            # own), which is trace(rest^-1 H) - 6: the increase of the six variances without it, in
            # units of the stated ones.
            forward(rest, column)
            backward(rest, column)
            for j in range(6):
                grown += column[j] * own[i, j]
        worst = max(worst, GROWTH_WEIGHT * grown)
        # With three LEDs none is redundant, so every one counts.
        if located < 4 or misfit > ODD_CHI2 + ODD_CHI2_PER_VIEW * views:
            worst = max(worst, moved)
    return worst


@compiled()
def _fill_upper(a: Float) -> None:
    """Complete a symmetric matrix from its lower half."""
    for i in range(len(a)):
        for j in range(i):
            a[j, i] = a[i, j]


@compiled()
def _views(seen: Bool, led: int) -> int:
    views = 0
    for c in range(seen.shape[0]):
        views += int(seen[c, led])
    return views
