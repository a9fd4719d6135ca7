"""Compiled match of one body with intersection points, by triples of equal distances."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _decide_kernel as decide_kernel
from ocmm_core.tracking.kernels import _grow_kernel as grow_kernel
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _meeting_kernel as meeting_kernel
from ocmm_core.tracking.kernels import _small_algebra as small_algebra
from ocmm_core.tracking.kernels._decide_kernel import (
    CONFUSED,
    FEW,
    NO_FIT,
    clear,
    copy_labels,
    in_sight,
    merge,
    spots_of,
)
from ocmm_core.tracking.kernels._grow_kernel import (
    FrameRays,
    Gates,
    LitBody,
    PackedCameras,
    extend_hypothesis,
)
from ocmm_core.tracking.kernels._kernel import Bool
from ocmm_core.tracking.kernels._meeting_kernel import measure

MAX_ATTEMPTS, LEAST_ATTEMPTS = 1500, 100
MAX_MEETINGS = 192
"""Limits of tried triples and intersection points; beyond, the scene is too confusing."""

USUAL_SPOTS = 32
"""Spots of eight LEDs in four cameras, for which the limits were measured."""

RULE_MARGIN = 0.17
"""Sine of 10 degrees: margin around a rule's limit in which compliance is uncertain."""

_NEEDS = (decide_kernel, grow_kernel, kernel, meeting_kernel, small_algebra)


class BodySearch(NamedTuple):
    """Requirements on the poses of a body."""

    number: int
    least: int
    """Poses that label fewer LEDs are not kept."""
    weak: Int
    """(1,): largest number of spots explained by one of those."""
    axes: Float
    rule_worlds: Float


class HeldPoses(NamedTuple):
    """Poses of all bodies; those of the body searched begin at ``start``."""

    poses: Int
    owner: Int
    certain: Bool
    doubt: Float
    start: int


