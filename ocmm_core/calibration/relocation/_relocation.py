"""Calibrate cameras in place without a CMM by one bundle adjustment.

From a waved probe and some ten placements of a length bar: camera poses, lenses and optionally the
geometry of the probe; length uncertainty from the covariance; bar residuals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration import bundle
from ocmm_core.calibration.guided import hull_of, location_gains
from ocmm_core.calibration.records import Finding, let_pass
from ocmm_core.calibration.relocation import _guards as guards
from ocmm_core.calibration.relocation._culprit import accuse_in_relocation, accuse_points, lone_bar
from ocmm_core.calibration.relocation._data import (
    BarDistance,
    BarResidual,
    KeptByPoints,
    Observations,
    RelocationOptions,
    RelocationResult,
    WrongSpot,
)
from ocmm_core.calibration.relocation._frame import anchors_of, jacobian_of_world, motion_to_world
from ocmm_core.calibration.relocation._problem import RelocationProblem, build, lens_covariance
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody, solve, triangulate


def judge_bars(
    rig: Rig, body: ProbeBody, observed: Observations, placements_used: NDArray[np.bool_]
) -> tuple[BarResidual, ...]:
    """Return the residual of each bar placement alone, with the cameras of ``rig``."""
    found = []
    used = iter(placements_used)
    for shown in observed.shown_bars:
        for index, (spots, sigma_px) in enumerate(zip(shown.uv, shown.sigma_px, strict=True)):
            ends = triangulate(rig, spots)
            sigma = np.nan
            if np.isfinite(ends).all():
                covariances = sigma_px**2 * location_gains(rig, ends)[1]
                sigma = _length_sigma_of(ends, covariances)
            measured = float(np.linalg.norm(ends[1] - ends[0]))
            found.append(_residual(shown.bar, index, measured, sigma, bool(next(used))))
    for touched in observed.touched_bars:
        for index, names in enumerate(touched.seats):
            pairs = [_seat_alone(rig, body, observed, observed.seats.index(n)) for n in names]
            ends, covariances = (np.stack(parts) for parts in zip(*pairs, strict=True))
            measured = float(np.linalg.norm(ends[1] - ends[0]))
            sigma = _length_sigma_of(ends, covariances)
            found.append(_residual(touched.bar, index, measured, sigma, used=True))
    return tuple(found)


def _residual(
    bar: BarDistance, placement: int, measured: float, sigma: float, used: bool
) -> BarResidual:
    return BarResidual(bar.name, placement, measured, measured - bar.length, sigma, used)


def _seat_alone(
    rig: Rig, body: ProbeBody, observed: Observations, seat: int
) -> tuple[Float, Float]:
    """Return mean (3,), mm, and covariance (3, 3) of the tips in one seat."""
    mine = observed.frames.seats == seat
    sigmas = observed.frames.sigma_px[mine]
    # Each frame has its own sigma; the unit of the solution is the smallest.
    unit_px = float(sigmas.min())
    batch = solve(observed.frames.uv[mine], rig, body, unit_px)
    solved = batch.status == 0
    growth = (sigmas / unit_px)[:, None, None] ** 2
    spread = growth * batch.tip_covariance + observed.seat_sigma**2 * np.eye(3)
    count = int(solved.sum())
    if not count:
        return np.full(3, np.nan), np.full((3, 3), np.nan)
    return batch.tip_world[solved].mean(axis=0), spread[solved].sum(axis=0) / count**2


def _length_sigma_of(ends: Float, covariances: Float) -> float:
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    return float(np.sqrt(along @ covariances.sum(axis=0) @ along))


_SOFT_MM = 0.1
"""Exact seats and bars slow convergence from a bad start: loosely first."""


def relocate(
    start: Rig,
    body: ProbeBody,
    observed: Observations,
    options: RelocationOptions | None = None,
    force: bool = False,
) -> RelocationResult:
    """Return the cameras that explain the spots of the waved probe and the bars.

    ``start``: poses to about 10 mm and half a degree, lenses to about 2 %; its
    `parameter_covariance` is the prior of ``lens="prior"`` and ``"fixed"``. ``force`` turns guards
    on the design into warnings. CalibrationError: too few frames, no length that gives the scale,
    an unknown seat, cameras undetermined by the frames, or a guard refuses.
    """
    options = options or RelocationOptions()
    problem = build(start, body, observed, options)
    found = _adjusted(problem)
    dof = found.data.excess + problem.own_degrees
    if dof < 1:
        raise CalibrationError(
            "relocation.too_few_frames",
            "Too few spots remain without the outliers to determine the cameras.",
            "Wave the probe longer, with its LEDs towards the cameras.",
        )
    chi2 = found.minimum.cost
    accusation = accuse_in_relocation(problem, found, start, body, observed, options)
    accused = [accusation.finding] if accusation and accusation.finding else []
    # Refuse hopeless results here: their world frame and covariance would be meaningless.
    settled = guards.judge_convergence(
        found,
        "Wave the probe longer, all over the volume and in all directions; if that does not help, "
        "calibrate the cameras from known points.",
    )
    findings = [*accused, *settled, *guards.judge_residuals(chi2, dof)]
    let_pass(findings, force=True)

    free = found.minimum.state
    motion = motion_to_world(options.world, observed.seats, free, start.cameras)
    state = free.in_world(motion)
    anchors = anchors_of(options.world, observed.seats, state, start.cameras)
    scale = max(1.0, chi2 / dof)
    near = _covariance(problem, found, state, start, options)
    to_world, of_anchors = jacobian_of_world(state, anchors)
    covariance = scale * (to_world @ near @ to_world.T + of_anchors @ of_anchors.T)
    thermal = _thermal(problem.prior, options.thermometer_k, near, to_world)
    misplaced: list[Finding] = []
    if isinstance(options.world, KeptByPoints):
        misplaced = guards.judge_anchors(tuple(options.world.positions_world), anchors, covariance)
        if accusation is not None:
            misplaced = [
                accuse_points(one, accusation.verdict, observed, options.world) for one in misplaced
            ]

    back = np.argsort(problem.order)
    used, seen = found.used[back], np.isfinite(found.distances[back])
    residuals = found.residuals[back]
    wrong = _wrong_spots(residuals, found.distances[back], seen & ~used)
    columns = state.columns
    cameras, of_probe = columns.of_cameras, slice(columns.of_leds.start, columns.of_tip.stop)
    tips = _tips(state, found)[back]
    targets = _targets(state, found)
    rig = replace(start, cameras=state.cameras)
    kept = replace(observed.frames, uv=np.where(used[..., None], observed.frames.uv, np.nan))
    bars = judge_bars(
        rig,
        replace(body, leds_probe=state.leds, tip_probe=state.tip),
        replace(observed, frames=kept),
        found.placements_used,
    )
    frames = int(np.isfinite(tips[:, 0]).sum())
    alone = lone_bar(accusation.verdict, observed, options) if accusation else None
    findings = [
        *findings,
        *guards.judge_knowledge(observed, options, problem.prior, state),
        *misplaced,
        *guards.judge_spots(wrong, int(seen.sum()), state.cameras),
        *guards.judge_design(observed, bars, targets, frames, alone),
        *guards.judge_focal(state.cameras, covariance),
    ]
    return RelocationResult(
        cameras=state.cameras, covariance=covariance[cameras, cameras],
        leds_probe=state.leds, tip_probe=state.tip,
        geometry_covariance=covariance[of_probe, of_probe],
        rms_px=float(np.sqrt(np.mean(residuals[used] ** 2))), chi2=chi2, dof=dof,
        residuals_px=-residuals, used=used, wrong_spots=wrong, frames_used=np.isfinite(tips[:, 0]),
        bars=bars, seats_world=dict(zip(observed.seats, state.seats, strict=True)),
        hull_world=hull_of(targets, "Wave the probe through the whole volume."), tips_world=tips,
        volume_world=np.stack([np.nanmin(tips, axis=0), np.nanmax(tips, axis=0)]),
        warnings=let_pass(findings, force), options=options,
        thermal=None if thermal is None else (thermal[0], thermal[1][cameras]),
    )  # fmt: skip


def _thermal(
    prior: bundle.Prior, sigma_k: float, covariance: Float, back: Float
) -> tuple[float, Float] | None:
    """Return what remains of the thermometer's error, K, and derivatives (k,) by it.

    It is linear in the priors' unknowns: bars and probe of different expansion measure it.
    """
    if prior.thermal is None:
        return None
    gain = sigma_k**2 * (prior.information @ prior.thermal)
    shared = covariance @ gain
    left = sigma_k**2 - sigma_k**2 * float(gain @ prior.thermal) + float(gain @ shared)
    left = max(left, 1e-12)
    return float(np.sqrt(left)), back @ shared / left


def _adjusted(problem: RelocationProblem) -> bundle.RobustMinimum:
    data, start = problem.data, problem.start
    if len(start.seats):
        soft = replace(data, seat_sigma=max(_SOFT_MM, data.seat_sigma), touched_sigma=_SOFT_MM)
        start = bundle.adjust_robustly(soft, problem.prior, start).minimum.state
    return bundle.adjust_robustly(data, problem.prior, start)


def _covariance(
    problem: RelocationProblem,
    found: bundle.RobustMinimum,
    state: bundle.BundleState,
    start: Rig,
    options: RelocationOptions,
) -> Float:
    considered = lens_covariance(start) if options.lens == "fixed" else None
    covariance = bundle.common_covariance(found.data, problem.prior, state, considered)
    if covariance is None:
        raise CalibrationError(
            "calibration.undetermined",
            "The frames do not determine the cameras.",
            "Wave the probe through the whole volume and tilt it in all directions; show the bar "
            "in depth too.",
        )
    return covariance


def _wrong_spots(
    residuals: Float, distances: Float, wrong: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
) -> tuple[WrongSpot, ...]:
    indices = np.argwhere(wrong)
    worst_first = np.argsort(-distances[wrong], kind="stable")
    return tuple(
        WrongSpot(int(n), int(c), int(led), float(distances[n, c, led]))
        for n, c, led in indices[worst_first]
    )


def _tips(state: bundle.BundleState, found: bundle.RobustMinimum) -> Points3:
    """Return the tips (n, 3), mm, world; NaN for unused frames."""
    tips: Points3 = state.rotations @ state.tip + state.origins
    tips[~found.data.active[0]] = np.nan
    return tips


def _targets(state: bundle.BundleState, found: bundle.RobustMinimum) -> Points3:
    """Return all LEDs of the probe seen by two cameras, (m, 3), mm, world."""
    seen: Points3 = state.leds_world[np.count_nonzero(found.used, axis=1) >= 2]
    return seen
