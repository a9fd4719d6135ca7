"""Display form of a relocation, assignment of bar LEDs, and motion of its seats.

A motion during the session shifts the second visit of a seat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ocmm_core.calibration import guided
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.relocation._data import KeptByPoints, Observations, RelocationResult
from ocmm_core.calibration.relocation._state import LENGTH_TOLERANCE
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError, TrackingError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody, triangulate


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
    uv = observed.frames.uv
    residuals = []
    for c, camera in enumerate(found.cameras):
        seen = np.isfinite(found.residuals_px[:, c]).all(axis=-1)
        residuals.append(
            guided.CameraResiduals(
                camera.name, uv[:, c][seen], found.residuals_px[:, c][seen], found.used[:, c][seen]
            )
        )
    after = found.applied_to(rig, rig.identity)
    at, errors = _misfits(after, observed, found)
    return guided.Findings(
        cameras=found.cameras,
        covariance=found.covariance,
        volume_world=found.volume_world,
        hull_world=found.hull_world,
        residuals=tuple(residuals),
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
