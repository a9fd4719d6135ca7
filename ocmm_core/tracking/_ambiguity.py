"""Whether the LEDs of a body can be taken for one another, or for those of another body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import TYPE_CHECKING

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, rigid_fit

if TYPE_CHECKING:
    from ocmm_core.tracking._body import LedBody

AMBIGUITY_LIMIT_MM = 1.0
"""A wrong labelling must leave at least this rigid residual (RMS), or the labels are in doubt."""

REVERSED = -0.99
"""Cosine between an axis and where a motion takes it, below which the motion reverses it."""


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """A wrong labelling that fits the body nearly as well as the right one.

    Attributes
    ----------
    labels
        LED number that stands at the place of LED 0, 1, 2 ..., -1 where none does.
    residual_mm
        RMS distance of the LEDs after the best rigid motion.
    tip_error_mm
        How far the tip would be wrong.
    """

    labels: tuple[int, ...]
    residual_mm: float
    tip_error_mm: float


def nearest(leds: Float, tip: Float, rules: Sequence[tuple[Float, Float]]) -> Ambiguity | None:
    """Return the wrong labelling of all LEDs with the smallest residual that no rule excludes.

    A rule excludes a labelling if the body, turned by that labelling's motion, breaks the rule in
    every attitude that keeps it; that is so when the motion reverses the rule's axis.

    Parameters
    ----------
    leds, tip
        (L, 3) and (3,), mm, body frame.
    rules
        ``(body_axis, world_direction)`` pairs, each (3,).
    """
    worst: Ambiguity | None = None
    identity = tuple(range(len(leds)))
    between = _distances(leds)
    for labels in permutations(identity):
        if labels == identity:
            continue
        spread = np.abs(between[np.ix_(labels, labels)] - between).max()
        # A rigid residual of r (RMS) changes no distance by more than 2 r sqrt(n), n at most 8.
        if worst is not None and spread > 6.0 * worst.residual_mm + 1e-9:
            continue
        found = _judge(leds, tip, rules, labels)
        if found is not None and (worst is None or found.residual_mm < worst.residual_mm):
            worst = found
    return worst


def confused(
    leds: Float, tip: Float, rules: Sequence[tuple[Float, Float]], hidden: int
) -> Ambiguity | None:
    """Return the nearest wrong labelling below the limit while ``hidden`` LEDs are not seen.

    Nobody tells which ones are hidden: LEDs of the whole body may be believed at every place. Three
    LEDs are never named without a fourth, but what could be meant by three that are seen keeps
    four from being named, for the search wants every other labelling to explain fewer spots by more
    than one light could add.
    """
    worst: Ambiguity | None = None
    # See above for the bound.
    slack = 2.0 * np.sqrt(len(leds)) * AMBIGUITY_LIMIT_MM
    for labels in _alike(_distances(leds), slack, hidden):
        if all(label in (-1, led) for led, label in enumerate(labels)):
            continue
        found = _judge(leds, tip, rules, labels)
        if found is None or found.residual_mm >= AMBIGUITY_LIMIT_MM:
            continue
        if worst is None or found.residual_mm < worst.residual_mm:
            worst = found
    return worst


def check_distinct(bodies: Sequence[LedBody]) -> None:
    """Refuse bodies of which three LEDs of one look like three LEDs of another.

    Raises
    ------
    InputError
        Two of the bodies could be taken for each other where some of their LEDs are hidden.
    """
    for one, other in combinations(bodies, 2):
        mine, theirs = _distances(one.leds_body), _distances(other.leds_body)
        for leds in combinations(range(one.n_leds), 3):
            for alike in permutations(range(other.n_leds), 3):
                spread = np.abs(mine[np.ix_(leds, leds)] - theirs[np.ix_(alike, alike)]).max()
                if spread < AMBIGUITY_LIMIT_MM:
                    raise InputError(
                        "bodies.alike",
                        f"LEDs {leds} of '{one.name}' look like LEDs {alike} of '{other.name}': "
                        f"their distances agree to {spread:.2f} mm.",
                        "Use another reference body, or move one of these LEDs by 5 mm.",
                    )


def _judge(
    leds: Float, tip: Float, rules: Sequence[tuple[Float, Float]], labels: Sequence[int]
) -> Ambiguity | None:
    """Return a labelling with its residual, or None where a rule excludes it."""
    believed = [led for led, label in enumerate(labels) if label >= 0]
    true = leds[[labels[led] for led in believed]]
    rotation, translation = rigid_fit(leds[believed], true)
    if any(float(axis @ rotation @ axis) < REVERSED for axis, _ in rules):
        return None
    miss = leds[believed] @ rotation.T + translation - true
    residual = float(np.sqrt(np.mean(np.sum(miss**2, axis=1))))
    moved = rotation @ tip + translation
    return Ambiguity(tuple(labels), residual, float(np.linalg.norm(moved - tip)))


def _alike(between: Float, slack: float, hidden: int) -> Iterator[tuple[int, ...]]:
    """Give labellings without ``hidden`` LEDs whose distances (L, L), mm, agree within slack."""
    count = len(between)

    def extend(labels: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        led = len(labels)
        if led == count:
            if labels.count(-1) == hidden:
                yield labels
            return
        for label in range(count):
            if label not in labels and all(
                other < 0 or abs(between[led, known] - between[label, other]) < slack
                for known, other in enumerate(labels)
            ):
                yield from extend((*labels, label))
        if labels.count(-1) < hidden:
            yield from extend((*labels, -1))

    return extend(())


def _distances(leds: Float) -> Float:
    between: Float = np.linalg.norm(leds[:, None] - leds[None], axis=2)
    return between
