"""Criteria that a pivot calibration must meet; same principle as `guards`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.calibration.pivot import _bundle as bundle
from ocmm_core.calibration.pivot._covariance import LEAST_BLOCKS, random_waves
from ocmm_core.calibration.pivot._data import ExcludedFrame, PivotLimits, PivotSweep, SweepCoverage
from ocmm_core.calibration.pivot._robust import FreePoses, free_poses
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Points3
from ocmm_core.tracking import ProbeBody

_WAVES, _WAVES_OF_PLACES = 100, 400
"""Waves of a sensor pattern and of a tracker's place errors. These are most of the scatter of the
tips: from too few waves, the covariance of 27 unknowns makes chi-square larger by 1.4, from 100."""
_FRAMES = 1000
"""Frames that represent all: errors of cameras vary slowly with the attitude."""


@dataclass(frozen=True, slots=True)
class CameraTips:
    """Shifts of the tips of some frames by independent sensor and camera errors of one sigma."""

    frames: Int
    """(m,): indices into the used frames, increasing."""
    shifts: Float
    """(m, 3, k), mm, world: by the cameras and by the noise of the arms; NaN for a frame without
    pose."""
    by_pattern: Float
    """(m, 3, k), likewise: by waves of a sensor pattern; their mean square is its variance."""


def tips_by_cameras(
    rig: Rig, sweep: PivotSweep, state: bundle.PivotState, slack_mm: float,
    pattern_px: float = 0.0, seed: int = 1,
) -> CameraTips:  # fmt: skip
    """Return how errors of cameras shift the tips of frames after the adjustment.

    Noise-free spots of wrong cameras, and of sensors with waves of ``pattern_px``, are adjusted
    with the calibrated ones by one step; each frame is then solved alone, as `free_poses` does.
    """
    noise = _noise_of_arms(rig, sweep, state, slack_mm)
    some = np.arange(0, len(sweep.uv), max(1, len(sweep.uv) // _FRAMES))
    state = replace(state, rotations=state.rotations[some], slacks=state.slacks[some])
    sweep = replace(sweep, uv=sweep.uv[some], sigma_px=sweep.sigma_px[some])
    root = bundle.camera_error_root(rig)
    waves = (_WAVES if rig.markers is None else _WAVES_OF_PLACES) if pattern_px > 0.0 else 0

    def wrong() -> Iterator[tuple[PivotSweep, Points3]]:
        for off in root.T:
            seen = bundle.spots_of_cameras(rig, sweep, state, off)
            yield seen, _followed(rig, seen, state, slack_mm)
        exact = bundle.spots_of_cameras(rig, sweep, state, np.zeros(len(root)))
        for off in noise:
            yield exact, state.arms + off
        for wave in random_waves(rig, exact.uv, pattern_px, waves, np.random.default_rng(seed)):
            seen = replace(exact, uv=exact.uv + wave)
            yield seen, _followed(rig, seen, state, slack_mm)

    split = root.shape[1] + len(noise)
    shifts = np.empty((len(some), 3, split + waves))
    for number, (seen, arms) in enumerate(wrong()):
        free = free_poses(rig, seen, arms)
        shifts[:, :, number] = np.where(free.solved[:, None], free.tips - state.centre, np.nan)
    return CameraTips(some.astype(np.int64), shifts[:, :, :split], shifts[:, :, split:])


def _followed(rig: Rig, seen: PivotSweep, state: bundle.PivotState, slack_mm: float) -> Points3:
    """Return the arms after one step to other spots."""
    here = bundle.normals_at(rig, seen, state, slack_mm)
    step = -bundle.solve_pinned(here.normals[0], state.turns(), here.gradients[0])
    return state.arms + step[3:].reshape(-1, 3)


def _noise_of_arms(rig: Rig, sweep: PivotSweep, state: bundle.PivotState, slack_mm: float) -> Float:
    """Return independent errors (k, L, 3), mm, of the arms by the noise of the spots."""
    here = bundle.normals_at(rig, sweep, state, slack_mm)
    covariance = bundle.inverse_pinned(here.normals[0], state.turns())
    if covariance is None:
        return np.empty((0, *state.arms.shape))
    values, vectors = np.linalg.eigh(covariance[3:, 3:])
    roots: Float = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    return roots.reshape(-1, *state.arms.shape)


_PARTS = 20
_SLOPE_MM = 0.05
"""Change of the tip per radian of rotation due to sensor errors."""
_LEAST_PARTS = 3
_MOVED_CHI2 = 35.0
"""Chi-square of three coordinates, maximum over some fifteen possible jump positions."""

WIDER = "Sweep the probe by 20 degrees or more to all sides, and turn it about its handle too."


@dataclass(frozen=True, slots=True)
class Jump:
    """Displacement of the ball during a sweep."""

    frame: int
    """First frame after it."""
    shift_world: Float
    """(3,), mm."""
    chi2: float
    """Of the hypothesis of no motion, three degrees of freedom."""


def judge_coverage(coverage: SweepCoverage, limits: PivotLimits) -> Iterator[Finding]:
    """Yield findings on the rotation range of the probe."""
    first, second, third = np.degrees(coverage.ranges)
    said = f"The probe was rotated by {first:.0f}, {second:.0f} and {third:.0f} degrees"
    if second < limits.weak_deg:
        yield Finding(
            "pivot.weak_motion",
            f"{said} about its three axes: too little to determine its tip.",
            WIDER,
            refuses=True,
        )
        return
    if coverage.attitudes < limits.least_attitudes:
        yield Finding(
            "pivot.few_poses",
            f"The probe was seen in only {coverage.attitudes} different attitudes; "
            f"{limits.least_attitudes} are required.",
            "Sweep the probe longer, along different paths.",
            refuses=True,
        )
    if second < limits.wanted_deg:
        yield Finding(
            "pivot.small_range",
            f"{said} about its three axes; {limits.wanted_deg:.0f} are required about two "
            "of them. Camera errors are amplified.",
            WIDER,
            refuses=bool(second < limits.small_deg),
            forcible=True,
        )
    if third < limits.roll_deg:
        yield Finding(
            "pivot.no_third_turn",
            f"{said}; {limits.roll_deg:.0f} are required about the third axis.",
            "Turn the probe about its handle as well.",
            refuses=False,
        )


def judge_left_out(
    left_out: tuple[ExcludedFrame, ...], frames: int, limits: PivotLimits
) -> Iterator[Finding]:
    if not left_out:
        return
    parts = []
    words = {
        "few": "show fewer than three LEDs to two cameras",
        "spots": "have spots that do not fit the probe",
        "tip": "place the ball elsewhere",
    }
    for reason, word in words.items():
        own = [one for one in left_out if one.reason == reason]
        if own:
            last = f" to {own[-1].frame}" if len(own) > 1 else ""
            off = f", by {np.median([one.size for one in own]):.2f} mm" if reason == "tip" else ""
            parts.append(f"{len(own)} {word} (frame {own[0].frame}{last}{off})")
    were = "was" if len(left_out) == 1 else "were"
    yield Finding(
        "pivot.left_out",
        f"{len(left_out)} of {frames} frames {were} excluded: {'; '.join(parts)}.",
        "Keep the ball in its cone and the LEDs towards the cameras, look for reflections, and "
        "sweep again.",
        refuses=len(left_out) > limits.left_out * frames,
        # Hidden LEDs mean a poor sweep; inconsistent spots and tips contradict the rest.
        forcible=all(one.reason == "few" for one in left_out),
    )


def find_jump(
    free: FreePoses,
    used: NDArray[np.bool_],
    centre: Float,
    common: float = 0.0,
    by_cameras: CameraTips | None = None,
) -> Jump | None:
    """Return the most probable displacement of the ball, sudden or gradual.

    Tips of single frames are averaged over twenty parts of the sweep, weighted by their
    covariances. Camera and sensor errors depend on the attitude, which drifts: a step in time is
    estimated together with the errors of the cameras (``by_cameras``: shifts; None if exact), by
    their covariance, and with a slope over each rotation axis for those of the sensors. Scatter
    beyond that is noise. ``used`` (n,): frames; ``centre`` (3,), mm, world, approximate;
    ``common``: fraction of a frame's variance shared by neighbours (sensor pattern), which does not
    average out within a part.
    """
    frames = np.flatnonzero(used & free.solved)
    if len(frames) < 2 * _PARTS:
        return None
    parts = np.array_split(frames, _PARTS)
    weights = np.linalg.inv(free.covariances[frames])
    turns = scipy.spatial.transform.Rotation.from_matrix(free.rotations[frames])
    held: Float = (turns.mean().inv() * turns).as_rotvec()
    ends = np.cumsum([len(part) for part in parts])[:-1]
    own = np.split(np.arange(len(frames)), ends)
    pulls = np.einsum("nij,nj->ni", weights, free.tips[frames] - centre)
    spreads = np.stack([np.linalg.inv(weights[part].sum(axis=0)) for part in own])
    means = np.stack([spreads[i] @ pulls[part].sum(axis=0) for i, part in enumerate(own)])
    shared = np.stack([free.covariances[part].mean(axis=0) for part in parts])
    information = np.linalg.inv(spreads + common * shared)
    attitudes = np.stack([held[part].mean(axis=0) for part in own])
    # Rows of each part, whitened: place, slope over three rotations, and (last) the step.
    roots = np.linalg.cholesky(information).transpose(0, 2, 1)
    cameras = _part_shifts(by_cameras, frames, np.flatnonzero(used), ends)
    fixed = np.concatenate(
        [roots, *(roots * attitudes[:, i, None, None] for i in range(3)), roots @ cameras], axis=2
    )
    seen = np.einsum("pij,pj->pi", roots, means).ravel()
    size = fixed.shape[2]
    prior = np.zeros((size - 3, size + 3))
    prior[:, 3:size] = np.diag(np.repeat([1.0 / _SLOPE_MM, 1.0], [9, size - 12]))
    best: Jump | None = None
    for split in range(_LEAST_PARTS, _PARTS - _LEAST_PARTS + 1):
        step = roots * (np.arange(_PARTS) >= split)[:, None, None]
        rows = np.concatenate([fixed, step], axis=2).reshape(-1, size + 3)
        design = np.vstack([rows, prior])
        covariance = np.linalg.inv(design.T @ design)
        found = covariance @ (rows.T @ seen)
        left = seen - rows @ found
        scale = max(float(left @ left) / (len(seen) - 15), 1.0)
        shift = found[size:]
        chi2 = float(shift @ np.linalg.solve(covariance[size:, size:], shift)) / scale
        if best is None or chi2 > best.chi2:
            best = Jump(int(parts[split][0]), shift, chi2)
    return best


def _part_shifts(by_cameras: CameraTips | None, frames: Int, used: Int, ends: Int) -> Float:
    """Return the mean shifts by camera errors of each part of the frames, (parts, 3, k)."""
    if by_cameras is None:
        return np.zeros((_PARTS, 3, 0))
    part_of = np.searchsorted(frames[ends], used[by_cameras.frames], side="right")
    good = np.isfinite(by_cameras.shifts).all(axis=(1, 2))
    for part in range(_PARTS):
        if not np.any(good & (part_of == part)):
            own = frames[np.searchsorted(ends, np.arange(len(frames)), side="right") == part]
            raise CalibrationError(
                "pivot.camera_errors",
                f"From frame {own[0]} to {own[-1]}, cameras wrong by their uncertainty give no "
                "pose of the probe.",
                "Calibrate the cameras, and sweep where all of them see the LEDs well.",
            )
    return np.stack(
        [by_cameras.shifts[good & (part_of == part)].mean(axis=0) for part in range(_PARTS)]
    )


def shared_part(rig: Rig, sweep: PivotSweep) -> float:
    """Return the fraction of a frame's variance due to the sensor pattern."""
    return float(min((rig.noise.pattern_px / np.median(sweep.sigma_px)) ** 2, 1.0))


