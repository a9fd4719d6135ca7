"""What a pivot calibration must show before it may be used; the same idea as `guards`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ocmm_core.calibration.pivot._covariance import LEAST_BLOCKS
from ocmm_core.calibration.pivot._data import LeftOut, PivotLimits, PivotSweep, SweepCoverage
from ocmm_core.calibration.pivot._robust import FreePoses
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody

_PARTS = 20
_SLOPE_MM = 0.05
"""Change of the tip over a radian of turn by errors of cameras and sensors."""
_LEAST_PARTS = 3
_MOVED_CHI2 = 35.0
"""Of three coordinates, the largest of some fifteen places where the ball may have jumped."""

WIDER = "Sweep the probe by 20 degrees or more to all sides, and turn it about its handle too."


@dataclass(frozen=True, slots=True)
class Jump:
    """Where the ball moved in the middle of a sweep."""

    frame: int
    """The first one after it."""
    shift_world: Float
    """(3,), mm."""
    chi2: float
    """Of no motion, three degrees of freedom."""


def judge_coverage(coverage: SweepCoverage, limits: PivotLimits) -> list[Finding]:
    """Return what the turns of the probe say."""
    first, second, third = np.degrees(coverage.ranges)
    said = f"The probe was rotated by {first:.0f}, {second:.0f} and {third:.0f} degrees"
    if second < limits.weak_deg:
        return [
            Finding(
                "pivot.weak_motion",
                f"{said} about its three axes: too little to determine its tip.",
                WIDER,
                refuses=True,
            )
        ]
    found = []
    if coverage.attitudes < limits.least_attitudes:
        found.append(
            Finding(
                "pivot.few_poses",
                f"The probe was seen in only {coverage.attitudes} different attitudes; "
                f"{limits.least_attitudes} are required.",
                "Sweep the probe longer, along different paths.",
                refuses=True,
            )
        )
    if second < limits.wanted_deg:
        found.append(
            Finding(
                "pivot.small_range",
                f"{said} about its three axes; {limits.wanted_deg:.0f} are required about two "
                "of them. Camera errors are amplified.",
                WIDER,
                refuses=bool(second < limits.small_deg),
                forcible=True,
            )
        )
    if third < limits.roll_deg:
        found.append(
            Finding(
                "pivot.no_third_turn",
                f"{said}; {limits.roll_deg:.0f} are required about the third axis.",
                "Turn the probe about its handle as well.",
                refuses=False,
            )
        )
    return found


def judge_left_out(
    left_out: tuple[LeftOut, ...], frames: int, limits: PivotLimits
) -> list[Finding]:
    """Return what the frames that were left out say."""
    if not left_out:
        return []
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
    return [
        Finding(
            "pivot.left_out",
            f"{len(left_out)} of {frames} frames {were} excluded: {'; '.join(parts)}.",
            "Keep the ball in its cone and the LEDs towards the cameras, look for reflections, and "
            "sweep again.",
            refuses=len(left_out) > limits.left_out * frames,
            # Hidden LEDs are a poor sweep; spots and tips that do not fit contradict the rest.
            forcible=all(one.reason == "few" for one in left_out),
        )
    ]


def find_jump(
    free: FreePoses, used: NDArray[np.bool_], centre: Float, common: float = 0.0
) -> Jump | None:
    """Return where the ball most probably moved to another place, or drifted on its way there.

    The tips of single frames are averaged over twenty parts of the sweep, each by its own
    covariance. What cameras and sensors do wrong follows the attitude, and a slow hand is in other
    attitudes later: a step in time is sought beside a slope over each axis of turn, which may be as
    large as such errors are. What the parts scatter beyond that counts as noise.

    Parameters
    ----------
    used
        (n,): frames that took part.
    centre
        (3,), mm, world: about where the ball rested.
    common
        Part of the variance of a frame that neighbouring frames share, because it is the sensors'
        pattern: it does not average out within a part.
    """
    frames = np.flatnonzero(used & free.solved)
    if len(frames) < 2 * _PARTS:
        return None
    parts = np.array_split(frames, _PARTS)
    weights = np.linalg.inv(free.covariances[frames])
    turns = Rotation.from_matrix(free.rotations[frames])
    held: Float = (turns.mean().inv() * turns).as_rotvec()
    ends = np.cumsum([len(part) for part in parts])[:-1]
    own = np.split(np.arange(len(frames)), ends)
    pulls = np.einsum("nij,nj->ni", weights, free.tips[frames] - centre)
    spreads = np.stack([np.linalg.inv(weights[part].sum(axis=0)) for part in own])
    means = np.stack([spreads[i] @ pulls[part].sum(axis=0) for i, part in enumerate(own)])
    shared = np.stack([free.covariances[part].mean(axis=0) for part in parts])
    information = np.linalg.inv(spreads + common * shared)
    attitudes = np.stack([held[part].mean(axis=0) for part in own])
    # Rows of each part, whitened: place, slope over three turns, and (last) the step.
    roots = np.linalg.cholesky(information).transpose(0, 2, 1)
    fixed = np.concatenate(
        [roots, *(roots * attitudes[:, i, None, None] for i in range(3))], axis=2
    )
    seen = np.einsum("pij,pj->pi", roots, means).ravel()
    prior = np.zeros((9, 15))
    prior[:, 3:12] = np.eye(9) / _SLOPE_MM
    best: Jump | None = None
    for split in range(_LEAST_PARTS, _PARTS - _LEAST_PARTS + 1):
        step = roots * (np.arange(_PARTS) >= split)[:, None, None]
        rows = np.concatenate([fixed, step], axis=2).reshape(-1, 15)
        design = np.vstack([rows, prior])
        covariance = np.linalg.inv(design.T @ design)
        found = covariance @ (rows.T @ seen)
        left = seen - rows @ found
        scale = max(float(left @ left) / (len(seen) - 15), 1.0)
        shift = found[12:]
        chi2 = float(shift @ np.linalg.solve(covariance[12:, 12:], shift)) / scale
        if best is None or chi2 > best.chi2:
            best = Jump(int(parts[split][0]), shift, chi2)
    return best


def shared_part(rig: Rig, sweep: PivotSweep) -> float:
    """Return the part of a frame's variance that is the pattern of the sensors."""
    return float(min((rig.noise.pattern_px / np.median(sweep.sigma_px)) ** 2, 1.0))


