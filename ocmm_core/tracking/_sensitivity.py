"""How the tip of one pose answers to every error of what it was computed from.

The pose minimises the reprojection residuals, so to first order a change of the spots, the cameras
or the LEDs moves it by the pseudo-inverse of the residuals' derivative (implicit function theorem;
GUM 5.1.2 calls these the sensitivity coefficients). All errors are meant as truth minus belief.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ocmm_core.camera import N_PARAMETERS, Rig, projection_jacobians
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float, Int, rigid_fit, rotation_from_vector
from ocmm_core.tracking._body import ProbeBody
from ocmm_core.tracking._pose import reprojection, tip_jacobian, triangulate

_MAX_STEPS = 10
_STEP_LIMIT = 1e-10


def _nothing() -> Float:
    return np.zeros((3, 0))


@dataclass(frozen=True, slots=True)
class TipSensitivity:
    """Tip of one set of spots and its derivatives; m spots were seen.

    Attributes
    ----------
    tip_world
        (3,), mm: converged estimate.
    camera
        (m,) int64: camera of each spot.
    uv
        (m, 2), px: the spots.
    by_spots
        (3, m, 2), mm/px.
    by_cameras
        (3, 14 C): in the order of `Rig.parameter_covariance`.
    by_geometry
        (3, 3 L + 3): in the order of `ProbeBody.geometry_covariance`.
    by_common
        (3, k), mm: what else moves all points of a job together, one independent standard deviation
        a column. It is the place of a reference body; (3, 0) without one.
    """

    tip_world: Float
    camera: Int
    uv: Float
    by_spots: Float
    by_cameras: Float
    by_geometry: Float
    by_common: Float = field(default_factory=_nothing)


@dataclass(frozen=True, slots=True)
class PoseSensitivity:
    """Pose of one set of spots and its derivatives; m spots were seen.

    Attributes
    ----------
    rotation, origin
        World from body, (3, 3) and (3,), mm: converged estimate.
    camera, uv
        (m,) int64 and (m, 2), px: the spots.
    by_spots, by_cameras, by_leds
        (6, 2 m), (6, 14 C) and (6, 3 L): of the pose increments of `pose.reprojection`.
    """

    rotation: Float
    origin: Float
    camera: Int
    uv: Float
    by_spots: Float
    by_cameras: Float
    by_leds: Float


def tip_sensitivity(spots: Float, rig: Rig, body: ProbeBody) -> TipSensitivity:
    """Return the tip of spots (C, L, 2), px by LED number, and its derivatives.

    Raises
    ------
    TrackingError
        The spots do not determine a pose.
    """
    pose = pose_sensitivity(spots, rig, body.leds_probe)
    to_tip = tip_jacobian(pose.rotation, body)
    # The estimate moves with the LEDs against the true tip, and the true tip with its own error.
    by_geometry = np.hstack([to_tip @ pose.by_leds, -pose.rotation])
    return TipSensitivity(
        tip_world=pose.rotation @ body.tip_probe + pose.origin,
        camera=pose.camera,
        uv=pose.uv,
        by_spots=(to_tip @ pose.by_spots).reshape(3, -1, 2),
        by_cameras=to_tip @ pose.by_cameras,
        by_geometry=by_geometry,
    )


def pose_sensitivity(spots: Float, rig: Rig, leds: Float) -> PoseSensitivity:
    """Return the pose of LEDs (L, 3), mm, body frame, from spots (C, L, 2), px, with derivatives.

    Raises
    ------
    TrackingError
        The spots do not determine a pose.
    """
    positions = triangulate(rig, spots)
    located = np.isfinite(positions).all(axis=1)
    if np.count_nonzero(located) < 3:
        raise TrackingError(
            "tracking.targets",
            f"Only {np.count_nonzero(located)} LEDs are seen by two cameras.",
            "At least three are needed: turn the probe towards the cameras.",
        )
    rotation, origin = rigid_fit(leds[located], positions[located])
    for _ in range(_MAX_STEPS):
        residuals, rows = reprojection(rig, leds, spots, rotation, origin)
        step: Float = np.linalg.lstsq(rows, residuals)[0].astype(np.float64)
        rotation = rotation_from_vector(step[:3]) @ rotation
        origin = origin + step[3:]
        if np.abs(step).max() < _STEP_LIMIT:
            break
    _, rows = reprojection(rig, leds, spots, rotation, origin)
    by_spots: Float = np.linalg.solve(rows.T @ rows, rows.T).astype(np.float64)

    seen = np.isfinite(spots).all(axis=2)
    camera_of, led_of = np.nonzero(seen)
    leds_world = leds @ rotation.T + origin
    by_cameras = np.zeros((6, N_PARAMETERS * len(rig.cameras)))
    by_leds = np.zeros((6, leds.size))
    for c, camera in enumerate(rig.cameras):
        rows_of = np.flatnonzero(camera_of == c)
        numbers = led_of[rows_of]
        d_point, d_parameters = projection_jacobians(camera, leds_world[numbers])
        both = (2 * rows_of[:, None] + np.arange(2)).ravel()
        part = slice(c * N_PARAMETERS, (c + 1) * N_PARAMETERS)
        by_cameras[:, part] = by_spots[:, both] @ d_parameters.reshape(-1, N_PARAMETERS)
        for led, row, slope in zip(numbers, rows_of, d_point @ rotation, strict=True):
            by_leds[:, 3 * led : 3 * led + 3] += by_spots[:, 2 * row : 2 * row + 2] @ slope
    return PoseSensitivity(
        rotation=rotation,
        origin=origin,
        camera=camera_of.astype(np.int64),
        uv=spots[seen],
        by_spots=by_spots,
        by_cameras=by_cameras,
        by_leds=by_leds,
    )
