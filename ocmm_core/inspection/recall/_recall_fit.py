"""Fit of a calibration to the raw spots of a job, point by point.

Residuals have three reasons: poses of the probe, parameter errors within their covariance, and
noise. The rest is a chi-square (generalised least squares with a prior; GUM 5.2.2 and Searle,
Linear Models, 2.5). A calibration that does not describe the cameras leaves more than noise; after
a movement without effect on residuals both calibrations fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.camera import N_PARAMETERS, Rig, project, projection_jacobians
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tracking import PoseBatch, ProbeBody, solve, spot_sigma_px


@dataclass(frozen=True, slots=True)
class Misfit:
    """Misfit of one calibration over n points, in their order."""

    poses: PoseBatch
    first: Float
    last: Float
    """`first`, `last`: (n + 1,): chi-square of points before, and from, each index on."""
    dof: Float
    """(n + 1,): degrees of freedom of the points before each index."""
    alike: float
    """Mean number of spots that share one error (>= 1): divides the number of observations."""

    @property
    def whole(self) -> float:
        return float(self.last[0])


def misfit_of(
    points: Sequence[MeasuredPoint], rig: Rig, body: ProbeBody, scale: float = 1.0
) -> Misfit:
    """Return the fit of points to a calibration; TrackingError if a pose is undetermined.

    `points`: one or more. `scale`: of the spots' noise, in standard deviations: the calibration's
    own residual beyond the noise of the rig.
    """
    spots = np.stack([point.spots for point in points])
    poses = solve(spots, rig, body, spot_sigma_px(rig))
    if np.any(poses.status):
        lost = points[int(np.flatnonzero(poses.status)[0])].number
        raise TrackingError(
            "tracking.targets",
            f"The spots of point {lost} do not determine a pose.",
            "Take the point again.",
        )
    frames = np.array([point.n_frames for point in points], dtype=np.float64)
    sigma = scale * np.sqrt(rig.noise.white_px**2 / frames + rig.noise.pattern_px**2)
    residuals, by_pose, by_prior = _rows(spots, poses, rig, body)
    factor = _factor(rig, body)
    n, width = len(points), factor.shape[1]
    normal, right, squares = np.zeros((n, width, width)), np.zeros((n, width)), np.zeros(n)
    dof = np.zeros(n)
    for index in range(n):
        seen = np.isfinite(residuals[index])
        rest = residuals[index, seen] / sigma[index]
        # Changes explained by the pose prove nothing about the cameras.
        basis, _ = np.linalg.qr(by_pose[index, seen])
        rows = (by_prior[index, seen] @ factor) / sigma[index]
        rest = rest - basis @ (basis.T @ rest)
        rows = rows - basis @ (basis.T @ rows)
        normal[index], right[index] = rows.T @ rows, rows.T @ rest
        squares[index], dof[index] = float(rest @ rest), np.count_nonzero(seen) - 6
    zero = np.zeros(1)
    return Misfit(
        poses=poses,
        first=_courses(normal, right, squares),
        last=_courses(normal[::-1], right[::-1], squares[::-1])[::-1],
        dof=np.concatenate([zero, np.cumsum(dof)]),
        alike=_alike(spots, rig),
    )


def _rows(spots: Float, poses: PoseBatch, rig: Rig, body: ProbeBody) -> tuple[Float, Float, Float]:
    """Return residuals (n, m), px, NaN if unseen, and derivatives by pose, cameras and LEDs."""
    n, cameras, leds, _ = spots.shape
    turned = np.einsum("nij,lj->nli", poses.rotation_world_from_probe, body.leds_probe)
    world = turned + poses.origin_world[:, None]
    residuals = np.empty((n, cameras, leds, 2))
    by_pose = np.empty((n, cameras, leds, 2, 6))
    by_prior = np.zeros((n, cameras, leds, 2, N_PARAMETERS * cameras + 3 * leds))
    for c, camera in enumerate(rig.cameras):
        residuals[:, c] = spots[:, c] - project(camera, world)
        jacobian, parameters = projection_jacobians(camera, world.reshape(-1, 3))
        d_point = jacobian.reshape(n, leds, 2, 3)
        by_pose[:, c, :, :, :3] = np.cross(turned[:, :, None], d_point)
        by_pose[:, c, :, :, 3:] = d_point
        own = slice(c * N_PARAMETERS, (c + 1) * N_PARAMETERS)
        by_prior[:, c, :, :, own] = parameters.reshape(n, leds, 2, N_PARAMETERS)
        of_leds = np.einsum("nlai,nij->nlaj", d_point, poses.rotation_world_from_probe)
        for led in range(leds):
            place = N_PARAMETERS * cameras + 3 * led
            by_prior[:, c, led, :, place : place + 3] = of_leds[:, led]
    rows = 2 * cameras * leds
    return (residuals.reshape(n, rows), by_pose.reshape(n, rows, 6), by_prior.reshape(n, rows, -1))


def _factor(rig: Rig, body: ProbeBody) -> Float:
    """Return F with F F' the covariance of the parameters of all cameras and of the LEDs."""
    leds = body.leds_probe.size
    size = len(rig.parameter_covariance)
    covariance = np.zeros((size + leds, size + leds))
    covariance[:size, :size] = rig.parameter_covariance
    covariance[size:, size:] = body.geometry_covariance[:leds, :leds]
    # Angles, pixels and polynomial terms differ by powers of ten.
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    factor: Float = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return factor


def _courses(normal: Float, right: Float, squares: Float) -> Float:
    """Return the chi-square of the first 0, 1, ... n points, the parameters free in their prior."""
    n, width = right.shape
    found = np.zeros(n + 1)
    sum_normal, sum_right, total = np.eye(width), np.zeros(width), 0.0
    for index in range(n):
        sum_normal += normal[index]
        sum_right += right[index]
        total += squares[index]
        found[index + 1] = total - float(sum_right @ np.linalg.solve(sum_normal, sum_right))
    return found


def _alike(spots: Float, rig: Rig) -> float:
    """Return the mean sum of correlations of a spot with all spots of its camera.

    The variance of a mean of n equal errors with this correlation is this multiple of that of n
    independent ones: n spots are worth n divided by this.
    """
    noise = rig.noise
    if noise.pattern_px <= 0.0:
        return 1.0
    sums = []
    for c in range(spots.shape[1]):
        uv = spots[:, c].reshape(-1, 2)
        uv = uv[np.isfinite(uv).all(axis=1)]
        apart = np.sum((uv[:, None] - uv[None]) ** 2, axis=2)
        sums.append(np.exp(-0.5 / noise.pattern_length_px**2 * apart).sum(axis=1))
    return float(np.concatenate(sums).mean())
