"""Steps of a relocation with instructions and gates."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.calibration import guided
from ocmm_core.calibration.relocation._state import RelocationState

PREPARE, SEATS_FIRST, WAVE, BAR = "prepare", "seats", "wave", "bar"
WORLD, SEATS_AGAIN, RESULT = "world", "again", "result"

COVERED = 0.95
"""Sufficient fraction of the wanted cells: a moved frame may not see every corner."""

_NO_SEATS = "Nothing to do: the recording has no seats."


def steps_of(state: RelocationState, length_sigma_mm: float | None) -> tuple[guided.Step, ...]:
    """Return the steps with their current gates; sigma is None before a prediction."""
    begun, use = state.begun, state.begun.bar.artefact.use
    hint = _missing_words(state.coverage().missing)
    seat, again = state.next_seat, state.seat_to_repeat
    show = (
        "Put it on its stand in the volume, both LEDs towards the cameras; change place and "
        "direction each time, also in depth."
        if state.shown
        else "Lay it down in the volume and touch its first and last nest; change place and "
        "direction each time, also in depth."
    )
    return (
        guided.Step(
            PREPARE,
            "Prepare",
            f"Take the probe and bar '{use.name}' (serial {use.serial}). Do not touch the "
            "cameras from now on.",
            guided.OPEN,
        ),
        guided.Step(
            SEATS_FIRST,
            "Seats first",
            guided.first_instruction(state.unvisited_seat) if state.wanted_visits else _NO_SEATS,
            guided.first_gate(state.unvisited_seat),
            len({one.seat for one in state.visits}),
            state.wanted_visits,
        ),
        guided.Step(
            WAVE,
            "Wave the probe",
            f"Wave it slowly through the whole volume, turning it continuously. {hint}".strip(),
            _wave_gate(state),
            len(state.poses),
            begun.poses_wanted,
        ),
        guided.Step(
            BAR,
            "Show the bar",
            show,
            _bar_gate(state, length_sigma_mm),
            state.placements,
            begun.bars_wanted,
        ),
        guided.Step(
            WORLD,
            "World frame",
            "Nothing to do: the world frame stays with the cameras."
            if not state.wanted_seats
            else "All points touched."
            if seat is None
            else f"Put the ball into control point '{seat}'.",
            _world_gate(state),
            len(state.seats),
            len(state.wanted_seats),
        ),
        guided.Step(
            SEATS_AGAIN,
            "Seats again",
            guided.again_instruction(again) if state.wanted_visits else _NO_SEATS,
            guided.again_gate(again),
            state.wanted_visits if again is None else again,
            state.wanted_visits,
        ),
        guided.Step(
            RESULT,
            "Result",
            "Review the residuals and the changes, then accept the new calibration or keep the "
            "old one.",
            guided.Gate(
                False, "This is the last step.", "Accept the new calibration, or keep the old one."
            ),
        ),
    )


def _missing_words(cells: Sequence[str]) -> str:
    """Return the first cells that lack poses, in a sentence; empty without any."""
    more = f" and {len(cells) - 3} more" if len(cells) > 3 else ""
    # Catalogues know the whole sentence (`COMPOSED` of `docs.make_core_texts`).
    return " ".join(("Missing probe poses:", ", ".join(cells[:3]))) + more + "." if cells else ""


def _wave_gate(state: RelocationState) -> guided.Gate:
    poses, wanted = len(state.poses), state.begun.poses_wanted
    covered = state.coverage()
    if covered.fraction < COVERED:
        return guided.Gate(
            False, _missing_words(covered.missing), "Wave it there in this attitude."
        )
    if poses < wanted:
        left = "1 pose" if wanted - poses == 1 else f"{wanted - poses} poses"
        return guided.Gate(False, f"{left} to go.", "Keep waving the probe.")
    return guided.OPEN


def _bar_gate(state: RelocationState, sigma: float | None) -> guided.Gate:
    missing = state.begun.bars_wanted - state.placements
    if missing > 0:
        left = "1 bar placement" if missing == 1 else f"{missing:d} bar placements"
        return guided.Gate(False, f"{left} to go.", "Keep showing the bar.")
    limit = state.begun.length_limit_mm
    if sigma is not None and sigma > limit:
        return guided.Gate(
            False,
            f"U of a length of {state.begun.length_mm:.0f} mm (k = 2) would be "
            f"{2e3 * sigma:.1f} um; the target is {2e3 * limit:.1f} um.",
            "Go back and wave the probe longer, or show the bar in more places.",
        )
    return guided.OPEN


def _world_gate(state: RelocationState) -> guided.Gate:
    seat = state.next_seat
    if seat is not None:
        return guided.Gate(False, f"Control point '{seat}' was not touched.", "Touch it.")
    return guided.OPEN
