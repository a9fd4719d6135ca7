"""Build the record of two sweeps, ready for acceptance, and its comparison.

At the end the ball rests in the first cone again, at an attitude of its sweep, and is compared with
poses of the most similar attitudes: common errors of cameras and probe cancel, motion remains.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from ocmm_core.calibration import guided, pivot, records
from ocmm_core.calibration.sweeping._views import ConeVisited, PivotBegun, PivotChange, PivotOutcome
from ocmm_core.camera import Rig, Vector3
from ocmm_core.errors import CalibrationError, TrackingError
from ocmm_core.geometry import Float, rigid_fit, triple
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
    rig: Rig, probe: ProbeBody, sweep: pivot.PivotSweep, rotations: Float, visits: ConeVisits
) -> tuple[records.Finding, ...]:
    """Return findings from the final visit, with the probe of the first sweep.

    ``rotations`` (n, 3, 3) of that sweep are world from probe; NaN if excluded.
    """
    if not visits.again:
        return (
            records.Finding(
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
        if isinstance(one, records.Finding):
            return (one,)
        repeats.append(one)
    moved = guided.repeat_finding(guided.judge_repeats(repeats), _REMEDY)
    return () if moved is None else (moved,)


def _repeat(
    rig: Rig,
    probe: ProbeBody,
    sweep: pivot.PivotSweep,
    rotations: Float,
    visits: ConeVisits,
    visit: ConeVisited,
) -> guided.Repeat | records.Finding:
    again = _touch(guided.from_spots(visit.uv), visit.sigma_px, rig, probe)
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
    shared = guided.shared_covariance(cameras, geometry, rig, probe)
    play = visits.slack_mm**2 * np.eye(3) + 0.5 * shared
    before = np.mean([one.tip_world for one in alike], axis=0)
    return guided.Repeat(
        "the ball in the first cone",
        guided.RestingPosition(before, noise + play, visits.begun_utc),
        guided.RestingPosition(again.tip_world, again.noise + play, visit.utc),
    )


def _touch(uv: Float, sigma_px: float, rig: Rig, body: ProbeBody) -> guided.RestingTouch | None:
    try:
        return guided.touch_of(uv, sigma_px, rig, body)
    except TrackingError:
        return None


def _unusable(what: str) -> records.Finding:
    return records.Finding(
        "repeat.unusable",
        f"The probe in the first cone {what}.",
        "Calibrate the probe again, and at the end rest the ball in the first cone held as at the "
        "start, all LEDs in view.",
        refuses=True,
    )


@dataclass(frozen=True, slots=True)
class PivotMaterial:
    """Input of a result."""

    rig: Rig
    body: ProbeBody
    """`rig`, `body`: Cameras, and nominal probe of the document."""
    begun: PivotBegun
    first: pivot.PivotSweep
    second: pivot.PivotSweep
    visits: ConeVisits
    """Of the first cone, at the start and end."""
    previous: records.ProbeRecord | None
    """Record in force at the start of the session, or None."""
    made: datetime
    force: bool


def conclude_pivot(given: PivotMaterial) -> PivotOutcome:
    """Return the result, deterministic; CalibrationError if undetermined, or a guard refuses."""
    begun = given.begun
    expected, options = begun.expected(given.body), begun.options()
    first = pivot.calibrate_probe(given.rig, expected, given.first, options, given.force)
    second = pivot.calibrate_probe(given.rig, expected, given.second, options, given.force)
    validation = pivot.validate_pivot(given.rig, first, second, given.second)
    records.let_pass(validation.findings, given.force)
    probe = first.applied_to(given.body, given.body.identity)
    moved = cone_findings(given.rig, probe, given.first, first.rotations, given.visits)
    records.let_pass(moved, given.force)
    findings = (*first.warnings, *second.warnings, *validation.findings, *moved)
    # Both sweeps often have the same findings. Spots better than the rig's document states are no
    # concern of the user.
    findings = tuple(
        {one.what: one for one in findings if one.code != "calibration.chi2_low"}.values()
    )
    change = None if given.previous is None else change_of(given.body, given.previous, first, begun)
    overruled = given.force and any(one.refuses for one in validation.findings)
    record = records.ProbeRecord(
        schema=records.PROBE_SCHEMA, probe=begun.probe, tip=begun.tip,
        made_utc=guided.utc_text(given.made), made_by=begun.who, software=begun.software,
        temperature_c=begun.temperature_c, rig=given.rig.name, rig_identity=given.rig.identity,
        data_sha256=guided.hash_of(
            given.first.uv, given.second.uv,
            *(guided.from_spots(one.uv) for one in given.visits.again),
        ),
        valid_until_utc=guided.utc_text(given.made + timedelta(days=begun.valid_days)),
        probe_identity=begun.probe_identity,
        leds_mm=tuple(triple(led) for led in first.leds_probe), tip_mm=triple(first.tip_probe),
        covariance=_symmetric(first.covariance), frames=len(given.first.uv),
        left_out=len(first.left_out), ranges_deg=triple(np.degrees(first.coverage.ranges)),
        attitudes=first.coverage.attitudes, rms_px=first.rms_px,
        chi2_per_dof=first.chi2 / first.dof, thesis_tip_mm=triple(first.thesis_tip_probe),
        thesis_spread_mm=first.thesis.spread, validation=_check(validation),
        change_mm=None if change is None else change.tip_distance, change_reason="",
        warnings=tuple(one.what for one in findings),
        forced=first.forced or second.forced or overruled,
        artefacts=() if begun.cone is None else (begun.cone,), previous=begun.running,
    )  # fmt: skip
    return PivotOutcome(
        record=record, body=first.applied_to(given.body, records.record_hash(record)), first=first,
        second=second, validation=validation, change=change, findings=findings,
    )  # fmt: skip


def change_of(
    body: ProbeBody, previous: records.ProbeRecord, found: pivot.PivotCalibration, begun: PivotBegun
) -> PivotChange:
    """Return the change from the previous calibration, both fitted to the same document."""
    leds, tip = laid_onto(body, previous)
    return PivotChange(
        previous, found.tip_probe - tip, found.leds_probe - leds, begun.change_limit_mm
    )


def expected_tip(
    body: ProbeBody, running: records.ProbeRecord | None, *, tip_unknown: bool
) -> Vector3 | None:
    """Return the tip in force or of the document, mm, or None; CalibrationError for other LEDs."""
    if running is None:
        return None if tip_unknown else triple(body.tip_probe)
    if len(running.leds_mm) != body.n_leds:
        raise CalibrationError(
            "pivot.leds",
            f"The active calibration of tip '{running.tip}' belongs to a probe with "
            f"{len(running.leds_mm)} LEDs, but '{body.name}' has {body.n_leds}.",
            "Give every probe its own name in its document.",
        )
    return triple(laid_onto(body, running)[1])


def laid_onto(body: ProbeBody, record: records.ProbeRecord) -> tuple[Float, Float]:
    """Return LEDs (L, 3) and tip (3,), mm, of a record in the frame of a document."""
    leds = np.array(record.leds_mm)
    rotation, shift = rigid_fit(leds, body.leds_probe)
    return leds @ rotation.T + shift, rotation @ np.array(record.tip_mm) + shift


def _check(validation: pivot.PivotValidation) -> records.PivotCheck:
    return records.PivotCheck(
        difference_mm=triple(validation.tip_difference),
        sigma_mm=triple(validation.tip_difference_sigma),
        led_difference_mm=validation.led_difference,
        place_mm=validation.place_distance,
        attitude_deg=float(np.degrees(validation.attitude_distance)),
        articulation_2s_mm=_finite(validation.articulation_2s),
        articulation_max_mm=_finite(validation.articulation_max),
    )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _symmetric(covariance: Float) -> tuple[tuple[float, ...], ...]:
    half = 0.5 * (covariance + covariance.T)
    return tuple(tuple(row) for row in half.tolist())
