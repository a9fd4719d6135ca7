"""Probe geometry from a sweep about its ball resting in a cone.

One adjustment of all spots determines the ball centre and the LEDs about it (thesis 3.2, replacing
its mean of four spheres).

Fault analysis (camera, cone, LED, or the cameras' record) maps a sweep onto a relocation bundle:
one seat with the ball, LEDs and tip unknown, cameras with their covariance. To first order, camera
errors below their uncertainty change it by less than a spot.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.bundle import BundleData, BundleState, Names, Prior, accuse, examine
from ocmm_core.calibration.pivot import _guards as guards
from ocmm_core.calibration.pivot._bundle import chi2_of_cameras, residuals
from ocmm_core.calibration.pivot._centre import thesis_pivot
from ocmm_core.calibration.pivot._covariance import coverage_of, geometry_in, pivot_uncertainty
from ocmm_core.calibration.pivot._data import PivotCalibration, PivotOptions, PivotSweep
from ocmm_core.calibration.pivot._robust import adjust_pivot_robustly
from ocmm_core.calibration.pivot._seat import examine_seat
from ocmm_core.calibration.pivot._start import start_pivot
from ocmm_core.calibration.records import Finding, let_pass
from ocmm_core.calibration.relocation import judge_residuals
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Points3, rigid_fit
from ocmm_core.tracking import ProbeBody

LEAST_SLACK_MM = 5e-4
"""Best credible rest of a ball in its cone."""

_LEAST_VARIANCE = 1e-10
"""For the scaled covariance of the cameras; smaller variances count as exact."""


def accuse_in_sweep(
    rig: Rig, sweep: PivotSweep, frames: Int, leds: Points3, tip: Float, centre: Float,
    rotations: Float, slack_mm: float, dof: int,
) -> tuple[Finding | None, float]:  # fmt: skip
    """Return the faulty element in consistent ``frames`` (n,) of a sweep, or None, and its worth.

    LEDs and tip: probe frame, mm; centre and rotations: world; ``dof`` of the adjustment.
    """
    n = len(rotations)
    data = BundleData(
        uv=np.ascontiguousarray(sweep.uv), weights=np.ascontiguousarray(sweep.weights),
        seats=np.zeros(n, dtype=np.int64), waved=0, seat_sigma=max(slack_mm, LEAST_SLACK_MM),
        bar_uv=np.zeros((0, len(rig.cameras), 2, 2)),
        bar_weights=np.zeros((0, len(rig.cameras), 2)), bars=np.zeros(0, dtype=np.int64),
        touched=np.zeros((0, 3), dtype=np.int64), touched_sigma=1.0,
    )  # fmt: skip
    state = BundleState(
        cameras=rig.cameras, leds=leds, tip=tip, seats=centre[None], lengths=np.zeros(0),
        rotations=rotations, origins=centre - rotations @ tip,
        bar_rotations=np.zeros((0, 3, 3)), bar_origins=np.zeros((0, 3)),
    )  # fmt: skip
    verdict = examine(data, _prior(rig, state), state, dof, exactly=False)
    if verdict is None or not verdict.named:
        return None, 0.0
    names = Names(
        cameras=tuple(camera.name for camera in rig.cameras),
        bars=(),
        procedure="the sweep",
        moment=lambda index: f"frame {int(frames[verdict.history.blocks[index].frames.start])}",
    )
    return accuse(verdict, names), verdict.named[0].worth


def _prior(rig: Rig, state: BundleState) -> Prior:
    """Return the prior: the cameras except their common rigid motion."""
    columns = state.columns
    cameras = columns.of_cameras
    covariance = rig.parameter_covariance
    scale = np.sqrt(covariance.diagonal())
    free = np.flatnonzero(scale > 0.0)
    information = np.zeros((columns.count, columns.count))
    if len(free):
        own = covariance[np.ix_(free, free)] / np.outer(scale[free], scale[free])
        values, vectors = np.linalg.eigh(own)
        inverse = (vectors / np.maximum(values, _LEAST_VARIANCE)) @ vectors.T
        inverse /= np.outer(scale[free], scale[free])
        motions = state.world_motions()[cameras][free]
        by = inverse @ motions
        # The common motion of all cameras is unobservable here.
        inverse -= by @ np.linalg.pinv(motions.T @ by) @ by.T
        information[np.ix_(free, free)] = 0.5 * (inverse + inverse.T)
    sought = np.concatenate([free, np.arange(columns.of_leds.start, columns.of_seats.stop)])
    return replace(Prior(state.values(), information, sought, len(free)), body_floats=True)


LEAST_FRAMES = 30
TOGETHER = 0.05
"""Fraction of frames; reflections and slips of a hand are rarer."""
_END = 0.02
"""Fraction of frames at either end of the sweep."""

_DRAWS, _PATTERNED = 8, 0.3
"""Number of drawn camera errors, the worst of which gives the limit of chi-square; unstated noise,
relative to the stated one, that counts as a sensor pattern."""


def calibrate_probe(
    rig: Rig,
    body: ProbeBody,
    sweep: PivotSweep,
    options: PivotOptions | None = None,
    force: bool = False,
) -> PivotCalibration:
    """Return LEDs and tip of the probe from a sweep.

    ``rig``: its `parameter_covariance` is part of the uncertainty. ``body``: nominal, defines the
    frame but does not influence the result. ``force`` overrules guards on the design.
    CalibrationError if the sweep does not determine the probe, or a guard refuses.
    """
    options = options or PivotOptions()
    limits = options.limits
    _check(body, sweep)
    start = start_pivot(rig, sweep, options.seed)
    robust = adjust_pivot_robustly(rig, sweep, start, options.slack_mm)
    if not robust.minimum.converged:
        raise CalibrationError(
            "pivot.not_converged",
            "The adjustment of the sweep did not converge.",
            "Sweep the probe wider, with its LEDs towards the cameras.",
        )
    state, used = robust.minimum.state, robust.used
    geometry = geometry_in(body.leds_probe, state.arms)
    of_probe = geometry.T_probe_from_body.rotation
    rotations = np.full((len(used), 3, 3), np.nan)
    rotations[used] = state.rotations @ of_probe.T
    middle = (geometry.leds_probe - geometry.tip_probe).mean(axis=0)
    coverage = coverage_of(rotations[used], middle)
    turned = tuple(guards.judge_coverage(coverage, limits))
    # Without enough motion the rest cannot be computed, or is meaningless.
    let_pass(turned, force)
    kept = sweep.only(used)
    uncertainty = pivot_uncertainty(
        rig, kept, state, geometry, options.slack_mm, options.resamples, options.seed,
        pattern=options.pattern,
    )  # fmt: skip
    spots = int(np.count_nonzero(kept.weights))
    # With slack, each pose has three more unknowns and three more conditions.
    dof = max(rig.per_spot * spots - 3 * len(kept.uv) - state.columns + 3, 1)
    # Camera errors within their uncertainty cause residuals beyond spot noise.
    by_cameras = chi2_of_cameras(rig, kept, state, options.slack_mm, _DRAWS, options.seed).max()
    chi2 = robust.minimum.cost
    common = guards.shared_part(rig, sweep) if options.pattern else 0.0
    # Spots that fit the probe worse than their sigma have errors that a wander does not cause.
    free = robust.free
    surplus = free.chi2[used].sum() / (free.dof[used].sum() + float(by_cameras)) - 1.0
    excess = float(np.sqrt(max(surplus, 0.0)))
    pattern_px = max(rig.noise.pattern_px * options.pattern, excess * np.median(sweep.sigma_px))
    by_tips = guards.tips_by_cameras(rig, kept, state, options.slack_mm, pattern_px, options.seed)
    total = uncertainty.total
    tip_sigma = float(np.sqrt(np.trace(total[-3:, -3:])))
    seat = examine_seat(
        robust.free, state, np.flatnonzero(used), by_tips, options.slack_mm, tip_sigma,
        pattern=options.pattern or excess > _PATTERNED,
    )  # fmt: skip
    total[-3:, -3:] += of_probe @ seat.of_tip @ of_probe.T
    judged = max(min(chi2, float(dof)), chi2 / (1.0 + float(by_cameras) / dof))
    # If many frames disagree with the others, the cause is not in single frames.
    asked, held = used, rotations
    if _did_not_come_back(used):
        asked = robust.free.solved
        held = np.where(used[:, None, None], rotations, robust.free.rotations @ of_probe.T)
    examined = sweep.only(asked)
    more = 2 * (np.count_nonzero(examined.weights) - spots) - 3 * (len(examined.uv) - len(kept.uv))
    accused, worth = accuse_in_sweep(
        rig, examined, np.flatnonzero(asked), geometry.leds_probe, geometry.tip_probe,
        state.centre, held[asked], options.slack_mm, dof + int(more),
    )  # fmt: skip
    jump = guards.find_jump(robust.free, used, state.centre, common, by_tips)
    moved = tuple(guards.judge_jump(jump, limits))
    judgements = [
        *guards.judge_shape(body, geometry.leds_probe, geometry.tip_probe, limits),
        *judge_residuals(judged, dof),
        *turned,
        *guards.judge_left_out(robust.left_out, len(used), limits),
        *moved,
        *guards.judge_uncertainty(tip_sigma, len(kept.uv), uncertainty.block, limits),
    ]
    # Pattern noise of the sensors follows the hand and resembles small changes in time: if the rig
    # has it, name an element only for findings of another guard.
    noticed = any(one.refuses and not one.forcible for one in judgements)
    named = [accused] if accused is not None and (noticed or not options.pattern) else []
    findings = [*seat.among(named, worth, jump.chi2 if jump and moved else 0.0), *judgements]
    warnings = let_pass(findings, force)
    residuals_px = np.full(sweep.uv.shape, np.nan)
    residuals_px[used] = -residuals(rig, kept, state)
    thesis = thesis_pivot(start.targets[used])
    return PivotCalibration(
        leds_probe=geometry.leds_probe, tip_probe=geometry.tip_probe, covariance=total,
        noise_covariance=uncertainty.noise, formal_covariance=uncertainty.formal,
        by_cameras=uncertainty.by_cameras, centre_world=state.centre, rotations=rotations,
        used=used, left_out=robust.left_out, residuals_px=residuals_px,
        rms_px=float(np.sqrt(np.nanmean(residuals_px**2))), chi2=chi2, dof=dof,
        tips_world=robust.free.tips, coverage=coverage, thesis=thesis,
        thesis_tip_probe=tip_of_arms(thesis.arms, body), warnings=warnings,
        forced=force and any(one.refuses for one in findings),
    )  # fmt: skip


def _did_not_come_back(used: NDArray[np.bool_]) -> bool:
    """Return whether a lasting displacement split the sweep; single excursions are outliers."""
    end = max(int(_END * len(used)), 1)
    many = np.count_nonzero(~used) > TOGETHER * len(used)
    return bool(many and min(used[:end].mean(), used[-end:].mean()) < 0.5)


def tip_of_arms(arms: Float, body: ProbeBody) -> Float:
    """Return the tip (3,), mm, in the document's frame fitted to the arms."""
    return rigid_fit(arms, body.leds_probe)[1]


def _check(body: ProbeBody, sweep: PivotSweep) -> None:
    if sweep.uv.ndim != 4 or sweep.uv.shape[2] != body.n_leds:
        raise CalibrationError(
            "pivot.leds",
            f"The sweep shows spots of {sweep.uv.shape[2] if sweep.uv.ndim == 4 else 0} LEDs, "
            f"but probe '{body.name}' has {body.n_leds}.",
            "Select the document of the probe that was swept.",
        )
    if len(sweep.sigma_px) != len(sweep.uv) or not np.all(sweep.sigma_px > 0.0):
        raise CalibrationError(
            "pivot.sigma",
            "The sweep has frames without a positive standard deviation of their spots.",
            "Give the sigma of the spots in pixels.",
        )
    if len(sweep.uv) < LEAST_FRAMES:
        raise CalibrationError(
            "pivot.few_frames",
            f"The sweep has only {len(sweep.uv)} frames; at least {LEAST_FRAMES} are needed, a "
            "few thousand are good.",
            "Sweep the probe for half a minute.",
        )
