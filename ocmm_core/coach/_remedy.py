"""A remedy while the probe is lost, from its last pose and the LEDs seen now."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.coach._advice import LEAST_LEDS
from ocmm_core.coach._picture import ProbePicture, picture_of
from ocmm_core.coach._prediction import Bool, common, sight_of
from ocmm_core.coach._stance import stance_at
from ocmm_core.coach._turns import TURNS, Turn
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody, satisfies_rules

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
        return turn.words, turn
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
