"""What calibrations of the thesis rig are worth, by their depth, for tests and benchmarks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.calibration.cameras import calibrate_rig
from ocmm_core.calibration.cameras._network import located_errors, split, subset
from ocmm_core.camera import PARAMETERS, Rig, project
from ocmm_core.geometry import Float
from ocmm_core.tracking import triangulate
from tests.core.calibration.known_points import SIGMA_PX, observe, rig, slab
from tests.core.calibration.predicted_errors import error_map
from tests.core.calibration.waved_probe import length_errors

TABLE_1_UM = np.array([4.6, 22.7, 4.6])
"""Thesis, along x, y (depth) and z."""

_NODES = np.array([6, 6, 6])


@dataclass(frozen=True, slots=True)
class Cost:
    """Systematic error of a calibration, which averaging does not reduce, um RMS.

    Attributes
    ----------
    found_um
        (h, 3): of exact spots, located with noisy calibrations; for each half depth.
    predicted_um
        (h, 3): by the calibrations' own error maps.
    length_um
        Of lengths of 400 mm anywhere in `waved_probe.VOLUME`.
    focal_sigma_um
        Of the focal length.
    """

    found_um: Float
    predicted_um: Float
    length_um: float
    focal_sigma_um: float


def table_1(runs: int) -> Float:
    """Return the RMS error (3,), um, of 200 points located after calibrating with 200 others."""
    squares = np.zeros((runs, 3))
    for seed in range(runs):
        points, spots = observe(rig(), 400, 15.0, seed)
        used, kept = split(points, 200, np.random.default_rng(seed))
        calibration = calibrate_rig(rig(), *subset(points, spots, used), force=True)
        calibrated = calibration.applied_to(rig(), "Table 1")
        errors = located_errors(calibrated, *subset(points, spots, kept))
        squares[seed] = np.nanmean(errors**2, axis=0)
    rms: Float = 1e3 * np.sqrt(squares.mean(axis=0))
    return rms


def cost_of(depth: float, half_depths: Sequence[float], runs: int) -> Cost:
    """Return what 200 points in 400 x ``depth`` x 400 mm cost.

    Parameters
    ----------
    half_depths
        Errors are those within 400 x 400 mm and so far in front of and behind the middle, mm.
    """
    truth = rig()
    found, predicted = np.zeros((2, runs, len(half_depths), 3))
    focal, lengths = np.zeros((2, runs))
    for seed in range(runs):
        calibration = calibrate_rig(truth, *observe(truth, 200, depth, seed), force=True)
        calibrated = calibration.applied_to(truth, "depth")
        focal[seed] = calibration.cameras[0].covariance[(PARAMETERS.index("focal"),) * 2]
        lengths[seed] = np.mean(length_errors(truth, calibrated) ** 2)
        for index, half in enumerate(half_depths):
            found[seed, index] = _found(truth, calibrated, half, seed)
            predicted[seed, index] = _predicted(calibrated, half)
    return Cost(
        1e3 * np.sqrt(found.mean(axis=0)),
        1e3 * np.sqrt(predicted.mean(axis=0)),
        1e3 * float(np.sqrt(lengths.mean())),
        1e3 * float(np.sqrt(focal.mean())),
    )


def _found(truth: Rig, calibrated: Rig, half: float, seed: int) -> Float:
    points = slab(200, 2.0 * half, np.random.default_rng((seed, 1)))
    exact = np.stack([project(camera, points) for camera in truth.cameras])
    squares: Float = np.mean((triangulate(calibrated, exact) - points) ** 2, axis=0)
    return squares


def _predicted(calibrated: Rig, half: float) -> Float:
    # Nodes in the middle of equal cells: their mean is that of the volume.
    corner = np.array([200.0, half, 200.0]) * (1.0 - 1.0 / _NODES)
    nodes = (int(_NODES[0]), int(_NODES[1]), int(_NODES[2]))
    chart = error_map(calibrated, np.stack([-corner, corner]), nodes, SIGMA_PX)
    squares: Float = np.mean(chart.calibration_sigma**2, axis=(0, 1, 2))
    return squares
