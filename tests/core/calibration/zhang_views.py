"""Zhang's model for the least-squares engine: skew, and a plane in several poses.

His distortion acts before the lens matrix on coordinates without unit; the running model has no
skew. So his data test the engine with a projection that is not ours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ocmm_core.calibration.cameras import cloud_of
from ocmm_core.calibration.cameras._dlt import pose_of_plane
from ocmm_core.camera import CameraModel
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector

PIXEL = CameraModel(
    "zhang", 1, 640, 480, 1.0, 800.0, 1.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0,
    RigidTransform.identity(),
)  # fmt: skip
"""A usual start: image centre, and pixels for unit of length."""


@dataclass(frozen=True, slots=True)
class ZhangState:
    """alpha, gamma, beta, u0, v0, k1, k2 in `lens` (7,), and the pose of every view."""

    lens: Float
    poses: tuple[RigidTransform, ...]


@dataclass(frozen=True, slots=True)
class ZhangProblem:
    """Corners of the plane (n, 3), inches, and where each view shows them, (views, n, 2), px."""

    corners: Float
    views: Float

    def start(self) -> ZhangState:
        """Return the closed-form poses for a guessed lens."""
        poses = tuple(pose_of_plane(PIXEL, cloud_of(self.corners), uv) for uv in self.views)
        assert all(pose is not None for pose in poses)
        lens = np.array([800.0, 0.0, 800.0, 320.0, 240.0, 0.0, 0.0])
        return ZhangState(lens, tuple(pose for pose in poses if pose is not None))

    def linearise(self, state: ZhangState) -> tuple[Float, Float]:
        """Return residuals, px, and their derivatives by the lens and every pose."""
        alpha, gamma, beta, u0, v0, k1, k2 = state.lens
        n, count = len(self.corners), len(self.views)
        residuals = np.zeros((count, n, 2))
        jacobian = np.zeros((count, n, 2, 7 + 6 * count))
        matrix = np.array([[alpha, gamma], [0.0, beta]])
        for view, (pose, uv) in enumerate(zip(state.poses, self.views, strict=True)):
            rotated = self.corners @ pose.rotation.T
            seen = rotated + pose.translation
            plane = seen[:, :2] / seen[:, 2:]
            r2 = np.sum(plane**2, axis=1)
            grow = (1.0 + k1 * r2 + k2 * r2**2)[:, None]
            distorted = plane * grow
            residuals[view] = distorted @ matrix.T + [u0, v0] - uv
            rows = jacobian[view]
            rows[:, 0, 0] = distorted[:, 0]
            rows[:, 0, 1] = rows[:, 1, 2] = distorted[:, 1]
            rows[:, 0, 3] = rows[:, 1, 4] = 1.0
            rows[:, :, 5] = (plane * r2[:, None]) @ matrix.T
            rows[:, :, 6] = (plane * r2[:, None] ** 2) @ matrix.T
            slope = (2.0 * k1 + 4.0 * k2 * r2)[:, None, None]
            by_plane = grow[:, None] * np.eye(2) + slope * plane[:, :, None] * plane[:, None]
            pinhole = np.zeros((n, 2, 3))
            pinhole[:, 0, 0] = pinhole[:, 1, 1] = 1.0 / seen[:, 2]
            pinhole[:, :, 2] = -plane / seen[:, 2:]
            by_seen = matrix @ by_plane @ pinhole
            part = 7 + 6 * view
            rows[:, :, part : part + 3] = np.cross(rotated[:, None], by_seen)
            rows[:, :, part + 3 : part + 6] = by_seen
        return residuals.ravel(), jacobian.reshape(-1, 7 + 6 * count)

    def moved(self, state: ZhangState, step: Float) -> ZhangState:
        """Return the state after a step."""
        poses = []
        for view, pose in enumerate(state.poses):
            part = step[7 + 6 * view : 13 + 6 * view]
            turned = rotation_from_vector(part[:3]) @ pose.rotation
            poses.append(RigidTransform(turned, pose.translation + part[3:]))
        return replace(state, lens=state.lens + step[:7], poses=tuple(poses))


def load_zhang(folder: Path) -> tuple[ZhangProblem, Float]:
    """Return his data and his published lens (7,)."""
    corners = np.loadtxt(folder / "Model.txt").reshape(-1, 2)
    views = [np.loadtxt(folder / f"data{view}.txt").reshape(-1, 2) for view in range(1, 6)]
    published = (folder / "calibration-result-zhang-withdistortion.txt").read_text().split()
    flat = np.column_stack([corners, np.zeros(len(corners))])
    return ZhangProblem(flat, np.stack(views)), np.array([float(word) for word in published[:7]])
