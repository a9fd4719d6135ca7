"""Start values: the direct linear transformation and poses for a given lens.

Homogeneous and normalised (Hartley 1997; thesis 3.1 with its errata): no element of the matrix is
set to one, so a world origin in the camera's principal plane does no harm. Points are whitened
along their principal axes, so that a flat volume is not also badly scaled.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.camera import CameraModel
from ocmm_core.geometry import Float, Pixels, Points3, RigidTransform

FLAT = 0.15
"""Depth over width below which the plane of the points gives a better pose than the DLT."""

FOCAL_GRID = (0.7, 1.4, 0.5, 2.0, 0.35, 3.0)
"""Multiples of the nominal focal length, tried if nothing else fits."""


@dataclass(frozen=True, slots=True)
class Start:
    """A camera to start a fit from."""

    name: str
    camera: CameraModel


@dataclass(frozen=True, slots=True)
class Cloud:
    """Points with their principal axes."""

    points: Points3
    """(n, 3), mm."""
    centre: Float
    """(3,), their mean."""
    widths: Float
    """(3,), mm: standard deviations along the axes, the largest first."""
    axes: Float
    """(3, 3): rows of a proper rotation."""

    @property
    def flatness(self) -> float:
        """Return the least over the greatest spread (box: edge) along the principal axes."""
        return float(self.widths[2] / self.widths[0]) if self.widths[0] > 0.0 else 0.0


def cloud_of(points: Points3) -> Cloud:
    """Return points (n, 3), mm, with their principal axes."""
    centre = points.mean(axis=0)
    centred = points - centre
    squares, vectors = np.linalg.eigh(centred.T @ centred / len(points))
    axes = vectors.T[::-1]
    if np.linalg.det(axes) < 0.0:
        axes = -axes
    return Cloud(points, centre, np.sqrt(np.maximum(squares[::-1], 0.0)), axes)


def starts(nominal: CameraModel, points_world: Points3, uv: Pixels) -> Iterator[Start]:
    """Yield starts for six or more points (n, 3), mm, likeliest first; nominal pose unused."""
    ideal = replace(
        nominal, aspect=1.0, u0=0.5 * (nominal.width - 1), v0=0.5 * (nominal.height - 1), k1=0.0,
        k2=0.0, p1=0.0, p2=0.0,
    )  # fmt: skip
    cloud = cloud_of(points_world)
    yield from _posed("nominal focal length", ideal, cloud, uv)
    matrix = dlt(cloud, uv)
    linear = camera_of_dlt(ideal, matrix) if matrix is not None else None
    if linear is not None:
        yield Start("DLT", linear)
        guess = replace(ideal, focal=linear.focal)
        yield from _posed("focal length of the DLT", guess, cloud, uv)
    for factor in FOCAL_GRID:
        guess = replace(ideal, focal=factor * ideal.focal)
        yield from _posed(f"{factor:g} x nominal focal length", guess, cloud, uv)


def dlt(cloud: Cloud, uv: Pixels) -> Float | None:
    """Return the projection matrix (3, 4), px/mm, points in front; None for coplanar points."""
    whitened = _whitening(cloud)
    if whitened is None:
        return None
    to_white, white = whitened
    to_unit, image = _image_normalisation(uv)
    matrix: Float = np.linalg.inv(to_unit) @ _homogeneous_solution(white, image) @ to_white
    depth = cloud.points @ matrix[2, :3] + matrix[2, 3]
    if np.median(depth) < 0.0:
        matrix = -matrix
    return matrix / np.linalg.norm(matrix[2, :3])


def camera_of_dlt(nominal: CameraModel, matrix: Float) -> CameraModel | None:
    """Return the distortion-free camera of a projection matrix.

    None for a mirror image or an implausible lens: another order, handedness, or a flat volume.
    """
    m1, m2, m3 = matrix[:, :3]
    u0, v0 = float(m1 @ m3), float(m2 @ m3)
    fx, fy = float(np.linalg.norm(m1 - u0 * m3)), float(np.linalg.norm(m2 - v0 * m3))
    if np.linalg.det(matrix[:, :3]) <= 0.0 or not (fx > 0.0 and fy > 0.0):
        return None
    if not (0.2 < fx / fy < 5.0 and abs(u0) < 10 * nominal.width and abs(v0) < 10 * nominal.height):
        return None
    lens = np.array([[fx, 0.0, u0], [0.0, fy, v0], [0.0, 0.0, 1.0]])
    return replace(
        nominal, focal=fy * nominal.pitch_mm, aspect=fx / fy, u0=u0, v0=v0,
        T_camera_from_world=_pose_of(np.linalg.solve(lens, matrix)),
    )  # fmt: skip


def pose_of_plane(camera: CameraModel, cloud: Cloud, uv: Pixels) -> RigidTransform | None:
    """Return the pose (camera from world) by the plane's homography; None for points on a line."""
    if cloud.widths[1] < 1e-6 * cloud.widths[0]:
        return None
    size = cloud.widths[0]
    plane = (cloud.points - cloud.centre) @ cloud.axes[:2].T / size
    image = (uv - [camera.u0, camera.v0]) / [camera.sx * camera.focal, camera.sy * camera.focal]
    to_unit, unit = _image_normalisation(image)
    homography = np.linalg.inv(to_unit) @ _homogeneous_solution(plane, unit)
    if homography[2, 2] < 0.0:
        homography = -homography
    norm = 0.5 * (np.linalg.norm(homography[:, 0]) + np.linalg.norm(homography[:, 1]))
    if not norm > 0.0:
        return None
    homography /= norm
    first, second = homography[:, 0], homography[:, 1]
    camera_from_plane = _nearest_rotation(np.column_stack([first, second, np.cross(first, second)]))
    rotation = camera_from_plane @ cloud.axes
    return RigidTransform(rotation, homography[:, 2] * size - rotation @ cloud.centre)


