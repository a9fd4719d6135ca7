"""Known points and their spots, for the tests of calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.calibration.cameras import KnownPoints, SpotTable
from ocmm_core.camera import CameraModel, Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Points3

SIGMA_PX = 0.0105
EDGE_MM = 12.288
"""Half a sensor side, at which the distortion in per cent is stated."""


def rig() -> Rig:
    return load_rig(resource("rigs", "thesis.toml"))


def distorted(camera: CameraModel, per_cent: float) -> CameraModel:
    """Return the camera with this distortion at the edge of the sensor."""
    k2 = 2e-8
    return replace(camera, k1=0.01 * per_cent / EDGE_MM**2 - k2 * EDGE_MM**2, k2=k2)


def slab(n: int, depth: float, rng: np.random.Generator) -> Points3:
    """Return points (n, 3), mm, in 400 x depth x 400 mm."""
    points: Points3 = rng.uniform(-0.5, 0.5, (n, 3)) * [400.0, depth, 400.0]
    return points


def observe(
    rig: Rig,
    n: int,
    depth: float,
    seed: int,
    sigma_px: float = SIGMA_PX,
    reference_sigma: float = 0.0,
) -> tuple[KnownPoints, SpotTable]:
    """Return points as a CMM lists them, with its errors, and their noisy spots."""
    rng = np.random.default_rng(seed)
    truth = slab(n, depth, rng)
    uv = np.stack([project(camera, truth) for camera in rig.cameras])
    uv += sigma_px * rng.standard_normal(uv.shape)
    listed = truth + reference_sigma * rng.standard_normal(truth.shape)
    names = tuple(f"P{index:03d}" for index in range(n))
    serials = tuple(camera.serial for camera in rig.cameras)
    return (KnownPoints(names, listed, reference_sigma, "CMM"), SpotTable(serials, uv, sigma_px))
