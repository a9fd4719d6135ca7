"""Which slot of which camera follows which LED.

For every pair of cameras, unlabelled spots are paired by how well they meet in space, and the
meeting points are matched to the body by their mutual distances (a depth-first search over all
labellings). Each labelling is then completed with the spots of all cameras and judged by the
reprojection residuals of its pose. The answer is given only if one labelling explains the spots
and no other explains as many: when in doubt, no label.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ocmm_core.camera.model import project
from ocmm_core.camera.rig import MAX_SLOTS, Rig
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking.body import LedBody, ProbeBody, rigid_fit, satisfies_rules
from ocmm_core.tracking.kernel import allocate, solve_frames
from ocmm_core.tracking.pose import PoseBatch, triangulate

CHI2_SIGMAS = 5.0
"""Normal quantile of the chi-square gates: one false alarm in three million."""

MAX_LABELLINGS = 600
"""Labellings of one pair of cameras beyond which the scene counts as too confused to name anything;
eight LEDs without a ghost have 219, counting those that leave some out."""


@dataclass(frozen=True, slots=True)
class IdentifyOptions:
    """Tolerances of the search.

    Attributes
    ----------
    sigma_px
        Standard deviation of one spot, px: everything that a single frame is subject to.
    gate_px
        A spot belongs to a predicted place within this distance, px.
    distance_mm
        Tolerance of the distance between two targets of one frame, mm.
    """

    sigma_px: float
    gate_px: float = 1.0
    distance_mm: float = 1.0


@dataclass(frozen=True, slots=True)
class Identification:
    """Outcome of the search.

    Attributes
    ----------
    slot_of_led
        (C, L) int64: slot that follows the LED, -1 where none does; None if in doubt.
    reason
        Why there is none; empty if there is one.
    """

    slot_of_led: Int | None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class _Meeting:
    """A point where rays of two cameras meet."""

    position: Float
    slots: tuple[tuple[int, int], tuple[int, int]]


def identify(
    rig: Rig, body: LedBody | ProbeBody, spots: Float, options: IdentifyOptions
) -> Identification:
    """Return which slot follows which LED.

    Parameters
    ----------
    spots
        (C, 8, 2), px: one frame, NaN where a slot is empty.
    options
        Tolerances.
    """
    body = _led_body(body)
    found: dict[bytes, Int] = {}
    met = False
    for pair in combinations(range(len(rig.cameras)), 2):
        meetings = _meetings(rig, spots, pair, options)
        if len(meetings) < 3:
            continue
        met = True
        labellings = _labellings(body, meetings, options)
        if len(labellings) >= MAX_LABELLINGS:
            return Identification(None, "too many spots could be LEDs")
        for labels in labellings:
            if any(_contains(known, meetings, labels) for known in found.values()):
                continue
            slot_of_led = _complete(rig, body, spots, meetings, labels, options)
            if slot_of_led is not None:
                found[slot_of_led.tobytes()] = slot_of_led
    if not met:
        return Identification(None, "fewer than three targets are seen by two cameras")
    counts = [int(np.count_nonzero(known >= 0)) for known in found.values()]
    best = [known for known, n in zip(found.values(), counts, strict=True) if n == max(counts)]
    if not best:
        return Identification(None, "the spots do not fit the probe body")
    if len(best) > 1:
        return Identification(None, "more than one labelling of the LEDs fits the spots")
    return Identification(best[0])


def identify_all(
    rig: Rig, bodies: Sequence[LedBody], spots: Float, options: IdentifyOptions
) -> tuple[Identification, ...]:
    """Return which slot follows which LED of each body; no slot is given to two of them.

    Parameters
    ----------
    bodies
        Probe and reference body, of which `check_distinct` must hold.
    spots
        (C, 8, 2), px: one frame, NaN where a slot is empty.
    options
        Tolerances.
    """
    found = [identify(rig, body, spots, options) for body in bodies]
    for one, other in combinations(range(len(bodies)), 2):
        first, second = found[one].slot_of_led, found[other].slot_of_led
        if first is not None and second is not None and _share_slots(first, second):
            found[one] = found[other] = Identification(None, "two bodies fit the same spots")
    return tuple(found)


def _share_slots(one: Int, other: Int) -> bool:
    return any(
        np.intersect1d(mine[mine >= 0], theirs).size
        for mine, theirs in zip(one, other, strict=True)
    )


def nearest_slots(
    rig: Rig, body: LedBody | ProbeBody, spots: Float, rotation: Float, origin: Float,
    gate_px: float,
) -> Int:  # fmt: skip
    """Return the slot whose spot lies at the place of each LED, (C, L), -1 where none does.

    Parameters
    ----------
    spots
        (C, 8, 2), px, NaN where a slot is empty.
    rotation, origin
        Pose of the probe in the world, (3, 3) and (3,), mm.
    gate_px
        Greatest distance, px; LED and spot must also be nearest to each other.
    """
    body = _led_body(body)
    leds_world = body.leds_body @ rotation.T + origin
    slot_of_led = np.full((len(rig.cameras), body.n_leds), -1, dtype=np.int64)
    for c, camera in enumerate(rig.cameras):
        distance = np.linalg.norm(project(camera, leds_world)[:, None] - spots[c][None], axis=2)
        distance = np.where(np.isfinite(distance), distance, np.inf)
        for led, slot in np.argwhere(distance < gate_px):
            if distance[led, slot] == distance[led].min() == distance[:, slot].min():
                slot_of_led[c, led] = slot
    return slot_of_led


def _led_body(body: LedBody | ProbeBody) -> LedBody:
    return body.led_body if isinstance(body, ProbeBody) else body


def ordered_spots(uv: Float, slot_of_led: Int) -> Float:
    """Return spots by LED (n, C, L, 2) from spots by slot (n, C, 8, 2); NaN where there is none."""
    cameras = np.arange(slot_of_led.shape[0])[:, None]
    ordered: Float = uv[:, cameras, slot_of_led]
    ordered[:, slot_of_led < 0] = np.nan
    return ordered


def chi2_limit(dof: Int) -> Float:
    """Return what chi-square exceeds by chance once in three million (Wilson-Hilferty)."""
    degrees = np.maximum(np.asarray(dof, dtype=np.float64), 1.0)
    ratio = 2.0 / (9.0 * degrees)
    limit: Float = degrees * (1.0 - ratio + CHI2_SIGMAS * np.sqrt(ratio)) ** 3
    return limit


def _meetings(
    rig: Rig, spots: Float, pair: tuple[int, int], options: IdentifyOptions
) -> list[_Meeting]:
    first, second = pair
    low, high = rig.volume_world
    # The probe body stands outside the volume in which its ball measures.
    reach = 400.0
    there = np.asarray(np.isfinite(spots).all(axis=2))
    pairs = [
        (a, b)
        for a in range(MAX_SLOTS)
        for b in range(MAX_SLOTS)
        if there[first, a] and there[second, b]
    ]
    if not pairs:
        return []
    paired = np.full((len(rig.cameras), len(pairs), 2), np.nan)
    paired[first] = [spots[first, a] for a, _ in pairs]
    paired[second] = [spots[second, b] for _, b in pairs]
    positions = triangulate(rig, paired)
    miss = np.maximum(
        np.linalg.norm(project(rig.cameras[first], positions) - paired[first], axis=1),
        np.linalg.norm(project(rig.cameras[second], positions) - paired[second], axis=1),
    )
    inside = ((positions > low - reach) & (positions < high + reach)).all(axis=1)
    with np.errstate(invalid="ignore"):
        good = inside & (miss < options.gate_px)
    return [
        _Meeting(positions[i], ((first, pairs[i][0]), (second, pairs[i][1])))
        for i in np.flatnonzero(good)
    ]


def _contains(known: Int, meetings: list[_Meeting], labels: dict[int, int]) -> bool:
    """Return whether a complete labelling says all that a partial one says."""
    return all(
        known[camera, led] == slot
        for led, index in labels.items()
        for camera, slot in meetings[index].slots
    )


def _labellings(
    body: LedBody, meetings: list[_Meeting], options: IdentifyOptions
) -> list[dict[int, int]]:
    """Return assignments LED -> meeting whose mutual distances agree, the largest first."""
    positions = np.array([meeting.position for meeting in meetings])
    measured = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    nominal = np.linalg.norm(body.leds_body[:, None] - body.leds_body[None], axis=2)
    found: list[dict[int, int]] = []

    def extend(led: int, labels: dict[int, int]) -> None:
        if len(found) >= MAX_LABELLINGS:
            return
        if led == body.n_leds:
            if len(labels) >= 3:
                found.append(dict(labels))
            return
        used = {slot for index in labels.values() for slot in meetings[index].slots}
        for index, meeting in enumerate(meetings):
            if used.intersection(meeting.slots):
                continue
            if all(
                abs(measured[index, other] - nominal[led, label]) < options.distance_mm
                for label, other in labels.items()
            ):
                labels[led] = index
                extend(led + 1, labels)
                del labels[led]
        extend(led + 1, labels)

    extend(0, {})
    return sorted(found, key=len, reverse=True)


def _complete(
    rig: Rig, body: LedBody, spots: Float, meetings: list[_Meeting], labels: dict[int, int],
    options: IdentifyOptions,
) -> Int | None:  # fmt: skip
    """Return the labelling of all spots that a partial one implies, or None if it does not hold."""
    leds = sorted(labels)
    rotation, origin = rigid_fit(
        body.leds_body[leds], np.array([meetings[labels[led]].position for led in leds])
    )
    if not satisfies_rules(body, rotation):
        return None
    # A rigid fit to noisy depths predicts a spot less well than two rays meet.
    slot_of_led = nearest_slots(rig, body, spots, rotation, origin, 5.0 * options.gate_px)
    if np.count_nonzero((slot_of_led >= 0).sum(axis=0) >= 2) < 3:
        return None
    outputs = allocate(1)
    solve_frames(
        ordered_spots(spots[None], slot_of_led), rig.packed(), body.leds_body,
        body.leds_body.mean(axis=0), options.sigma_px, 1, *outputs,
    )  # fmt: skip
    pose = PoseBatch(*outputs)
    if pose.status[0] != 0 or pose.chi2[0] > chi2_limit(pose.dof)[0]:
        return None
    return slot_of_led if _faces_cameras(rig, body, pose, slot_of_led) else None


def _faces_cameras(rig: Rig, body: LedBody, pose: PoseBatch, slot_of_led: Int) -> bool:
    """Return whether every labelled LED shines towards the camera that is said to see it."""
    rotation, origin = pose.rotation_world_from_probe[0], pose.origin_world[0]
    leds_world = body.leds_body @ rotation.T + origin
    directions = body.led_directions_body @ rotation.T
    margin = np.cos(min(body.emission_half_angle + np.radians(10.0), np.pi))
    for c, camera in enumerate(rig.cameras):
        sight = camera.centre_world - leds_world
        cosine = np.sum(sight * directions, axis=1) / np.linalg.norm(sight, axis=1)
        if np.any((slot_of_led[c] >= 0) & (cosine < margin)):
            return False
    return True
