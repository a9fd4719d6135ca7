"""Ambiguity of LED labels within a body, and between bodies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, rigid_fit

if TYPE_CHECKING:
    from ocmm_core.tracking._body import LedBody

AMBIGUITY_LIMIT_MM = 1.0
"""Least rigid residual (RMS) of a wrong labelling for unambiguous labels."""

FEW_LEDS = 8
"""Up to this number of LEDs, every order is tested by its rigid residual. For more there are too
many orders (nine LEDs have 362,880): then no LED, rather than their RMS, may deviate by the limit,
which the search, with gates a tenth of that, cannot miss; and more LEDs must be in sight
(`least_in_sight`).
"""

_FIRST = 50
"""Number of labellings with least distance changes fitted before others are excluded."""

REVERSED = -0.99
"""Cosine between an axis and its image below which a motion reverses it."""


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """A wrong labelling that fits the body nearly as well as the correct one."""

    labels: tuple[int, ...]
    """LED assigned to the place of LED 0, 1 ... (`nearest`: of the visible ones), -1: none."""
    residual_mm: float
    """RMS distance of the LEDs after the best rigid motion."""
    tip_error_mm: float
    """Resulting error of the tip."""


def nearest(
    leds: Float, tip: Float, rules: Sequence[tuple[Float, Float]], seen: Sequence[int] | None = None
) -> Ambiguity | None:
    """Return the wrong labelling with the smallest residual not excluded by a rule.

    Any LED may be assigned to any place, as the hidden ones are unknown. A rule, a ``(body_axis,
    world_direction)`` pair, excludes a labelling if the body, turned by that labelling's motion,
    breaks the rule in every attitude that satisfies it, which is so if the motion reverses the
    rule's axis.

    ``leds`` (L, 3) and ``tip`` (3,), mm, body frame; ``seen``: numbers of the visible LEDs, None
    for all. For more than `FEW_LEDS`, only a labelling below the limit is found, and only among the
    visible ones. The labels of the result are assigned to their places, in this order.
    """
    places = tuple(range(len(leds)) if seen is None else seen)
    if len(leds) > FEW_LEDS:
        return confused(leds[list(places)], tip, rules, hidden=0)
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
    """Return the nearest wrong labelling below the limit with ``hidden`` unseen LEDs.

    The hidden ones are unknown: any LED of the body may be assigned to any place. Three LEDs are
    never labelled without a fourth, but an ambiguity of three visible ones prevents labelling of
    four, as the search requires all other labellings to explain fewer spots by more than one light
    could add.
    """
    worst: Ambiguity | None = None
    # See above for the bound; with many LEDs, two that deviate by the limit change their distance
    # by twice as much.
    slack = 2.0 * np.sqrt(len(leds) if len(leds) <= FEW_LEDS else 1.0) * AMBIGUITY_LIMIT_MM
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
    """Refuse bodies confusable while some LEDs are hidden, by InputError; see `most_alike`."""
    for one, other in combinations(bodies, 2):
        found = _in_common(
            _distances(one.leds_body), _distances(other.leds_body), most_alike(one, other) + 1
        )
        if found is not None:
            leds, alike, spread = found
            raise InputError(
                "bodies.alike",
                f"LEDs {leds} of '{one.name}' can be confused with LEDs {alike} of "
                f"'{other.name}': their distances agree to {spread:.2f} mm.",
                "Use another reference body, or move one of these LEDs by 5 mm.",
            )


def least_in_sight(n_leds: int) -> int:
    """Return the number of LEDs of a body that must be visible for labelling.

    Four that confirm each other, see `kernels`. The more LEDs a body has, the more triples match
    lights by chance, and the more must be visible beyond a triple.
    """
    return 4 if n_leds <= FEW_LEDS else 3 + -(-n_leds // 8)


def most_alike(one: LedBody, other: LedBody) -> int:
    """Return the number of LEDs of two bodies that may look alike.

    No three of two small bodies: they would prevent each other's labelling. Among many LEDs three
    match by chance, and fewer than the least in sight are never labelled.
    """
    if max(one.n_leds, other.n_leds) <= FEW_LEDS:
        return 2
    return min(least_in_sight(one.n_leds), least_in_sight(other.n_leds)) - 1


def _in_common(
    mine: Float, theirs: Float, count: int
) -> tuple[tuple[int, ...], tuple[int, ...], float] | None:
    """Return the first ``count`` LEDs of similar distances (L, L), (M, M), and deviation, mm."""

    def extend(
        leds: tuple[int, ...], alike: tuple[int, ...], fits: NDArray[np.bool_]
    ) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
        # fits[l, m]: LED l may be confused with m in addition to those already chosen.
        if len(leds) == count:
            return leds, alike
        for led, label in np.argwhere(fits):
            agree = np.abs(mine[led][:, None] - theirs[label][None]) < AMBIGUITY_LIMIT_MM
            # Each set of LEDs once: in rising order.
            agree[: led + 1] = False
            agree[:, label] = False
            found = extend((*leds, int(led)), (*alike, int(label)), fits & agree)
            if found is not None:
                return found
        return None

    found = extend((), (), np.ones((len(mine), len(theirs)), dtype=np.bool_))
    if found is None:
        return None
    leds, alike = found
    return leds, alike, float(np.abs(mine[np.ix_(leds, leds)] - theirs[np.ix_(alike, alike)]).max())


def _judge(
    leds: Float,
    tip: Float,
    rules: Sequence[tuple[Float, Float]],
    places: Sequence[int],
    labels: Sequence[int],
) -> Ambiguity | None:
    """Return the effect of LEDs ``labels`` assigned to ``places``; None if excluded by rules."""
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
    """Yield labellings without ``hidden`` LEDs whose distances (L, L), mm, agree within slack."""
    count = len(between)
    # List elements are accessed several times as fast as those of an array.
    far = between.tolist()

    def extend(labels: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        led = len(labels)
        if led == count:
            if labels.count(-1) == hidden:
                yield labels
            return
        for label in range(count):
            if label not in labels and all(
                other < 0 or abs(far[led][known] - far[label][other]) < slack
                for known, other in enumerate(labels)
            ):
                yield from extend((*labels, label))
        if labels.count(-1) < hidden:
            yield from extend((*labels, -1))

    return extend(())


def _distances(leds: Float) -> Float:
    between: Float = np.linalg.norm(leds[:, None] - leds[None], axis=2)
    return between
