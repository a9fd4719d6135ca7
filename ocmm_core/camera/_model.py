"""The camera model: world to pixel, and its exact inverse.

Thesis 1.2.3 with the errata: pinhole with focal length in millimetres, two radial and two
tangential distortion terms that act on the ideal image point, then pixel scale and offset.
``Sy`` is fixed to one over the pixel pitch; ``Sx = aspect * Sy``, because only ``f * Sx`` and
``f * Sy`` can be observed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.geometry import Float, Pixels, Points3, RigidTransform, rotation_from_vector

Vector3 = tuple[float, float, float]

PARAMETERS = (
    "rotation_x", "rotation_y", "rotation_z", "x0", "y0", "z0",
    "focal", "aspect", "u0", "v0", "k1", "k2", "p1", "p2",
)  # fmt: skip
"""Order of the calibrated parameters of one camera: a small rotation (rad) applied in the camera
frame after the present one, the translation (mm) of the camera-from-world motion, then the lens."""

N_PARAMETERS = len(PARAMETERS)

PACKED_SIZE = 21
"""Length of `CameraModel.packed`: R row by row (9), t (3), f, Sx, Sy, u0, v0, k1, k2, p1, p2."""

NEWTON_STEPS = 3
"""Exact to 5e-13 px for 1.5 % edge distortion, 5e-12 px for 3 %."""


@dataclass(frozen=True, slots=True)
class CameraModel:
    """One calibrated camera."""

    name: str
    serial: int
    """`name`, `serial`: Name in the rig document, serial number reported by the electronics."""
    width: int
    height: int
    """`width`, `height`: px."""
    pitch_mm: float
    focal: float
    """mm."""
    aspect: float
    """Sx / Sy."""
    u0: float
    v0: float
    """`u0`, `v0`: Principal point, px."""
    k1: float
    k2: float
    """`k1`, `k2`: Radial distortion, mm^-2 and mm^-4."""
    p1: float
    p2: float
    """`p1`, `p2`: Tangential distortion, mm^-1."""
    T_camera_from_world: RigidTransform
    """Pose; the camera looks along its +z."""

    @property
    def sx(self) -> float:
        """Return the horizontal scale, px/mm."""
        return self.aspect / self.pitch_mm

    @property
    def sy(self) -> float:
        """Return the vertical scale, px/mm."""
        return 1.0 / self.pitch_mm

    @property
    def centre_world(self) -> Float:
        """Return the projection centre (3,), mm, world frame."""
        return self.T_camera_from_world.inverse().translation

    def packed(self) -> Float:
        """Return the numbers for the compiled kernel, (21,), see `PACKED_SIZE`."""
        pose = self.T_camera_from_world
        lens = [
            self.focal, self.sx, self.sy, self.u0, self.v0, self.k1, self.k2, self.p1, self.p2
        ]  # fmt: skip
        return np.concatenate([pose.rotation.ravel(), pose.translation, lens])

    def perturbed(self, change: Float) -> CameraModel:
        """Return this camera with ``change`` (14,), in the order of `PARAMETERS`, added."""
        pose = self.T_camera_from_world
        moved = RigidTransform(
            rotation_from_vector(change[:3]) @ pose.rotation, pose.translation + change[3:6]
        )
        focal, aspect, u0, v0, k1, k2, p1, p2 = (float(value) for value in change[6:])
        return replace(
            self,
            T_camera_from_world=moved,
            focal=self.focal + focal,
            aspect=self.aspect + aspect,
            u0=self.u0 + u0,
            v0=self.v0 + v0,
            k1=self.k1 + k1,
            k2=self.k2 + k2,
            p1=self.p1 + p1,
            p2=self.p2 + p2,
        )


def distort(camera: CameraModel, ideal: Float) -> Float:
    """Return the distorted image point (..., 2), mm, of the ideal one."""
    x, y = ideal[..., 0], ideal[..., 1]
    r2 = x * x + y * y
    radial = r2 * (camera.k1 + camera.k2 * r2)
    return np.stack(
        [
            x + x * radial + 2.0 * camera.p1 * x * y + camera.p2 * (3.0 * x * x + y * y),
            y + y * radial + camera.p1 * (x * x + 3.0 * y * y) + 2.0 * camera.p2 * x * y,
        ],
        axis=-1,
    )


def distortion_jacobian(camera: CameraModel, ideal: Float) -> Float:
    """Return d(distorted)/d(ideal), (..., 2, 2)."""
    x, y = ideal[..., 0], ideal[..., 1]
    r2 = x * x + y * y
    radial = r2 * (camera.k1 + camera.k2 * r2)
    slope = 2.0 * camera.k1 + 4.0 * camera.k2 * r2
    cross = x * y * slope + 2.0 * camera.p1 * x + 2.0 * camera.p2 * y
    jacobian = np.empty((*x.shape, 2, 2))
    jacobian[..., 0, 0] = 1.0 + radial + x * x * slope + 2.0 * camera.p1 * y + 6.0 * camera.p2 * x
    jacobian[..., 0, 1] = cross
    jacobian[..., 1, 0] = cross
    jacobian[..., 1, 1] = 1.0 + radial + y * y * slope + 6.0 * camera.p1 * y + 2.0 * camera.p2 * x
    return jacobian


def undistort(camera: CameraModel, distorted: Float) -> Float:
    """Return the ideal image point (..., 2), mm, of a distorted one; three Newton steps."""
    ideal = np.array(distorted, dtype=np.float64)
    for _ in range(NEWTON_STEPS):
        miss = distorted - distort(camera, ideal)
        j = distortion_jacobian(camera, ideal)
        determinant = j[..., 0, 0] * j[..., 1, 1] - j[..., 0, 1] * j[..., 1, 0]
        step_x = (j[..., 1, 1] * miss[..., 0] - j[..., 0, 1] * miss[..., 1]) / determinant
        step_y = (j[..., 0, 0] * miss[..., 1] - j[..., 1, 0] * miss[..., 0]) / determinant
        ideal = ideal + np.stack([step_x, step_y], axis=-1)
    return ideal


def to_pixels(camera: CameraModel, distorted: Float) -> Pixels:
    """Return pixel coordinates (..., 2) of distorted image points (..., 2), mm."""
    uv: Pixels = distorted * np.array([camera.sx, camera.sy]) + np.array([camera.u0, camera.v0])
    return uv


def from_pixels(camera: CameraModel, uv: Pixels) -> Float:
    """Return distorted image points (..., 2), mm, of pixel coordinates (..., 2)."""
    image: Float = (uv - np.array([camera.u0, camera.v0])) / np.array([camera.sx, camera.sy])
    return image


def ideal_from_pixels(camera: CameraModel, uv: Pixels) -> Float:
    """Return ideal image points (..., 2), mm, of pixel coordinates (..., 2)."""
    return undistort(camera, from_pixels(camera, uv))


def project(camera: CameraModel, points_world: Points3) -> Pixels:
    """Return pixels (..., 2) of world points (..., 3), mm; NaN behind the camera."""
    in_camera = camera.T_camera_from_world.apply(points_world)
    depth = in_camera[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        ideal = np.where(depth > 0.0, camera.focal * in_camera[..., :2] / depth, np.nan)
    return to_pixels(camera, distort(camera, ideal))


def on_sensor(camera: CameraModel, uv: Pixels) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return which pixel coordinates (..., 2) lie on the sensor; NaN does not."""
    u, v = uv[..., 0], uv[..., 1]
    return (u >= 0.0) & (u <= camera.width - 1) & (v >= 0.0) & (v <= camera.height - 1)


