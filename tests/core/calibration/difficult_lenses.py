"""Calibrations that invite a wrong minimum, for tests and benchmarks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ocmm_core.calibration.cameras import fit_camera
from ocmm_core.calibration.cameras._guards import judge_fit
from ocmm_core.calibration.records import let_pass
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel, project
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels, Points3, RigidTransform, rotation_from_vector
from tests.core.calibration.known_points import SIGMA_PX, distorted, rig, slab

SAME_MINIMUM = 1e-9
"""Probability of a normalised error this large at the right minimum; wrong ones are far beyond."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Known points, their spots in a camera, and the camera's data sheet."""

    truth: CameraModel
    nominal: CameraModel
    points: Points3
    uv: Pixels


def trial_of(seed: int) -> Trial:
    """Return one of the calibrations that must not end in a wrong minimum.

    Distortion up to 3 % at the edge of the sensor; half of the volumes are 15 to 60 mm deep, the
    others up to 400 mm; the focal length of the data sheet is up to 5 % off; one in five has six
    wrong points, from 0.3 px to half the picture.
    """
    rng = np.random.default_rng(seed)
    truth = distorted(_CAMERAS[seed % 2], rng.uniform(-3.0, 3.0))
    depth = rng.uniform(15.0, 60.0) if seed % 4 < 2 else rng.uniform(60.0, 400.0)
    points = slab(200, depth, rng)
    uv = project(truth, points) + SIGMA_PX * rng.standard_normal((200, 2))
    nominal = replace(truth, focal=truth.focal * float(rng.uniform(0.95, 1.05)))
    if seed % 5 == 0:
        rows = rng.choice(200, 6, replace=False)
        uv[rows] += rng.standard_normal((6, 2)) * 10.0 ** rng.uniform(-0.5, 2.5, (6, 1))
    return Trial(truth, nominal, points, uv)


def anywhere(seed: int) -> Trial:
    """Return a trial with 20 to 400 points, any world frame, a rolled camera, a vague lens.

    The focal length of the data sheet is half to twice the true one; every third trial has up to 9
    % wrong points.
    """
    rng = np.random.default_rng((seed, 1))
    truth = distorted(_CAMERAS[seed % 2], rng.uniform(-3.0, 3.0))
    n = int(np.exp(rng.uniform(np.log(20.0), np.log(400.0))))
    points = slab(n, float(np.exp(rng.uniform(np.log(15.0), np.log(400.0)))), rng)
    turn = Rotation.random(rng=rng).as_matrix()
    shift = rng.uniform(-1500.0, 1500.0, 3)
    pose = truth.T_camera_from_world
    roll = rotation_from_vector(np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)]))
    rotation = roll @ pose.rotation @ turn.T
    pose = RigidTransform(rotation, roll @ pose.translation - rotation @ shift)
    truth = replace(truth, T_camera_from_world=pose)
    points = points @ turn.T + shift
    uv = project(truth, points) + SIGMA_PX * rng.standard_normal((n, 2))
    if seed % 3 == 0:
        wrong = max(1, int(rng.uniform(0.0, 0.09) * n))
        rows = rng.choice(n, wrong, replace=False)
        uv[rows] += rng.standard_normal((wrong, 2)) * 10.0 ** rng.uniform(-0.5, 2.7, (wrong, 1))
    focal = truth.focal * float(np.exp(rng.uniform(-np.log(2.0), np.log(2.0))))
    return Trial(truth, replace(truth, focal=focal), points, uv)


def end_of(trial: Trial) -> Literal["right", "wrong", "refused"]:
    """Return how the calibration ends; all 14 parameters must fit their covariance.

    Guards that question the design of the volume are overruled: half of the trials are flat.
    """
    try:
        fit = fit_camera(trial.nominal, trial.points, trial.uv, SIGMA_PX)
        found = judge_fit(fit, [str(index) for index in range(len(trial.uv))])
        let_pass([one for one in found if one.code not in _ABOUT_THE_VOLUME], force=False)
    except CalibrationError:
        return "refused"
    errors = parameter_errors(fit.camera.model, trial.truth)
    square = float(errors @ np.linalg.solve(fit.covariance, errors))
    return "right" if square < chi2.isf(SAME_MINIMUM, N_PARAMETERS) else "wrong"


def parameter_errors(found: CameraModel, truth: CameraModel) -> Float:
    """Return found minus truth, (14,), in the order of `PARAMETERS`."""
    turned = found.T_camera_from_world.rotation @ truth.T_camera_from_world.rotation.T
    rotation = 0.5 * np.array(
        [turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]
    )
    shift = found.T_camera_from_world.translation - truth.T_camera_from_world.translation
    lens = [getattr(found, name) - getattr(truth, name) for name in PARAMETERS[6:]]
    return np.concatenate([rotation, shift, lens])


_CAMERAS = rig().cameras
_ABOUT_THE_VOLUME = {
    "calibration.flat_volume", "calibration.small_volume", "calibration.focal_sigma",
}  # fmt: skip
