"""Residuals of one camera at known points, for the least-squares engine."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.cameras._lens import (
    ALL_PARAMETERS,
    LensCamera,
    by_point,
    project_extended,
    project_with_jacobian,
)
from ocmm_core.camera import N_PARAMETERS, PARAMETERS
from ocmm_core.geometry import Float, Pixels, Points3

BEHIND_PX = 1e9


@dataclass(frozen=True, slots=True)
class CameraProblem:
    """Reference points, their spots, and uncertainties."""

    points_world: Points3
    uv: Pixels
    """`points_world`, `uv`: (n, 3), mm, and (n, 2), px."""
    whitening: Float
    """(3, n), 1/px: triangle (00, 10, 11) that scales residuals to unit variance, weighted."""
    free: tuple[int, ...]
    """Indices into `ALL_PARAMETERS` of the fitted parameters; the others are fixed."""

    def linearise(self, state: LensCamera) -> tuple[Float, Float]:
        """Return whitened residuals (2n,), predicted minus observed, all u first; (2n, p)."""
        terms = max(N_PARAMETERS, self.free[-1] + 1)
        seen = project_with_jacobian(state, self.points_world, terms, self.uv, self.whitening)
        rows = seen.rows if terms == len(self.free) else seen.rows[list(self.free)]
        return seen.residuals.reshape(-1), rows.reshape(len(self.free), -1).T

    def miss(self, state: LensCamera) -> Pixels:
        """Return predicted minus observed, (n, 2), px."""
        return project_extended(state, self.points_world) - self.uv

    def distances(self, miss: Pixels) -> Float:
        """Return the whitened length (n,) of each point's residual (n, 2), px."""
        u, v = np.where(np.isfinite(miss), miss, BEHIND_PX).T
        first, across, second = self.whitening
        distances: Float = np.hypot(first * u, across * u + second * v)
        return distances

    def moved(self, state: LensCamera, step: Float) -> LensCamera:
        """Return the camera after a step (p,) of the free parameters."""
        change = np.zeros(len(ALL_PARAMETERS))
        change[list(self.free)] = step
        return state.moved(change)

    def scaled(self, factors: Float) -> CameraProblem:
        return replace(self, whitening=self.whitening * factors)


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
    """Return the whitening (3, n), 1/px, for uncertain spots and reference points.

    An error ``reference_sigma`` (mm per axis) moves a spot by d(pixel)/d(point). Each point occurs
    once in this fit, so the sum is to first order the fit with unknown points (errors in
    variables).
    """
    n = len(points_world)
    whitening = np.zeros((3, n))
    if reference_sigma == 0.0:
        whitening[0] = whitening[2] = 1.0 / sigma_px
        return whitening
    u, v = by_point(camera, project_with_jacobian(camera, points_world, N_PARAMETERS).rows)
    variance_u = sigma_px**2 + reference_sigma**2 * np.einsum("in,in->n", u, u)
    variance_v = sigma_px**2 + reference_sigma**2 * np.einsum("in,in->n", v, v)
    common = reference_sigma**2 * np.einsum("in,in->n", u, v)
    # Inverse of the lower Cholesky factor, written out.
    first = np.sqrt(variance_u)
    across = common / first
    second = np.sqrt(variance_v - across**2)
    whitening[0] = 1.0 / first
    whitening[1] = -across / (first * second)
    whitening[2] = 1.0 / second
    return whitening
