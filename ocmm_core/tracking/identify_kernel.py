"""The compiled search for labels: all that the spots of one frame can mean, and the decision.

Three meeting points whose distances are those of three LEDs (a rigid signature) give a pose, by a
rotation that never is a reflection; `grow_kernel.grow` completes it. Every pose that holds is kept,
of every body, and the decision is taken among all of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera.compiled import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import grow_kernel, kernel, meeting_kernel, small_algebra
from ocmm_core.tracking.grow_kernel import grow
from ocmm_core.tracking.kernel import Bool
from ocmm_core.tracking.meeting_kernel import measure, meet, straighten

FOUND, FEW, NO_FIT, AMBIGUOUS, CONFUSED, THIN, NEAR_RULE = range(7)
"""Outcomes: named; fewer than three targets; nothing fits; more than one labelling fits; too many
could be meant; too few LEDs to be sure; too near to what an orientation rule forbids."""

MAX_POSES = 32
MAX_ATTEMPTS = 1500
"""Triples of one frame that are tried before the scene counts as too confused."""

RULE_MARGIN = 0.17
"""Sine of 10 degrees: within them of what a rule forbids, a promise kept and one broken look
alike."""

SURE_LEDS = 4
"""LEDs in space that name a body without a strobe code. Three may be two LEDs and a reflection:
that agrees by chance in one of some ten thousand such scenes; the place of a fourth LED, seen by
one camera at least, must agree as well."""

_NEEDS = (grow_kernel, kernel, meeting_kernel, small_algebra)


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
        (B, C, S): LED by strobe code, -1 where a slot may be any, -2 where none; (B,).
    sigma, rival_px, limits
        See `grow_kernel.grow`.
    status, labels
        Outputs (n, B) and (n, B, C, 8): slot of each LED, -1 where none.
    """
    n, n_cameras, n_slots = spots.shape[:3]
    n_bodies = len(counts)
    ideal = np.empty((n_cameras, n_slots, 2))
    slopes = np.empty((n_cameras, n_slots, 4))
    there = np.empty((n_cameras, n_slots), np.bool_)
    poses = np.empty((MAX_POSES, n_cameras, 8), np.int64)
    owner = np.empty(MAX_POSES, np.int64)
    certain = np.empty(MAX_POSES, np.bool_)
    for frame in range(n):
        straighten(spots[frame], cams, ideal, slopes, there)
        held = 0
        for body in range(n_bodies):
            size = counts[body]
            before = held
            outcome, held = _search(
                ideal, slopes, there, usable[body], cams, centres, bounds, leds[body, :size],
                directions[body, :size], least_cosines[body], axes[body, : n_rules[body]],
                rule_worlds[body, : n_rules[body]], sigma, rival_px, limits, body,
                poses, owner, certain, held,
            )  # fmt: skip
            status[frame, body] = outcome if held == before or outcome == CONFUSED else FOUND
        for body in range(n_bodies):
            labels[frame, body] = -1
            if status[frame, body] == FOUND:
                _decide(
                    poses, owner, certain, held, body, coded[body], status[frame],
                    labels[frame, body],
                )  # fmt: skip


@compiled(*_NEEDS)
def _search(
    ideal: Float, slopes: Float, there: Bool, usable: Int, cams: Float, centres: Float,
    bounds: Float, leds: Float, directions: Float, least_cosine: float, axes: Float,
    rule_worlds: Float, sigma: float, rival_px: float, limits: Float, body: int,
    poses: Int, owner: Int, certain: Bool, held: int,
) -> tuple[int, int]:  # fmt: skip
    """Add what the spots can mean as this body to ``poses``; return outcome and number held."""
    n_cameras, n_slots, n_leds = there.shape[0], there.shape[1], len(leds)
    positions = np.empty((n_slots * n_slots, 3))
    covariances = np.empty((n_slots * n_slots, 3, 3))
    slots = np.empty((n_slots * n_slots, 2), np.int64)
    far = np.empty((n_slots * n_slots, n_slots * n_slots))
    slack = np.empty((n_slots * n_slots, n_slots * n_slots))
    nominal = np.empty((n_leds, n_leds))
    for i in range(n_leds):
        for j in range(n_leds):
            nominal[i, j] = np.sqrt(np.sum((leds[i] - leds[j]) ** 2))
    labels = np.empty((n_cameras, n_leds), np.int64)
    rotation = np.empty((3, 3))
    origin = np.empty(3)
    start, attempts, met = held, 0, False
    for first in range(n_cameras):
        for second in range(first + 1, n_cameras):
            count = meet(
                ideal, slopes, there, cams, first, second, sigma, bounds,
                positions, covariances, slots,
            )  # fmt: skip
            if count < 3:
                continue
            met = True
            measure(positions, covariances, count, far, slack)
            for i in range(n_leds):
                for m in range(count):
                    if not _may(usable, first, second, slots[m], i):
                        continue
                    for j in range(i + 1, n_leds):
                        for n in range(count):
                            if (
                                not _apart(slots[m], slots[n])
                                or abs(far[m, n] - nominal[i, j]) > slack[m, n]
                                or not _may(usable, first, second, slots[n], j)
                            ):
                                continue
                            for k in range(j + 1, n_leds):
                                for o in range(count):
                                    if (
                                        not _apart(slots[m], slots[o])
                                        or not _apart(slots[n], slots[o])
                                        or abs(far[m, o] - nominal[i, k]) > slack[m, o]
                                        or abs(far[n, o] - nominal[j, k]) > slack[n, o]
                                        or not _may(usable, first, second, slots[o], k)
                                    ):
                                        continue
                                    labels[:] = -1
                                    labels[first, i], labels[second, i] = slots[m]
                                    labels[first, j], labels[second, j] = slots[n]
                                    labels[first, k], labels[second, k] = slots[o]
                                    if _known(poses, start, held, labels, 6):
                                        continue
                                    attempts += 1
                                    if attempts > MAX_ATTEMPTS or held == MAX_POSES:
                                        return CONFUSED, held
                                    chi2 = grow(
                                        ideal, slopes, there, usable, cams, centres, leds,
                                        directions, least_cosine, sigma, rival_px, limits,
                                        labels, rotation, origin,
                                    )  # fmt: skip
                                    if chi2 < 0.0:
                                        continue
                                    kept = _promise(axes, rule_worlds, rotation)
                                    if kept < -RULE_MARGIN:
                                        continue
                                    poses[held] = -1
                                    poses[held, :, :n_leds] = labels
                                    owner[held], certain[held] = body, kept > RULE_MARGIN
                                    held = _merge(poses, start, held, certain)
    return (NO_FIT if met else FEW), held


