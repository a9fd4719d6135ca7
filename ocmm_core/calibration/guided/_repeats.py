"""Judge whether places measured twice have stayed in place.

A change in between (camera, frame, table, seat) displaces the second position, while shared errors
cancel. The normalised square of the shift is chi-square with three degrees of freedom. Two seats
fixed to the table are visited first, and again after all other observations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
import scipy

from ocmm_core.calibration.guided._articulation import SEAT_SIGMA_MM
from ocmm_core.calibration.guided._procedure import OPEN, Gate
from ocmm_core.calibration.guided._session_events import SessionEvent, Spots
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float

REPEAT_CHANCE = 1e-3
"""Probability that any repeat of an undisturbed session is called inconsistent."""


@dataclass(frozen=True, slots=True)
class RestingPosition:
    """Position of the resting ball."""

    world: Float
    """(3,), mm."""
    covariance: Float
    """(3, 3), mm^2: of effects that differ between visits. Effects shared by both positions
    (cameras, probe) are excluded; the pattern noise of the sensors is included if the attitude
    differs."""
    utc: str
    """ISO 8601 text."""


@dataclass(frozen=True, slots=True)
class Repeat:
    """One place, measured first and again."""

    place: str
    first: RestingPosition
    again: RestingPosition
    """`first`, `again`: In order of time."""


@dataclass(frozen=True, slots=True)
class JudgedRepeat:
    """Result of one place."""

    place: str
    first_utc: str
    again_utc: str
    """`place`, `first_utc`, `again_utc`: See `Repeat`."""
    shift_world: Float
    """(3,), mm: again less first."""
    normalised_square: float
    """With the covariance of the shift; 3 on average if nothing moved."""
    limit: float
    """Critical value at the stated probability, shared by all repeats."""

    @property
    def consistent(self) -> bool:
        return self.normalised_square <= self.limit

    @property
    def shift_mm(self) -> float:
        return float(np.linalg.norm(self.shift_world))


def judge_repeats(
    repeats: Sequence[Repeat], chance: float = REPEAT_CHANCE, seat_sigma_mm: float = SEAT_SIGMA_MM
) -> tuple[JudgedRepeat, ...]:
    """Return the shifts of places measured twice, in order.

    ``chance`` that any is called inconsistent although nothing moved is divided equally
    (Bonferroni); ``seat_sigma_mm``: seating repeatability, per axis. CalibrationError if a position
    or covariance is not finite, or not a covariance.
    """
    limit = float(scipy.special.chdtri(3.0, chance / max(len(repeats), 1)))
    judged = []
    for one in repeats:
        both = one.first.covariance + one.again.covariance
        shift = np.asarray(one.again.world - one.first.world, dtype=np.float64)
        _require_numbers(one.place, shift, both)
        both = 0.5 * (both + both.T) + 2.0 * seat_sigma_mm**2 * np.eye(3)
        if float(np.linalg.eigvalsh(both)[0]) <= 0.0:
            raise _unusable(one.place, "has an invalid covariance")
        square = float(shift @ np.linalg.solve(both, shift))
        judged.append(JudgedRepeat(one.place, one.first.utc, one.again.utc, shift, square, limit))
    return tuple(judged)


def moved_between(judged: Sequence[JudgedRepeat]) -> tuple[str, str] | None:
    """Return the interval in which something moved, ISO 8601 text, or None.

    A single change lies within every inconsistent repeat and no consistent one. If none explains
    all, the whole interval of the inconsistent ones.
    """
    wrong = [one for one in judged if not one.consistent]
    if not wrong:
        return None
    spans = [(_moment(one.first_utc), _moment(one.again_utc)) for one in wrong]
    low, high = max(begin for begin, _ in spans), min(end for _, end in spans)
    # A consistent repeat shortens an end, which may let another one do so.
    for _ in judged:
        for one in judged:
            begin, end = _moment(one.first_utc), _moment(one.again_utc)
            if one.consistent and begin <= low < end:
                low = end
            elif one.consistent and begin < high <= end:
                high = begin
    if low >= high:
        low, high = min(begin for begin, _ in spans), max(end for _, end in spans)
    return low.isoformat(), high.isoformat()


def repeat_finding(judged: Sequence[JudgedRepeat], remedy: str) -> Finding | None:
    """Return the finding if places moved, or None; ``remedy``: sentence, what to repeat."""
    between = moved_between(judged)
    if between is None:
        return None
    wrong = sorted((one for one in judged if not one.consistent), key=lambda one: -one.shift_mm)
    places = "; ".join(f"{one.place} by {1e3 * one.shift_mm:.0f} um" for one in wrong)
    return Finding(
        "repeat.moved",
        f"Measured again, {len(wrong)} of {len(judged)} places moved more than chance explains: "
        f"{places}. It happened between {shown_moment(between[0])} and "
        f"{shown_moment(between[1])} UTC.",
        remedy,
        refuses=True,
    )


def shown_moment(utc: str) -> str:
    """Return an ISO 8601 moment in display form, to the second."""
    return f"{_moment(utc):%Y-%m-%d %H:%M:%S}"


def _moment(utc: str) -> datetime:
    return datetime.fromisoformat(utc)


def _require_numbers(place: str, shift: Float, covariance: Float) -> None:
    if not (np.isfinite(shift).all() and np.isfinite(covariance).all()):
        raise _unusable(place, "has a position or covariance that is not a number")


def _unusable(place: str, what: str) -> CalibrationError:
    return CalibrationError(
        "repeat.unusable",
        f"The repeat of {place} {what}.",
        "Measure this place again with all LEDs in view of the cameras.",
    )


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
