"""Whether the LEDs of a layout can be taken for one another, also where some are hidden."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from ocmm_core.geometry import Float, Int, rigid_fit
from ocmm_core.tracking import AMBIGUITY_LIMIT_MM, REVERSED, Ambiguity, ProbeBody

_FIRST = 50
"""So many labellings that change the distances least are fitted before others are left out."""


@dataclass(frozen=True, slots=True)
class WrongLabels:
    """The wrong labelling that comes nearest to the body.

    Attributes
    ----------
    hidden
        Number of the LED that no camera sees, from 1; 0 where all are seen.
    ambiguity
        The labelling; its labels name the LEDs that are believed at the places of those seen. None
        where the rules exclude all.
    """

    hidden: int
    ambiguity: Ambiguity | None

    @property
    def is_safe(self) -> bool:
        """Return whether the labels cannot be confused."""
        found = self.ambiguity
        return found is None or found.residual_mm >= AMBIGUITY_LIMIT_MM


def wrong_labels(body: ProbeBody) -> tuple[WrongLabels, ...]:
    """Return the nearest wrong labelling with all LEDs, and with each of them hidden.

    Three LEDs are a triangle, and two of them no pose: none of three may be hidden.
    """
    everything = tuple(range(body.n_leds))
    found = [WrongLabels(0, nearest_labelling(body, everything))]
    if body.n_leds > 3:
        for hidden in everything:
            seen = tuple(led for led in everything if led != hidden)
            found.append(WrongLabels(hidden + 1, nearest_labelling(body, seen)))
    return tuple(found)


def nearest_labelling(body: ProbeBody, seen: tuple[int, ...]) -> Ambiguity | None:
    """Return the wrong labelling of the LEDs ``seen`` with the smallest rigid residual.

    Every LED of the body may be believed at every place, for nobody tells which one is hidden. A
    labelling whose motion reverses the axis of an orientation rule is excluded, as in
    `tracking.ambiguity`, whose `nearest` takes all LEDs to be seen, and whose `confused` finds only
    what is below its limit; a designer wants to know how near the nearest one is.
    """
    labels = np.array(
        [order for order in permutations(range(body.n_leds), len(seen)) if order != seen]
    )
    leds = body.leds_probe
    distances = np.linalg.norm(leds[:, None] - leds[None], axis=2)
    spread = _spread(labels, distances, distances[np.ix_(seen, seen)])
    order = np.argsort(spread, kind="stable")
    best: Ambiguity | None = None
    for rank, index in enumerate(order):
        # A rigid residual of r (RMS) changes no distance by more than 2 r sqrt(n), n at most 8.
        if best is not None and rank > _FIRST and spread[index] > 6.0 * best.residual_mm + 1e-9:
            break
        believed = leds[labels[index]]
        rotation, translation = rigid_fit(believed, leds[list(seen)])
        if any(float(axis @ rotation @ axis) < REVERSED for axis, _ in body.rules):
            continue
        miss = believed @ rotation.T + translation - leds[list(seen)]
        residual = float(np.sqrt(np.mean(np.sum(miss**2, axis=1))))
        if best is None or residual < best.residual_mm:
            tip = rotation @ body.tip_probe + translation - body.tip_probe
            best = Ambiguity(
                tuple(int(label) for label in labels[index]), residual, float(np.linalg.norm(tip))
            )
    return best


def _spread(labels: Int, distances: Float, true: Float) -> Float:
    """Return the largest change of a distance of each labelling (k, n), mm, pair by pair."""
    spread = np.zeros(len(labels))
    for first in range(len(true)):
        for second in range(first):
            between = distances[labels[:, first], labels[:, second]]
            np.maximum(spread, np.abs(between - true[first, second]), out=spread)
    return spread
