"""The turn of the probe that reduces the uncertainty of its ball, and a remedy if it is lost.

A hint does not flicker: it waits before appearing, vanishing and changing. The remedy follows from
the last pose and the LEDs seen now.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.coach._turns import (
    PAIRS,
    TURNS,
    Bool,
    Held,
    ProbePicture,
    Sensitivities,
    Stance,
    Turn,
    Way,
    common,
    picture_of,
    sight_of,
    stance_at,
    uncertainties,
)
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking import ProbeBody, satisfies_rules

REAL_SHARE = 0.15
"""A turn that reduces U by less is not worth a movement of the hand."""
LEAST_LEDS = 4
"""Identification needs this many LEDs seen by two cameras."""
_EFFORT = 0.0015
"""Least reduction of U per degree, as a share: of two equal turns the smaller wins."""
MARGIN_RAD = float(np.radians(6.0))
"""Margin of the light cone of counted LEDs: the hand follows within some 3 degrees."""
_SHINING = 2
"""LEDs at the rim of their cone are uncertain; with this many, a camera sees one, or is blocked."""
_LOWEST = float(np.cos(np.radians(100.0)))
"""Largest inclination of the handle from upright."""


@dataclass(frozen=True, slots=True)
class Hint:
    """One or two turns and their benefit."""

    turns: tuple[Turn, ...]
    """In this order; the second is about another axis."""
    now_mm: float
    then_mm: float
    """`now_mm`, `then_mm`: U, k = 2, of an averaged point, worst direction: held, turned."""
    leds: int
    """LEDs then seen by two cameras."""

    @property
    def share(self) -> float:
        """Return the relative reduction of U."""
        return 1.0 - self.then_mm / self.now_mm

    @property
    def ways(self) -> tuple[Way, ...]:
        return tuple(turn.way for turn in self.turns)

    @property
    def degrees(self) -> int:
        return sum(turn.degrees for turn in self.turns)

    def rotation_world(self, stance: Stance) -> Float:
        """Return the rotation (3, 3) of the world about the ball."""
        return _rotation(self.turns, stance)


@dataclass(frozen=True, slots=True)
class Advice:
    """Result of the coach."""

    now_mm: float
    """U as the probe is held; NaN without a pose."""
    hints: tuple[Hint, ...] = ()
    """Best of each way with enough LEDs, least U for effort first; may include a larger U."""

    def best(self, share: float = REAL_SHARE) -> Hint | None:
        """Return the best turn that reduces U by ``share``, or None."""
        return next((hint for hint in self.hints if hint.share >= share), None)

    def along(self, ways: tuple[Way, ...]) -> Hint | None:
        """Return the best turn along these ways."""
        return next((hint for hint in self.hints if hint.ways == ways), None)


def advise(
    rig: Rig, body: ProbeBody, held: Held, sensitivities: Sensitivities | None = None
) -> Advice:
    """Return the turns about the resting ball with their predicted uncertainty.

    An LED expected by a camera but not seen is hidden, and counts as hidden in every turn, as do
    all of a camera that sees nothing; LEDs seen beyond the model count until the probe is turned.
    Pairs of turns are tried only if no single turn suffices. The frame of ``held`` is the rig.
    """
    advice = _tried(rig, body, held, sensitivities, [(turn,) for turn in TURNS])
    if advice.best() is not None or not np.isfinite(advice.now_mm):
        return advice
    more = _tried(rig, body, held, sensitivities, PAIRS)
    return Advice(advice.now_mm, tuple(sorted((*advice.hints, *more.hints), key=_cost)))


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
    # A camera that sees none of its lit LEDs will not see those lit after a turn.
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
    """Return which attitudes (n, 3, 3) a hand and the rules of the probe allow."""
    handle = unit(body.leds_probe.mean(axis=0) - body.tip_probe)
    upright: Bool = rotations @ handle @ stance.up >= _LOWEST
    return upright & satisfies_rules(body, rotations)


WAIT_S = 0.6
"""Shorter changes are hand movements that nobody can follow."""
KEPT_SHARE = 0.07
"""A shown hint stays until its share falls below this: half of the share to appear."""
_MUCH_BETTER = 0.12
"""Additional reduction of U for another way to replace the hint."""
_OTHER_DEG, _OTHER_U = 10, 0.1
"""Changes of angle and, as a share, of U that update a shown hint."""


@dataclass(slots=True)
class SteadyHint:
    """Steady the hint shown, fed with each advice."""

    shown: Hint | None = None
    _coming: Hint | None = None
    _changing: bool = False
    _since_s: float = 0.0
    _worded_s: float = float("-inf")

    def push(self, advice: Advice | None, time_s: float) -> Hint | None:
        """Take in an advice, or None, and return the hint to show."""
        wanted = self._wanted(advice)
        if _alike(wanted, self.shown):
            self._changing = False
            self._reword(wanted, time_s)
            return self.shown
        if not self._changing or not _alike(wanted, self._coming):
            self._since_s = time_s
        self._changing, self._coming = True, wanted
        if time_s - self._since_s >= WAIT_S:
            self.shown, self._changing, self._worded_s = wanted, False, time_s
        return self.shown

    def _wanted(self, advice: Advice | None) -> Hint | None:
        if advice is None:
            return None
        best = advice.best()
        if self.shown is None:
            return best
        # Pairs of turns are only tried if no single one suffices.
        kept = advice.along(self.shown.ways)
        if kept is None or kept.share < KEPT_SHARE:
            return best
        if best is not None and best.share >= kept.share + _MUCH_BETTER:
            return best
        return kept

    def _reword(self, wanted: Hint | None, time_s: float) -> None:
        if wanted is None or self.shown is None or time_s - self._worded_s < WAIT_S:
            return
        now = self.shown
        if (
            abs(wanted.degrees - now.degrees) >= _OTHER_DEG
            or abs(wanted.now_mm - now.now_mm) > _OTHER_U * now.now_mm
            or abs(wanted.then_mm - now.then_mm) > _OTHER_U * now.then_mm
        ):
            self.shown, self._worded_s = wanted, time_s


def _alike(one: Hint | None, other: Hint | None) -> bool:
    if one is None or other is None:
        return one is other
    return one.ways == other.ways


_HIDDEN_SHARE = 0.5
"""A camera that sees a smaller share of its lit LEDs is obstructed."""


@dataclass(frozen=True, slots=True, eq=False)
class ProbeHelp:
    """A picture and one remedy."""

    remedy: str
    """One short sentence, readable from afar; empty if the reason suffices."""
    picture: ProbePicture
    """Of the probe, with the turn of the remedy if any."""


def help_when_lost(
    rig: Rig,
    body: ProbeBody,
    rotation: Float | None,
    tip_rig: Float | None,
    seen: Bool,
    *,
    named: bool = True,
) -> ProbeHelp:
    """Return the remedy for too few LEDs; pose (3, 3), (3,), mm, rig, or None; ``seen``: (C, L)."""
    remedy, turn = ("Turn the LEDs to the cameras", None)
    if named:
        remedy, turn = _remedy(rig, body, rotation, tip_rig, seen)
    return ProbeHelp(remedy, picture_of(rig, body, rotation, seen, turn))


def _remedy(
    rig: Rig, body: ProbeBody, rotation: Float | None, tip_rig: Float | None, seen: Bool
) -> tuple[str, Turn | None]:
    if rotation is None or tip_rig is None or not seen.any():
        return "Show the LEDs to the cameras", None
    here = sight_of(rig, body, rotation[None], tip_rig)
    blind = [
        camera.name
        for camera, shining, sees in zip(rig.cameras, here.seen[0], seen, strict=True)
        if shining.sum() >= LEAST_LEDS
        and np.count_nonzero(shining & ~sees) > _HIDDEN_SHARE * shining.sum()
    ]
    if len(blind) == len(rig.cameras):
        return "Clear the line of sight", None
    if blind:
        return f"Clear the view of camera {' and '.join(blind)}", None
    if np.count_nonzero(here.on_sensor[0].all(axis=0)) < LEAST_LEDS:
        return "Bring the probe back before the cameras", None
    turn = _back(rig, body, rotation, tip_rig, int(common(here.seen)[0]))
    if turn is not None:
        return turn.instruction, turn
    if common(here.seen)[0] >= LEAST_LEDS:
        return "Clear the line of sight", None
    return "Turn the LEDs to the cameras", None


def _back(rig: Rig, body: ProbeBody, rotation: Float, tip_rig: Float, now: int) -> Turn | None:
    """Return the least turn with which two cameras see enough LEDs, or the most possible."""
    stance = stance_at(rig)
    rotations = np.stack([turn.rotation_world(stance) for turn in TURNS]) @ rotation
    leds = common(sight_of(rig, body, rotations, tip_rig).seen)
    leds = np.where(satisfies_rules(body, rotations), leds, 0)
    wanted = min(int(leds.max()), LEAST_LEDS + 1)
    if wanted <= now:
        return None
    enough = [(TURNS[place].degrees, -int(leds[place]), place)
              for place in np.flatnonzero(leds >= wanted)]  # fmt: skip
    return TURNS[min(enough)[2]]
