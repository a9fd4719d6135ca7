"""What a pivot calibration must show before it may be used; the same idea as `guards`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.guards import Finding
from ocmm_core.calibration.pivot_covariance import LEAST_BLOCKS
from ocmm_core.calibration.pivot_data import Coverage, LeftOut, PivotLimits
from ocmm_core.calibration.pivot_robust import FreePoses
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking.body import ProbeBody

_PARTS = 20
_LEAST_PARTS = 3
_MOVED_CHI2 = 35.0
"""Of three coordinates, the largest of some fifteen places where the ball may have jumped."""

WIDER = "Sweep the probe by 20 degrees or more to all sides, and turn it about its handle too."


@dataclass(frozen=True, slots=True)
class Jump:
    """Where the ball moved in the middle of a sweep.

    Attributes
    ----------
    frame
        The first one after it.
    shift_world
        (3,), mm.
    chi2
        Of no motion, three degrees of freedom.
    """

    frame: int
    shift_world: Float
    chi2: float


def judge_coverage(coverage: Coverage, limits: PivotLimits) -> list[Finding]:
    """Return what the turns of the probe say."""
    first, second, third = np.degrees(coverage.ranges)
    said = f"The probe was turned by {first:.0f}, {second:.0f} and {third:.0f} degrees"
    if second < limits.weak_deg:
        return [
            Finding(
                "pivot.weak_motion",
                f"{said} about its three axes: too little to find its tip.",
                WIDER,
                refuses=True,
            )
        ]
    found = []
    if coverage.attitudes < limits.least_attitudes:
        found.append(
            Finding(
                "pivot.few_poses",
                f"The probe was seen in {coverage.attitudes} different attitudes only; "
                f"{limits.least_attitudes} are wanted.",
                "Sweep the probe longer, on other ways each time.",
                refuses=True,
            )
        )
    if second < limits.wanted_deg:
        found.append(
            Finding(
                "pivot.small_range",
                f"{said} about its three axes, and {limits.wanted_deg:.0f} are wanted about two "
                f"of them; errors of the cameras are enlarged.",
                WIDER,
                refuses=bool(second < limits.small_deg),
                forcible=True,
            )
        )
    if third < limits.roll_deg:
        found.append(
            Finding(
                "pivot.no_third_turn",
                f"{said}; about the third axis {limits.roll_deg:.0f} are wanted.",
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
        "tip": "put the ball elsewhere",
    }
    for reason, word in words.items():
        own = [one for one in left_out if one.reason == reason]
        if own:
            last = f" to {own[-1].frame}" if len(own) > 1 else ""
            off = f", by {np.median([one.size for one in own]):.2f} mm" if reason == "tip" else ""
            parts.append(f"{len(own)} {word} (frame {own[0].frame}{last}{off})")
    return [
        Finding(
            "pivot.left_out",
            f"{len(left_out)} of {frames} frames were left out: {'; '.join(parts)}.",
            "Keep the ball in its cone and the LEDs towards the cameras, look for reflections, and "
            "sweep again.",
            refuses=len(left_out) > limits.left_out * frames,
            forcible=True,
        )
    ]


def find_jump(free: FreePoses, used: NDArray[np.bool_], centre: Float) -> Jump | None:
    """Return where the ball most probably moved to another place, or drifted on its way there.

    The tips of single frames are averaged over twenty parts of the sweep, each by its own
    covariance; the parts before and after every possible moment are compared. What the parts
    scatter beyond their noise, as errors of the cameras make them, counts as noise.
    """
    frames = np.flatnonzero(used & free.solved)
    if len(frames) < 2 * _PARTS:
        return None
    parts = np.array_split(frames, _PARTS)
    information = np.stack([np.linalg.inv(free.covariances[part]).sum(axis=0) for part in parts])
    pulls = np.stack(
        [
            np.einsum(
                "nij,nj->i", np.linalg.inv(free.covariances[part]), free.tips[part] - centre
            )
            for part in parts
        ]
    )
    means = np.linalg.solve(information, pulls[..., None])[..., 0]
    best: Jump | None = None
    for split in range(_LEAST_PARTS, _PARTS - _LEAST_PARTS + 1):
        sides, squares = [], 0.0
        for side in (slice(0, split), slice(split, None)):
            own = np.linalg.inv(information[side].sum(axis=0))
            mean = own @ pulls[side].sum(axis=0)
            off = means[side] - mean
            squares += float(np.einsum("pi,pij,pj->", off, information[side], off))
            sides.append((mean, own))
        scale = max(squares / (3.0 * (_PARTS - 2)), 1.0)
        shift = sides[1][0] - sides[0][0]
        chi2 = float(shift @ np.linalg.solve(sides[0][1] + sides[1][1], shift)) / scale
        if best is None or chi2 > best.chi2:
            best = Jump(int(parts[split][0]), shift, chi2)
    return best


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
            f"The ball stood {1e3 * size:.0f} um elsewhere after frame {jump.frame} than before: "
            f"the cone or the ball in it moved.",
            "Clamp the cone, clean it, press the ball into it evenly, and sweep again.",
            refuses=True,
            forcible=True,
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
                f"The LEDs are {rms:.2f} mm (RMS) from where the document of probe '{body.name}' "
                f"has them, LED {int(off.argmax()) + 1} most, by {off.max():.2f} mm.",
                "Choose the document of this probe, or correct its LEDs.",
                refuses=True,
            )
        ]
    moved = float(np.linalg.norm(tip_probe - body.tip_probe))
    if moved > limits.tip_change_mm:
        return [
            Finding(
                "pivot.tip_changed",
                f"The tip is {moved:.3f} mm from where probe '{body.name}' had it.",
                "Check that the right tip is mounted and chosen.",
                refuses=True,
                forcible=True,
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
                f"The tip is known to {1e3 * tip_sigma:.0f} um only, and "
                f"{1e3 * limits.tip_sigma_mm:.0f} um is the limit.",
                f"{WIDER} If that does not help, calibrate the cameras in a deeper volume.",
                refuses=True,
                forcible=True,
            )
        )
    if frames // block <= LEAST_BLOCKS:
        found.append(
            Finding(
                "pivot.correlated",
                f"Frames resemble each other over {block} of {frames}: the sweep holds hardly more "
                f"than {frames // block} independent parts, and its uncertainty is a guess.",
                "Sweep longer and quicker, to and fro.",
                refuses=False,
            )
        )
    return found
