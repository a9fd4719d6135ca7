"""Acceptance of a touch as a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core import measuring
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.session._job_points import ReferenceUse
from ocmm_core.inspection.session._step_log import JobLedger
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class Accepted:
    """An acceptable touch."""

    stable: measuring.StablePoint
    feature: str
    side: measuring.Side
    """Side of the probe, and its evidence."""
    sensitivity: TipSensitivity
    """Sensitivity of the tip to its inputs."""

    def point(self, number: int, tip_radius: float) -> measuring.MeasuredPoint:
        stable = self.stable
        return measuring.MeasuredPoint(
            number=number,
            feature=self.feature,
            time_s=stable.time_s,
            first_frame=stable.first_frame,
            last_frame=stable.last_frame,
            n_frames=stable.n_frames,
            tip_world=stable.tip_world,
            random_covariance=stable.random_covariance,
            direction=self.side.direction,
            tip_radius=tip_radius,
            rotation_world_from_probe=stable.rotation_world_from_probe,
            spots=stable.spots,
            chi2_per_dof=stable.chi2_per_dof,
            approach=self.side.word,
            reference_spots=stable.reference_spots,
        )


@dataclass(frozen=True, slots=True)
class TouchAssignment:
    """Feature and method of a touch."""

    feature: str
    """Empty if every feature is done."""
    method: str
    """Detection of its side (`measuring.compensation.METHODS`)."""
    nominal_normal: Float | None = None
    """(3,), unit, world: of the nominal surface at the ball; None while unknown."""


class Acceptance:
    """Make a durable point of an acceptable touch; the last of three steps."""

    def __init__(
        self,
        ledger: JobLedger,
        rig: Rig,
        body: ProbeBody,
        options: SessionOptions,
        reference: ReferenceUse,
    ) -> None:
        self._ledger, self._rig, self._body = ledger, rig, body
        self._options, self._reference = options, reference

    def take(
        self, touch: measuring.Touch, stable: measuring.StablePoint, meant: TouchAssignment
    ) -> measuring.MeasuredPoint | measuring.Refusal:
        """Return the point from a touch, or why it gives none."""
        ledger = self._ledger
        judged = judge_touch(
            touch, stable, meant, self._rig, self._body, self._options, self._reference
        )
        if isinstance(judged, measuring.Refusal):
            return judged
        point = judged.point(ledger.points.next_number(), self._body.tip_radius)
        ledger.add([point], [judged.sensitivity])
        return point


def judge_touch(
    touch: measuring.Touch,
    stable: measuring.StablePoint,
    meant: TouchAssignment,
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    reference: ReferenceUse,
) -> Accepted | measuring.Refusal:
    """Return the result of a touch, or why it gives none."""
    if not meant.feature:
        return all_measured(stable.time_s)
    side = measuring.side_of(
        meant.method,
        touch,
        stable.tip_world,
        stable.rotation_world_from_probe,
        body,
        options.point.approach_mm,
        meant.nominal_normal,
        stable.time_s,
    )
    if isinstance(side, measuring.Refusal):
        return side
    sensitivity = reference.sensitivity(stable.spots, stable.reference_spots)
    refusal = doubt_of(stable, sensitivity, rig, body, options.point.max_uncertainty)
    return refusal or Accepted(stable, meant.feature, side, sensitivity)


def all_measured(time_s: float) -> measuring.Refusal:
    return measuring.Refusal(
        measuring.RefusalCode.NO_FEATURE,
        "All features of the plan are measured.",
        "Select a feature to reopen or repeat, or write the report.",
        time_s,
    )


def doubt_of(
    stable: measuring.StablePoint,
    sensitivity: TipSensitivity,
    rig: Rig,
    body: ProbeBody,
    limit: float,
) -> measuring.Refusal | None:
    """Return why a ball centre is no point: outside, or more uncertain than ``limit``, mm."""
    low, high = rig.volume_world
    if np.any(stable.tip_rig < low) or np.any(stable.tip_rig > high):
        return measuring.Refusal(
            measuring.RefusalCode.OUTSIDE,
            "The ball is outside the volume in which the cameras are calibrated.",
            "Move the part or the cameras, or calibrate a larger volume.",
            stable.time_s,
        )
    uncertainty = measuring.point_uncertainty(sensitivity, rig, body, stable.random_covariance)
    if uncertainty > limit:
        return measuring.Refusal(
            measuring.RefusalCode.UNCERTAIN,
            f"The uncertainty of the point would be {uncertainty:.3f} mm (limit {limit:.3f} mm).",
            "Turn the probe so that both cameras see more LEDs.",
            stable.time_s,
        )
    return None
