"""Ambiguity of the LED labels of a layout, also with hidden LEDs."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.tracking import AMBIGUITY_LIMIT_MM, Ambiguity, ProbeBody, nearest_ambiguity


@dataclass(frozen=True, slots=True)
class WrongLabels:
    """The wrong labelling closest to the body."""

    hidden: int
    """Number of the unseen LED, from 1; 0 if all are seen."""
    ambiguity: Ambiguity | None
    """LEDs assigned to the places of the visible ones; None if the rules exclude all."""

    @property
    def is_safe(self) -> bool:
        """Return whether the labels cannot be confused."""
        found = self.ambiguity
        return found is None or found.residual_mm >= AMBIGUITY_LIMIT_MM


def wrong_labels(body: ProbeBody) -> tuple[WrongLabels, ...]:
    """Return the nearest wrong labelling with all LEDs and with each hidden (none of three)."""
    everything = tuple(range(body.n_leds))
    found = [WrongLabels(0, nearest_ambiguity(body))]
    if body.n_leds > 3:
        for hidden in everything:
            seen = tuple(led for led in everything if led != hidden)
            found.append(WrongLabels(hidden + 1, nearest_ambiguity(body, seen)))
    return tuple(found)