def pose_of_dlt(camera: CameraModel, cloud: Cloud, uv: Pixels) -> RigidTransform | None:
    """Return the pose (camera from world) nearest to the DLT; None if coplanar or mirrored."""
    matrix = dlt(cloud, uv)
    if matrix is None:
        return None
    scale = [camera.focal * camera.sx, camera.focal * camera.sy]
    seen = matrix.copy()
    seen[:2] = (matrix[:2] - np.outer([camera.u0, camera.v0], matrix[2])) / np.array(scale)[:, None]
    return _pose_of(seen) if np.linalg.det(seen[:, :3]) > 0.0 else None


def _posed(name: str, camera: CameraModel, cloud: Cloud, uv: Pixels) -> Iterator[Start]:
    """Yield starts with this lens; poses by plane and by DLT, the likelier one first."""
    methods = [("plane", pose_of_plane), ("DLT", pose_of_dlt)]
    if cloud.flatness >= FLAT:
        methods.reverse()
    for method, pose_by in methods:
        pose = pose_by(camera, cloud, uv)
        if pose is not None:
            yield Start(f"{name}, {method}", replace(camera, T_camera_from_world=pose))


def _homogeneous_solution(points: Float, image: Float) -> Float:
    """Return the matrix (3, d + 1) that maps points (n, d) to image points (n, 2).

    Unit vector that minimises all rows [h, 0, -u h] and [0, h, -v h], h = (point, 1). Both inputs
    are normalised, so the explicit normal matrix is harmless.
    """
    h = np.column_stack([points, np.ones(len(points))])
    d = h.shape[1]
    u, v = image.T
    normal = np.zeros((3 * d, 3 * d))
    normal[:d, :d] = normal[d : 2 * d, d : 2 * d] = h.T @ h
    normal[:d, 2 * d :] = -(h.T * u) @ h
    normal[d : 2 * d, 2 * d :] = -(h.T * v) @ h
    normal[2 * d :, 2 * d :] = (h.T * (u * u + v * v)) @ h
    # eigh reads the upper triangle only.
    _, vectors = np.linalg.eigh(normal, UPLO="U")
    return vectors[:, 0].reshape(3, d)


def _pose_of(matrix: Float) -> RigidTransform:
    """Return the motion nearest to ``matrix`` (3, 4), whose left part is a scaled rotation."""
    left, _, right = np.linalg.svd(matrix[:, :3])
    rotation = left @ right
    return RigidTransform(rotation, rotation @ np.linalg.solve(matrix[:, :3], matrix[:, 3]))


def _nearest_rotation(matrix: Float) -> Float:
    left, _, right = np.linalg.svd(matrix)
    rotation: Float = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return rotation


def _whitening(cloud: Cloud) -> tuple[Float, Points3] | None:
    """Return the whitening matrix (4, 4) and whitened points; None for coplanar points."""
    if cloud.widths[2] < 1e-6 * cloud.widths[0]:
        return None
    linear = cloud.axes / cloud.widths[:, None]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, -linear @ cloud.centre
    return matrix, (cloud.points - cloud.centre) @ linear.T


def _image_normalisation(image: Float) -> tuple[Float, Float]:
    """Return the matrix (3, 3) that centres and scales image points, and the points (n, 2)."""
    centre = image.mean(axis=0)
    size = float(np.sqrt(np.mean((image - centre) ** 2))) or 1.0
    matrix = np.diag([1.0 / size, 1.0 / size, 1.0])
    matrix[:2, 2] = -centre / size
    return matrix, (image - centre) / size