def judge_jump(jump: Jump | None, limits: PivotLimits) -> Iterator[Finding]:
    size = 0.0 if jump is None else float(np.linalg.norm(jump.shift_world))
    if jump is not None and jump.chi2 > _MOVED_CHI2 and size > limits.moved_mm:
        yield Finding(
            "pivot.moved",
            f"The ball shifted by {1e3 * size:.0f} um after frame {jump.frame}: the cone or the "
            "ball in it moved.",
            "Clamp the cone, clean it, press the ball into it evenly, and sweep again.",
            refuses=True,
        )


def judge_shape(
    body: ProbeBody, leds_probe: Points3, tip_probe: Float, limits: PivotLimits
) -> Iterator[Finding]:
    """Yield a finding on the difference from the probe's document."""
    off = np.linalg.norm(leds_probe - body.leds_probe, axis=1)
    rms, moved = float(np.sqrt(np.mean(off**2))), float(np.linalg.norm(tip_probe - body.tip_probe))
    if rms > limits.shape_mm:
        yield Finding(
            "pivot.wrong_probe",
            f"The LEDs are {rms:.2f} mm (RMS) off the document of probe '{body.name}', LED "
            f"{int(off.argmax()) + 1} most, by {off.max():.2f} mm.",
            "Select the document of this probe, or correct its LEDs.",
            refuses=True,
        )
    elif moved > limits.tip_change_mm:
        yield Finding(
            "pivot.tip_changed",
            f"The tip is {moved:.3f} mm from its position in probe '{body.name}'.",
            "Check that the right tip is mounted and selected; give another stylus its own name.",
            refuses=True,
        )


def judge_uncertainty(
    tip_sigma: float, frames: int, block: int, limits: PivotLimits
) -> Iterator[Finding]:
    if tip_sigma > limits.tip_sigma_mm:
        yield Finding(
            "pivot.tip_sigma",
            f"U of the tip (k = 2) is {2e3 * tip_sigma:.0f} um; the limit is "
            f"{2e3 * limits.tip_sigma_mm:.0f} um.",
            f"{WIDER} If that does not help, calibrate the cameras in a deeper volume.",
            refuses=True,
            forcible=True,
        )
    if frames // block <= LEAST_BLOCKS:
        yield Finding(
            "pivot.correlated",
            f"Frames are correlated over {block} of {frames}: the sweep has hardly more "
            f"than {frames // block} independent parts, so its uncertainty is only a guess.",
            "Sweep longer and faster, back and forth.",
            refuses=False,
        )
