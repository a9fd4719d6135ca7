"""The residuals of one camera that looks at known points, for the least-squares engine."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.lens import (
    ALL_PARAMETERS,
    LensCamera,
    extended_jacobians,
    project_extended,
)
from ocmm_core.camera.model import N_PARAMETERS, PARAMETERS
from ocmm_core.geometry import Float, Pixels, Points3


@dataclass(frozen=True, slots=True)
class CameraProblem:
    """Known points, their spots, and how far each can be wrong.

    Attributes
    ----------
    points_world, uv
        (n, 3), mm, and (n, 2), px.
    whitening
        (n, 2, 2), 1/px: brings a residual to unit variance; rows of points that are left out or
        weighted down are scaled down.
    free
        Indices into `ALL_PARAMETERS` of what is fitted; the rest stays at its start.
    """

    points_world: Points3
    uv: Pixels
    whitening: Float
    free: tuple[int, ...]

    def linearise(self, state: LensCamera) -> tuple[Float, Float]:
        """Return whitened residuals (2n,), predicted minus observed, and derivatives (2n, p)."""
        miss = project_extended(state, self.points_world) - self.uv
        if not np.isfinite(miss).all():
            return np.full(miss.size, np.inf), np.zeros((miss.size, len(self.free)))
        extra = self.free[-1] >= N_PARAMETERS or bool(state.extra.any())
        _, d_parameters = extended_jacobians(state, self.points_world, extra)
        if self.free != tuple(range(d_parameters.shape[2])):
            d_parameters = d_parameters[:, :, self.free]
        residuals = (self.whitening @ miss[:, :, None])[:, :, 0]
        jacobian = self.whitening @ d_parameters
        return residuals.ravel(), jacobian.reshape(-1, len(self.free))

    def moved(self, state: LensCamera, step: Float) -> LensCamera:
        """Return the camera after ``step`` (p,) of what is free."""
        change = np.zeros(len(ALL_PARAMETERS))
        change[list(self.free)] = step
        return state.moved(change)

    def scaled(self, factors: Float) -> CameraProblem:
        """Return the problem with every point's residual multiplied by its factor (n,)."""
        return replace(self, whitening=self.whitening * factors[:, None, None])


def free_parameters(extra_terms: tuple[str, ...] = ()) -> tuple[int, ...]:
    """Return the indices of the running model's parameters and of the named extra terms."""
    return tuple(
        index
        for index, name in enumerate(ALL_PARAMETERS)
        if name in PARAMETERS or name in extra_terms
    )


def whitening_of(
    camera: LensCamera, points_world: Points3, sigma_px: float, reference_sigma: float
) -> Float:
    """Return the whitening (n, 2, 2), 1/px, for uncertain spots and uncertain reference points.

    A reference point that is wrong by ``reference_sigma`` (mm, each axis, independent) moves its
    spot by d(pixel)/d(point). In the fit of one camera each point occurs once, so weighting with
    this sum is, to first order, the fit with the points as unknowns (errors in variables).
    """
    n = len(points_world)
    if reference_sigma == 0.0:
        return np.broadcast_to(np.eye(2) / sigma_px, (n, 2, 2))
    d_point, _ = extended_jacobians(camera, points_world, bool(camera.extra.any()))
    spread = reference_sigma**2 * (d_point @ d_point.transpose(0, 2, 1))
    spread += sigma_px**2 * np.eye(2)
    # Inverse of the lower Cholesky factor, written out.
    first = np.sqrt(spread[:, 0, 0])
    across = spread[:, 1, 0] / first
    second = np.sqrt(spread[:, 1, 1] - across**2)
    whitening = np.zeros((n, 2, 2))
    whitening[:, 0, 0] = 1.0 / first
    whitening[:, 1, 0] = -across / (first * second)
    whitening[:, 1, 1] = 1.0 / second
    return whitening
