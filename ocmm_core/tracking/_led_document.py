"""LEDs and orientation rules in documents, with their checks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.camera import MAX_LEDS, Vector3
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, unit

MIN_LEDS = 3

MIN_WIDTH_MM = 5.0
"""LEDs closer to one line (RMS) leave the rotation about it undetermined."""


class LedEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One LED: its place and the direction of its light, probe frame."""

    position: Vector3
    direction: Vector3


class OrientationRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An orientation constraint: a probe axis stays on one side of a world direction.

    ``probe_axis`` mapped to the world must have a positive component along ``world_direction``.
    """

    probe_axis: Vector3
    world_direction: Vector3


def check_leds(
    path: Path, what: str, leds: Sequence[LedEntry], rules: Sequence[tuple[str, Vector3]] = ()
) -> None:
    """Refuse too few or too many, coincident or collinear LEDs, and zero directions by InputError.

    ``what`` is ``"probe"`` or ``"reference"``; ``rules`` are directions by field.
    """
    count = len(leds)
    if not MIN_LEDS <= count <= MAX_LEDS:
        raise InputError(
            f"{what}.leds",
            f"{path}: field 'leds' of the {what} has {count} LED(s).",
            f"Give {MIN_LEDS} to {MAX_LEDS} LEDs.",
        )
    directions = [(f"leds[{i}].direction", led.direction) for i, led in enumerate(leds)]
    for field, direction in (*directions, *rules):
        if np.linalg.norm(direction) < 1e-9:
            raise InputError(
                f"{what}.direction",
                f"{path}: field '{field}' is a zero vector, which has no direction.",
                "Give the direction; the length is ignored.",
            )
    positions = np.array([led.position for led in leds])
    distances = np.linalg.norm(positions[:, None] - positions, axis=2) + 1e9 * np.eye(count)
    if distances.min() < 5.0:
        first, second = np.unravel_index(int(distances.argmin()), distances.shape)
        raise InputError(
            f"{what}.leds",
            f"{path}: leds[{min(first, second)}] and leds[{max(first, second)}] are "
            f"{distances.min():.2f} mm apart.",
            "Place LEDs at least 5 mm apart, so that each gives its own spot.",
        )
    # RMS distance of the LEDs from their best-fit line.
    spread = np.linalg.svd(positions - positions.mean(axis=0))[1]
    width = float(np.linalg.norm(spread[1:])) / np.sqrt(count)
    if width < MIN_WIDTH_MM:
        raise InputError(
            f"{what}.leds",
            f"{path}: the LEDs stand within {width:.2f} mm (RMS) of one line.",
            (
                f"Place them at least {MIN_WIDTH_MM:g} mm from it, or the rotation about it "
                "stays unknown."
            ),
        )


def rule_directions(rules: Sequence[OrientationRule]) -> list[tuple[str, Vector3]]:
    """Return the directions of orientation rules by field, for `check_leds`."""
    return [
        (f"orientation_rules[{index}].{name}", direction)
        for index, rule in enumerate(rules)
        for name, direction in (
            ("probe_axis", rule.probe_axis),
            ("world_direction", rule.world_direction),
        )
    ]


def unit_rules(rules: Sequence[OrientationRule]) -> tuple[tuple[Float, Float], ...]:
    """Return orientation rules as pairs of unit vectors, in the form of the bodies."""
    return tuple(
        (unit(np.array(rule.probe_axis)), unit(np.array(rule.world_direction))) for rule in rules
    )