def judge_jump(jump: Jump | None, limits: PivotLimits) -> list[Finding]:
    """Return what a moving ball or cone says."""
    if jump is None or jump.chi2 <= _MOVED_CHI2:
        return []
    size = float(np.linalg.norm(jump.shift_world))
    if size <= limits.moved_mm:
        return []
    return [
        Finding(
            "pivot.moved",
            f"The ball shifted by {1e3 * size:.0f} um after frame {jump.frame}: the cone or the "
            "ball in it moved.",
            "Clamp the cone, clean it, press the ball into it evenly, and sweep again.",
            refuses=True,
        )
    ]


def judge_shape(
    body: ProbeBody, leds_probe: Points3, tip_probe: Float, limits: PivotLimits
) -> list[Finding]:
    """Return what the difference to the probe's document says."""
    off = np.linalg.norm(leds_probe - body.leds_probe, axis=1)
    rms = float(np.sqrt(np.mean(off**2)))
    if rms > limits.shape_mm:
        return [
            Finding(
                "pivot.wrong_probe",
                f"The LEDs are {rms:.2f} mm (RMS) off the document of probe '{body.name}', LED "
                f"{int(off.argmax()) + 1} most, by {off.max():.2f} mm.",
                "Select the document of this probe, or correct its LEDs.",
                refuses=True,
            )
        ]
    moved = float(np.linalg.norm(tip_probe - body.tip_probe))
    if moved > limits.tip_change_mm:
        return [
            Finding(
                "pivot.tip_changed",
                f"The tip is {moved:.3f} mm from its position in probe '{body.name}'.",
                "Check that the right tip is mounted and selected; give another stylus its own "
                "name.",
                refuses=True,
            )
        ]
    return []


def judge_uncertainty(
    tip_sigma: float, frames: int, block: int, limits: PivotLimits
) -> list[Finding]:
    """Return what the uncertainty of the tip says."""
    found = []
    if tip_sigma > limits.tip_sigma_mm:
        found.append(
            Finding(
                "pivot.tip_sigma",
                f"The tip is known only to {1e3 * tip_sigma:.0f} um; the limit is "
                f"{1e3 * limits.tip_sigma_mm:.0f} um.",
                f"{WIDER} If that does not help, calibrate the cameras in a deeper volume.",
                refuses=True,
                forcible=True,
            )
        )
    if frames // block <= LEAST_BLOCKS:
        found.append(
            Finding(
                "pivot.correlated",
                f"Frames are correlated over {block} of {frames}: the sweep has hardly more "
                f"than {frames // block} independent parts, so its uncertainty is only a guess.",
                "Sweep longer and faster, back and forth.",
                refuses=False,
            )
        )
    return found
