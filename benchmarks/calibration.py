"""Calibration of cameras from known points against OpenCV's calibrateCamera, on the same points.

Thesis rig, 400 points in a volume 200 mm deep, spots with 0.0105 px of noise. Both start from the
nominal lens and find the pose by themselves; both fit 14 parameters a camera. Ours also looks for
wrong points and returns the covariance. Run: ``python benchmarks/calibration.py``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.blas import use_one_thread

use_one_thread()

import cv2  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
import numpy as np  # noqa: E402 - as above

from ocmm_core.calibration.camera_model_fit import fit_camera  # noqa: E402 - as above
from ocmm_core.camera.model import CameraModel, project  # noqa: E402 - as above
from ocmm_core.camera.rig import load_rig  # noqa: E402 - as above
from ocmm_core.documents import resource  # noqa: E402 - as above
from ocmm_core.geometry import Pixels, Points3  # noqa: E402 - as above

SIGMA_PX = 0.0105
RATIO_LIMIT = 1.0
ACCURACY_LIMIT = 1.02
"""Of the RMS errors of the focal lengths; OpenCV takes positions in single precision."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """What both found.

    Attributes
    ----------
    seconds, peer_seconds
        Processor time of all cameras, the median of the rounds.
    focal_um, peer_focal_um
        RMS error of the focal lengths over all calibrations.
    rms_px, peer_rms_px
        Mean RMS residual, per coordinate.
    """

    seconds: float
    peer_seconds: float
    focal_um: float
    peer_focal_um: float
    rms_px: float
    peer_rms_px: float

    @property
    def holds(self) -> bool:
        """Return whether ours is at least as fast and as accurate."""
        fast = self.seconds <= RATIO_LIMIT * self.peer_seconds
        return fast and self.focal_um <= ACCURACY_LIMIT * self.peer_focal_um


def with_opencv(camera: CameraModel, points: Points3, uv: Pixels) -> tuple[float, float]:
    """Return focal length, mm, and RMS residual, px per coordinate."""
    scale = camera.focal / camera.pitch_mm
    matrix = np.array(
        [[scale, 0.0, 0.5 * camera.width], [0.0, scale, 0.5 * camera.height], [0.0, 0.0, 1.0]]
    )
    rms, found, *_ = cv2.calibrateCamera(
        [points.astype(np.float32)], [uv.astype(np.float32)], (camera.width, camera.height),
        matrix, np.zeros(4), flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3,
    )  # fmt: skip
    return float(found[1, 1]) * camera.pitch_mm, float(rms) / np.sqrt(2.0)


def with_ours(camera: CameraModel, points: Points3, uv: Pixels) -> tuple[float, float]:
    """Return focal length, mm, and RMS residual, px per coordinate."""
    fit = fit_camera(camera, points, uv, SIGMA_PX)
    return fit.camera.model.focal, fit.rms_px


def compare(rounds: int, n: int, seed: int) -> Comparison:
    """Return the comparison over ``rounds`` calibrations of both cameras."""
    cameras = load_rig(resource("rigs", "thesis.toml")).cameras
    rng = np.random.default_rng(seed)
    methods: tuple[Callable[[CameraModel, Points3, Pixels], tuple[float, float]], ...] = (
        with_ours,
        with_opencv,
    )
    spent = np.zeros((rounds, 2))
    focal, rms = np.zeros((2, rounds, len(cameras), 2))
    for round_ in range(rounds):
        points = rng.uniform(-1.0, 1.0, (n, 3)) * [200.0, 100.0, 200.0]
        views = [project(camera, points) for camera in cameras]
        views = [uv + SIGMA_PX * rng.standard_normal(uv.shape) for uv in views]
        # In turn, so that both have the same neighbours on the machine.
        for which in (0, 1) if round_ % 2 else (1, 0):
            began = time.process_time()
            results = [methods[which](c, points, uv) for c, uv in zip(cameras, views, strict=True)]
            spent[round_, which] = time.process_time() - began
            for index, (camera, (found, left)) in enumerate(zip(cameras, results, strict=True)):
                focal[round_, index, which] = found - camera.focal
                rms[round_, index, which] = left
    seconds = np.median(spent, axis=0)
    errors = 1e3 * np.sqrt(np.mean(focal**2, axis=(0, 1)))
    left = rms.mean(axis=(0, 1))
    return Comparison(
        float(seconds[0]), float(seconds[1]), float(errors[0]), float(errors[1]),
        float(left[0]), float(left[1]),
    )  # fmt: skip


def main() -> int:
    """Print the comparison; return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=60, help="calibrations of the rig (60)")
    parser.add_argument("--points", type=int, default=400, help="points of each (400)")
    parser.add_argument("--seed", type=int, default=1, help="seed of points and noise (1)")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    found = compare(options.rounds, options.points, options.seed)
    ratio = found.seconds / found.peer_seconds
    print(f"{options.points} points x 2 cameras     ours   OpenCV")
    print(f"time, ms            {1e3 * found.seconds:8.2f} {1e3 * found.peer_seconds:8.2f}")
    print(f"RMS residual, px    {found.rms_px:8.5f} {found.peer_rms_px:8.5f}")
    print(f"focal error, um     {found.focal_um:8.3f} {found.peer_focal_um:8.3f}")
    print(f"time ratio {ratio:.2f} (<= {RATIO_LIMIT:g})  {'ok' if found.holds else 'BROKEN'}")
    return 0 if found.holds else 1


if __name__ == "__main__":
    sys.exit(main())
