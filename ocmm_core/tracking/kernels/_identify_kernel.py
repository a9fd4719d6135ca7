"""Compiled search for labels: all possible poses of a frame, and the decision.

Three intersection points with the distances of three LEDs (a rigid signature) give a pose, with a
proper rotation; `_grow_kernel.extend_hypothesis` completes it. Every valid pose of every body is
kept for the decision.

Up to `ALL_SPOTS` spots a camera, all are seeds. Of more, a subset: a pose that explains many spots
is found from any of them, and so is every rival that explains nearly as many, because it leaves too
few spots unexplained to miss all seeds. Only equally good rivals matter.

Tracked labels are extended by free LEDs (`extend_tracked`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.kernels import _decide_kernel as decide_kernel
from ocmm_core.tracking.kernels import _grow_kernel as grow_kernel
from ocmm_core.tracking.kernels import _kernel as kernel
from ocmm_core.tracking.kernels import _match_kernel as match_kernel
from ocmm_core.tracking.kernels import _meeting_kernel as meeting_kernel
from ocmm_core.tracking.kernels import _small_algebra as small_algebra
from ocmm_core.tracking.kernels._decide_kernel import (
    CONFUSED,
    FEW,
    FOUND,
    NO_FIT,
    clear,
    decide,
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
from ocmm_core.tracking.kernels._match_kernel import (
    BodySearch,
    HeldPoses,
    match_body,
    most_attempts,
)
from ocmm_core.tracking.kernels._meeting_kernel import triangulate_pairs, undistort_rays

MAX_POSES = 32
MAX_COMPARISONS = 32_000_000
"""Limits of kept poses and compared distance pairs; beyond, the scene is too confusing."""

ALL_SPOTS = 16
"""Up to this number of spots a camera, all are seeds."""

FIRST_SEEDS = 12
"""Initial seeds a camera otherwise; doubled until sufficient."""

SPARE_SEEDS = 7
"""Three make a triple; four more may have no partner in the other camera."""

USUAL_CAMERAS = 4
USEFUL_PAIRS = 6
"""Number of cameras up to which all pairs are searched; with more, number of pairs that see three
LEDs to search after a pose was found.
"""

_NEEDS = (decide_kernel, grow_kernel, kernel, match_kernel, meeting_kernel, small_algebra)


@compiled(*_NEEDS)
def identify_frames(
    spots: Float, cams: Float, centres: Float, bounds: Float, pairs: Int, counts: Int, least: Int,
    leds: Float, directions: Float, least_cosines: Float, axes: Float, rule_worlds: Float,
    n_rules: Int, usable: Int, coded: Bool, sigma: float, rival_px: float, limits: Float,
    status: NDArray[np.uint8], labels: Int,
) -> None:  # fmt: skip
    """Label the spots of every frame.

    ``spots`` (n, C, S, 2), px, NaN for empty slots; ``cams`` (C, 21), ``centres`` (C, 3), mm,
    ``bounds`` (2, 3), mm: corners of the possible LED positions; ``pairs`` (P, 2) of cameras, in
    search order. The B bodies: ``counts``, ``least``, ``least_cosines`` (B,), ``leds``,
    ``directions`` (B, L, 3); ``least`` LEDs must be visible to label a body of many, 0 if ambiguity
    alone decides. Orientation rules: ``axes``, ``rule_worlds`` (B, 4, 3), ``n_rules`` (B,).
    ``usable`` (B, C S): LED by strobe code, -1 for any, -2 for none; ``coded`` (B,). Outputs:
    ``status`` (n, B) and ``labels`` (n, B, C, L): slot of each LED, -1 if none.
    """
    n, n_cameras, n_slots = spots.shape[:3]
    n_bodies = len(counts)
    ideal = np.empty((n_cameras, n_slots, 2))
    jacobian = np.empty((n_cameras, n_slots, 4))
    there = np.empty((n_cameras, n_slots), np.bool_)
    poses = np.empty((MAX_POSES, n_cameras, leds.shape[1]), np.int64)
    owner = np.empty(MAX_POSES, np.int64)
    certain = np.empty(MAX_POSES, np.bool_)
    doubt = np.empty(MAX_POSES)
    weak = np.empty((n_bodies, 1), np.int64)
    cameras, gates = PackedCameras(cams, centres), Gates(sigma, rival_px, limits)
    for frame in range(n):
        undistort_rays(spots[frame], cams, ideal, jacobian, there)
        # A constant would be one more type to compile for.
        held = int(np.int64(0))
        for body in range(n_bodies):
            size = counts[body]
            weak[body, 0] = 0
            # Poses of all bodies go into one list: a pose of one may claim the spots of another.
            before = held
            lit = LitBody(leds[body, :size], directions[body, :size], least_cosines[body])
            search = BodySearch(
                body, least[body], weak[body], axes[body, : n_rules[body]],
                rule_worlds[body, : n_rules[body]],
            )  # fmt: skip
            outcome, held = _search(
                spots[frame], FrameRays(ideal, jacobian, there, usable[body]), cameras, bounds,
                pairs, lit, search, gates, HeldPoses(poses, owner, certain, doubt, held),
            )  # fmt: skip
            # Valid poses make it FOUND for now; `decide` selects one and checks its certainty.
            status[frame, body] = outcome if held == before or outcome == CONFUSED else FOUND
        # Only after all bodies were searched.
        for body in range(n_bodies):
            clear(labels[frame, body])
            if status[frame, body] == FOUND:
                decide(
                    poses, owner, certain, doubt, held, body, coded[body], weak[body, 0],
                    status[frame], labels[frame, body],
                )  # fmt: skip


@compiled(*_NEEDS)
def _search(
    spots: Float, rays: FrameRays, cameras: PackedCameras, bounds: Float, pairs: Int, body: LitBody,
    search: BodySearch, gates: Gates, kept: HeldPoses,
) -> tuple[int, int]:  # fmt: skip
    """Add the possible poses of this body to ``kept``; return outcome and number held."""
    there, n_cameras = rays.there, len(cameras.packed)
    left = np.empty(2, np.int64)
    left[0] = (USEFUL_PAIRS + 1) * most_attempts(n_cameras * len(body.leds))
    left[1] = MAX_COMPARISONS
    fullest, total = 0, 0
    for c in range(there.shape[0]):
        count = 0
        for slot in range(there.shape[1]):
            count += int(there[c, slot])
        fullest = max(fullest, count)
        total += count
    held = kept.start
    if fullest <= ALL_SPOTS:
        return _search_seeds(
            rays, there, there, cameras, bounds, pairs, body, search, gates, kept, held, left
        )
    alone = np.empty(there.shape, np.bool_)
    seeds = np.empty(there.shape, np.bool_)
    _leave_rivals(spots, there, gates.rival_px, alone)
    width = FIRST_SEEDS
    while True:
        _choose_seeds(alone, width, seeds)
        outcome, held = _search_seeds(
            rays, seeds, alone, cameras, bounds, pairs, body, search, gates, kept, held, left
        )
        if outcome == CONFUSED or width >= fullest:
            return outcome, held
        most = 0
        for pose in range(kept.start, held):
            most = max(most, spots_of(kept.poses[pose]))
        # A relevant rival explains at most one spot a camera less than the best, and leaves no more
        # than these unexplained in the mean over the cameras; the other seeds are its own.
        if held > kept.start and width >= (total - most) // n_cameras + 1 + SPARE_SEEDS:
            return outcome, held
        width *= 2


@compiled(*_NEEDS)
def _search_seeds(
    rays: FrameRays, seeds: Bool, alone: Bool, cameras: PackedCameras, bounds: Float, pairs: Int,
    body: LitBody, search: BodySearch, gates: Gates, kept: HeldPoses, held: int, left: Int,
) -> tuple[int, int]:  # fmt: skip
    """Search with some spots of the first camera of every pair, and those of the second.

    LEDs are searched among the intersection points of two cameras, for every pair; without success,
    among all: each of four cameras may see another three.
    """
    n_cameras, n_slots = rays.there.shape
    most = 3 * n_slots * n_slots
    positions = np.empty((most, 3))
    covariances = np.empty((most, 3, 3))
    lights = np.empty((most, 2), np.int64)
    total, useful, whole = 0, 0, True
    for pair in range(len(pairs)):
        # All pairs of spots of two cameras could intersect; reserve room for them.
        if total + n_slots * n_slots > most:
            if n_cameras <= USUAL_CAMERAS:
                return CONFUSED, held
            total, whole = 0, False
        count = triangulate_pairs(
            rays.ideal, rays.jacobian, seeds, alone, cameras.packed, pairs[pair, 0],
            pairs[pair, 1], gates.sigma, bounds, positions[total:], covariances[total:],
            lights[total:],
        )  # fmt: skip
        outcome, held = match_body(
            positions[total : total + count], covariances[total : total + count],
            lights[total : total + count], rays, cameras, body, search, gates, kept, held, left,
        )  # fmt: skip
        if outcome == CONFUSED:
            return CONFUSED, held
        total += count
        useful += int(count >= 3)
        if n_cameras > USUAL_CAMERAS and useful >= USEFUL_PAIRS and held > kept.start:
            break
    # Two cameras have a single pair, so mixing adds nothing.
    if held > kept.start or n_cameras == 2:
        return (NO_FIT if total >= 3 or not whole else FEW), held
    if not whole:
        return CONFUSED, held
    return match_body(
        positions[:total], covariances[:total], lights[:total], rays, cameras, body, search, gates,
        kept, held, left,
    )  # fmt: skip


@compiled()
def _leave_rivals(spots: Float, there: Bool, rival_px: float, alone: Bool) -> None:
    """Write which spots are alone within ``rival_px`` and so may be seeds."""
    for c in range(there.shape[0]):
        for slot in range(there.shape[1]):
            alone[c, slot] = there[c, slot]
            for other in range(there.shape[1]):
                du = spots[c, slot, 0] - spots[c, other, 0]
                dv = spots[c, slot, 1] - spots[c, other, 1]
                # The distance to an empty slot is NaN: no rival.
                if other != slot and du * du + dv * dv < rival_px * rival_px:
                    alone[c, slot] = False


@compiled()
def _choose_seeds(alone: Bool, width: int, seeds: Bool) -> None:
    """Choose about ``width`` spots of every camera, evenly over its slots."""
    for c in range(alone.shape[0]):
        count = 0
        for slot in range(alone.shape[1]):
            count += int(alone[c, slot])
        turn = 0
        for slot in range(alone.shape[1]):
            seeds[c, slot] = False
            if alone[c, slot]:
                # One of `width` parts ends here.
                seeds[c, slot] = (turn + 1) * width // count > turn * width // count
                turn += 1


@compiled(*_NEEDS)
def extend_tracked(
    spots: Float, cams: Float, centres: Float, leds: Float, directions: Float, least_cosine: float,
    sigma: float, rival_px: float, limits: Float, labels: Int,
) -> float:  # fmt: skip
    """Complete given labels and return the ambiguity, infinite on failure.

    See `extend_hypothesis`. ``spots`` (C, S, 2), px, of one frame.
    """
    n_cameras, n_slots = spots.shape[0], spots.shape[1]
    ideal = np.empty((n_cameras, n_slots, 2))
    jacobian = np.empty((n_cameras, n_slots, 4))
    there = np.empty((n_cameras, n_slots), np.bool_)
    undistort_rays(spots, cams, ideal, jacobian, there)
    located = 0
    for led in range(len(leds)):
        views = 0
        for c in range(n_cameras):
            # A label with an empty slot in this frame has no effect on the pose; the LED is free.
            if labels[c, led] >= 0 and not there[c, labels[c, led]]:
                labels[c, led] = -1
            views += int(labels[c, led] >= 0)
        located += int(views >= 2)
    # Three located LEDs are the minimum for the six pose parameters.
    if located < 3:
        return np.inf
    worth = np.empty(1)
    # -1: any slot may be any LED. The strobe code is no longer needed once labels exist.
    usable = np.full(n_cameras * n_slots, -1)
    chi2 = extend_hypothesis(
        FrameRays(ideal, jacobian, there, usable), PackedCameras(cams, centres),
        LitBody(leds, directions, least_cosine), Gates(sigma, rival_px, limits), labels,
        np.empty((3, 3)), np.empty(3), worth,
    )  # fmt: skip
    # The caller compares with `MAX_DOUBT`; infinity is always above it.
    return worth[0] if chi2 >= 0.0 else np.inf


@compiled()
def without_rivals(spots: Float, rival_px: float) -> Float:
    """Return spots (n, C, S, 2), px, without those nearer to another one than ``rival_px``.

    Their images disturb each other, and the camera may exchange them.
    """
    kept = spots.copy()
    for frame in range(spots.shape[0]):
        for c in range(spots.shape[1]):
            for i in range(spots.shape[2]):
                for j in range(i):
                    du = spots[frame, c, i, 0] - spots[frame, c, j, 0]
                    dv = spots[frame, c, i, 1] - spots[frame, c, j, 1]
                    # The distance to an empty slot is NaN, and the comparison false: no rival.
                    if du * du + dv * dv < rival_px * rival_px:
                        # Drop both: both centroids are biased, and they are indistinguishable.
                        # Distances are from `spots`, not `kept`, so that a third spot near both is
                        # also found.
                        for axis in range(2):
                            kept[frame, c, i, axis] = np.nan
                            kept[frame, c, j, axis] = np.nan
    return kept
