"""One bundle of all cameras, the poses of the board, and the board's own shape.

The board is a probe whose LEDs are corners with the covariance of `Board`; `calibration.bundle`
does the rest. Each camera is adjusted separately first: its residuals and those of the joint
adjustment must agree, otherwise something moved. The standard deviation of a corner is estimated
from the residuals. Detection errors within a picture are correlated (blur, light, tilt), so the
covariance is scaled by the scatter between views over that of independent corners (sandwich
estimate; Huber 1967).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from ocmm_boards._board import Board
from ocmm_boards._corners import LEAST_CORNERS, BoardViews, with_dot_centres
from ocmm_boards._guards import FewViews, judge_solution, placed, start_camera, told_moved
from ocmm_core.calibration import bundle, guided
from ocmm_core.calibration.records import let_pass
from ocmm_core.calibration.relocation import (
    KeptByCameras,
    anchors_of,
    jacobian_of_world,
    motion_to_world,
)
from ocmm_core.camera import CameraModel, Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Points3, RigidTransform, rigid_fit, unit
from ocmm_core.tracking import triangulate

START_SIGMA_PX = 0.2
"""A detector's usual scatter; the true one is estimated."""
_SIGMA_ROUNDS = 4
_SETTLED = 0.02
_HOPELESS_PX = 3.0
"""A board that is bent as stated leaves less by its nominal shape."""
EVALUATION_FROM = 20
"""Views seen by two cameras, from which every fifth is kept for evaluation."""


@dataclass(frozen=True, slots=True)
class BoardCalibration:
    """Cameras calibrated with a board."""

    found: guided.Findings
    """Cameras, covariance, residuals and warnings."""
    sigma_px: float
    """Estimated standard deviation of a corner of level 0, px per axis."""
    together: float
    """Factor of the covariance, as corners of a picture err together."""
    board: Board
    corners: Points3
    """(N, 3), mm: shape of the board as found."""
    views: int


@dataclass(frozen=True, slots=True)
class _Fit:
    """An adjustment with its estimated scatter."""

    minimum: bundle.RobustMinimum
    prior: bundle.Prior
    sigma_px: float

    @property
    def state(self) -> bundle.BundleState:
        return self.minimum.minimum.state


def calibrate_with_board(
    rig: Rig, board: Board, views: BoardViews, force: bool = False
) -> BoardCalibration:
    """Return the cameras that explain the corners, in the world of the rig document.

    ``rig``: sensors, nominal focal lengths and rough poses; ``force`` turns guards on the design
    into warnings. CalibrationError: too few views, cameras that share none, or a guard refuses.
    """
    _require_views(rig, views)
    used, held = _split(views)
    alone, whole, chosen = _in_steps(rig, board, used)
    if board.document.pattern == "dots":
        used = with_dot_centres(used, board.document.dot, whole.state, chosen)
        alone, whole, chosen = _in_steps(rig, board, used)
    motion = motion_to_world(KeptByCameras(), (), whole.state, rig.cameras)
    state = whole.state.in_world(motion)
    near = bundle.common_covariance(whole.minimum.data, whole.prior, state)
    if near is None:
        raise CalibrationError(
            "calibration.undetermined",
            "The pictures do not determine the cameras.",
            "Show the board at more angles and distances, in every part of the pictures.",
        )
    to_world, of_anchors = jacobian_of_world(
        state, anchors_of(KeptByCameras(), (), state, rig.cameras)
    )
    of_cameras = state.columns.of_cameras
    located = replace(rig, cameras=state.cameras)
    together = _together(whole, located, state, near)
    covariance = together * (to_world @ near @ to_world.T + of_anchors @ of_anchors.T)
    covariance = covariance[of_cameras, of_cameras]
    at_world, errors_world = _evaluated(located, state.leds, held)
    findings = judge_solution(rig, board, state, covariance, whole.minimum, whole.sigma_px, alone)
    common = state.leds_world[whole.minimum.used.sum(axis=1) >= 2]
    hull = _hull(common)
    chi2 = whole.minimum.minimum.cost
    found = guided.Findings(
        cameras=state.cameras, covariance=covariance,
        volume_world=np.stack([hull.min(axis=0), hull.max(axis=0)]), hull_world=hull,
        residuals=_residuals(whole.minimum, used.chosen(chosen), state.cameras),
        rms_px=float(np.sqrt(np.mean(whole.minimum.residuals[whole.minimum.used] ** 2))),
        chi2_per_dof=chi2 / _dof(whole.minimum, whole.prior),
        points=int(whole.minimum.used.any(axis=1).sum()),
        outliers=_outliers(whole.minimum, used.chosen(chosen), rig),
        errors_at_world=at_world, errors_world=errors_world,
        warnings=let_pass(findings, force),
    )  # fmt: skip
    return BoardCalibration(found, whole.sigma_px, together, board, state.leds, len(chosen))


