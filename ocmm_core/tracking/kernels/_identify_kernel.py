"""The compiled search for labels: all that the spots of one frame can mean, and the decision.

Three meeting points whose distances are those of three LEDs (a rigid signature) give a pose, by a
rotation that never is a reflection; `_grow_kernel.grow` completes it. Every pose that holds is
kept, of every body, and the decision is taken among all of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import (
    _doubt_kernel as doubt_kernel,
)
from ocmm_core.tracking.kernels import (
    _grow_kernel as grow_kernel,
)
from ocmm_core.tracking.kernels import (
    _kernel as kernel,
)
from ocmm_core.tracking.kernels import (
    _meeting_kernel as meeting_kernel,
)
from ocmm_core.tracking.kernels import (
    _small_algebra as small_algebra,
)
from ocmm_core.tracking.kernels._grow_kernel import extend_hypothesis
from ocmm_core.tracking.kernels._kernel import Bool
from ocmm_core.tracking.kernels._meeting_kernel import measure, triangulate_pairs, undistort_rays

FOUND, FEW, NO_FIT, AMBIGUOUS, CONFUSED, THIN, NEAR_RULE = range(7)
"""Outcomes: named; fewer than three targets; nothing fits; more than one labelling fits; too many
could be meant; too few LEDs to be sure; too near to what an orientation rule forbids."""

MAX_POSES = 32
MAX_ATTEMPTS = 1500
MAX_MEETINGS = 192
"""Triples that are tried, and meeting points, before the scene counts as too confused."""

RULE_MARGIN = 0.17
"""Sine of 10 degrees: within them of what a rule forbids, a promise kept and one broken look
alike."""

# In squared standard deviations of the pose: a single false LED may have moved it by seven of them,
# and the ball, which the pose carries, by no more. Beyond that a tip counts as wrong
# (`benchmarks.labels`): at nine, one of 1.2 million tips was.
MAX_DOUBT = 49.0
"""Greatest doubt (`doubt_kernel.ambiguity_score`). Three LEDs may be two LEDs
and a reflection, which agrees by chance in one of some ten thousand such scenes; so every LED must
be spoken for by the others. Three that name themselves by a strobe code are enough."""

_NEEDS = (doubt_kernel, grow_kernel, kernel, meeting_kernel, small_algebra)


@compiled(*_NEEDS)
def identify_frames(
    spots: Float, cams: Float, centres: Float, bounds: Float, counts: Int, leds: Float,
    directions: Float, least_cosines: Float, axes: Float, rule_worlds: Float, n_rules: Int,
    usable: Int, coded: Bool, sigma: float, rival_px: float, limits: Float,
    status: NDArray[np.uint8], labels: Int,
) -> None:  # fmt: skip
    """Name the spots of every frame.

    Parameters
    ----------
    spots
        (n, C, S, 2), px, NaN where a slot is empty.
    cams, centres, bounds
        (C, 21); (C, 3), mm; (2, 3), mm: corners of where LEDs can be.
    counts, leds, directions, least_cosines
        The B bodies: (B,), (B, 8, 3), (B, 8, 3), (B,).
    axes, rule_worlds, n_rules
        Orientation rules (B, 4, 3), (B, 4, 3), (B,).
    usable, coded
        (B, C S): LED by strobe code, -1 where a slot may be any, -2 where none; (B,).
    sigma, rival_px, limits
        See `_grow_kernel.grow`.
    status, labels
        Outputs (n, B) and (n, B, C, 8): slot of each LED, -1 where none.
    """
    n, n_cameras, n_slots = spots.shape[:3]
    n_bodies = len(counts)
    ideal = np.empty((n_cameras, n_slots, 2))
    jacobian = np.empty((n_cameras, n_slots, 4))
    there = np.empty((n_cameras, n_slots), np.bool_)
    poses = np.empty((MAX_POSES, n_cameras, 8), np.int64)
    owner = np.empty(MAX_POSES, np.int64)
    certain = np.empty(MAX_POSES, np.bool_)
    doubt = np.empty(MAX_POSES)
    for frame in range(n):
        undistort_rays(spots[frame], cams, ideal, jacobian, there)
        # A constant would be one more type to compile for.
        held = int(np.int64(0))
        for body in range(n_bodies):
            size = counts[body]
            # Poses of all bodies go into one list: a pose of one may claim the spots of another.
            before = held
            outcome, held = _search(
                ideal, jacobian, there, usable[body], cams, centres, bounds, leds[body, :size],
                directions[body, :size], least_cosines[body], axes[body, : n_rules[body]],
                rule_worlds[body, : n_rules[body]], sigma, rival_px, limits, body,
                poses, owner, certain, doubt, held,
            )  # fmt: skip
            # Poses that hold make it FOUND for now; which one, and whether it is sure, `_decide`
            # says.
            status[frame, body] = outcome if held == before or outcome == CONFUSED else FOUND
        # Only after all bodies were searched.
        for body in range(n_bodies):
            _clear(labels[frame, body])
            if status[frame, body] == FOUND:
                _decide(
                    poses, owner, certain, doubt, held, body, coded[body], status[frame],
                    labels[frame, body],
                )  # fmt: skip


@compiled(*_NEEDS)
def _search(
    ideal: Float, jacobian: Float, there: Bool, usable: Int, cams: Float, centres: Float,
    bounds: Float, leds: Float, directions: Float, least_cosine: float, axes: Float,
    rule_worlds: Float, sigma: float, rival_px: float, limits: Float, body: int,
    poses: Int, owner: Int, certain: Bool, doubt: Float, held: int,
) -> tuple[int, int]:  # fmt: skip
    """Add what the spots can mean as this body to ``poses``; return outcome and number held.

    LEDs are sought among the meeting points of two cameras, of every two; where that gives nothing,
    among all: of four cameras each may see another three.
    """
    n_cameras, n_slots = there.shape
    positions = np.empty((MAX_MEETINGS, 3))
    covariances = np.empty((MAX_MEETINGS, 3, 3))
    lights = np.empty((MAX_MEETINGS, 2), np.int64)
    start, total = held, 0
    for first in range(n_cameras):
        for second in range(first + 1, n_cameras):
            # All pairs of spots of two cameras could meet; there must be room for as many.
            if total + n_slots * n_slots > MAX_MEETINGS:
                return CONFUSED, held
            count = triangulate_pairs(
                ideal, jacobian, there, cams, first, second, sigma, bounds,
                positions[total:], covariances[total:], lights[total:],
            )  # fmt: skip
            outcome, held = _match(
                positions[total : total + count], covariances[total : total + count],
                lights[total : total + count], ideal, jacobian, there, usable, cams, centres,
                leds, directions, least_cosine, axes, rule_worlds, sigma, rival_px, limits, body,
                poses, owner, certain, doubt, start, held,
            )  # fmt: skip
            if outcome == CONFUSED:
                return CONFUSED, held
            total += count
    # With two cameras there is one pair of them, and nothing more to mix.
    if held > start or n_cameras == 2:
        return (NO_FIT if total >= 3 else FEW), held
    return _match(
        positions[:total], covariances[:total], lights[:total], ideal, jacobian, there, usable,
        cams, centres, leds, directions, least_cosine, axes, rule_worlds, sigma, rival_px, limits,
        body, poses, owner, certain, doubt, start, held,
    )  # fmt: skip


@compiled(*_NEEDS)
def _match(
    positions: Float, covariances: Float, lights: Int, ideal: Float, jacobian: Float, there: Bool,
    usable: Int, cams: Float, centres: Float, leds: Float, directions: Float, least_cosine: float,
    axes: Float, rule_worlds: Float, sigma: float, rival_px: float, limits: Float, body: int,
    poses: Int, owner: Int, certain: Bool, doubt: Float, start: int, held: int,
) -> tuple[int, int]:  # fmt: skip
    """Try every three LEDs at every three of the meeting points that are as far apart."""
    count, n_leds, n_slots = len(positions), len(leds), there.shape[1]
    # Three points are the least that fix a pose, and the least that a body's distances can tell.
    if count < 3:
        return FEW, held
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
    for i in range(n_leds):
        for m in range(count):
            if not _may(usable, lights[m], i):
                continue
            # i < j < k: every set of three LEDs once, at every ordered choice of three meeting
            # points.
            for j in range(i + 1, n_leds):
                for n in range(count):
                    if (
                        # The distances prune from the outside: a pair that is not as far apart
                        # costs no third loop.
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
                            # Each meeting point names two spots, one in each of two cameras.
                            _clear(labels)
                            for side in range(2):
                                labels[lights[m, side] // n_slots, i] = lights[m, side] % n_slots
                                labels[lights[n, side] // n_slots, j] = lights[n, side] % n_slots
                                labels[lights[o, side] // n_slots, k] = lights[o, side] % n_slots
                            if _known(poses, start, held, labels):
                                continue
                            # The number of triples grows with the third power of the meeting
                            # points; the limit keeps a frame full of reflections from stopping the
                            # live stream.
                            attempts += 1
                            if attempts > MAX_ATTEMPTS or held == MAX_POSES:
                                return CONFUSED, held
                            chi2 = extend_hypothesis(
                                ideal, jacobian, there, usable, cams, centres, leds, directions,
                                least_cosine, sigma, rival_px, limits, labels, rotation, origin,
                                worth,
                            )  # fmt: skip
                            # A rule says that an axis of the body keeps to one side of a world
                            # direction: a component above zero. Below -RULE_MARGIN the pose is
                            # forbidden; within it the pose is held, but not certain.
                            kept = _promise(axes, rule_worlds, rotation)
                            if chi2 < 0.0 or kept < -RULE_MARGIN:
                                continue
                            _clear(poses[held])
                            _copy(labels, poses[held])
                            owner[held], certain[held] = body, kept > RULE_MARGIN
                            # Written behind the last pose held; `_merge` decides whether it stays.
                            doubt[held] = worth[0]
                            held = _merge(poses, start, held, certain, doubt)
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
def _known(poses: Int, start: int, held: int, labels: Int) -> bool:
    """Return whether a pose that is held says all that a labelling of six spots says."""
    for pose in range(start, held):
        same = 0
        for c in range(labels.shape[0]):
            for led in range(labels.shape[1]):
                same += labels[c, led] >= 0 and poses[pose, c, led] == labels[c, led]
        # Three LEDs in two cameras each: all that a triple says. Growing it again gives nothing
        # new.
        if same == 6:
            return True
    return False


@compiled()
def _promise(axes: Float, rule_worlds: Float, rotation: Float) -> float:
    """Return the least component of a rule's axis along its world direction, 1 without rules."""
    # The rule that is kept least counts; a cosine of one is never exceeded.
    least = 1.0
    for rule in range(len(axes)):
        along = 0.0
        for i in range(3):
            for j in range(3):
                # world . R axis: the cosine between the world direction and the axis as the pose
                # turns it.
                along += rule_worlds[rule, i] * rotation[i, j] * axes[rule, j]
        least = min(least, along)
    return least


