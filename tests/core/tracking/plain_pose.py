"""Poses in plain numpy, which the compiled kernel is compared with."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, rigid_fit, rotation_from_vector
from ocmm_core.tracking import ProbeBody
from ocmm_core.tracking._pose import Method, PoseBatch, arm_jacobian, reprojection, triangulate
from ocmm_core.tracking.kernels import LOST, MAX_TIP_SIGMA, OK, allocate


def solve_reference(
    uv: Float, rig: Rig, body: ProbeBody, sigma_px: float, method: Method = "gauss-newton"
) -> PoseBatch:
    """Return `solve`, frame by frame in plain numpy."""
    outputs = PoseBatch(*allocate(len(uv)))
    for frame, spots in enumerate(uv):
        _solve_frame(frame, spots, rig, body, sigma_px, method, outputs)
    return outputs


def _solve_frame(
    frame: int, spots: Float, rig: Rig, body: ProbeBody, sigma_px: float, method: Method,
    out: PoseBatch,
) -> None:  # fmt: skip
    for array in (
        out.tip_world, out.tip_covariance, out.rotation_world_from_probe, out.origin_world, out.chi2
    ):  # fmt: skip
        array[frame] = np.nan
    out.status[frame], out.dof[frame] = LOST, 0
    positions = triangulate(rig, spots)
    located = np.isfinite(positions).all(axis=1)
    if np.count_nonzero(located) < 3:
        return
    rotation, origin = rigid_fit(body.leds_probe[located], positions[located])
    leds_world = body.leds_probe @ rotation.T + origin
    for camera, camera_spots in zip(rig.cameras, spots, strict=True):
        seen = np.isfinite(camera_spots).all(axis=1)
        if np.any(camera.T_camera_from_world.apply(leds_world[seen])[:, 2] <= 0.0):
            return
    residuals, rows = reprojection(rig, body.leds_probe, spots, rotation, origin)
    information = rows.T @ rows
    squares = float(residuals @ residuals)
    # LEDs on one line leave a pose undetermined.
    if np.linalg.matrix_rank(information) < 6:
        return
    covariance = np.linalg.inv(information)
    if method != "thesis":
        gradient = rows.T @ residuals
        step = covariance @ gradient
        squares -= float(gradient @ step)
        rotation = rotation_from_vector(step[:3]) @ rotation
        origin = origin + step[3:]
    to_tip = arm_jacobian(rotation @ body.tip_probe)
    tip_covariance = sigma_px**2 * to_tip @ covariance @ to_tip.T
    if not np.trace(tip_covariance) <= MAX_TIP_SIGMA**2:
        return
    out.status[frame] = OK
    out.tip_world[frame] = rotation @ body.tip_probe + origin
    out.tip_covariance[frame] = tip_covariance
    out.rotation_world_from_probe[frame] = rotation
    out.origin_world[frame] = origin
    out.chi2[frame] = max(squares, 0.0) / sigma_px**2
    out.dof[frame] = len(residuals) - 6
