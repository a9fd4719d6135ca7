"""Which views of a board are still missing: places in the pictures, tilts, distances.

Focal length and distortion need corners in every part of a picture, and boards that are tilted in
all directions (Zhang 2000); the cameras among each other need views that two of them see.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_boards._board import Board
from ocmm_boards._corners import BoardViews
from ocmm_boards._guards import FewViews, start_camera
from ocmm_core.camera import CameraModel
from ocmm_core.geometry import Int, Pixels

CELLS = 3
"""Parts of a picture in each direction."""
_WANTED = FewViews.wanted * 5 // 4 + 1
"""As every fifth view is kept for evaluation."""
_LEAST_TILT = np.sin(np.radians(20.0))
_TILTED_VIEWS = 2
_SPREAD = 1.15
"""Largest over smallest distance."""
_PARTS = (
    "upper left", "upper middle", "upper right", "left side", "middle part", "right side",
    "lower left", "lower middle", "lower right",
)  # fmt: skip
_SIDES = ("left edge", "right edge", "upper edge", "lower edge")


@dataclass(frozen=True, slots=True)
class ViewReport:
    """Value of the views so far."""

    corners: tuple[int, ...]
    """In the last view, by camera."""
    cells: Int
    """(C, 3, 3): corners of all views in each part of a picture, rows from above."""
    views: int
    """That at least one camera can use."""
    common: int
    """That two cameras can use."""
    enough: bool
    wanted: str
    """Sentence: the view to take next, or that there are enough."""


class ViewCoach:
    """Collects the corners of views, and names the view to take next.

    ``views``: corners (C, N, 2) of each earlier view, px, NaN if unseen.
    """

    def __init__(
        self, cameras: Sequence[CameraModel], board: Board, views: Iterable[Pixels] = ()
    ) -> None:
        self._cameras, self._board = tuple(cameras), board
        self._views = list(views)

    def add(self, corners: Sequence[Pixels]) -> ViewReport:
        """Add the corners (N, 2) of each camera, px, NaN if unseen; return the new report."""
        self._views.append(np.stack(corners))
        return self.report()

    def report(self) -> ViewReport:
        shape = (len(self._views), len(self._cameras), len(self._board.corners), 2)
        uv = np.array(self._views).reshape(shape)
        views = BoardViews(
            tuple(f"{n:03d}" for n in range(1, len(uv) + 1)), uv, np.zeros(shape[:3], np.int64)
        )
        usable = views.usable
        common = int((usable.sum(axis=1) >= min(2, len(self._cameras))).sum())
        cells = np.stack([_cells(one, uv[:, n]) for n, one in enumerate(self._cameras)])
        wanted = self._wanted(views, common, cells)
        return ViewReport(
            tuple(views.seen[-1].sum(axis=1).tolist()) if len(uv) else (0,) * len(self._cameras),
            cells, int(usable.any(axis=1).sum()), common, not wanted,
            wanted or "There are enough views: calibrate.",
        )  # fmt: skip

    def _wanted(self, views: BoardViews, common: int, cells: Int) -> str:
        """Return the sentence on the most needed view; empty if there are enough."""
        usable = views.usable
        if len(usable) and not usable[-1].any():
            return "No camera sees enough of the board: bring it closer, into focus and light."
        for index, camera in enumerate(self._cameras):
            if usable[:, index].sum() < 3:
                return f"Show the board to camera '{camera.name}', and to another one as well."
        if common < FewViews.common:
            return "Show the board where two cameras see it."
        for index, camera in enumerate(self._cameras):
            tilts, distances = self._poses(views, index)
            side = _missing_side(tilts)
            if side:
                return (
                    f"Camera '{camera.name}': tilt the board by 30 to 50 degrees, its {side} "
                    "towards the camera."
                )
            part = _missing_part(cells[index])
            if part:
                return f"Camera '{camera.name}': show the board in the {part} of its picture."
            if distances.max() < _SPREAD * distances.min():
                return f"Camera '{camera.name}': show the board nearer and farther away."
        left = _WANTED - len(usable)
        return f"Go on with other places and tilts; views wanted: {left}." if left > 0 else ""

    def _poses(self, views: BoardViews, index: int) -> tuple[Pixels, Pixels]:
        """Return tilts of the board (n, 2), and distances (n,), mm, in one camera.

        Tilts are parts of its normal away from the camera: positive if the board is nearer to the
        right and below.
        """
        _, poses = start_camera(self._cameras[index], self._board, views, index)
        normals = np.stack([pose.rotation[:, 2] for pose in poses.values()])
        tilts = normals[:, :2] * np.sign(normals[:, 2:])
        return tilts, np.array([pose.translation[2] for pose in poses.values()])


def _cells(camera: CameraModel, uv: Pixels) -> Int:
    seen = uv[np.isfinite(uv[..., 0])]
    edges = [np.linspace(0.0, size, CELLS + 1) for size in (camera.height, camera.width)]
    counts, _, _ = np.histogram2d(seen[:, 1], seen[:, 0], bins=edges)
    found: Int = counts.astype(np.int64)
    return found


def _missing_part(cells: Int) -> str:
    """Return the first part of a picture without corners; empty if none."""
    for part, count in zip(_PARTS, cells.ravel().tolist(), strict=True):
        if count == 0:
            return part
    return ""


def _missing_side(tilts: Pixels) -> str:
    """Return the edge of the board that was not towards the camera often enough; empty if none."""
    amounts = (-tilts[:, 0], tilts[:, 0], -tilts[:, 1], tilts[:, 1])
    for side, amount in zip(_SIDES, amounts, strict=True):
        if np.count_nonzero(amount > _LEAST_TILT) < _TILTED_VIEWS:
            return side
    return ""
