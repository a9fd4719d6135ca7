"""Validation of a sweep by a second, independent one.

The same ball in another cone, or swept at other attitudes, must give the same tip: reveals camera
errors that the first sweep could not (thesis 3.2.2: 5.2 um, of which noise explains a tenth).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ocmm_core.calibration.pivot._data import PivotCalibration, PivotSweep
from ocmm_core.calibration.pivot._robust import free_poses
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3

CONTRADICTION = 1e-4
"""Probability below which a difference of two sweeps is not attributed to chance."""

OTHER_PLACE_MM = 30.0
OTHER_ATTITUDE = np.radians(15.0)
_CELL = np.radians(10.0)
_LEAST_IN_CELL = 5


@dataclass(frozen=True, slots=True)
class PivotValidation:
    """Agreement of a second sweep with a calibration."""

    tip_difference: Float
    """(3,), mm, probe frame: tip of the second sweep less that of the first."""
    tip_difference_sigma: Float
    """(3,), mm: standard uncertainty of the difference."""
    led_difference: float
    """mm: RMS distance of the LEDs."""
    place_distance: float
    """mm: between the ball positions."""
    attitude_distance: float
    """rad: between the mean attitudes."""
    articulation_2s: float
    articulation_max: float
    """`articulation_2s`, `articulation_max`: mm: two standard deviations and the largest distance
    from their mean of the tips that the first calibration gives, averaged over attitudes within 10
    degrees (single point articulation, ASME B89.4.22)."""
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Return whether nothing refuses."""
        return not any(one.refuses for one in self.findings)


def validate_pivot(
    rig: Rig, first: PivotCalibration, second: PivotCalibration, sweep: PivotSweep
) -> PivotValidation:
    """Return the agreement of the second calibration, from ``sweep``, with the first.

    Same rig and document: common effects of camera errors cancel from the uncertainty.
    """
    off = second.tip_probe - first.tip_probe
    by_cameras = (second.by_cameras - first.by_cameras)[-3:]
    covariance = (first.noise_covariance + second.noise_covariance)[-3:, -3:]
    covariance = covariance + by_cameras @ rig.parameter_covariance @ by_cameras.T
    chi2 = float(off @ np.linalg.solve(covariance, off))
    place = float(np.linalg.norm(second.centre_world - first.centre_world))
    attitude = attitude_between(first.coverage.directions_world, second.coverage.directions_world)
    spread, largest = _articulation(rig, first, second, sweep)
    sigma = np.sqrt(np.diag(covariance))
    findings = []
    if place < OTHER_PLACE_MM and attitude < OTHER_ATTITUDE:
        findings.append(
            Finding(
                "pivot.same_place",
                f"The second sweep is only {place:.0f} mm from the first, in the same "
                "attitudes: it repeats the first one's errors.",
                "Sweep in another cone elsewhere, or lean the probe another way.",
                refuses=True,
                forcible=True,
            )
        )
    if chi2 > scipy.special.chdtri(3, CONTRADICTION):
        findings.append(
            Finding(
                "pivot.contradiction",
                f"The second sweep places the tip {1e3 * np.linalg.norm(off):.1f} um from the "
                f"first; about {1e3 * np.sqrt(np.sum(sigma**2)):.1f} um is expected.",
                "Clean ball and cone, check stylus and LEDs for looseness, and repeat both "
                "sweeps. If it persists, calibrate the cameras.",
                refuses=True,
            )
        )
    return PivotValidation(
        tip_difference=off,
        tip_difference_sigma=sigma,
        led_difference=float(
            np.sqrt(np.mean(np.sum((second.leds_probe - first.leds_probe) ** 2, axis=1)))
        ),
        place_distance=place,
        attitude_distance=attitude,
        articulation_2s=spread,
        articulation_max=largest,
        findings=tuple(findings),
    )


def _articulation(
    rig: Rig, first: PivotCalibration, second: PivotCalibration, sweep: PivotSweep
) -> tuple[float, float]:
    free = free_poses(rig, sweep.only(second.used), first.leds_probe - first.tip_probe)
    cells = np.round(second.coverage.directions_world / _CELL).astype(np.int64)
    means = []
    for cell in np.unique(cells, axis=0):
        own = (cells == cell).all(axis=1) & free.solved
        if np.count_nonzero(own) >= _LEAST_IN_CELL:
            # Tips are weighted by the covariance of their own spots.
            information = np.linalg.inv(free.covariances[own])
            pull = np.einsum("nij,nj->i", information, free.tips[own])
            means.append(np.linalg.solve(information.sum(axis=0), pull))
    if len(means) < 2:
        return np.nan, np.nan
    distances = np.linalg.norm(np.array(means) - np.mean(means, axis=0), axis=1)
    return 2.0 * float(np.sqrt(np.sum(distances**2) / (len(means) - 1))), float(distances.max())


def attitude_between(first: Points3, second: Points3) -> float:
    """Return the angle, rad, between the middles of two sets of unit directions.

    Each cell of directions counts once, so that dwelling of the hand has no influence.
    """
    a, b = (
        np.unique(np.round(directions / _CELL), axis=0).mean(axis=0)
        for directions in (first, second)
    )
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