@compiled(*_NEEDS)
def match_body(
    positions: Float, covariances: Float, lights: Int, rays: FrameRays, cameras: PackedCameras,
    body: LitBody, search: BodySearch, gates: Gates, kept: HeldPoses, held: int, left: Int,
) -> tuple[int, int]:  # fmt: skip
    """Try all triples of LEDs at all triples of intersection points with equal distances.

    ``left`` (2,): remaining triples and comparisons for this frame.
    """
    there, usable, leds, weak = rays.there, rays.usable, body.leds, search.weak
    poses, owner, certain, doubt, start = kept
    count, n_leds, n_slots = len(positions), len(leds), there.shape[1]
    # Three points are the minimum to determine a pose and to match distances.
    if count < 3:
        return FEW, held
    if count > MAX_MEETINGS:
        return CONFUSED, held
    far = np.empty((count, count))
    slack = np.empty((count, count))
    measure(positions, covariances, count, far, slack)
    nominal = np.empty((n_leds, n_leds))
    for i in range(n_leds):
        for j in range(n_leds):
            square = 0.0
            for k in range(3):
                square += (leds[i, k] - leds[j, k]) ** 2
            nominal[i, j] = np.sqrt(square)
    labels = np.empty((there.shape[0], n_leds), np.int64)
    rotation = np.empty((3, 3))
    origin = np.empty(3)
    worth = np.empty(1)
    attempts = 0
    # The cost of a triple grows with cameras and LEDs: the limit keeps the time constant.
    most = most_attempts(there.shape[0] * n_leds)
    for i in range(n_leds):
        for m in range(count):
            if not _may(usable, lights[m], i):
                continue
            # i < j < k: every set of three LEDs once, at every ordered choice of three points.
            for j in range(i + 1, n_leds):
                left[1] -= count
                if left[1] < 0:
                    return CONFUSED, held
                for n in range(count):
                    if (
                        # Distances prune early: a mismatched pair skips the third loop.
                        abs(far[m, n] - nominal[i, j]) > slack[m, n]
                        or not _apart(lights[m], lights[n])
                        or not _may(usable, lights[n], j)
                    ):
                        continue
                    for k in range(j + 1, n_leds):
                        for o in range(count):
                            if (
                                abs(far[m, o] - nominal[i, k]) > slack[m, o]
                                or abs(far[n, o] - nominal[j, k]) > slack[n, o]
                                or not _apart(lights[m], lights[o])
                                or not _apart(lights[n], lights[o])
                                or not _may(usable, lights[o], k)
                            ):
                                continue
                            if _known(
                                poses, start, held, n_slots, i, j, k, lights[m], lights[n],
                                lights[o],
                            ):  # fmt: skip
                                continue
                            # Each intersection point has two spots, one in each of two cameras.
                            clear(labels)
                            for side in range(2):
                                labels[lights[m, side] // n_slots, i] = lights[m, side] % n_slots
                                labels[lights[n, side] // n_slots, j] = lights[n, side] % n_slots
                                labels[lights[o, side] // n_slots, k] = lights[o, side] % n_slots
                            # The number of triples grows with the third power of the points; the
                            # limit keeps a frame full of reflections from stopping the live stream.
                            attempts += 1
                            left[0] -= 1
                            if attempts > most or left[0] < 0 or held == len(poses):
                                return CONFUSED, held
                            chi2 = extend_hypothesis(
                                rays, cameras, body, gates, labels, rotation, origin, worth
                            )
                            # A rule requires a positive component of a body axis along a world
                            # direction. Below -RULE_MARGIN the pose is forbidden; within it the
                            # pose is kept, but not certain.
                            margin = _promise(search.axes, search.rule_worlds, rotation)
                            if chi2 < 0.0 or margin < -RULE_MARGIN:
                                continue
                            if search.least > 0 and in_sight(labels) < search.least:
                                weak[0] = max(weak[0], spots_of(labels))
                                continue
                            clear(poses[held])
                            copy_labels(labels, poses[held])
                            owner[held], certain[held] = search.number, margin > RULE_MARGIN
                            # Written behind the last pose held; `merge` decides whether it stays.
                            doubt[held] = worth[0]
                            held = merge(poses, start, held, certain, doubt)
    return NO_FIT, held


@compiled()
def _may(usable: Int, lights: Int, led: int) -> bool:
    one, other = usable[lights[0]], usable[lights[1]]
    # -1 may be any LED, -2 equals no LED number and never passes.
    return bool((one == -1 or one == led) and (other == -1 or other == led))


@compiled()
def _apart(one: Int, other: Int) -> bool:
    return bool(
        # One spot is one LED; a number holds its camera and its slot.
        one[0] != other[0] and one[0] != other[1] and one[1] != other[0] and one[1] != other[1]
    )


@compiled()
def most_attempts(spots: int) -> int:
    """Return the limit of triples for this largest number of spots of a body."""
    if spots <= USUAL_SPOTS:
        return MAX_ATTEMPTS
    return max(MAX_ATTEMPTS * USUAL_SPOTS // spots, LEAST_ATTEMPTS)


@compiled()
def _known(
    poses: Int, start: int, held: int, n_slots: int, i: int, j: int, k: int,
    at_i: Int, at_j: Int, at_k: Int,
) -> bool:  # fmt: skip
    """Return whether a kept pose already contains a labelling of six spots."""
    for pose in range(start, held):
        same = True
        for side in range(2):
            same = (
                same
                and poses[pose, at_i[side] // n_slots, i] == at_i[side] % n_slots
                and poses[pose, at_j[side] // n_slots, j] == at_j[side] % n_slots
                and poses[pose, at_k[side] // n_slots, k] == at_k[side] % n_slots
            )
        if same:
            return True
    return False


@compiled()
def _promise(axes: Float, rule_worlds: Float, rotation: Float) -> float:
    """Return the least component of a rule's axis along its world direction, 1 without rules."""
    # The least satisfied rule counts; a cosine of one is never exceeded.
    least = 1.0
    for rule in range(len(axes)):
        along = 0.0
        for i in range(3):
            for j in range(3):
                # world . R axis: the cosine between the world direction and the rotated axis.
                along += rule_worlds[rule, i] * rotation[i, j] * axes[rule, j]
        least = min(least, along)
    return least
