"""Steps of a relocation with instructions and gates, their display form, and motion of seats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ocmm_core.calibration import guided
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.relocation._data import KeptByPoints, Observations, RelocationResult
from ocmm_core.calibration.relocation._state import LENGTH_TOLERANCE, RelocationState
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError, TrackingError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody, triangulate

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
            guided.LAST_OF_CALIBRATION,
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


def bar_ends(rig: Rig, uv: Float, length: float) -> Float:
    """Return the two spots of a bar in each camera, (C, 2, 2), px, with matching ends.

    Only the correct pairing gives the distance of the LEDs; CalibrationError if none does. ``uv``
    (C, 2, 2), px: both spots in any order, or NaN.
    """
    seeing = [c for c in range(len(uv)) if np.isfinite(uv[c]).all()]
    best, least = uv, np.inf
    for swaps in product((False, True), repeat=max(len(seeing) - 1, 0)):
        paired = uv.copy()
        for camera, swap in zip(seeing[1:], swaps, strict=True):
            paired[camera] = uv[camera, ::-1] if swap else uv[camera]
        ends = triangulate(rig, paired)
        off = abs(float(np.linalg.norm(ends[1] - ends[0])) / length - 1.0)
        if off < least:
            best, least = paired, off
    if not least < LENGTH_TOLERANCE:
        raise CalibrationError(
            "relocation.bar",
            "The two visible points are not the ends of the bar.",
            "Cover other lights, and check that this is the selected bar.",
        )
    return best


def findings_of(rig: Rig, observed: Observations, found: RelocationResult) -> guided.Findings:
    """Return a relocation in displayed and recorded form."""
    after = found.applied_to(rig, rig.identity)
    at, errors = _misfits(after, observed, found)
    return guided.Findings(
        cameras=found.cameras,
        covariance=found.covariance,
        volume_world=found.volume_world,
        hull_world=found.hull_world,
        residuals=guided.residuals_of(
            found.cameras, observed.frames.uv, found.residuals_px, found.used
        ),
        rms_px=found.rms_px,
        chi2_per_dof=found.chi2 / found.dof,
        points=int(np.count_nonzero(found.frames_used)),
        outliers=tuple(
            f"pose {one.frame + 1}, LED {one.led + 1} in {found.cameras[one.camera].name}"
            for one in found.wrong_spots
        ),
        errors_at_world=at,
        errors_world=errors,
        warnings=found.warnings,
    )


def _misfits(
    after: Rig, observed: Observations, found: RelocationResult
) -> tuple[Points3, Points3]:
    """Return places and misfits (n, 3), mm: of shown bars along them, and of control points."""
    places: list[Float] = []
    misfits: list[Float] = []
    for shown in observed.shown_bars:
        for uv in shown.uv:
            ends = triangulate(after, uv)
            between = ends[1] - ends[0]
            size = float(np.linalg.norm(between))
            places.append(ends.mean(axis=0))
            misfits.append(between / size * (size - shown.bar.length))
    if isinstance(found.options.world, KeptByPoints):
        for name, position in found.options.world.positions_world.items():
            places.append(position)
            misfits.append(found.seats_world[name] - position)
    return np.array(places).reshape(-1, 3), np.array(misfits).reshape(-1, 3)


_REMEDY = "Find what moved (camera, frame, table or seat), fix it, and relocate again."


def seat_findings(
    rig: Rig, body: ProbeBody, found: RelocationResult, visits: Sequence[guided.SeatVisited]
) -> tuple[Finding, ...]:
    """Return findings from the visits of the seats, in order of time, or of their absence.

    The relocation was computed without them.
    """
    if not visits:
        return (
            Finding(
                "repeat.missing",
                "No seat was visited at both start and end: a camera or frame that moved in "
                "between may go unnoticed.",
                "Next time, visit two cones fixed to the table first and last.",
                refuses=False,
            ),
        )
    after = found.applied_to(rig, rig.identity)
    probe = replace(
        body,
        leds_probe=found.leds_probe,
        tip_probe=found.tip_probe,
        geometry_covariance=found.geometry_covariance,
    )
    repeats = []
    for seat in range(guided.SEATS):
        first, *later = [one for one in visits if one.seat == seat]
        for again in later:
            one = _repeat(after, probe, first, again)
            if isinstance(one, Finding):
                return (one,)
            repeats.append(one)
    moved = guided.repeat_finding(guided.judge_repeats(repeats), _REMEDY)
    return () if moved is None else (moved,)


def _repeat(
    rig: Rig, body: ProbeBody, first: guided.SeatVisited, again: guided.SeatVisited
) -> guided.Repeat | Finding:
    place = f"seat {first.seat + 1}"
    try:
        one, two = (
            guided.touch_of(guided.from_spots(visit.uv), visit.sigma_px, rig, body)
            for visit in (first, again)
        )
    except TrackingError:
        return Finding(
            "repeat.unusable",
            f"The new calibration gives no probe position in {place}.",
            "Relocate again, with all LEDs in view of the cameras in both seats.",
            refuses=True,
        )
    # Errors of cameras and probe cancel as far as the attitude agrees; the rest is shared out.
    cameras, geometry = two.by_cameras - one.by_cameras, two.by_geometry - one.by_geometry
    shared = guided.shared_covariance(cameras, geometry, rig, body)
    return guided.Repeat(
        place,
        _resting(one.tip_world, one.noise + 0.5 * shared, first),
        _resting(two.tip_world, two.noise + 0.5 * shared, again),
    )


def _resting(world: Float, covariance: Float, visit: guided.SeatVisited) -> guided.RestingPosition:
    return guided.RestingPosition(world, covariance, visit.utc)
