"""Assign camera slots to LEDs of the bodies.

Spots of two cameras are paired by the distance of their rays, and the intersection points are
matched to the bodies by mutual distances, with any LEDs hidden. Each match is completed with the
spots of all cameras explained by its pose. A labelling is only accepted if it explains the spots
and every other explains fewer, by more than one light could add; ambiguous spots get no label.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking._ambiguity import FEW_LEDS, least_in_sight
from ocmm_core.tracking._body import LedBody, ProbeBody
from ocmm_core.tracking._pose import independent, require_spots
from ocmm_core.tracking.kernels import decide_kernel as outcomes
from ocmm_core.tracking.kernels import extend_tracked
from ocmm_core.tracking.kernels import identify_kernel as kernel

CHI2_SIGMAS = 5.0
"""Normal quantile of the chi-square gates: one false alarm in three million."""

_REACH_MM = 400.0
"""LEDs are outside the measuring volume of the ball, by at most this."""

_CONE_SLACK = np.radians(10.0)
"""An LED is seen a little outside its stated cone."""

_REASONS = {
    outcomes.FEW: "fewer than three targets are seen by two cameras",
    outcomes.NO_FIT: "the spots do not fit the body",
    outcomes.AMBIGUOUS: "more than one labelling of the LEDs fits the spots",
    outcomes.CONFUSED: "too many spots could be LEDs",
    outcomes.THIN: "too few LEDs are seen to distinguish them from reflections",
    outcomes.NEAR_RULE: "the body is held too close to an attitude its orientation rules exclude",
}


@dataclass(frozen=True, slots=True)
class IdentifyOptions:
    """Tolerances of the search."""

    sigma_px: float
    """Standard deviation of one spot, px, of a single frame, including all effects."""
    rival_px: float = 1.0
    """Distance of two spots or two LEDs in a camera, px, below which neither is labelled."""


@dataclass(frozen=True, slots=True)
class Identification:
    """Result of the search."""

    slot_of_led: Int | None
    """(C, L) int64: slot of each LED, -1 if none; None if ambiguous."""
    reason: str = ""
    """Why there is no labelling, or empty."""


def identify(
    rig: Rig,
    body: LedBody | ProbeBody,
    spots: Float,
    options: IdentifyOptions,
    led_of_slot: Int | None = None,
) -> Identification:
    """Return each LED's slot for spots (C, S, 2), px, of one frame, NaN if empty.

    ``led_of_slot`` (C, S) is the result of the strobe code (`strobe.decode`), or None.
    """
    return identify_all(rig, [led_body(body)], spots, options, [led_of_slot])[0]


def identify_all(
    rig: Rig,
    bodies: Sequence[LedBody],
    spots: Float,
    options: IdentifyOptions,
    led_of_slot: Sequence[Int | None] = (),
) -> tuple[Identification, ...]:
    """Return the slot of each LED of each body; no slot is assigned twice.

    Bodies must pass `ambiguity.check_distinct`. As `identify`, with codes for every body or none.
    """
    status, labels = identify_many(rig, bodies, spots[None], options, led_of_slot)
    return tuple(
        Identification(None, _REASONS[int(outcome)])
        if outcome != outcomes.FOUND
        else Identification(slots[:, : body.n_leds].copy())
        for body, outcome, slots in zip(bodies, status[0], labels[0], strict=True)
    )


def identify_many(
    rig: Rig,
    bodies: Sequence[LedBody],
    spots: Float,
    options: IdentifyOptions,
    led_of_slot: Sequence[Int | None] = (),
) -> tuple[NDArray[np.uint8], Int]:
    """Return outcome (n, B) and slots of LEDs (n, B, C, L) of independent frames.

    Frames are (n, C, S, 2). Outcomes as of the kernel; slots are -1 if none or unlabelled.
    """
    count, n_cameras, n_slots = len(bodies), len(rig.cameras), spots.shape[-2]
    require_spots(spots, rig, n_slots)
    sizes = np.array([body.n_leds for body in bodies])
    leds, directions = np.zeros((2, count, int(sizes.max()), 3))
    n_rules = np.array([len(body.rules) for body in bodies])
    axes, worlds = np.zeros((2, count, max(1, int(n_rules.max())), 3))
    for index, body in enumerate(bodies):
        leds[index, : body.n_leds] = body.leds_body
        directions[index, : body.n_leds] = body.led_directions_body
        for rule, (axis, world) in enumerate(body.rules):
            axes[index, rule], worlds[index, rule] = axis, world
    usable = np.full((count, n_cameras, n_slots), -1, dtype=np.int64)
    coded = np.zeros(count, dtype=np.bool_)
    for index, of_slots in enumerate(led_of_slot):
        if of_slots is not None:
            usable[index], coded[index] = of_slots, True
    status = np.empty((len(spots), count), dtype=np.uint8)
    labels = np.empty((len(spots), count, n_cameras, leds.shape[1]), dtype=np.int64)
    kernel.identify_frames(
        np.ascontiguousarray(spots, dtype=np.float64),
        rig.packed(),
        np.stack([camera.centre_world for camera in rig.cameras]),
        rig.volume_world + np.array([[-_REACH_MM], [_REACH_MM]]),
        _camera_pairs(n_cameras),
        sizes,
        np.where(
            coded,
            0,
            [0 if body.n_leds <= FEW_LEDS else least_in_sight(body.n_leds) for body in bodies],
        ),
        leds,
        directions,
        np.array([_least_cosine(body, rig) for body in bodies]),
        axes,
        worlds,
        n_rules,
        usable.reshape(count, n_cameras * n_slots),
        coded,
        options.sigma_px,
        options.rival_px,
        chi2_limit(independent(rig, np.arange(2 * n_cameras * n_slots + 1))),
        status,
        labels,
    )
    return status, labels


def extended_labels(
    rig: Rig, body: LedBody, spots: Float, labels: Int, options: IdentifyOptions
) -> Int:
    """Return labels (C, L) extended by free LEDs with unambiguous spots.

    LEDs with an empty slot in this frame are also free, as they may reappear in another slot; they
    keep their slot if not found. Labels that do not fit this frame, or ambiguous extensions, are
    returned unchanged. Spots as in `identify`; a label of -1 is none.
    """
    more = labels.copy()
    doubt = extend_tracked(
        np.ascontiguousarray(spots),
        rig.packed(),
        np.stack([camera.centre_world for camera in rig.cameras]),
        body.leds_body,
        body.led_directions_body,
        _least_cosine(body, rig),
        options.sigma_px,
        options.rival_px,
        chi2_limit(independent(rig, np.arange(2 * more.size + 1))),
        more,
    )
    if doubt > outcomes.MAX_DOUBT:
        return labels
    taken = (labels[:, :, None] == more[:, None, :]).any(axis=2)
    return np.where((more < 0) & ~taken, labels, more)


def _camera_pairs(n_cameras: int) -> Int:
    """Return all pairs of cameras (P, 2), neighbours first for more than four."""
    if n_cameras <= kernel.USUAL_CAMERAS:
        return np.array([(c, d) for c in range(n_cameras) for d in range(c + 1, n_cameras)])
    steps = range(1, n_cameras // 2 + 1)
    pairs = [(c, (c + step) % n_cameras) for step in steps for c in range(n_cameras)]
    return np.array([pair for n, pair in enumerate(pairs) if pair[::-1] not in pairs[:n]])


def _least_cosine(body: LedBody, rig: Rig) -> float:
    if rig.markers is not None:
        # The cameras of a tracker are elsewhere than those that stand for it.
        return -1.0
    return float(np.cos(min(body.emission_half_angle + _CONE_SLACK, np.pi)))


def led_body(body: LedBody | ProbeBody) -> LedBody:
    """Return the LEDs of a body that may have a tip."""
    return body.led_body if isinstance(body, ProbeBody) else body


def ordered_spots(uv: Float, slot_of_led: Int) -> Float:
    """Return spots by LED (n, C, L, 2) from spots by slot (n, C, S, 2); NaN if none."""
    cameras = np.arange(slot_of_led.shape[0])[:, None]
    ordered: Float = uv[:, cameras, slot_of_led]
    ordered[:, slot_of_led < 0] = np.nan
    return ordered


def chi2_limit(dof: Int) -> Float:
    """Return the chi-square limit with a chance of one in three million (Wilson-Hilferty)."""
    degrees = np.maximum(np.asarray(dof, dtype=np.float64), 1.0)
    ratio = 2.0 / (9.0 * degrees)
    return degrees * (1.0 - ratio + CHI2_SIGMAS * np.sqrt(ratio)) ** 3
