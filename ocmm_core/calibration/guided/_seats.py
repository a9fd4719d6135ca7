"""Two seats fixed to the table: visited first, and again after all other observations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.calibration.guided._procedure import OPEN, Gate
from ocmm_core.calibration.guided._session_events import SessionEvent, Spots
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float

SEATS = 2
"""Visited first and again at the end."""

SEAT_MM = 5.0
"""Larger than unnoticed seat motion, smaller than the distance between seats."""

_SEATS_APART = 0.3
"""Fraction of the space diagonal: seats close together give the same evidence on a camera."""


class SeatVisited(SessionEvent, frozen=True, kw_only=True):
    """The probe in a seat that stays in place during the session."""

    seat: int
    uv: Spots
    """(C, L), px."""
    sigma_px: float


def judge_first_visit(tip_world: Float, known_world: Sequence[Float], rig: Rig) -> str:
    """Return why a resting ball (3,), mm, cannot be in a new seat; empty if it can."""
    away = [float(np.linalg.norm(tip_world - one)) for one in known_world]
    least = _SEATS_APART * float(np.linalg.norm(np.ptp(rig.volume_world, axis=0)))
    if away and min(away) < least:
        return (
            f"This seat is {min(away):.0f} mm from the first one; at least {least:.0f} mm are "
            "needed: use another one."
        )
    return ""


def judge_visit_again(
    tip_world: Float, seat: int, known_world: Sequence[Float], near_mm: float = SEAT_MM
) -> str:
    """Return why a ball is not within ``near_mm`` of the wanted seat; empty if it may be."""
    away = [float(np.linalg.norm(tip_world - one)) for one in known_world]
    if away[seat] <= near_mm:
        return ""
    other = next((i for i, one in enumerate(away) if one <= near_mm), None)
    where = f"in seat {other + 1}" if other is not None else f"{away[seat]:.0f} mm from it"
    return f"Seat {seat + 1} is next, but the ball is {where}: put it into seat {seat + 1}."


def first_gate(seat: int | None) -> Gate:
    """Return the gate of the first visits; ``seat`` is the next one, None after the last."""
    if seat is None:
        return OPEN
    return Gate(
        False,
        f"Seat {seat + 1} of {SEATS} was not visited.",
        "Put the ball into a cone fixed to the table.",
    )


def again_gate(seat: int | None) -> Gate:
    """Return the gate of the visits at the end; see `first_gate`."""
    if seat is None:
        return OPEN
    return Gate(
        False,
        f"Seat {seat + 1} of {SEATS} was not visited again.",
        f"Put the ball into seat {seat + 1} once more.",
    )


def first_instruction(seat: int | None) -> str:
    """Return what to do at the first visits; see `first_gate`."""
    if seat is None:
        return "Both seats visited. Leave them in place."
    return (
        f"Put the ball into seat {seat + 1} of {SEATS}: a cone fixed to the table that stays in "
        "place until the end."
    )


def again_instruction(seat: int | None) -> str:
    """Return what to do at the visits at the end; see `first_gate`."""
    if seat is None:
        return "Both seats visited again."
    return f"Put the ball into seat {seat + 1} of {SEATS} again."
