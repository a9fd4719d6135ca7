"""How well cameras measure lengths, from their covariance alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import N_PARAMETERS, Rig, on_sensor, project, projection_jacobians
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3

_TRIES = 100_000


def random_lines(volume_world: Float, length: float, lines: int, seed: int) -> Float:
    """Return ends (lines, 2, 3), mm, of uniformly random lines in a box (2, 3), mm.

    CalibrationError if the box is too small for the length.
    """
    rng = np.random.default_rng(seed)
    low, high = volume_world
    directions = rng.standard_normal((_TRIES, 3))
    arms = 0.5 * length * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    centres = low + rng.random((_TRIES, 3)) * (high - low)
    inside = np.minimum(centres - np.abs(arms) - low, high - centres - np.abs(arms)).min(axis=1)
    fits = np.flatnonzero(inside >= 0.0)[:lines]
    if len(fits) < lines:
        raise CalibrationError(
            "relocation.small_volume",
            f"A length of {length:g} mm does not fit into the volume of "
            f"{' x '.join(f'{side:.0f}' for side in high - low)} mm.",
            "Use a shorter length, or a larger volume.",
        )
    return np.stack([(centres - arms)[fits], (centres + arms)[fits]], axis=1)


def length_sigma(
    rig: Rig, volume_world: Float, length: float = 400.0, lines: int = 200, seed: int = 0
) -> float:
    """Return the RMS standard deviation, mm, that the cameras' covariance gives to lengths.

    At fixed random places in the volume (2, 3), mm, without spot noise: the error after any
    averaging. CalibrationError if the volume is too small, or two cameras see none of the lines.
    """
    ends = random_lines(volume_world, length, lines, seed)
    gains, _, seen = location_gains(rig, ends.reshape(-1, 3))
    whole = seen.reshape(-1, 2).all(axis=1)
    if not whole.any():
        raise CalibrationError(
            "relocation.no_common_volume",
            "No length in the volume is seen by two cameras from end to end.",
            "Aim the cameras at one common volume.",
        )
    ends, gains = ends[whole], gains.reshape(-1, 2, *gains.shape[1:])[whole]
    along = (ends[:, 1] - ends[:, 0]) / length
    rows = np.einsum("ni,nip->np", along, gains[:, 1] - gains[:, 0])
    variances = np.einsum("np,pq,nq->n", rows, rig.parameter_covariance, rows, optimize=True)
    return float(np.sqrt(np.mean(variances)))


def location_gains(rig: Rig, points: Points3) -> tuple[Float, Float, NDArray[np.bool_]]:
    """Return how located points move with the cameras' parameters, and with the spots.

    d(point)/d(parameters), (n, 3, 14 C); covariances, (n, 3, 3), mm^2 / px^2, for a spot sigma of 1
    px; seen by two cameras, (n,): if not, the others are zero and NaN.
    """
    n, count = len(points), len(rig.cameras)
    by_point = np.zeros((n, count, 2, 3))
    by_parameters = np.zeros((n, count, 2, N_PARAMETERS))
    views = np.zeros(n, dtype=np.int64)
    for c, camera in enumerate(rig.cameras):
        sees = on_sensor(camera, project(camera, points))
        by_point[sees, c], by_parameters[sees, c] = projection_jacobians(camera, points[sees])
        views += sees
    seen = views >= 2
    gains = np.zeros((n, 3, count * N_PARAMETERS))
    covariances = np.full((n, 3, 3), np.nan)
    stacked = by_point[seen].reshape(-1, 2 * count, 3)
    covariances[seen] = np.linalg.inv(stacked.transpose(0, 2, 1) @ stacked)
    # Each camera's spots depend on its own parameters only.
    located = -np.einsum(
        "nij,ncuj,ncup->nicp", covariances[seen], by_point[seen], by_parameters[seen]
    )
    gains[seen] = located.reshape(-1, 3, count * N_PARAMETERS)
    return gains, covariances, seen
