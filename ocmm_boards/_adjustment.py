"""Adjust cameras, poses of the board and its shape: each camera alone, then all together.

The board is a probe whose LEDs are corners with the covariance of `Board`; `calibration.bundle`
does the rest. Each camera is adjusted separately first: its residuals and those of the joint
adjustment must agree, otherwise something moved. The standard deviation of a corner is estimated
from the residuals.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_boards._board import Board
from ocmm_boards._corners import LEAST_CORNERS, BoardViews
from ocmm_boards._guards import placed, start_camera, told_mirrored, told_moved, told_unexplained
from ocmm_core.calibration import bundle
from ocmm_core.calibration.records import let_pass
from ocmm_core.camera import CameraModel, Rig
from ocmm_core.geometry import Int, RigidTransform

START_SIGMA_PX = 0.2
"""A detector's usual scatter; the true one is estimated."""
_SIGMA_ROUNDS = 4
_SETTLED = 0.02
_HOPELESS_PX = 3.0
"""A board that is bent as stated leaves less by its nominal shape."""


@dataclass(frozen=True, slots=True)
class BoardFit:
    """An adjustment of views of the board; of probe and bars as well, once they were added."""

    minimum: bundle.RobustMinimum
    data: bundle.BundleData
    """With the weights of all spots."""
    prior: bundle.Prior
    sigma_px: float
    """Estimated scatter of a corner of level 0, px per axis."""
    views: Int
    """(n,): index of each view; they are the first frames."""
    corners: int
    """Number of corners; they are the first LEDs."""

    @property
    def state(self) -> bundle.BundleState:
        return self.minimum.minimum.state

    def of_boards(self, state: bundle.BundleState) -> bundle.RobustMinimum:
        """Return the part of the board's views alone, at a state of the whole."""
        views, corners = slice(0, len(self.views)), slice(0, self.corners)
        own = np.s_[views, :, corners]
        found, data = self.minimum, self.minimum.data
        reduced = replace(
            state, leds=state.leds[corners], rotations=state.rotations[views],
            origins=state.origins[views],
        )  # fmt: skip
        return bundle.RobustMinimum(
            replace(found.minimum, state=reduced),
            replace(data, uv=data.uv[own], weights=data.weights[own], seats=data.seats[views]),
            found.distances[own], found.residuals[own],
        )  # fmt: skip


def adjust_in_steps(rig: Rig, board: Board, views: BoardViews) -> tuple[list[float], BoardFit]:
    """Adjust each camera, then all; return the scatter of each, px, and the whole."""
    cameras, poses, alone = [], [], []
    for index, nominal in enumerate(rig.cameras):
        camera, of_camera = start_camera(nominal, board, views, index)
        let_pass(told_mirrored(nominal, of_camera.values()), force=False)
        single = _adjusted(board, views, (camera,), of_camera, [index])
        cameras.append(single.state.cameras[0])
        poses.append(_poses(single))
        alone.append(single.sigma_px)
    let_pass(told_unexplained(rig, alone), force=False)
    started, boards = placed(tuple(cameras), poses, board.corners)
    every = list(range(len(rig.cameras)))
    expected_px = float(np.sqrt(np.mean(np.square(alone))))
    return alone, _adjusted(board, views, started, boards, every, expected_px)


def sees(good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the views (n,) in which a camera sees enough corners, from a mask (n, C, N)."""
    enough: NDArray[np.bool_] = (good.sum(axis=2) >= LEAST_CORNERS).any(axis=1)
    return enough


def _adjusted(
    board: Board, views: BoardViews, cameras: tuple[CameraModel, ...],
    boards: dict[int, RigidTransform], indices: list[int], expected_px: float = START_SIGMA_PX,
) -> BoardFit:  # fmt: skip
    """Adjust cameras ``indices`` to the views in ``boards``, poses world from board.

    CalibrationError if several contradict each other by far; ``expected_px``: scatter of each
    alone.
    """
    chosen = np.array(sorted(boards), dtype=np.int64)
    count, n = len(indices), len(chosen)
    own = np.ix_(chosen, np.array(indices, dtype=np.int64))
    uv = np.ascontiguousarray(views.uv[own])
    state = bundle.BundleState(
        cameras=cameras, leds=board.corners, tip=np.zeros(3), seats=np.zeros((0, 3)),
        lengths=np.zeros(0), rotations=np.stack([boards[view].rotation for view in chosen]),
        origins=np.stack([boards[view].translation for view in chosen]),
        bar_rotations=np.zeros((0, 3, 3)), bar_origins=np.zeros((0, 3)),
    )  # fmt: skip
    seen = views.seen[own] & views.usable[own][..., None]
    weights = seen * 0.5 ** views.levels[own]
    data = bundle.BundleData(
        uv=uv, weights=weights / START_SIGMA_PX, seats=np.full(n, -1, dtype=np.int64), waved=n,
        seat_sigma=1.0, bar_uv=np.zeros((0, count, 2, 2)), bar_weights=np.zeros((0, count, 2)),
        bars=np.zeros(0, dtype=np.int64), touched=np.zeros((0, 3), dtype=np.int64),
        touched_sigma=1.0,
    )  # fmt: skip
    prior = _prior(board, state)
    sigma = START_SIGMA_PX
    fixed = replace(prior, free=np.arange(state.columns.of_cameras.stop), rows=0)
    first = bundle.adjust_robustly(data, fixed, state, sees)
    state = first.minimum.state
    # Poses that fit one camera alone leave half of the corners right.
    left_px = float(np.nanpercentile(np.linalg.norm(first.residuals[seen], axis=1), 75.0))
    if count > 1 and left_px > _HOPELESS_PX:
        # With free corners the adjustment would take minutes to fail.
        let_pass([told_moved(expected_px, left_px)], force=False)
    for _ in range(_SIGMA_ROUNDS):
        minimum = bundle.adjust_robustly(data, prior, state, sees)
        state = minimum.minimum.state
        ratio = float(np.sqrt(minimum.minimum.cost / dof_of(minimum, prior)))
        if abs(ratio - 1.0) <= _SETTLED:
            break
        sigma *= ratio
        data = replace(data, weights=weights / sigma)
    return BoardFit(minimum, data, prior, sigma, chosen, len(board.corners))


def _prior(board: Board, state: bundle.BundleState) -> bundle.Prior:
    columns = state.columns
    information = np.zeros((columns.count, columns.count))
    leds = columns.all_leds()
    information[np.ix_(leds, leds)] = np.linalg.inv(board.covariance)
    return bundle.Prior(state.values(), information, np.arange(columns.of_leds.stop), len(leds))


def dof_of(found: bundle.RobustMinimum, prior: bundle.Prior) -> int:
    return max(found.data.excess + prior.rows + prior.gauge - len(prior.free), 1)


def _poses(fit: BoardFit) -> dict[int, RigidTransform]:
    """Return the board's poses in a camera adjusted alone, for the views that were used."""
    state, active = fit.state, fit.minimum.data.active[0]
    camera = state.cameras[0].T_camera_from_world
    return {
        view: camera.compose(RigidTransform(state.rotations[row], state.origins[row]))
        for row, view in enumerate(fit.views.tolist())
        if active[row]
    }
