"""How the uncertainties of cameras hang together that were calibrated with the same points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocmm_core.calibration.cameras._lens import by_point, project_with_jacobian
from ocmm_core.calibration.cameras._model_fit import CameraFit
from ocmm_core.calibration.cameras._problem import whitening_of
from ocmm_core.calibration.cameras._reference_points import KnownPoints
from ocmm_core.camera import N_PARAMETERS
from ocmm_core.geometry import Float, Int


def own_covariance(fit: CameraFit, points: KnownPoints) -> Float:
    """Return the covariance (14, 14) of one camera by itself.

    It grows by chi-square per degree of freedom where that is above one, and never shrinks.
    """
    stretch = _stretch(fit, points)
    own: Float = fit.covariance * max(1.0, fit.chi2 / fit.dof) + np.outer(stretch, stretch)
    return own


def joint_covariance(
    fits: Sequence[CameraFit], indices: Sequence[Int], points: KnownPoints
) -> Float:
    """Return the covariance (14 C, 14 C) of all cameras.

    A reference point that is wrong by d moves the parameters of every camera that used it by
    -C J' W Jp d, where C is the camera's covariance; the product of two cameras' gains times the
    variance of d is what they have in common. So is a length of the list that is wrong.

    Parameters
    ----------
    indices
        Which of the points each camera saw.
    """
    count = len(fits)
    covariance = np.zeros((N_PARAMETERS * count,) * 2)
    gains = np.zeros((count, N_PARAMETERS, len(points.names), 3))
    stretches = [_stretch(fit, points) for fit in fits]
    for c, (fit, seen) in enumerate(zip(fits, indices, strict=True)):
        part = slice(c * N_PARAMETERS, (c + 1) * N_PARAMETERS)
        covariance[part, part] = own_covariance(fit, points)
        gains[c][:, seen[fit.used]] = _reference_gain(fit)
    for a in range(count):
        for b in range(a + 1, count):
            common = points.sigma**2 * np.einsum("pni,qni->pq", gains[a], gains[b])
            common += np.outer(stretches[a], stretches[b])
            rows, columns = (slice(c * N_PARAMETERS, (c + 1) * N_PARAMETERS) for c in (a, b))
            covariance[rows, columns] = common
            covariance[columns, rows] = common.T
    return covariance


def _stretch(fit: CameraFit, points: KnownPoints) -> Float:
    """Return how a camera's parameters (14,) move when all lengths of the list grow by one sigma.

    The spots stay the same when the camera moves away in the same ratio; the middle of the points
    stays where it is.
    """
    move = np.zeros(N_PARAMETERS)
    pose = fit.camera.model.T_camera_from_world
    move[3:6] = points.length_sigma * pose.apply(points.positions_world.mean(axis=0))
    return move


def _reference_gain(fit: CameraFit) -> Float:
    """Return d(parameters)/d(reference position), (14, n, 3), of the used points."""
    points = fit.points_world[fit.used]
    whitening = whitening_of(fit.camera, points, fit.sigma_px, fit.reference_sigma)
    rows = project_with_jacobian(fit.camera, points, N_PARAMETERS, whitening=whitening).rows
    gain: Float = -np.einsum(
        "pq,qun,uin->pni", fit.covariance, rows, by_point(fit.camera, rows), optimize=True
    )
    return gain
