"""Whether a touch may become a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.camera.rig import Rig
from ocmm_core.geometry import Float
from ocmm_core.inspection.options import SessionOptions
from ocmm_core.inspection.reference_use import ReferenceUse
from ocmm_core.measuring.point import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.measuring.stable_point import StablePoint, average
from ocmm_core.measuring.trigger import Touch, approach_direction
from ocmm_core.measuring.uncertainty import point_uncertainty
from ocmm_core.tracking.body import ProbeBody
from ocmm_core.tracking.sensitivity import TipSensitivity


@dataclass(frozen=True, slots=True)
class Accepted:
    """A touch that is good enough.

    Attributes
    ----------
    stable
        The ball at rest.
    direction
        (3,), unit: from the ball to the surface, by the approach.
    sensitivity
        How the tip follows what it was computed from.
    """

    stable: StablePoint
    direction: Float
    sensitivity: TipSensitivity

    def point(self, number: int, feature: str, tip_radius: float) -> MeasuredPoint:
        """Return the measured point."""
        stable = self.stable
        return MeasuredPoint(
            number=number,
            feature=feature,
            time_s=stable.time_s,
            first_frame=stable.first_frame,
            last_frame=stable.last_frame,
            n_frames=stable.n_frames,
            tip_world=stable.tip_world,
            random_covariance=stable.random_covariance,
            direction=self.direction,
            tip_radius=tip_radius,
            rotation_world_from_probe=stable.rotation_world_from_probe,
            spots=stable.spots,
            chi2_per_dof=stable.chi2_per_dof,
            approach="trail",
            reference_spots=stable.reference_spots,
        )


def judge_touch(
    touch: Touch,
    feature: str,
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
    reference: ReferenceUse,
) -> Accepted | Refusal:
    """Return what a touch gives, or why it gives nothing.

    Parameters
    ----------
    feature
        What it is meant for; empty where every feature is done.
    """
    if touch.interrupted:
        return Refusal(
            RefusalCode.GAP,
            "The frames of the cameras were interrupted during the touch.",
            "Touch again when the machine is ready.",
            0.0,
        )
    stable = average(touch.window, touch.expected, rig, options.point)
    if isinstance(stable, Refusal):
        return stable
    if not feature:
        return Refusal(
            RefusalCode.NO_FEATURE,
            "Every feature of the plan is done.",
            "Select a feature to measure it again, or export the report.",
            stable.time_s,
        )
    direction = approach_direction(touch.trail_world, stable.tip_world, options.point.approach_mm)
    if direction is None:
        return Refusal(
            RefusalCode.NO_APPROACH,
            "It is not known from which side the ball came to the surface.",
            f"Move it away by {options.point.approach_mm:g} mm or more and touch again.",
            stable.time_s,
        )
    sensitivity = reference.sensitivity(stable.spots, stable.reference_spots)
    refusal = _doubt(stable, sensitivity, rig, body, options.point.max_uncertainty)
    return refusal or Accepted(stable, direction, sensitivity)


def _doubt(
    stable: StablePoint, sensitivity: TipSensitivity, rig: Rig, body: ProbeBody, limit: float
) -> Refusal | None:
    low, high = rig.volume_world
    if np.any(stable.tip_rig < low) or np.any(stable.tip_rig > high):
        return Refusal(
            RefusalCode.OUTSIDE,
            "The ball is outside the volume in which the cameras are calibrated.",
            "Move the part or the cameras, or calibrate a larger volume.",
            stable.time_s,
        )
    uncertainty = point_uncertainty(sensitivity, rig, body)
    if uncertainty > limit:
        return Refusal(
            RefusalCode.UNCERTAIN,
            f"The point would be uncertain by {uncertainty:.3f} mm (limit {limit:.3f} mm).",
            "Turn the probe so that more LEDs face both cameras.",
            stable.time_s,
        )
    return None
