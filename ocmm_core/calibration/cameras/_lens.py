"""Camera with three extra lens terms, to test whether they are needed.

k3 (radial, r^6) and the thin prism s1, s2 (Weng 1992) extend the running model (`camera.model`: k1,
k2, p1, p2). A camera that needs them is refused (`guards`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ocmm_core.calibration.cameras._kernel import project_points_with_jacobian
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel
from ocmm_core.geometry import Float, Pixels, Points3

EXTRA_TERMS = ("k3", "s1", "s2")
"""Radial, mm^-6; thin prism along x and y, mm^-1."""

ALL_PARAMETERS = (*PARAMETERS, *EXTRA_TERMS)


@dataclass(frozen=True, slots=True)
class LensCamera:
    """A camera model with the extra terms."""

    model: CameraModel
    extra: Float = field(default_factory=lambda: np.zeros(len(EXTRA_TERMS)))
    """(3,), in the order of `EXTRA_TERMS`."""

    def moved(self, change: Float) -> LensCamera:
        """Return this camera with ``change`` (17,), in the order of `ALL_PARAMETERS`, added."""
        return LensCamera(
            self.model.perturbed(change[:N_PARAMETERS]), self.extra + change[N_PARAMETERS:]
        )

    def packed(self) -> Float:
        """Return the parameters in kernel form, (24,)."""
        return np.concatenate([self.model.packed(), self.extra])


@dataclass(frozen=True, slots=True)
class ProjectedPoints:
    """Residuals of projected points with derivatives."""

    residuals: Float
    """(2, n): u and v of predicted minus observed, whitened; infinite behind the camera."""
    rows: Float
    """(terms, 2, n): derivatives in the order of `ALL_PARAMETERS`."""


def project_with_jacobian(
    camera: LensCamera,
    points_world: Points3,
    terms: int = len(ALL_PARAMETERS),
    uv: Pixels | None = None,
    whitening: Float | None = None,
) -> ProjectedPoints:
    """Return the pixels of world points (n, 3), mm, and their derivatives.

    By the first ``terms`` (14 to 17) parameters. ``uv`` (n, 2), px, is subtracted; ``whitening``
    (3, n), 1/px, as in `_model_fit.CameraProblem`, default plain pixels.
    """
    n = len(points_world)
    if uv is None:
        uv = np.zeros((n, 2))
    if whitening is None:
        whitening = np.ones((3, n))
        whitening[1] = 0.0
    residuals, rows = np.empty((2, n)), np.empty((terms, 2, n))
    # Data from files may have another byte order, which the kernel refuses.
    points = np.ascontiguousarray(points_world, dtype=np.float64)
    spots = np.ascontiguousarray(uv, dtype=np.float64)
    project_points_with_jacobian(camera.packed(), points, spots, whitening, residuals, rows)
    return ProjectedPoints(residuals, rows)


def by_point(camera: LensCamera, rows: Float) -> Float:
    """Return d/d(point), (2, 3, n), 1/mm, world: rows of the camera's shift, rotated."""
    rotation = camera.model.T_camera_from_world.rotation
    moved: Float = np.einsum("aun,ab->ubn", rows[3:6], rotation)
    return moved


def project_extended(camera: LensCamera, points_world: Points3) -> Pixels:
    """Return the pixel coordinates (n, 2) of world points (n, 3), mm; infinite behind it."""
    return project_with_jacobian(camera, points_world, N_PARAMETERS).residuals.T