def _in_steps(rig: Rig, board: Board, views: BoardViews) -> tuple[list[float], _Fit, Int]:
    """Adjust each camera, then all; return the scatter of each, px, the whole, and its views."""
    cameras, poses, alone = [], [], []
    for index, nominal in enumerate(rig.cameras):
        camera, of_camera = start_camera(nominal, board, views, index)
        single = _adjusted(board, views, (camera,), of_camera, [index])
        cameras.append(single.state.cameras[0])
        poses.append(_poses(single, of_camera))
        alone.append(single.sigma_px)
    started, boards = placed(tuple(cameras), poses, board.corners)
    every = list(range(len(rig.cameras)))
    expected_px = float(np.sqrt(np.mean(np.square(alone))))
    whole = _adjusted(board, views, started, boards, every, expected_px)
    return alone, whole, np.array(sorted(boards), dtype=np.int64)


def _require_views(rig: Rig, views: BoardViews) -> None:
    good = views.usable
    for camera, count in zip(rig.cameras, good.sum(axis=0), strict=True):
        if count < FewViews.of_camera:
            raise CalibrationError(
                "boards.few_views",
                f"Camera '{camera.name}' sees the board in only {count} pictures.",
                f"Take {FewViews.wanted} pictures or more of the board; at least "
                f"{FewViews.of_camera} are needed.",
            )
    common = int((good.sum(axis=1) >= 2).sum())
    if common < FewViews.common:
        raise CalibrationError(
            "boards.few_common",
            f"Only {common} views show the board to two cameras at the same time.",
            f"Show it where two cameras see it, {FewViews.wanted} times or more.",
        )


def _split(views: BoardViews) -> tuple[BoardViews, BoardViews]:
    """Return the views to calibrate by, and every fifth of those that two cameras see."""
    common = np.flatnonzero(views.usable.sum(axis=1) >= 2)
    held = common[2::5] if len(common) >= EVALUATION_FROM else common[:0]
    kept = np.setdiff1d(np.arange(len(views.names)), held)
    return views.chosen(kept.astype(np.int64)), views.chosen(held.astype(np.int64))


