"""First values of a calibration with a board, and its criteria.

The design may be overruled, contradictions not. First values are focal lengths and poses of the
board, one camera after the other: a flat board maps to an image by a homography. It gives the pose
for a known focal length, and several of them the focal length (Zhang 2000), for a central principal
point without distortion.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.special import chdtrc

from ocmm_boards._board import Board
from ocmm_boards._corners import BoardViews
from ocmm_core.calibration.bundle import BundleState, RobustMinimum
from ocmm_core.calibration.cameras import OUTLIERS_REFUSED, lens_effect
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.relocation import judge_convergence, judge_focal
from ocmm_core.camera import CameraModel, Rig, from_pixels
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, RigidTransform, rigid_fit

WORST_SIGMA_PX = 0.5
"""Scatter of corners above which no detector of ours works."""
TOGETHER = 1.3
"""Scatter of all cameras together over that of each alone."""
BASELINE_WARNED, BASELINE_REFUSED = 0.05, 0.15
"""Relative deviation of the distance of two cameras from the rig document."""
TURNED_RAD = 0.5
"""Deviation of the direction of a camera from that in the rig document, seen from the first."""
FOCAL_OFF = 0.25
"""Relative deviation of a focal length from the rig document."""
POOR_SIGMA_PX = 0.25
"""Scatter of corners in pictures with glare or blur."""
CONTRADICTION = 1e-5
"""Probability below which a shape is not attributed to chance."""


class FewViews:
    """Numbers of views."""

    of_camera: Final = 8
    common: Final = 5
    wanted: Final = 30


def judge_solution(
    rig: Rig, board: Board, covariance: Float, found: RobustMinimum, sigma_px: float,
    alone: Sequence[float], traceable: bool,
) -> list[Finding]:  # fmt: skip
    """Return the findings; ``alone``: corner scatter of each separately adjusted camera, px."""
    state = found.minimum.state
    return [
        *_scatter(rig, sigma_px, alone),
        *_focal(rig, state.cameras),
        *judge_convergence(found, "Take more pictures of the board, at more angles and distances."),
        *_shape(board, state),
        *_spots(found, rig.cameras),
        *_lenses(state, found, sigma_px),
        *_baselines(rig, state),
        *_views(found),
        *_focal_sigma(state.cameras, covariance, sigma_px),
        *([] if traceable else [_untraceable(board)]),
    ]


def _scatter(rig: Rig, sigma_px: float, alone: Sequence[float]) -> list[Finding]:
    expected = float(np.sqrt(np.mean(np.square(alone))))
    moved = [told_moved(expected, sigma_px)] if sigma_px > TOGETHER * expected else []
    return told_unexplained(rig, alone) or moved


def told_unexplained(rig: Rig, alone: Sequence[float]) -> list[Finding]:
    """Return that a camera alone does not explain its corners, with this scatter, px, of each."""
    worst = max(range(len(alone)), key=lambda index: alone[index])
    if alone[worst] <= WORST_SIGMA_PX:
        return []
    return [
        Finding(
            "boards.scatter",
            f"The corners scatter by {alone[worst]:.2f} px in camera "
            f"'{rig.cameras[worst].name}' alone; not a valid calibration.",
            "Check columns, rows and order of the corners, the pitch of the pixels in the rig "
            "document, and that all pictures show the same board in focus.",
            refuses=True,
        )
    ]


def told_mirrored(camera: CameraModel, poses: Iterable[RigidTransform]) -> list[Finding]:
    """Return that a camera sees most boards, posed in its frame, from behind."""
    if np.median([pose.rotation[2, 2] for pose in poses]) > 0.0:
        return []
    return [
        Finding(
            "boards.mirrored",
            f"Camera '{camera.name}' sees the board from behind: its pictures are mirrored, or "
            "the corners of a row are listed from right to left.",
            "Switch off mirroring in the camera, or list the corners as seen from the front.",
            refuses=True,
        )
    ]


def told_moved(alone_px: float, together_px: float) -> Finding:
    """Return that all cameras together explain the corners worse than each alone."""
    return Finding(
        "boards.moved",
        f"Each camera alone explains its pictures to {alone_px:.3f} px, all together only to "
        f"{together_px:.3f} px: a camera moved, or the pictures of a view do not show the same "
        "board at the same moment and the same way round.",
        "Fix the cameras, take the pictures of a view at the same moment with the board at rest, "
        "check the patterns of names, and take all of them again.",
        refuses=True,
    )


def _shape(board: Board, state: BundleState) -> list[Finding]:
    """Return findings on a board that contradicts its document."""
    off = (state.leds - board.corners).ravel()
    square = float(off @ np.linalg.solve(board.covariance, off))
    if chdtrc(off.size, square) >= CONTRADICTION:
        return []
    lengths = np.linalg.norm(off.reshape(-1, 3), axis=1)
    row, column = divmod(int(np.argmax(lengths)), board.document.columns)
    return [
        Finding(
            "boards.shape",
            f"The board '{board.document.name}' is not as its document says: corner {column + 1} "
            f"of row {row + 1} is off most, by {1e3 * lengths.max():.0f} um.",
            "Check that all pictures show this board, measure it, and state its flatness and "
            "corners as they are.",
            refuses=True,
        )
    ]


def _spots(found: RobustMinimum, cameras: Sequence[CameraModel]) -> list[Finding]:
    seen = np.isfinite(found.distances)
    wrong = seen & ~found.used
    if not wrong.any():
        return []
    refuses = bool(wrong.sum() > OUTLIERS_REFUSED * seen.sum())
    pictures = np.count_nonzero(seen, axis=2) > 0
    lost = pictures & (np.count_nonzero(found.used, axis=2) == 0)
    listed = ", ".join(
        f"{count} of camera '{camera.name}'"
        for camera, count in zip(cameras, wrong.sum(axis=(0, 2)), strict=True)
    )
    if refuses and 2 * np.count_nonzero(wrong & lost[:, :, None]) > wrong.sum():
        return [
            Finding(
                "boards.views",
                f"{lost.sum()} of {pictures.sum()} pictures do not belong to their views; "
                f"corners left out: {listed}.",
                "Take the pictures of a view at the same moment, of the same board, and check the "
                "names of the files.",
                refuses=True,
            )
        ]
    return [
        Finding(
            "calibration.outliers",
            f"{wrong.sum()} of {seen.sum()} corners are outliers and were excluded: {listed}.",
            "Look for glare on the board and for things in front of it.",
            refuses=refuses,
        )
    ]


def _lenses(state: BundleState, found: RobustMinimum, sigma_px: float) -> Iterator[Finding]:
    corners = state.leds_world
    for index, camera in enumerate(state.cameras):
        used = found.used[:, index]
        yield from lens_effect(
            camera, corners[used], found.data.uv[:, index][used],
            found.data.weights[:, index][used], sigma_px,
        )  # fmt: skip


def _baselines(rig: Rig, state: BundleState) -> Iterator[Finding]:
    stated, found = (_beside_first(one) for one in (rig.cameras, state.cameras))
    first = rig.cameras[0]
    for nominal, (stated_at, stated_turn), (at, turn) in zip(
        rig.cameras[1:], stated, found, strict=True
    ):
        apart, nominally = np.linalg.norm(at), np.linalg.norm(stated_at)
        off = abs(apart / nominally - 1.0)
        if off > BASELINE_WARNED:
            yield Finding(
                "boards.baseline",
                f"By the board, cameras '{first.name}' and '{nominal.name}' are {apart:.1f} mm "
                f"apart, by the rig document {nominally:.1f} mm.",
                "Check the pitch of the board, and where the rig document puts the cameras.",
                refuses=bool(off > BASELINE_REFUSED),
                forcible=True,
            )
        cosines = at @ stated_at / (apart * nominally), 0.5 * (np.trace(turn.T @ stated_turn) - 1.0)
        if min(cosines) < np.cos(TURNED_RAD):
            yield Finding(
                "boards.swapped",
                f"Seen from camera '{first.name}', camera '{nominal.name}' is not where the rig "
                "document puts it: the pictures of cameras are swapped.",
                "Check the names of the pictures, and places and directions in the rig document.",
                refuses=True,
                forcible=True,
            )


def _beside_first(cameras: Sequence[CameraModel]) -> list[tuple[Float, Float]]:
    """Return place (3,), mm, and rotation of all others in the frame of the first camera."""
    first, *others = (camera.T_camera_from_world for camera in cameras)
    motions = (first.compose(other.inverse()) for other in others)
    return [(motion.translation, motion.rotation) for motion in motions]


def _views(found: RobustMinimum) -> list[Finding]:
    count = int(found.data.active[0].sum())
    if count >= FewViews.wanted:
        return []
    return [
        Finding(
            "boards.few_pictures",
            f"Only {count} views of the board were used.",
            f"Take {FewViews.wanted} or more, tilted in all directions, near and far, in every "
            "part of the pictures.",
            refuses=False,
        )
    ]


def _focal(rig: Rig, cameras: Sequence[CameraModel]) -> Iterator[Finding]:
    for nominal, camera in zip(rig.cameras, cameras, strict=True):
        if abs(camera.focal / nominal.focal - 1.0) > FOCAL_OFF:
            yield Finding(
                "boards.focal",
                f"The focal length of camera '{camera.name}' is {camera.focal:.2f} mm, by the rig "
                f"document {nominal.focal:.2f} mm.",
                "Give pictures in full resolution, and check focal length and pitch of the pixels "
                "in the rig document.",
                refuses=True,
                forcible=True,
            )


def _focal_sigma(
    cameras: Sequence[CameraModel], covariance: Float, sigma_px: float
) -> Iterator[Finding]:
    remedy = "Take more pictures of the board, tilted by 30 to 50 degrees in all directions."
    if sigma_px > POOR_SIGMA_PX:
        remedy = "Look for glare, blur and motion: the corners of these pictures scatter too much."
    for one in judge_focal(cameras, covariance):
        yield Finding("calibration.focal_sigma", one.what, remedy, refuses=True, forcible=True)


def _untraceable(board: Board) -> Finding:
    return Finding(
        "boards.scale",
        f"The scale is not traceable: the board '{board.document.name}' has no certificate. "
        f"All lengths may be off by {2e6 * board.scale_sigma:.0f} um/m (k = 2, as stated).",
        "Show a certified length bar and add it by 'ocmm calibrate bundle'; it needs no new "
        "pictures. Then verify with another bar.",
        refuses=False,
    )


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
    focal = _start_focal(list(maps.values()), nominal.focal)
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


def _start_focal(maps: list[Float], nominal: float) -> float:
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
