"""Cameras whose calibration others have published, for tests and benchmarks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.io

from ocmm_core.calibration.cameras import fit_camera
from ocmm_core.calibration.cameras._least_squares import minimise
from ocmm_core.calibration.cameras._model_fit import CameraFit
from ocmm_core.camera import CameraModel
from ocmm_core.geometry import RigidTransform
from tests.core.calibration.zhang_views import load_zhang


def fit_heikkila(reference: Path) -> CameraFit:
    """Return the camera of Heikkila's toolbox: 491 points of a 3-D target in one picture."""
    data = scipy.io.loadmat(reference / "camera" / "heikkila" / "cademo.mat")["data3d"]
    # His Sony camera: 768 x 576 pixels on 6.2031 x 4.6515 mm, nominally 8.5 mm.
    nominal = CameraModel(
        "heikkila", 1, 768, 576, 4.6515 / 576, 8.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        RigidTransform.identity(),
    )  # fmt: skip
    return fit_camera(nominal, data[:, :3], data[:, 3:], 0.051)


def fit_zhang(reference: Path) -> tuple[float, float]:
    """Return RMS residual, px, and the largest relative deviation from Zhang's published lens.

    The skew is an angle, and so relative to the focal length.
    """
    problem, published = load_zhang(reference / "camera" / "zhang")
    minimum = minimise(problem, problem.start())
    assert minimum.converged
    scale = np.abs(published)
    scale[1] = published[0]
    views, corners = problem.views.shape[:2]
    rms = float(np.sqrt(minimum.cost / (views * corners)))
    return rms, float((np.abs(minimum.state.lens - published) / scale).max())
