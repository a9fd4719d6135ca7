"""Whether the LEDs of a body can be taken for one another, or for those of another body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations
from typing import TYPE_CHECKING

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, rigid_fit

if TYPE_CHECKING:
    from ocmm_core.tracking._body import LedBody

AMBIGUITY_LIMIT_MM = 1.0
"""A wrong labelling must leave at least this rigid residual (RMS), or the labels are in doubt."""

_FIRST = 50
"""So many labellings that change the distances least are fitted before others are left out."""

REVERSED = -0.99
"""Cosine between an axis and where a motion takes it, below which the motion reverses it."""


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """A wrong labelling that fits the body nearly as well as the right one.

    Attributes
    ----------
    labels
        LED number that is believed at the place of LED 0, 1, 2 ... (of `nearest`: of those seen),
        -1 where none is.
    residual_mm
        RMS distance of the LEDs after the best rigid motion.
    tip_error_mm
        How far the tip would be wrong.
    """

    labels: tuple[int, ...]
    residual_mm: float
    tip_error_mm: float


def nearest(
    leds: Float,
    tip: Float,
    rules: Sequence[tuple[Float, Float]],
    seen: Sequence[int] | None = None,
) -> Ambiguity | None:
    """Return the wrong labelling of LEDs with the smallest residual that no rule excludes.

    Every LED of the body may be believed at every place, for nobody tells which ones are hidden. A
    rule excludes a labelling if the body, turned by that labelling's motion, breaks the rule in
    every attitude that keeps it; that is so when the motion reverses the rule's axis.

    Parameters
    ----------
    leds, tip
        (L, 3) and (3,), mm, body frame.
    rules
        ``(body_axis, world_direction)`` pairs, each (3,).
    seen
        Numbers of the LEDs that are seen; None where all are. The labels of the result name what
        is believed at their places, in this order.
    """
    places = tuple(range(len(leds)) if seen is None else seen)
    orders = np.array(
        [order for order in permutations(range(len(leds)), len(places)) if order != places]
    )
    between = _distances(leds)
    spread = _spread(orders, between, between[np.ix_(places, places)])
    best: Ambiguity | None = None
    for rank, index in enumerate(np.argsort(spread, kind="stable")):
        # A rigid residual of r (RMS) changes no distance by more than 2 r sqrt(n), n at most 8.
        if best is not None and rank > _FIRST and spread[index] > 6.0 * best.residual_mm + 1e-9:
            break
        labels = tuple(int(label) for label in orders[index])
        found = _judge(leds, tip, rules, places, labels)
        if found is not None and (best is None or found.residual_mm < best.residual_mm):
            best = found
    return best


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
        believed = [led for led, label in enumerate(labels) if label >= 0]
        found = _judge(leds, tip, rules, believed, [labels[led] for led in believed])
        if found is None or found.residual_mm >= AMBIGUITY_LIMIT_MM:
            continue
        if worst is None or found.residual_mm < worst.residual_mm:
            worst = replace(found, labels=labels)
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
                        f"LEDs {leds} of '{one.name}' can be confused with LEDs {alike} of "
                        f"'{other.name}': their distances agree to {spread:.2f} mm.",
                        "Use another reference body, or move one of these LEDs by 5 mm.",
                    )


def _judge(
    leds: Float,
    tip: Float,
    rules: Sequence[tuple[Float, Float]],
    places: Sequence[int],
    labels: Sequence[int],
) -> Ambiguity | None:
    """Return what LEDs ``labels`` believed at ``places`` do; None where a rule excludes them."""
    at, true = leds[list(places)], leds[list(labels)]
    rotation, translation = rigid_fit(at, true)
    if any(float(axis @ rotation @ axis) < REVERSED for axis, _ in rules):
        return None
    miss = at @ rotation.T + translation - true
    residual = float(np.sqrt(np.mean(np.sum(miss**2, axis=1))))
    moved = rotation @ tip + translation
    return Ambiguity(tuple(labels), residual, float(np.linalg.norm(moved - tip)))


def _spread(orders: Int, distances: Float, true: Float) -> Float:
    """Return the largest change of a distance of each labelling (k, n), mm, pair by pair."""
    spread = np.zeros(len(orders))
    for first in range(len(true)):
        for second in range(first):
            between = distances[orders[:, first], orders[:, second]]
            np.maximum(spread, np.abs(between - true[first, second]), out=spread)
    return spread


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
