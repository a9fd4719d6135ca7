"""First values: focal lengths and board poses from homographies, then one camera after the other.

A flat board maps to an image by a homography. It gives the pose for a known focal length, and
several of them the focal length (Zhang 2000), for a central principal point without distortion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_boards._board import Board
from ocmm_boards._corners import BoardViews
from ocmm_core.camera import CameraModel, from_pixels
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, RigidTransform, rigid_fit

_FOCAL_RANGE = 2.0
"""A found focal length further from the nominal one is not trusted."""


def start_camera(
    nominal: CameraModel, board: Board, views: BoardViews, index: int
) -> tuple[CameraModel, dict[int, RigidTransform]]:
    """Return camera ``index`` at the origin, without distortion, and board poses by view."""
    camera = replace(
        nominal, k1=0.0, k2=0.0, p1=0.0, p2=0.0, T_camera_from_world=RigidTransform.identity()
    )
    maps = {}
    for view in np.flatnonzero(views.usable[:, index]).tolist():
        seen = views.seen[view, index]
        image = from_pixels(camera, views.uv[view, index, seen])
        maps[view] = _homography(board.corners[seen, :2], image)
    focal = _focal(list(maps.values()), nominal.focal)
    camera = replace(camera, focal=focal)
    return camera, {view: _pose(one, focal) for view, one in maps.items()}


def placed(
    cameras: tuple[CameraModel, ...], poses: list[dict[int, RigidTransform]], corners: Points3
) -> tuple[tuple[CameraModel, ...], dict[int, RigidTransform]]:
    """Return the cameras in the frame of the first one, and the board in it for each view.

    CalibrationError if a camera shares no view with those before it.
    """
    placed_at = {0: RigidTransform.identity()}
    while len(placed_at) < len(cameras):
        shared = {
            (other, one): sorted(poses[other].keys() & poses[one].keys())
            for one in placed_at
            for other in range(len(cameras))
            if other not in placed_at
        }
        (other, one), views = max(shared.items(), key=lambda item: len(item[1]))
        if not views:
            raise CalibrationError(
                "boards.no_common_view",
                f"Camera '{cameras[other].name}' never sees the board together with another one.",
                "Show the board where two cameras see it at the same time.",
            )
        # The board's corners as both cameras see them, in all views at once.
        mine = np.vstack([poses[other][view].apply(corners) for view in views])
        theirs = np.vstack([poses[one][view].apply(corners) for view in views])
        between = RigidTransform(*rigid_fit(theirs, mine))
        placed_at[other] = between.compose(placed_at[one])
    moved = tuple(
        replace(camera, T_camera_from_world=placed_at[index])
        for index, camera in enumerate(cameras)
    )
    boards: dict[int, RigidTransform] = {}
    for index, of_camera in enumerate(poses):
        for view, pose in of_camera.items():
            boards.setdefault(view, placed_at[index].inverse().compose(pose))
    return moved, boards


def _homography(board: Float, image: Float) -> Float:
    """Return the matrix (3, 3) that maps board to image, both (n, 2), by the DLT."""
    scale_board, scale_image = _normalising(board), _normalising(image)
    a, b = _normalised(board, scale_board), _normalised(image, scale_image)
    rows = np.zeros((len(a), 2, 9))
    rows[:, 0, 0:3] = rows[:, 1, 3:6] = a
    rows[:, 0, 6:9], rows[:, 1, 6:9] = -b[:, :1] * a, -b[:, 1:2] * a
    found = np.linalg.svd(rows.reshape(-1, 9), full_matrices=False)[2][-1].reshape(3, 3)
    whole: Float = np.linalg.inv(scale_image) @ found @ scale_board
    return whole / np.linalg.norm(whole)


def _normalising(points: Float) -> Float:
    middle = points.mean(axis=0)
    spread = float(np.sqrt(np.mean((points - middle) ** 2)))
    return np.array([[1.0, 0.0, -middle[0]], [0.0, 1.0, -middle[1]], [0.0, 0.0, spread]]) / spread


def _normalised(points: Float, scale: Float) -> Float:
    moved: Float = np.column_stack([points, np.ones(len(points))]) @ scale.T
    return moved


def _focal(maps: list[Float], nominal: float) -> float:
    """Return the focal length, mm, by which the board's axes are upright and equally long."""
    left, right = [], []
    for matrix in maps:
        a, b = matrix[:, 0], matrix[:, 1]
        left += [a[0] * b[0] + a[1] * b[1], a[0] ** 2 + a[1] ** 2 - b[0] ** 2 - b[1] ** 2]
        right += [-a[2] * b[2], b[2] ** 2 - a[2] ** 2]
    x, y = np.array(left), np.array(right)
    if not x @ x > 0.0 or not x @ y > 0.0:
        return nominal
    found = float(np.sqrt(x @ x / (x @ y)))
    return found if 1.0 / _FOCAL_RANGE <= found / nominal <= _FOCAL_RANGE else nominal


def _pose(matrix: Float, focal: float) -> RigidTransform:
    """Return the camera-from-board motion of a homography."""
    columns = matrix / np.array([[focal], [focal], [1.0]])
    columns *= 2.0 / (np.linalg.norm(columns[:, 0]) + np.linalg.norm(columns[:, 1]))
    if columns[2, 2] < 0.0:
        columns = -columns
    x, y = columns[:, 0], columns[:, 1]
    u, _, vt = np.linalg.svd(np.column_stack([x, y, np.cross(x, y)]))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return RigidTransform(rotation, columns[:, 2])
