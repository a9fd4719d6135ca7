"""Cameras from one bundle of a board's views, and of probe and bars if they were recorded.

Detection errors within a picture are correlated (blur, light, tilt), so the part of the covariance
by noise is scaled by the scatter between frames over that of independent spots (sandwich estimate;
Huber 1967).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_boards._adjustment import BoardFit, adjust_in_steps, dof_of
from ocmm_boards._board import Board
from ocmm_boards._corners import LEAST_CORNERS, BoardViews, with_dot_centres
from ocmm_boards._guards import FewViews, judge_solution
from ocmm_boards._joint import RecordedSpots, judge_recorded, with_recorded
from ocmm_core.calibration import bundle, guided
from ocmm_core.calibration.records import Finding, let_pass
from ocmm_core.calibration.relocation import (
    KeptByCameras,
    anchors_of,
    jacobian_of_world,
    motion_to_world,
)
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Points3, RigidTransform, rigid_fit, unit
from ocmm_core.tracking import triangulate

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
    corners: Points3
    """(N, 3), mm: shape of the board as found."""
    views: int


def calibrate_with_board(
    rig: Rig, board: Board, views: BoardViews, force: bool = False,
    recorded: RecordedSpots | None = None,
) -> BoardCalibration:  # fmt: skip
    """Return the cameras that explain the corners, in the world of the rig document.

    ``rig``: sensors, nominal focal lengths and rough poses; ``force`` turns guards on the design
    into warnings; ``recorded``: probe and bars, in the same bundle. CalibrationError: too few
    views, cameras that share none, or a guard refuses.
    """
    _require_views(rig, views)
    used, held = _split(views)
    alone, whole = adjust_in_steps(rig, board, used)
    if board.document.pattern == "dots":
        used = with_dot_centres(used, board.document.dot, whole.state, whole.views)
        alone, whole = adjust_in_steps(rig, board, used)
    findings: list[Finding] = []
    if recorded is not None:
        near = _near(whole, whole.state)
        apart = _together(whole, replace(rig, cameras=whole.state.cameras), whole.state, near)[0]
        whole = with_recorded(rig, board, whole, recorded, apart)
        findings = judge_recorded(rig, board, whole, recorded)
        # A wrong length or place would make all that follows meaningless.
        let_pass(findings, force=True)
    motion = motion_to_world(KeptByCameras(), (), whole.state, rig.cameras)
    state = whole.state.in_world(motion)
    near = _near(whole, state)
    to_world, of_anchors = jacobian_of_world(
        state, anchors_of(KeptByCameras(), (), state, rig.cameras)
    )
    of_cameras = state.columns.of_cameras
    located = replace(rig, cameras=state.cameras)
    together, noise = _together(whole, located, state, near)
    grown = near + (together - 1.0) * noise
    covariance = to_world @ grown @ to_world.T + of_anchors @ of_anchors.T
    covariance = covariance[of_cameras, of_cameras]
    own = whole.of_boards(state)
    corners = own.minimum.state.leds
    at_world, errors_world = _evaluated(located, corners, held)
    traceable = board.traceable or bool(recorded and recorded.artefacts)
    findings += judge_solution(rig, board, covariance, own, whole.sigma_px, alone, traceable)
    common = state.leds_world[whole.minimum.used.sum(axis=1) >= 2]
    hull = guided.hull_of(common, "Show the board all over the volume that two cameras see.")
    chi2 = whole.minimum.minimum.cost
    seen = np.isfinite(whole.minimum.distances)[..., None]
    left = np.where(seen, -whole.minimum.residuals, np.nan)
    found = guided.Findings(
        cameras=state.cameras, covariance=covariance,
        volume_world=np.stack([hull.min(axis=0), hull.max(axis=0)]), hull_world=hull,
        residuals=guided.residuals_of(
            state.cameras, whole.data.uv, left, whole.minimum.used
        ),
        rms_px=float(np.sqrt(np.mean(own.residuals[own.used] ** 2))),
        chi2_per_dof=chi2 / dof_of(whole.minimum, whole.prior),
        points=int(whole.minimum.used.any(axis=1).sum()),
        outliers=_outliers(own, used.chosen(whole.views), rig),
        errors_at_world=at_world, errors_world=errors_world,
        warnings=let_pass(findings, force),
    )  # fmt: skip
    return BoardCalibration(found, whole.sigma_px, together, corners, len(whole.views))


def _near(fit: BoardFit, state: bundle.BundleState) -> Float:
    """Return the covariance (k, k) of the common unknowns; CalibrationError if undetermined."""
    near = bundle.common_covariance(fit.minimum.data, fit.prior, state)
    if near is None:
        raise CalibrationError(
            "calibration.undetermined",
            "The pictures do not determine the cameras.",
            "Show the board at more angles and distances, in every part of the pictures.",
        )
    return near


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


def _together(
    fit: BoardFit, rig: Rig, state: bundle.BundleState, covariance: Float
) -> tuple[float, Float]:
    """Return the variance of lengths by the scatter between frames, over the stated one.

    Also the part of the covariance (k, k) by the stated noise of the spots in them.
    """
    data, columns = fit.minimum.data, state.columns
    nothing = replace(fit.prior, information=np.zeros_like(fit.prior.information))
    scatter, stated = np.zeros((columns.count,) * 2), np.zeros((columns.count,) * 2)
    for frame in np.flatnonzero(data.active[0]):
        part, seats = slice(frame, frame + 1), data.seats[frame : frame + 1]
        one = replace(
            data, uv=data.uv[part], weights=data.weights[part], seats=seats,
            waved=int(seats[0] < 0), bars=data.bars[:0], touched=data.touched[:0],
        )  # fmt: skip
        there = replace(state, rotations=state.rotations[part], origins=state.origins[part])
        normal, gradient = bundle.linearise(one, nothing, there, 0.0).reduced()
        scatter += np.outer(gradient, gradient)
        stated += normal
    cameras = covariance[columns.of_cameras]
    lengths = _length_rows(rig, state, state.leds[[0, fit.corners - 1]])
    grown, white = (
        np.einsum("np,pq,nq->", lengths, cameras @ part @ cameras.T, lengths, optimize=True)
        for part in (scatter, stated)
    )
    return max(1.0, float(grown / white)), covariance @ stated @ covariance


def _length_rows(rig: Rig, state: bundle.BundleState, ends: Points3) -> Float:
    """Return the derivatives (m, 14 C) of a length in all poses by the cameras."""
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


def _outliers(found: bundle.RobustMinimum, views: BoardViews, rig: Rig) -> tuple[str, ...]:
    wrong: Int = np.argwhere(np.isfinite(found.distances) & ~found.used)
    return tuple(
        f"corner {corner + 1} of view {views.names[view]} in {rig.cameras[camera].name}"
        for view, camera, corner in wrong
    )