@compiled()
def _merge(poses: Int, start: int, held: int, certain: Bool, doubt: Float) -> int:
    """Keep the last pose unless it is one that is held already; return the number held."""
    for pose in range(start, held):
        same, conflicts, more = 0, 0, 0
        for c in range(poses.shape[1]):
            for led in range(8):
                one, other = poses[pose, c, led], poses[held, c, led]
                same += one >= 0 and one == other
                conflicts += one >= 0 and other >= 0 and one != other
                more += int(other >= 0) - int(one >= 0)
        # The same three LEDs at the same spots, and nowhere another opinion: one pose that was
        # grown from two triples. The one that explains more spots is kept, with its own doubt.
        if conflicts == 0 and same >= 6:
            if more > 0:
                _copy(poses[held], poses[pose])
                certain[pose], doubt[pose] = certain[held], doubt[held]
            return held
    return held + 1


@compiled()
def _decide(
    poses: Int, owner: Int, certain: Bool, doubt: Float, held: int, body: int, coded: bool,
    status: NDArray[np.uint8], labels: Int,
) -> None:  # fmt: skip
    """Choose among all poses; write the status of ``body`` and its labels (C, 8).

    The best one must explain more than any other, of this body or of one that claims its spots, by
    more than one light in space could add.
    """
    n_cameras = poses.shape[1]
    best, most = -1, -1
    for pose in range(held):
        if owner[pose] == body and _spots(poses[pose]) > most:
            best, most = pose, _spots(poses[pose])
    for pose in range(held):
        # A single light in space gives at most one spot in every camera, so that n_cameras spots
        # more can be the work of one reflection. A rival that near in number leaves the answer
        # open.
        if pose == best or _spots(poses[pose]) < most - n_cameras:
            continue
        if owner[pose] == body or _share(poses[best], poses[pose]):
            status[body] = AMBIGUOUS
            return
    in_sight = 0
    for led in range(8):
        seen = False
        for c in range(n_cameras):
            seen = seen or poses[best, c, led] >= 0
        in_sight += int(seen)
    # A strobe code names each LED by itself; three LEDs that carry it need no fourth to speak for
    # them.
    if doubt[best] > MAX_DOUBT and not (coded and in_sight == 3):
        status[body] = THIN
    elif not certain[best]:
        status[body] = NEAR_RULE
    else:
        _copy(poses[best], labels)


@compiled()
def _clear(labels: Int) -> None:
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            labels[c, led] = -1


@compiled()
def _copy(labels: Int, to: Int) -> None:
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            to[c, led] = labels[c, led]


@compiled()
def _spots(labels: Int) -> int:
    count = 0
    for c in range(labels.shape[0]):
        for led in range(labels.shape[1]):
            count += int(labels[c, led] >= 0)
    return count


@compiled()
def _share(one: Int, other: Int) -> bool:
    for c in range(one.shape[0]):
        for led in range(8):
            for second in range(8):
                # A slot that both poses claim, whichever LED they take it for.
                if one[c, led] >= 0 and one[c, led] == other[c, second]:
                    return True
    return False
