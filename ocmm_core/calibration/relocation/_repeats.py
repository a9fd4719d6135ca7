"""Judge whether the seats of a relocation moved: a motion shifts the second visit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ocmm_core.calibration.guided import (
    SEATS,
    Repeat,
    RestingPosition,
    SeatVisited,
    from_spots,
    judge_repeats,
    repeat_finding,
    shared_covariance,
    touch_of,
)
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.relocation._data import RelocationResult
from ocmm_core.camera import Rig
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

_REMEDY = "Find what moved (camera, frame, table or seat), fix it, and relocate again."


def seat_findings(
    rig: Rig, body: ProbeBody, found: RelocationResult, visits: Sequence[SeatVisited]
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
    for seat in range(SEATS):
        first, *later = [one for one in visits if one.seat == seat]
        for again in later:
            one = _repeat(after, probe, first, again)
            if isinstance(one, Finding):
                return (one,)
            repeats.append(one)
    moved = repeat_finding(judge_repeats(repeats), _REMEDY)
    return () if moved is None else (moved,)


def _repeat(rig: Rig, body: ProbeBody, first: SeatVisited, again: SeatVisited) -> Repeat | Finding:
    place = f"seat {first.seat + 1}"
    try:
        one, two = (
            touch_of(from_spots(visit.uv), visit.sigma_px, rig, body) for visit in (first, again)
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
    shared = shared_covariance(cameras, geometry, rig, body)
    return Repeat(
        place,
        _resting(one.tip_world, one.noise + 0.5 * shared, first),
        _resting(two.tip_world, two.noise + 0.5 * shared, again),
    )


def _resting(world: Float, covariance: Float, visit: SeatVisited) -> RestingPosition:
    return RestingPosition(world, covariance, visit.utc)