@compiled()
def _may(usable: Int, first: int, second: int, slots: Int, led: int) -> bool:
    one, other = usable[first, slots[0]], usable[second, slots[1]]
    return bool((one == -1 or one == led) and (other == -1 or other == led))


@compiled()
def _apart(one: Int, other: Int) -> bool:
    return bool(one[0] != other[0] and one[1] != other[1])


@compiled()
def _known(poses: Int, start: int, held: int, labels: Int, size: int) -> bool:
    """Return whether a pose that is held says all that a labelling of ``size`` spots says."""
    for pose in range(start, held):
        same = 0
        for c in range(labels.shape[0]):
            for led in range(labels.shape[1]):
                same += labels[c, led] >= 0 and poses[pose, c, led] == labels[c, led]
        if same == size:
            return True
    return False


@compiled()
def _promise(axes: Float, rule_worlds: Float, rotation: Float) -> float:
    """Return the least component of a rule's axis along its world direction, 1 without rules."""
    least = 1.0
    for rule in range(len(axes)):
        along = 0.0
        for i in range(3):
            for j in range(3):
                along += rule_worlds[rule, i] * rotation[i, j] * axes[rule, j]
        least = min(least, along)
    return least


@compiled()
def _merge(poses: Int, start: int, held: int, certain: Bool) -> int:
    """Keep the last pose unless it is one that is held already; return the number held."""
    for pose in range(start, held):
        same, conflicts, more = 0, 0, 0
        for c in range(poses.shape[1]):
            for led in range(8):
                one, other = poses[pose, c, led], poses[held, c, led]
                same += one >= 0 and one == other
                conflicts += one >= 0 and other >= 0 and one != other
                more += int(other >= 0) - int(one >= 0)
        if conflicts == 0 and same >= 6:
            if more > 0:
                poses[pose] = poses[held]
                certain[pose] = certain[held]
            return held
    return held + 1


@compiled()
def _decide(
    poses: Int, owner: Int, certain: Bool, held: int, body: int, coded: bool,
    status: NDArray[np.uint8], labels: Int,
) -> None:  # fmt: skip
    """Choose among all poses; write the status of ``body`` and its labels (C, 8).

    The best one must explain more than any other, of this body or of one that claims its spots, by
    more than one light in space could add.
    """
    n_cameras = poses.shape[1]
    best, most = -1, -1
    for pose in range(held):
        if owner[pose] == body and np.sum(poses[pose] >= 0) > most:
            best, most = pose, np.sum(poses[pose] >= 0)
    for pose in range(held):
        if pose == best or np.sum(poses[pose] >= 0) < most - n_cameras:
            continue
        if owner[pose] == body or _share(poses[best], poses[pose]):
            status[body] = AMBIGUOUS
            return
    in_sight = 0
    for led in range(8):
        in_sight += int(np.any(poses[best, :, led] >= 0))
    if not coded and in_sight < SURE_LEDS:
        status[body] = THIN
    elif not certain[best]:
        status[body] = NEAR_RULE
    else:
        labels[:] = poses[best]


@compiled()
def _share(one: Int, other: Int) -> bool:
    for c in range(one.shape[0]):
        for led in range(8):
            for second in range(8):
                if one[c, led] >= 0 and one[c, led] == other[c, second]:
                    return True
    return False
