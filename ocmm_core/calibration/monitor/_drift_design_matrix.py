"""Derivatives of look spots by poses, cameras and LEDs, and the prior of their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri

from ocmm_core.calibration.monitor._residual_samples import ResidualSample, leds_world_of
from ocmm_core.camera import N_PARAMETERS, CameraModel, Rig, project, projection_jacobians
from ocmm_core.geometry import Float, Int, Pixels, skew
from ocmm_core.tracking import ProbeBody

CAMERA_CHANGES = (
    "pitch", "yaw", "roll", "sideways", "vertical", "axial", "focal length",
    "principal point u", "principal point v",
)  # fmt: skip
"""Possible changes of a camera: rotations (rad) about its axes through its projection centre (x to
the right of the image, y down it, z along the view), shifts (mm) of that centre along them, focal
length (mm) and principal point (px)."""

N_MOTIONS = 6
"""The first of them are motions."""


@dataclass(frozen=True, slots=True)
class Belief:
    """Prior of the errors of cameras and probe without changes."""

    mean: Float
    """(14 C + 3 L + 3,): truth minus documents; parameters of all cameras, then the probe as in
    `ProbeBody.geometry_covariance`."""
    covariance: Float
    _factor: Float | None = field(default=None, init=False, repr=False, compare=False)

    @classmethod
    def of_documents(cls, rig: Rig, body: ProbeBody) -> Belief:
        """Return the prior from the calibrations of the cameras and of the probe."""
        n_cameras = len(rig.parameter_covariance)
        size = n_cameras + len(body.geometry_covariance)
        covariance = np.zeros((size, size))
        covariance[:n_cameras, :n_cameras] = rig.parameter_covariance
        covariance[n_cameras:, n_cameras:] = body.geometry_covariance
        return cls(np.zeros(size), covariance)

    def factor(self) -> Float:
        """Return F with F F' = covariance; cached, as it is needed twice a second."""
        if self._factor is not None:
            return self._factor
        # Units differ widely, and fixed parameters have zero variance.
        scale = np.sqrt(np.diag(self.covariance))
        scale = np.where(scale > 0.0, scale, 1.0)
        values, vectors = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        factor: Float = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        object.__setattr__(self, "_factor", factor)
        return factor


@dataclass(frozen=True, slots=True)
class SpotRows:
    """The n spots of one camera in some looks, with derivatives."""

    look: Int
    led: Int
    """`look`, `led`: (n,)."""
    uv: Pixels
    residuals: Pixels
    """`uv`, `residuals`: (n, 2), px: position, and as in `ResidualSample`."""
    white_px: Float
    pattern_px: Float
    """`white_px`, `pattern_px`: (n,): standard deviations, as in `ResidualSample`."""
    by_pose: Float
    """(n, 2, 6): by rotation about the ball (rad), shift of the ball (mm), world."""
    by_camera: Float
    """(n, 2, 14): in the order of `camera.model.PARAMETERS`."""
    by_led: Float
    """(n, 2, 3): place of the LED, mm, probe frame."""


def spot_rows(looks: Sequence[ResidualSample], rig: Rig, body: ProbeBody, c: int) -> SpotRows:
    """Return the spots of camera ``c`` in the looks."""
    camera = rig.cameras[c]
    residuals = np.stack([look.residuals[c] for look in looks])
    k, led = np.nonzero(np.isfinite(residuals[..., 0]))
    points = leds_world_of(looks, body)[k, led]
    d_point, d_parameters = projection_jacobians(camera, points)
    rotations = np.stack([look.rotation_world_from_probe for look in looks])
    arms = points - tips_world(looks, body)[k]
    return SpotRows(
        look=k.astype(np.int64), led=led.astype(np.int64), uv=project(camera, points),
        residuals=residuals[k, led], white_px=np.array([look.white_px for look in looks])[k],
        pattern_px=np.stack([look.pattern_px[c] for look in looks])[k, led],
        by_pose=np.concatenate([np.cross(arms[:, None], d_point), d_point], axis=2),
        by_camera=d_parameters, by_led=d_point @ rotations[k],
    )  # fmt: skip


def spot_weights(spots: SpotRows, pattern_length_px: float, floor_px: float) -> Float:
    """Return the inverse covariance (n, n), 1/px², per axis; LinAlgError if not definite."""
    n = len(spots.look)
    # Two buffers reused: this runs twice a second during measuring, and allocating arrays of this
    # size, or summing over pairs, would take longer than the computation.
    u, v = spots.uv.T
    covariance, other = u[:, None] - u, v[:, None] - v
    covariance *= covariance
    other *= other
    covariance += other
    covariance *= -0.5 / pattern_length_px**2
    np.exp(covariance, out=covariance)
    covariance *= np.multiply.outer(spots.pattern_px, spots.pattern_px, out=other)
    covariance += np.multiply(np.equal.outer(spots.led, spots.led), floor_px**2, out=other)
    diagonal = np.arange(n)
    covariance[diagonal, diagonal] += spots.white_px**2
    upper, failed = dpotrf(covariance.T, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError(f"The covariance of {n} spots is not positive definite.")
    # Inverting from the factor takes a third of the work of solving for every column of one.
    half, _ = dpotri(upper, overwrite_c=1)
    half[diagonal, diagonal] *= 0.5
    weights: Float = half + half.T
    return weights


def camera_changes(camera: CameraModel) -> Float:
    """Return d(`camera.model.PARAMETERS`)/d(`CAMERA_CHANGES`), (14, 9)."""
    columns = np.zeros((N_PARAMETERS, len(CAMERA_CHANGES)))
    # The parameters turn the scene about the world origin; a rotation of the camera about its
    # projection centre is the inverse and also changes the translation.
    columns[0:3, 0:3] = -np.eye(3)
    columns[3:6, 0:3] = skew(camera.T_camera_from_world.translation)
    columns[3:6, 3:6] = -np.eye(3)
    columns[6, 6] = columns[8, 7] = columns[9, 8] = 1.0
    return columns


def tips_world(looks: Sequence[ResidualSample], body: ProbeBody) -> Float:
    """Return the ball position of each look from its pose, (K, 3), mm, world."""
    return np.stack(
        [look.rotation_world_from_probe @ body.tip_probe + look.origin_world for look in looks]
    )
