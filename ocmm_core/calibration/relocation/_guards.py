"""Criteria that a relocation must meet; same principle as `guards`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy

from ocmm_core.calibration.bundle import BundleState, Prior, RobustMinimum
from ocmm_core.calibration.cameras import (
    CHI2_DEVIATION,
    FLAT_REFUSED,
    FLAT_WARNED,
    FOCAL_SIGMA,
    OUTLIERS_REFUSED,
    RMS_FORCED,
    RMS_REFUSED,
    cloud_of,
)
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.relocation import _data as data
from ocmm_core.calibration.relocation._frame import Anchors
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel
from ocmm_core.geometry import Float, Int, Points3

FEW_FRAMES = 100
FEW_PLACEMENTS = 5
PLACEMENTS_REFUSED = 0.3
BAR_SIGMAS = 5.0
"""Relative to the mean of all placements; the influence of the probe only makes it smaller."""

ANCHOR_SIGMAS = 5.0
CONTRADICTION = 1e-5
"""Probability below which a shift of known quantities is not attributed to chance."""


def judge_convergence(found: RobustMinimum, remedy: str) -> list[Finding]:
    if found.minimum.converged:
        return []
    what = "The adjustment did not converge."
    return [Finding("calibration.not_converged", what, remedy, refuses=True)]


def judge_residuals(chi2: float, dof: int) -> list[Finding]:
    ratio = float(np.sqrt(chi2 / dof))
    said = f"The residuals are {ratio:.1f} times the stated sigmas of the spots"
    deviation = CHI2_DEVIATION * np.sqrt(2.0 / dof)
    if ratio > RMS_REFUSED:
        return [
            Finding(
                "calibration.rms",
                f"{said}; not a valid calibration.",
                "Check that the cameras are those of the rig document, that the probe is the right "
                "one, and that no camera moved meanwhile.",
                refuses=True,
            )
        ]
    if ratio**2 > 1.0 + deviation:
        return [
            Finding(
                "calibration.chi2",
                f"{said} (chi-square {chi2:.0f} for {dof} degrees of freedom).",
                "Look for a moving camera, a loose LED or a probe waved too fast, and check the "
                "sigma of the spots.",
                refuses=ratio > RMS_FORCED,
            )
        ]
    if ratio**2 < 1.0 - deviation:
        return [
            Finding(
                "calibration.chi2_low",
                f"The residuals are {1.0 / max(ratio, 1e-9):.1f} times smaller than the stated "
                "sigma of the spots.",
                "State the true sigma of the spots; the uncertainty of this calibration is too "
                "large.",
                refuses=False,
            )
        ]
    return []


def judge_spots(
    wrong: Sequence[data.WrongSpot], seen: int, cameras: Sequence[CameraModel]
) -> list[Finding]:
    if not wrong:
        return []
    counts = [sum(spot.camera == index for spot in wrong) for index in range(len(cameras))]
    by_camera = ", ".join(
        f"{count} of camera '{camera.name}'" for camera, count in zip(cameras, counts, strict=True)
    )
    return [
        Finding(
            "calibration.outliers",
            f"1 of {seen} spots is an outlier and was excluded: {by_camera}."
            if len(wrong) == 1
            else f"{len(wrong)} of {seen} spots are outliers and were excluded: {by_camera}.",
            "Look for reflections and LEDs that hide each other, and wave the probe again.",
            refuses=len(wrong) > OUTLIERS_REFUSED * seen,
        )
    ]


def judge_design(
    observed: data.Observations, bars: Sequence[data.BarResidual], targets: Points3, frames: int,
    scale_rests_on: str | None = None,
) -> Iterator[Finding]:  # fmt: skip
    """Yield findings on the choice of frames and bars.

    ``targets`` (n, 3), mm, world: LEDs seen by two cameras; ``scale_rests_on``: name of the bar if
    it is the only reference of length.
    """
    if frames < FEW_FRAMES:
        yield Finding(
            "relocation.few_frames",
            f"Only {frames} frames of the probe were used.",
            "Wave the probe longer; aim for 500 frames all over the volume.",
            refuses=False,
        )
    if not observed.bars:
        yield Finding(
            "relocation.no_bar",
            "No length bar was shown: the scale depends on the probe LEDs alone.",
            "Show a certified bar in ten placements.",
            refuses=False,
        )
    else:
        yield from _placements(observed, bars)
    if scale_rests_on is not None:
        yield Finding(
            "relocation.one_bar",
            f"All lengths depend on bar '{scale_rests_on}' alone: nothing else would reveal "
            "an error in it.",
            "Verify with another certified bar before measuring.",
            refuses=False,
        )
    flat = cloud_of(targets).flatness
    if flat < FLAT_WARNED:
        yield Finding(
            "calibration.flat_volume",
            f"The LEDs fill a volume that is {flat:.2f} times as deep as wide: points in front "
            f"of and behind it are measured wrong.",
            "Wave the probe through the whole volume, also to and from the cameras.",
            refuses=flat < FLAT_REFUSED,
            forcible=True,
        )


def _placements(observed: data.Observations, bars: Sequence[data.BarResidual]) -> Iterator[Finding]:
    used = sum(bar.used for bar in bars)
    if used < len(bars):
        wrong = [bar for bar in bars if not bar.used]
        listed = ", ".join(
            f"{bar.placement + 1} ({1e3 * bar.error_mm:+.0f} um)" for bar in wrong[:10]
        )
        yield Finding(
            "relocation.bar_left_out",
            f"{len(wrong)} of {len(bars)} bar placements do not fit and were excluded: {listed}.",
            "Repeat these placements. If most of them do not fit, check the certified "
            "length and the geometry of the probe.",
            refuses=len(wrong) > PLACEMENTS_REFUSED * len(bars),
        )
    weights = np.array([bar.sigma_mm**-2 for bar in bars if bar.used])
    errors = np.array([bar.error_mm for bar in bars if bar.used])
    # The thermometer's error is in the certified length, and in the uncertainty of the result.
    heat = max((bar.sigma for bar in observed.bars if bar.per_k), default=0.0)
    total = weights.sum()
    if used and abs(weights @ errors) > BAR_SIGMAS * np.hypot(np.sqrt(total), total * heat):
        yield Finding(
            "relocation.bar_contradicts",
            "Bar and probe LEDs contradict each other: the bar appears "
            f"{1e3 * (weights @ errors) / weights.sum():+.1f} um off its certified length.",
            "Check the certified length and the temperature, and relocate with another "
            "certified bar. If the result is the same, calibrate the probe again.",
            refuses=True,
        )
    if used < FEW_PLACEMENTS:
        yield Finding(
            "relocation.few_placements",
            f"A length bar was used in only {used} placement(s).",
            "Show it in ten placements all over the volume and in all directions.",
            refuses=False,
        )


def judge_focal(cameras: Sequence[CameraModel], covariance: Float) -> Iterator[Finding]:
    """Yield findings on insufficiently determined focal lengths."""
    for index, camera in enumerate(cameras):
        focal = N_PARAMETERS * index + PARAMETERS.index("focal")
        sigma = float(np.sqrt(covariance[focal, focal])) / camera.focal
        if sigma > FOCAL_SIGMA:
            yield Finding(
                "calibration.focal_sigma",
                f"The focal length of camera '{camera.name}' is known only to {sigma:.1e} "
                f"of its value; the limit is {FOCAL_SIGMA:.0e}.",
                "Wave the probe through a deeper volume, and tilt it more.",
                refuses=True,
                forcible=True,
            )


def judge_knowledge(
    observed: data.Observations, options: data.RelocationOptions, prior: Prior, state: BundleState
) -> Iterator[Finding]:
    """Yield findings on prior knowledge contradicted by the frames."""
    columns = state.columns
    off = state.values() - prior.values
    if options.geometry == "uncertain" and _contradicts(prior, off, columns.all_leds()):
        moved = off[columns.of_leds].reshape(-1, 3)
        led = int(np.argmax(np.linalg.norm(moved, axis=1)))
        yield Finding(
            "relocation.probe_changed",
            f"The probe LEDs deviate from its document, LED {led + 1} most, by "
            f"{1e3 * np.linalg.norm(moved[led]):.0f} um.",
            "Select the right probe, or calibrate the probe again; then repeat the relocation.",
            refuses=True,
        )
    for index, bar in enumerate(observed.bars):
        column = columns.of_lengths.start + index
        if _contradicts(prior, off, np.array([column])):
            yield Finding(
                "relocation.bar_contradicts",
                f"According to the probe and other bars, bar '{bar.name}' is "
                f"{1e3 * off[column]:+.1f} um off its certified length, "
                f"{abs(off[column]) / bar.sigma:.0f} times its uncertainty.",
                "Check the certified length and the temperature, and relocate with another "
                "certified bar. If the result is the same, calibrate the probe again.",
                refuses=True,
            )
    if options.lens == "prior":
        for index, camera in enumerate(state.cameras):
            lens = np.arange(N_PARAMETERS * index + 6, N_PARAMETERS * (index + 1))
            if _contradicts(prior, off, lens):
                yield Finding(
                    "relocation.lens_changed",
                    f"The lens of camera '{camera.name}' does not match its previous "
                    f"calibration (focal length {1e3 * off[lens[0]]:+.1f} um).",
                    "Check the lens for looseness, and fasten it; then calibrate the "
                    "cameras from known points.",
                    refuses=True,
                )


def judge_anchors(names: Sequence[str], anchors: Anchors, covariance: Float) -> list[Finding]:
    """Return findings on displaced anchors; ``covariance`` (k, k) of the common unknowns."""
    variances = np.diag(anchors.follow @ covariance @ anchors.follow.T).reshape(-1, 3).sum(axis=1)
    residuals = np.linalg.norm(anchors.points - anchors.targets, axis=1)
    limits = ANCHOR_SIGMAS * np.sqrt(variances + 3.0 * anchors.sigma**2)
    wrong = [
        f"'{name}' ({1e3 * miss:.0f} um)"
        for name, miss, limit in zip(names, residuals, limits, strict=True)
        if miss > limit
    ]
    if not wrong:
        return []
    return [
        Finding(
            "relocation.points_moved",
            "The points that define the world frame have moved relative to each other: "
            f"{', '.join(wrong)}.",
            "Check that none of them was moved and that each was touched under its own name.",
            refuses=True,
        )
    ]


def _contradicts(prior: Prior, off: Float, columns: Int) -> bool:
    information = prior.information[np.ix_(columns, columns)]
    known = np.count_nonzero(information.diagonal())
    if not known:
        return False
    others = np.setdiff1d(np.flatnonzero(prior.information.diagonal()), columns)
    across = prior.information[np.ix_(columns, others)]
    if across.any():
        # One thermometer errs in all of them: what the others allow for is no contradiction.
        scale = np.sqrt(prior.information.diagonal()[others])
        rest = prior.information[np.ix_(others, others)] / np.outer(scale, scale)
        across = across / scale
        information = information - across @ np.linalg.solve(rest, across.T)
    square = float(off[columns] @ information @ off[columns])
    return bool(scipy.special.chdtrc(known, square) < CONTRADICTION)