def projection_jacobians(camera: CameraModel, points_world: Points3) -> tuple[Float, Float]:
    """Return the derivatives of pixels by the points and by the camera parameters.

    `points_world`: (n, 3), mm, in front of the camera.

    Returns
    -------
    d_point
        (n, 2, 3), px/mm, world frame.
    d_parameters
        (n, 2, 14), in the order of `PARAMETERS`.
    """
    pose = camera.T_camera_from_world
    rotated = points_world @ pose.rotation.T
    in_camera = rotated + pose.translation
    x, y, z = in_camera.T
    f = camera.focal
    ideal = f * in_camera[:, :2] / z[:, None]
    scale = np.array([camera.sx, camera.sy])
    d_ideal = scale[:, None] * distortion_jacobian(camera, ideal)
    pinhole = np.zeros((len(z), 2, 3))
    pinhole[:, 0, 0] = pinhole[:, 1, 1] = f / z
    pinhole[:, 0, 2] = -f * x / z**2
    pinhole[:, 1, 2] = -f * y / z**2
    d_camera_point = d_ideal @ pinhole
    d_point = d_camera_point @ pose.rotation

    parameters = np.zeros((len(z), 2, N_PARAMETERS))
    cross = np.zeros((len(z), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2] = rotated[:, 2], -rotated[:, 1]
    cross[:, 1, 0], cross[:, 1, 2] = -rotated[:, 2], rotated[:, 0]
    cross[:, 2, 0], cross[:, 2, 1] = rotated[:, 1], -rotated[:, 0]
    parameters[:, :, 0:3] = d_camera_point @ cross
    parameters[:, :, 3:6] = d_camera_point
    parameters[:, :, 6] = np.einsum("nij,nj->ni", d_ideal, ideal / f)
    distorted = distort(camera, ideal)
    parameters[:, 0, 7] = distorted[:, 0] / camera.pitch_mm
    parameters[:, 0, 8] = 1.0
    parameters[:, 1, 9] = 1.0
    xi, yi = ideal.T
    r2 = xi * xi + yi * yi
    terms = np.stack(
        [
            np.stack([xi * r2, yi * r2], axis=-1),
            np.stack([xi * r2 * r2, yi * r2 * r2], axis=-1),
            np.stack([2.0 * xi * yi, xi * xi + 3.0 * yi * yi], axis=-1),
            np.stack([3.0 * xi * xi + yi * yi, 2.0 * xi * yi], axis=-1),
        ],
        axis=-1,
    )
    parameters[:, :, 10:14] = scale[:, None] * terms
    return d_point, parameters
