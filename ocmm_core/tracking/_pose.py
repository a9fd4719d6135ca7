"""Spots to pose and tip: `solve` calls the kernel; derivatives in plain numpy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import Rig, distortion_jacobian, ideal_from_pixels
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking._body import ProbeBody
from ocmm_core.tracking.kernels import MAX_TIP_SIGMA, allocate, solve_frames

Method = Literal["gauss-newton", "thesis"]


@dataclass(frozen=True, slots=True)
class PoseBatch:
    """Pose and tip of n frames; NaN if the status is not 0 (OK)."""

    status: NDArray[np.uint8]
    """(n,) uint8: 0 solved, 1 lost (fewer than three LEDs seen by two cameras, LEDs so close to one
    line that spot noise alone moves the tip by `kernels.MAX_TIP_SIGMA`, or the limit of a tracker,
    or an LED behind a camera that sees it)."""
    tip_world: Float
    """(n, 3), mm."""
    tip_covariance: Float
    """(n, 3, 3), mm^2, for independent spot noise of the given sigma."""
    rotation_world_from_probe: Float
    origin_world: Float
    """`rotation_world_from_probe`, `origin_world`: (n, 3, 3) and (n, 3), mm."""
    chi2: Float
    """(n,): squared residuals over sigma squared."""
    dof: Int
    """(n,): twice the number of spots minus six; with the markers of a tracker three each."""


def solve(
    uv: Float, rig: Rig, body: ProbeBody, sigma_px: float, method: Method = "gauss-newton"
) -> PoseBatch:
    """Return pose, tip, covariance and chi-square of every frame.

    ``uv`` (n, C, L, 2), px by LED number, NaN if unseen; ``sigma_px``: standard deviation of a
    spot, each axis. ``"gauss-newton"``: one step on all reprojection residuals after the rigid fit,
    which reaches the Cramer-Rao bound; ``"thesis"``: unweighted rigid fit of triangulated targets
    (thesis 2.4), for comparison. Its covariance is that of the former, hence too small.
    """
    return solve_leds(uv, rig, body.leds_probe, body.tip_probe, sigma_px, method)


def solve_leds(
    uv: Float, rig: Rig, leds: Float, point: Float, sigma_px: float, method: Method = "gauss-newton"
) -> PoseBatch:
    """Return `solve` for LEDs (L, 3) and any point (3,) fixed to them, mm."""
    require_spots(uv, rig, len(leds))
    outputs = allocate(len(uv))
    steps = 0 if method == "thesis" else 1
    # A tracker has a limit of its own, if it is coarser than cameras.
    most = max(MAX_TIP_SIGMA, 0.0 if rig.markers is None else rig.markers.most_tip_sigma)
    solve_frames(
        np.ascontiguousarray(uv), rig.packed(), leds, point, sigma_px, most, steps, *outputs
    )
    batch = PoseBatch(*outputs)
    if rig.markers is None:
        return batch
    return replace(batch, dof=np.where(batch.status == 0, independent(rig, batch.dof), 0))


def independent(rig: Rig, dof: Int) -> Int:
    """Return the degrees of freedom of poses whose ``dof`` counts two coordinates a spot."""
    return dof if rig.markers is None else (dof + 6) // 2 * rig.per_spot - 6


def require_spots(uv: Float, rig: Rig, n_leds: int) -> None:
    """Raise TrackingError unless spots (n, C, L, 2) have the cameras of a rig and as many LEDs.

    Compiled functions would read and write out of bounds.
    """
    if uv.shape[1:] != (len(rig.cameras), n_leds, 2):
        raise TrackingError(
            "tracking.shape",
            f"Spots of {' x '.join(map(str, uv.shape[1:]))} numbers do not belong to "
            f"{len(rig.cameras)} cameras and {n_leds} LEDs.",
            "Use the rig and the body that they were taken with.",
        )


def triangulate(rig: Rig, spots: Float) -> Float:
    """Return the LED positions (L, 3), mm, world, from spots (C, L, 2), px.

    NaN if seen by fewer than two cameras. Thesis 2.4.1 with homogeneous rows (errata).
    """
    positions = np.full((spots.shape[1], 3), np.nan)
    for led in range(spots.shape[1]):
        rows, rhs = [], []
        for camera, uv in zip(rig.cameras, spots[:, led], strict=True):
            if not np.isfinite(uv).all():
                continue
            ideal = ideal_from_pixels(camera, uv)
            pose = camera.T_camera_from_world
            for axis in range(2):
                rows.append(ideal[axis] * pose.rotation[2] - camera.focal * pose.rotation[axis])
                t = pose.translation
                rhs.append(camera.focal * t[axis] - ideal[axis] * t[2])
        if len(rows) >= 4:
            positions[led] = np.linalg.lstsq(np.array(rows), np.array(rhs))[0]
    return positions


def reprojection(
    rig: Rig, leds: Float, spots: Float, rotation: Float, origin: Float
) -> tuple[Float, Float]:
    """Return residuals (m,), px, and their derivative (m, 6) by the pose, spot by spot.

    The LEDs (L, 3), mm, are in the body frame at ``rotation`` and ``origin``. The pose increments
    are a rotation vector (rad, world axes, about the origin of the body) and a translation (mm).
    Order: camera by camera, LED by LED, u before v. Residuals are formed on the ideal image and
    scaled to pixels by the derivative of the distortion.
    """
    residuals, rows = [], []
    arms_of_all = leds @ rotation.T
    for camera, camera_spots in zip(rig.cameras, spots, strict=True):
        seen = np.isfinite(camera_spots).all(axis=1)
        arms = arms_of_all[seen]
        in_camera = camera.T_camera_from_world.apply(arms + origin)
        depth = in_camera[:, 2]
        ideal = ideal_from_pixels(camera, camera_spots[seen])
        predicted = camera.focal * in_camera[:, :2] / depth[:, None]
        slope = np.array([[camera.sx], [camera.sy]]) * distortion_jacobian(camera, ideal)
        pinhole = np.zeros((len(arms), 2, 3))
        pinhole[:, 0, 0] = pinhole[:, 1, 1] = camera.focal / depth
        pinhole[:, :, 2] = -predicted / depth[:, None]
        d_point = slope @ pinhole @ camera.T_camera_from_world.rotation
        d_turn = np.cross(arms[:, None], d_point)
        residuals.append(np.einsum("nij,nj->ni", slope, ideal - predicted).ravel())
        rows.append(np.concatenate([d_turn, d_point], axis=2).reshape(-1, 6))
    return np.concatenate(residuals), np.concatenate(rows)


def arm_jacobian(arm_world: Float) -> Float:
    """Return d(point)/d(pose), (..., 3, 6), of an arm, mm: rotation w moves it by -skew(arm) w."""
    x, y, z = np.moveaxis(arm_world, -1, 0)
    by_pose = np.zeros((*arm_world.shape[:-1], 3, 6))
    by_pose[..., 0, 1], by_pose[..., 0, 2] = z, -y
    by_pose[..., 1, 0], by_pose[..., 1, 2] = -z, x
    by_pose[..., 2, 0], by_pose[..., 2, 1] = y, -x
    by_pose[..., :, 3:] = np.eye(3)
    return by_pose
