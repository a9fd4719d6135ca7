"""Which turn of the probe would better the uncertainty of its ball."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.coach._prediction import Bool, Held, Sensitivities, common, sight_of, uncertainties
from ocmm_core.coach._stance import Stance, stance_at
from ocmm_core.coach._turns import PAIRS, TURNS, Turn, Way
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking import ProbeBody, satisfies_rules

REAL_SHARE = 0.15
"""A turn that takes less than this off U is not worth a movement of the hand."""
LEAST_LEDS = 4
"""Identification needs so many that two cameras see."""
_EFFORT = 0.0015
"""A degree more must take so much of U off, as a share: of two alike the smaller turn is said."""
MARGIN_RAD = float(np.radians(6.0))
"""The LEDs that are counted on shine so much further: a hand is good to some 3 degrees."""
_SHINING = 2
"""LEDs at the rim of their cone are a guess; of so many a camera sees one, or nothing at all."""
_LOWEST = float(np.cos(np.radians(100.0)))
"""Nobody holds a probe with its handle farther from upright."""


@dataclass(frozen=True, slots=True)
class Hint:
    """A turn, or two, and what they are good for."""

    turns: tuple[Turn, ...]
    """What to do, in this order; the second is a turn about another axis."""
    now_mm: float
    then_mm: float
    """`now_mm`, `then_mm`: U, k = 2, of one averaged point in its worst direction: as the probe is
    held, and turned."""
    leds: int
    """How many LEDs two cameras see then."""

    @property
    def share(self) -> float:
        """Return which part of U it takes off."""
        return 1.0 - self.then_mm / self.now_mm

    @property
    def ways(self) -> tuple[Way, ...]:
        """Return where it goes."""
        return tuple(turn.way for turn in self.turns)

    @property
    def degrees(self) -> int:
        """Return how far it goes in all."""
        return sum(turn.degrees for turn in self.turns)

    def rotation_world(self, stance: Stance) -> Float:
        """Return it as a rotation (3, 3) of the world about the ball."""
        return _rotation(self.turns, stance)


@dataclass(frozen=True, slots=True)
class Advice:
    """What the coach found."""

    now_mm: float
    """U as the probe is held; NaN where there is none."""
    hints: tuple[Hint, ...] = ()
    """The best of every way that keeps enough LEDs, the least U for the effort first; some may make
    U worse."""

    def best(self, share: float = REAL_SHARE) -> Hint | None:
        """Return the best turn that takes so much off; None where none does."""
        return next((hint for hint in self.hints if hint.share >= share), None)

    def along(self, ways: tuple[Way, ...]) -> Hint | None:
        """Return the best turn that goes there."""
        return next((hint for hint in self.hints if hint.ways == ways), None)


def advise(
    rig: Rig, body: ProbeBody, held: Held, sensitivities: Sensitivities | None = None
) -> Advice:
    """Return the turns about the resting ball, and the uncertainty that each would give.

    What a camera should see now and does not is hidden by something, and counts as hidden in every
    turn, as everything does of a camera that sees nothing; what it sees beyond the model counts as
    long as the probe is not turned. Two turns at once are tried only where no single one is worth
    it.

    Parameters
    ----------
    held
        In the frame of the rig.
    """
    advice = _tried(rig, body, held, sensitivities, [(turn,) for turn in TURNS])
    if advice.best() is not None or not np.isfinite(advice.now_mm):
        return advice
    more = _tried(rig, body, held, sensitivities, PAIRS)
    ranked = sorted((*advice.hints, *more.hints), key=_cost)
    return Advice(advice.now_mm, tuple(ranked))


def uncertainty_of(rig: Rig, body: ProbeBody, held: Held) -> float:
    """Return U, mm, k = 2, as the probe is held, by the model of its sight; NaN without a pose."""
    return _tried(rig, body, held, None, ()).now_mm


def _tried(
    rig: Rig,
    body: ProbeBody,
    held: Held,
    sensitivities: Sensitivities | None,
    turns: Sequence[tuple[Turn, ...]],
) -> Advice:
    stance = stance_at(rig)
    rotations = np.stack([_rotation(some, stance) for some in ((), *turns)])
    rotations = rotations @ held.rotation_world_from_probe
    sight = sight_of(rig, body, rotations, held.tip_world)
    hidden = sight.seen[0] & ~held.seen
    # A camera that sees nothing of what shines to it does not see what comes to light by a turn.
    shining = np.count_nonzero(sight.seen[0], axis=1)
    hidden[(shining >= _SHINING) & ~held.seen.any(axis=1)] = True
    sight.seen[1:] &= ~hidden
    sight.seen[0] = held.seen
    sure = sight_of(rig, body, rotations, held.tip_world, MARGIN_RAD).seen & ~hidden
    leds = common(sure)
    allowed = (leds >= LEAST_LEDS) & _may_be_held(body, rotations, stance)
    allowed[0] = True
    sight.seen[~allowed] = False
    found = uncertainties(sight, rig, body, sensitivities)
    now = float(found[0])
    if not np.isfinite(now):
        return Advice(now)
    best: dict[tuple[Way, ...], Hint] = {}
    for number, some in enumerate(turns, start=1):
        if np.isfinite(found[number]):
            hint = Hint(some, now, float(found[number]), int(leds[number]))
            if hint.ways not in best or _cost(hint) < _cost(best[hint.ways]):
                best[hint.ways] = hint
    return Advice(now, tuple(sorted(best.values(), key=_cost)))


def _cost(hint: Hint) -> float:
    return hint.then_mm * (1.0 + _EFFORT * hint.degrees)


def _rotation(turns: tuple[Turn, ...], stance: Stance) -> Float:
    found = np.eye(3)
    for turn in turns:
        found = turn.rotation_world(stance) @ found
    return found


def _may_be_held(body: ProbeBody, rotations: Float, stance: Stance) -> Bool:
    """Return of attitudes (n, 3, 3) whether a hand and the rules of the probe allow them."""
    handle = unit(body.leds_probe.mean(axis=0) - body.tip_probe)
    upright: Bool = rotations @ handle @ stance.up >= _LOWEST
    return upright & satisfies_rules(body, rotations)