def _sees(good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the views (n,) in which a camera sees enough corners, from a mask (n, C, N)."""
    enough: NDArray[np.bool_] = (good.sum(axis=2) >= LEAST_CORNERS).any(axis=1)
    return enough


def _adjusted(
    board: Board, views: BoardViews, cameras: tuple[CameraModel, ...],
    boards: dict[int, RigidTransform], indices: list[int], expected_px: float = START_SIGMA_PX,
) -> _Fit:  # fmt: skip
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
    first = bundle.adjust_robustly(data, fixed, state, _sees)
    state = first.minimum.state
    # Poses that fit one camera alone leave half of the corners right.
    left_px = float(np.nanpercentile(np.linalg.norm(first.residuals[seen], axis=1), 75.0))
    if count > 1 and left_px > _HOPELESS_PX:
        # With free corners the adjustment would take minutes to fail.
        let_pass([told_moved(expected_px, left_px)], force=False)
    for _ in range(_SIGMA_ROUNDS):
        minimum = bundle.adjust_robustly(data, prior, state, _sees)
        state = minimum.minimum.state
        ratio = float(np.sqrt(minimum.minimum.cost / _dof(minimum, prior)))
        if abs(ratio - 1.0) <= _SETTLED:
            break
        sigma *= ratio
        data = replace(data, weights=weights / sigma)
    return _Fit(minimum, prior, sigma)


def _prior(board: Board, state: bundle.BundleState) -> bundle.Prior:
    columns = state.columns
    information = np.zeros((columns.count, columns.count))
    leds = columns.all_leds()
    information[np.ix_(leds, leds)] = np.linalg.inv(board.covariance)
    return bundle.Prior(state.values(), information, np.arange(columns.of_leds.stop), len(leds))


def _dof(found: bundle.RobustMinimum, prior: bundle.Prior) -> int:
    return max(found.data.excess + prior.rows + prior.gauge - len(prior.free), 1)


def _poses(fit: _Fit, boards: dict[int, RigidTransform]) -> dict[int, RigidTransform]:
    """Return the board's poses in a camera adjusted alone, for the views that were used."""
    state, active = fit.state, fit.minimum.data.active[0]
    camera = state.cameras[0].T_camera_from_world
    return {
        view: camera.compose(RigidTransform(state.rotations[row], state.origins[row]))
        for row, view in enumerate(sorted(boards))
        if active[row]
    }


def _together(fit: _Fit, rig: Rig, state: bundle.BundleState, covariance: Float) -> float:
    """Return the variance of lengths by the scatter between views, over the stated one."""
    data, columns = fit.minimum.data, state.columns
    nothing = replace(fit.prior, information=np.zeros_like(fit.prior.information))
    scatter, stated = np.zeros((columns.count,) * 2), np.zeros((columns.count,) * 2)
    for view in np.flatnonzero(data.active[0]):
        part = slice(view, view + 1)
        one = replace(
            data, uv=data.uv[part], weights=data.weights[part], seats=data.seats[part], waved=1
        )
        there = replace(state, rotations=state.rotations[part], origins=state.origins[part])
        normal, gradient = bundle.linearise(one, nothing, there, 0.0).reduced()
        scatter += np.outer(gradient, gradient)
        stated += normal
    cameras = covariance[columns.of_cameras]
    lengths = _length_rows(rig, state)
    grown, white = (
        np.einsum("np,pq,nq->", lengths, cameras @ part @ cameras.T, lengths, optimize=True)
        for part in (scatter, stated)
    )
    return max(1.0, float(grown / white))


def _length_rows(rig: Rig, state: bundle.BundleState) -> Float:
    """Return the derivatives (m, 14 C) of the boards' diagonals by the cameras."""
    ends = state.leds[[0, -1]]
    points = np.einsum("nij,lj->nli", state.rotations, ends) + state.origins[:, None]
    gains, _, seen = guided.location_gains(rig, points.reshape(-1, 3))
    whole = seen.reshape(-1, 2).all(axis=1)
    along = unit(points[:, 1] - points[:, 0])[whole]
    both = gains.reshape(-1, 2, gains.shape[1], gains.shape[2])[whole]
    rows: Float = np.einsum("ni,nip->np", along, both[:, 1] - both[:, 0])
    return rows


def _evaluated(rig: Rig, corners: Points3, held: BoardViews) -> tuple[Points3, Points3]:
    """Return places and errors (n, 3), mm, world, of corners in views that were kept back.

    Each board is located by all cameras, corner by corner, and compared with its shape.
    """
    places, errors = [np.empty((0, 3))], [np.empty((0, 3))]
    for uv in held.uv:
        located = triangulate(rig, uv)
        good = np.isfinite(located).all(axis=1)
        if good.sum() >= LEAST_CORNERS:
            motion = RigidTransform(*rigid_fit(corners[good], located[good]))
            places.append(located[good])
            errors.append(located[good] - motion.apply(corners[good]))
    return np.vstack(places), np.vstack(errors)


def _residuals(
    found: bundle.RobustMinimum, views: BoardViews, cameras: tuple[CameraModel, ...]
) -> tuple[guided.CameraResiduals, ...]:
    result = []
    for index, camera in enumerate(cameras):
        seen = np.isfinite(found.distances[:, index])
        result.append(
            guided.CameraResiduals(
                camera.name,
                views.uv[:, index][seen],
                -found.residuals[:, index][seen],
                found.used[:, index][seen],
            )
        )
    return tuple(result)


def _outliers(found: bundle.RobustMinimum, views: BoardViews, rig: Rig) -> tuple[str, ...]:
    wrong: Int = np.argwhere(np.isfinite(found.distances) & ~found.used)
    return tuple(
        f"corner {corner + 1} of view {views.names[view]} in {rig.cameras[camera].name}"
        for view, camera, corner in wrong
    )


def _hull(corners: Points3) -> Points3:
    try:
        return corners[ConvexHull(corners).vertices]
    except (QhullError, ValueError) as error:
        raise CalibrationError(
            "calibration.no_common_volume",
            f"Only {len(corners)} corners, or corners in one plane, were seen by two cameras.",
            "Show the board all over the volume that two cameras see.",
        ) from error
