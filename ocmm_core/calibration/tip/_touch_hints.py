"""User hints: why a resting ball is rejected, and what is missing."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.guided import OPEN, PLACE_DONE, Gate, RestingTouch
from ocmm_core.calibration.tip._sphere_layout import CONE_TOLERANCE, TOLERANCE
from ocmm_core.calibration.tip._state import TouchState

_SAME_PLACE = np.radians(5.0)
_OFF_SPHERE_MM, _OFF_AT_FIRST_MM = 3.0, 12.0
_KNOWN_FROM = 4
"""Number of points from which the sphere's centre is reliable."""

_OFF_CONE_MM = 2.5
_CLEAR_MM = 5.0
_NEW_ATTITUDE = np.radians(10.0)


def judge_on_sphere(state: TouchState, touch: RestingTouch) -> str:
    """Return why a resting ball is not a wanted point of the sphere, or empty text."""
    progress, centre = state.sphere, state.centre()
    if centre is None:
        return ""
    away = touch.tip_world - centre
    distance = float(np.linalg.norm(away))
    off = distance - state.reach
    known = len(progress.tips_world) >= _KNOWN_FROM
    if abs(off) > (_OFF_SPHERE_MM if known else _OFF_AT_FIRST_MM):
        return (
            f"The ball is {abs(off):.0f} mm {'off' if off > 0.0 else 'inside'} the sphere: rest "
            "it on the sphere."
        )
    if not known:
        return ""
    direction = away / distance
    if float((progress.directions_world @ direction).max()) > np.cos(_SAME_PLACE):
        return PLACE_DONE
    free = state.wanted.places.directions[list(progress.missing)]
    if progress.next_place is not None and not (free @ direction > np.cos(TOLERANCE)).any():
        next_words = state.next_words()
        return f"This place is not needed: touch the sphere {next_words}."
    return ""


def judge_in_cone(state: TouchState, touch: RestingTouch) -> str:
    """Return why a resting ball is not at a wanted attitude in the cone, or empty text."""
    progress, centre = state.cone, state.centre()
    handle = state.handle(touch)
    if len(progress.tips_world):
        off = float(np.linalg.norm(touch.tip_world - progress.tips_world.mean(axis=0)))
        if off > _OFF_CONE_MM:
            return (
                f"The ball is {off:.0f} mm from its place in the cone: put it there, or undo "
                "the attitudes."
            )
    elif centre is not None:
        clear = float(np.linalg.norm(touch.tip_world - centre)) - state.reach
        if clear < _CLEAR_MM:
            return "The ball is still on the sphere: put it into the cone."
    if progress.next_attitude is None:
        if float((progress.handles_world @ handle).max()) > np.cos(_NEW_ATTITUDE):
            return "This attitude is done: lean the probe another way."
        return ""
    missing = np.array([one.handle_world for one in progress.attitudes if one.point is None])
    if float((missing @ handle).max()) < np.cos(CONE_TOLERANCE):
        hold = progress.attitudes[progress.next_attitude].name
        return f"Keep the ball in the cone and hold the probe {hold}."
    return ""


def places_gate(state: TouchState) -> Gate:
    progress, wanted = state.sphere, state.wanted
    touched = len(progress.places) - len(progress.missing)
    left = max(wanted.points - len(progress.tips_world), wanted.places_needed - touched)
    if left <= 0:
        return OPEN
    some = "points on the sphere are" if left != 1 else "point on the sphere is"
    next_words = state.next_words() or "once more"
    return Gate(False, f"{left} {some} missing.", f"Touch the sphere {next_words}.")


def attitudes_gate(state: TouchState) -> Gate:
    attitudes, wanted = state.cone.attitudes, state.cone.next_attitude
    missing = sum(one.point is None for one in attitudes)
    if wanted is None:
        return OPEN
    hold = attitudes[wanted].name
    return Gate(
        False,
        f"{missing} of {len(attitudes)} attitudes in the cone to go.",
        f"Keep the ball in the cone and hold the probe {hold}.",
    )
