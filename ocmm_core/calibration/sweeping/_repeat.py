"""Judge whether the first cone of a pivot calibration stayed in place.

At the end the ball rests there again, at an attitude of its sweep, and is compared with poses of
the most similar attitudes: common errors of cameras and probe cancel, motion remains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.guided import (
    Repeat,
    RestingPosition,
    RestingTouch,
    from_spots,
    judge_repeats,
    repeat_finding,
    shared_covariance,
    touch_of,
)
from ocmm_core.calibration.pivot import PivotSweep
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.sweeping._session import ConeVisited
from ocmm_core.camera import Rig
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

ALIKE = np.radians(12.0)
"""Largest rotation between compared poses."""

LEAST_ALIKE = 5
_MOST_ALIKE = 20
_REMEDY = "Find what moved (cone, camera, frame or tip), fix it, and calibrate the probe again."


@dataclass(frozen=True, slots=True)
class ConeVisits:
    """First cone, at the start and end."""

    begun_utc: str
    """Start of its sweep."""
    again: tuple[ConeVisited, ...]
    """Final visits in time order; none in recordings without."""
    slack_mm: float = 0.0
    """Standard deviation of the ball's place in the cone, per axis."""


def turns_from(rotations: Float, rotation: Float) -> Float:
    """Return the angles between rotations (n, 3, 3) and another, (n,), rad; NaN stays."""
    cosines = 0.5 * (np.einsum("nij,ij->n", rotations, rotation) - 1.0)
    turns: Float = np.arccos(np.clip(cosines, -1.0, 1.0))
    return turns


def cone_findings(
    rig: Rig, probe: ProbeBody, sweep: PivotSweep, rotations: Float, visits: ConeVisits
) -> tuple[Finding, ...]:
    """Return findings from the final visit, with the probe of the first sweep.

    ``rotations`` (n, 3, 3) of that sweep are world from probe; NaN if excluded.
    """
    if not visits.again:
        return (
            Finding(
                "repeat.missing",
                "The first cone was not revisited at the end: movement in between may go "
                "unnoticed.",
                "Next time, put the ball back into the first cone at the end.",
                refuses=False,
            ),
        )
    repeats = []
    for visit in visits.again:
        one = _repeat(rig, probe, sweep, rotations, visits, visit)
        if isinstance(one, Finding):
            return (one,)
        repeats.append(one)
    moved = repeat_finding(judge_repeats(repeats), _REMEDY)
    return () if moved is None else (moved,)


def _repeat(
    rig: Rig,
    probe: ProbeBody,
    sweep: PivotSweep,
    rotations: Float,
    visits: ConeVisits,
    visit: ConeVisited,
) -> Repeat | Finding:
    again = _touch(from_spots(visit.uv), visit.sigma_px, rig, probe)
    if again is None:
        return _unusable("is not seen well enough at the end")
    turned = turns_from(rotations, again.rotation_world_from_probe)
    nearest = np.argsort(np.where(np.isfinite(turned), turned, np.inf))[:_MOST_ALIKE]
    nearest = nearest[turned[nearest] <= ALIKE]
    seen = [_touch(sweep.uv[i], float(sweep.sigma_px[i]), rig, probe) for i in nearest]
    alike = [one for one in seen if one is not None]
    if len(alike) < LEAST_ALIKE:
        return _unusable("is held at the end in an attitude not in its sweep")
    # Neighbours share sensor pattern noise: their mean is no better than one of them.
    noise = np.mean([one.noise for one in alike], axis=0)
    cameras = again.by_cameras - np.mean([one.by_cameras for one in alike], axis=0)
    geometry = again.by_geometry - np.mean([one.by_geometry for one in alike], axis=0)
    shared = shared_covariance(cameras, geometry, rig, probe)
    play = visits.slack_mm**2 * np.eye(3) + 0.5 * shared
    before = np.mean([one.tip_world for one in alike], axis=0)
    return Repeat(
        "the ball in the first cone",
        RestingPosition(before, noise + play, visits.begun_utc),
        RestingPosition(again.tip_world, again.noise + play, visit.utc),
    )


def _touch(uv: Float, sigma_px: float, rig: Rig, body: ProbeBody) -> RestingTouch | None:
    try:
        return touch_of(uv, sigma_px, rig, body)
    except TrackingError:
        return None


def _unusable(what: str) -> Finding:
    return Finding(
        "repeat.unusable",
        f"The probe in the first cone {what}.",
        "Calibrate the probe again, and at the end rest the ball in the first cone held as at the "
        "start, all LEDs in view.",
        refuses=True,
    )
