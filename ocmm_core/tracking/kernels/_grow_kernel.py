"""Compiled growth of a labelling: from three LEDs to all spots explained by their pose.

Here and in the search, arrays are copied and summed element by element: numba compiles slices with
all their checks and messages, which takes longer than all the rest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _decide_kernel as decide_kernel
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _meeting_kernel as meeting_kernel
from ocmm_core.tracking.kernels import _small_algebra as small_algebra
from ocmm_core.tracking.kernels._decide_kernel import ambiguity_score, clear
from ocmm_core.tracking.kernels._kernel import Bool, fit_leds, normal_equations, triangulate_leds
from ocmm_core.tracking.kernels._meeting_kernel import view
from ocmm_core.tracking.kernels._small_algebra import backward, cholesky, forward, turn

# exp(-23 / 2) = 1.0e-5, the tail probability of chi-square with two degrees of freedom.
SPOT_CHI2 = 23.0
"""Squared distance of a spot from its LED's predicted place, over its variance, beyond which it is
not the LED's: excludes one in a hundred thousand by chance.
"""

MANY_SPOTS = 40
SURE_PLACE = 2.5
"""From this number of spots on, all LEDs with a sufficiently certain place (trace of the covariance
of the miss over the variance of a spot, which itself contributes two) are added at once: the pose
hardly changes, and a round for every spot would take too long.
"""

_NEEDS = (decide_kernel, kernel, meeting_kernel, small_algebra)


class FrameRays(NamedTuple):
    """Spots of a frame by camera and slot, see `meeting_kernel.undistort_rays`."""

    ideal: Float
    jacobian: Float
    there: Bool
    usable: Int
    """(C S,): LED of a slot by its strobe code, -1 for any, -2 for none."""


class PackedCameras(NamedTuple):
    packed: Float
    """(C, 21)."""
    centres: Float
    """(C, 3), mm."""


class LitBody(NamedTuple):
    """The LEDs of a body."""

    leds: Float
    directions: Float
    least_cosine: float
    """Of the widest angle under which an LED can be seen."""


class Gates(NamedTuple):
    sigma: float
    rival_px: float
    limits: Float
    """Chi-square by degrees of freedom."""


@compiled(*_NEEDS)
def extend_hypothesis(
    rays: FrameRays, cameras: PackedCameras, body: LitBody, gates: Gates, labels: Int,
    rotation: Float, origin: Float, worth: Float,
) -> float:  # fmt: skip
    """Complete a labelling of three LEDs with all spots explained by its pose.

    Spots are added one by one, the most certain place first, and only if unambiguous. Finally,
    spots are removed that have another spot or the place of another LED within ``rival_px``: they
    are indistinguishable there, and images of such close lights disturb each other.

    ``labels`` (C, L): slots, -1 if none, changed in place. Outputs: ``rotation`` (3, 3) and
    ``origin`` (3,), mm, pose in the world; ``worth`` (1,), see `ambiguity_score`.
    Returns chi-square, or -1 if the labelling fails.
    """
    ideal, jacobian, there, usable = rays
    cams, centres = cameras
    leds, directions, least_cosine = body
    sigma, rival_px, limits = gates
    n_cameras, n_leds = labels.shape
    led_ideal = np.empty((n_cameras, n_leds, 2))
    led_jacobian = np.empty((n_cameras, n_leds, 4))
    seen = np.empty((n_cameras, n_leds), np.bool_)
    h = np.empty((6, 6))
    g = np.empty(6)
    step = np.empty((3, 3))
    work = np.empty((3, 3))
    rows = np.empty((2, 6))
    place = np.empty(2)
    points = np.empty((n_leds, 3))
    located = np.empty(n_leds, np.bool_)
    # The start: closed forms, accurate to the noise of triangulation, so that one step suffices.
    spots = _gather(ideal, jacobian, labels, led_ideal, led_jacobian, seen)
    count = triangulate_leds(led_ideal, seen, cams, points, located)
    fit_leds(leds, points, located, count, rotation, origin, np.empty((4, 4)), np.empty((4, 4)))
    for c in range(n_cameras):
        for led in range(n_leds):
            if seen[c, led] and not _faces(
                centres[c], leds[led], directions[led], rotation, origin, least_cosine
            ):
                # An LED facing away from the camera cannot be the spot.
                return -1.0
    sure = np.empty((n_cameras, n_leds), np.int64)
    while True:
        many = spots >= MANY_SPOTS
        if many:
            clear(sure)
        # One Gauss-Newton step for every added spot. Afterwards h holds the factor of J'J.
        chi2 = _improve(
            led_ideal, led_jacobian, seen, cams, leds, rotation, origin, h, g, step, work, sigma
        )
        # Six pose parameters, two coordinates a spot.
        if chi2 < 0.0 or chi2 > limits[2 * spots - 6]:
            return -1.0
        best, best_c, best_led, best_slot = np.inf, -1, -1, -1
        for c in range(n_cameras):
            for led in range(n_leds):
                if seen[c, led] or not _faces(
                    centres[c], leds[led], directions[led], rotation, origin, least_cosine
                ):
                    continue
                # Predicted place of the LED and its uncertainty: the covariance of spot minus
                # prediction is sigma^2 (I + J (J'J)^-1 J'), of which s is the matrix in brackets;
                # rows become J L^-T.
                _predict(cams, c, leds[led], rotation, origin, place, rows)
                forward(h, rows[0])
                forward(h, rows[1])
                s00, s01, s11 = 1.0, 0.0, 1.0
                for k in range(6):
                    s00 += rows[0, k] * rows[0, k]
                    s01 += rows[0, k] * rows[1, k]
                    s11 += rows[1, k] * rows[1, k]
                # The quadratic form with the inverse of a 2x2 matrix, by its cofactors.
                scale = 1.0 / (sigma * sigma * (s00 * s11 - s01 * s01))
                near, slot_near = 0, -1
                for slot in range(there.shape[1]):
                    if not there[c, slot]:
                        continue
                    ex, ey = _miss(ideal[c, slot], jacobian[c, slot], place)
                    if scale * (s11 * ex * ex - 2.0 * s01 * ex * ey + s00 * ey * ey) < SPOT_CHI2:
                        near += 1
                        slot_near = slot
                # Exactly one candidate spot, not held by another LED.
                if near != 1 or _taken(labels, c, slot_near):
                    continue
                follows = usable[c * there.shape[1] + slot_near]
                # Also refuses -2, a slot without an LED by its code. The LED with the most certain
                # place (trace of the covariance) is added first.
                if many and follows in (-1, led) and s00 + s11 < SURE_PLACE:
                    sure[c, led] = slot_near
                if follows in (-1, led) and s00 + s11 < best:
                    best, best_c, best_led, best_slot = s00 + s11, c, led, slot_near
        # No unambiguous candidate remains. Every round adds a spot, so the loop ends.
        if best_c < 0:
            break
        labels[best_c, best_led] = best_slot
        if many:
            _add_sure(sure, labels)
        spots = _gather(ideal, jacobian, labels, led_ideal, led_jacobian, seen)
    if _drop_rivals(rays, cameras, body, rival_px, labels, rotation, origin, place, rows):
        _gather(ideal, jacobian, labels, led_ideal, led_jacobian, seen)
        # The spots remaining after removal of rivals must still determine a pose.
        if triangulate_leds(led_ideal, seen, cams, points, located) < 3:
            return -1.0
        chi2 = _improve(
            led_ideal, led_jacobian, seen, cams, leds, rotation, origin, h, g, step, work, sigma
        )
        if chi2 < 0.0:
            return -1.0
    # All spots together met the limit above; the remaining ones are not compared again.
    worth[0] = ambiguity_score(led_ideal, led_jacobian, seen, cams, leds, rotation, origin, sigma)
    return chi2


@compiled()
def _gather(
    ideal: Float, jacobian: Float, labels: Int, led_ideal: Float, led_jacobian: Float, seen: Bool
) -> int:
    """Write the labelled spots in the order of the LEDs; return their number."""
    spots = 0
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            slot = labels[c, led]
            seen[c, led] = slot >= 0
            if slot < 0:
                continue
            spots += 1
            for k in range(2):
                led_ideal[c, led, k] = ideal[c, slot, k]
            for k in range(4):
                led_jacobian[c, led, k] = jacobian[c, slot, k]
    return spots


@compiled(kernel, small_algebra)
def _improve(
    led_ideal: Float, led_jacobian: Float, seen: Bool, cams: Float, leds: Float,
    rotation: Float, origin: Float, h: Float, g: Float, step: Float, work: Float, sigma: float,
) -> float:  # fmt: skip
    """Apply a Gauss-Newton step; return chi-square after it, -1 if undetermined."""
    squares: float = normal_equations(
        led_ideal, led_jacobian, seen, cams, leds, rotation, origin, h, g
    )
    if not cholesky(h):
        return -1.0
    forward(h, g)
    for i in range(6):
        # L^-1 g|^2 is the decrease of the sum of squares by a full step, to first order.
        squares -= g[i] * g[i]
    backward(h, g)
    turn(rotation, g[0], g[1], g[2], step, work)
    for i in range(3):
        origin[i] += g[3 + i]
    # From a distant start, the first-order prediction may be negative.
    return max(squares, 0.0) / (sigma * sigma)


@compiled()
def _faces(
    centre: Float, led: Float, direction: Float, rotation: Float, origin: Float, least_cosine: float
) -> bool:
    along, size = 0.0, 0.0
    for i in range(3):
        # The LED's place gets the whole motion, its direction only the rotation.
        place, heading = origin[i], 0.0
        for j in range(3):
            place += rotation[i, j] * led[j]
            heading += rotation[i, j] * direction[j]
        along += (centre[i] - place) * heading
        size += (centre[i] - place) ** 2
    # cos(angle) = direction . ray / |ray|; directions are unit vectors.
    return bool(along >= least_cosine * np.sqrt(size))


@compiled(meeting_kernel)
def _predict(
    cams: Float, c: int, led: Float, rotation: Float, origin: Float, place: Float, rows: Float
) -> None:
    """Write the image (2,) of an LED, mm, and ``rows`` (2, 6), px by rotation and shift."""
    arm = np.empty(3)
    point = np.empty(3)
    derivative = np.empty((2, 3))
    for i in range(3):
        arm[i] = rotation[i, 0] * led[0] + rotation[i, 1] * led[1] + rotation[i, 2] * led[2]
        point[i] = arm[i] + origin[i]
    place[0], place[1], _ = view(cams, c, point, derivative)
    for axis in range(2):
        # Sx, Sy. The distortion's own derivative, a few per cent, is ignored: this only affects the
        # size of a gate and the order in which spots are added.
        scale = cams[c, 13 + axis]
        dx, dy, dz = (
            scale * derivative[axis, 0], scale * derivative[axis, 1], scale * derivative[axis, 2]
        )  # fmt: skip
        # arm x derivative: the rotation about the probe's origin, world axes, as in
        # `normal_equations`.
        rows[axis, 0] = arm[1] * dz - arm[2] * dy
        rows[axis, 1] = arm[2] * dx - arm[0] * dz
        rows[axis, 2] = arm[0] * dy - arm[1] * dx
        rows[axis, 3], rows[axis, 4], rows[axis, 5] = dx, dy, dz


@compiled()
def _miss(ideal: Float, slope: Float, place: Float) -> tuple[float, float]:
    """Return the distance of a spot from a place on the ideal image, px."""
    ex, ey = ideal[0] - place[0], ideal[1] - place[1]
    return slope[0] * ex + slope[1] * ey, slope[2] * ex + slope[3] * ey


@compiled()
def _add_sure(sure: Int, labels: Int) -> None:
    """Assign the LEDs ``sure`` (C, L) to their slots, unless claimed by another."""
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            slot = sure[c, led]
            if slot >= 0 and not _taken(labels, c, slot):
                wanted = 0
                for other in range(labels.shape[1]):
                    wanted += int(sure[c, other] == slot)
                if wanted == 1:
                    labels[c, led] = slot


@compiled()
def _taken(labels: Int, c: int, slot: int) -> bool:
    taken = False
    for led in range(labels.shape[1]):
        taken = taken or labels[c, led] == slot
    return taken


@compiled(meeting_kernel)
def _drop_rivals(
    rays: FrameRays, cameras: PackedCameras, body: LitBody, rival_px: float, labels: Int,
    rotation: Float, origin: Float, place: Float, rows: Float,
) -> bool:  # fmt: skip
    """Remove labels with an equally close second spot or LED; return whether any was."""
    ideal, jacobian, there, _ = rays
    cams, centres = cameras
    leds, directions, least_cosine = body
    n_cameras, n_leds = labels.shape
    # near[led, slot]: the spot of the slot is within rival_px of the place of the LED.
    near = np.zeros((n_leds, there.shape[1]), np.bool_)
    dropped = False
    for c in range(n_cameras):
        for led in range(n_leds):
            for slot in range(there.shape[1]):
                near[led, slot] = False
            # An LED facing away is no rival. A labelled one is checked regardless of the cone.
            if labels[c, led] < 0 and not _faces(
                centres[c], leds[led], directions[led], rotation, origin, least_cosine
            ):
                continue
            _predict(cams, c, leds[led], rotation, origin, place, rows)
            for slot in range(there.shape[1]):
                if there[c, slot]:
                    ex, ey = _miss(ideal[c, slot], jacobian[c, slot], place)
                    near[led, slot] = ex * ex + ey * ey < rival_px * rival_px
        for led in range(n_leds):
            slot = labels[c, led]
            if slot < 0:
                continue
            # Other spots at the LED's place, and other LEDs at the spot's.
            rivals = 0
            for other in range(there.shape[1]):
                rivals += int(near[led, other])
            for other in range(n_leds):
                rivals += int(near[other, slot])
            # The spot itself is counted twice if it is at its place.
            if rivals > 2 * int(near[led, slot]):
                labels[c, led] = -1
                dropped = True
    return dropped
