"""Ball centres of single observations with their uncertainty contributions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody, tip_sensitivity


@dataclass(frozen=True, slots=True)
class RestingTouch:
    """Pose of the probe at rest."""

    tip_world: Float
    """(3,), mm: centre of the ball by the calibration of the probe."""
    rotation_world_from_probe: Float
    """(3, 3)."""
    noise: Float
    """(3, 3), mm^2: covariance by the spots of this observation alone."""
    by_cameras: Float
    """(3, 14 C): derivatives by the cameras' parameters, which all observations share."""
    by_geometry: Float
    """(3, 3 L + 3): by the LEDs and the tip of the probe; they turn with the attitude."""


def touch_of(uv: Float, sigma_px: float, rig: Rig, body: ProbeBody) -> RestingTouch:
    """Return the touch of averaged spots (C, L, 2), px; TrackingError without a pose."""
    found = tip_sensitivity(uv, rig, body)
    by_spots = found.by_spots.reshape(3, -1)
    return RestingTouch(
        tip_world=found.tip_world,
        # The true tip moves against the estimated one as the probe is turned.
        rotation_world_from_probe=-found.by_geometry[:, -3:],
        noise=sigma_px**2 * by_spots @ by_spots.T,
        by_cameras=found.by_cameras,
        by_geometry=found.by_geometry,
    )


def tips_of(touches: Sequence[RestingTouch]) -> Points3:
    """Return the ball centres (n, 3), mm, world."""
    return np.array([one.tip_world for one in touches]).reshape(-1, 3)


def shared_covariance(by_cameras: Float, by_geometry: Float, rig: Rig, body: ProbeBody) -> Float:
    """Return the covariance (3, 3), mm^2, of a tip due to cameras and probe.

    Derivatives as in `RestingTouch`, or their difference between touches: shared effects cancel.
    """
    covariance: Float = (
        by_cameras @ rig.parameter_covariance @ by_cameras.T
        + by_geometry @ body.geometry_covariance @ by_geometry.T
    )
    return covariance


def joint_covariance(
    touches: Sequence[RestingTouch], directions: Float, rig: Rig, body: ProbeBody
) -> Float:
    """Return the covariance, mm^2, (n k, n k), of n tips projected on ``directions`` (n, k, 3)."""
    n, k, _ = directions.shape
    noise = np.array([one.noise for one in touches])
    cameras = np.array([one.by_cameras for one in touches])
    geometry = np.array([one.by_geometry for one in touches])
    covariance = np.zeros((n, k, n, k))
    own = directions @ noise @ directions.transpose(0, 2, 1)
    covariance[np.arange(n), :, np.arange(n), :] = own
    flat: Float = covariance.reshape(n * k, n * k)
    for jacobian, shared in (
        (cameras, rig.parameter_covariance), (geometry, body.geometry_covariance)
    ):  # fmt: skip
        rows = (directions @ jacobian).reshape(n * k, -1)
        flat = flat + rows @ shared @ rows.T
    return 0.5 * (flat + flat.T)
