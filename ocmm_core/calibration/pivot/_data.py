"""What a pivot calibration takes and what it gives: a sweep, choices and the result."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.pivot._centre import ThesisPivot
from ocmm_core.calibration.records import Finding
from ocmm_core.geometry import Float, Pixels, Points3
from ocmm_core.tracking import ProbeBody

Reason = Literal["few", "spots", "tip"]
"""Why a frame was left out: fewer than three LEDs seen by two cameras; spots that do not fit the
probe; the ball was not where it rested in the others."""


@dataclass(frozen=True, slots=True)
class PivotSweep:
    """Frames of a probe that is swept while its ball rests in a cone, in the order of time.

    Attributes
    ----------
    uv
        (n, C, L, 2), px, by LED number; NaN where not seen.
    sigma_px
        (n,), px per axis: standard deviation of a spot in each frame.
    """

    uv: Pixels
    sigma_px: Float

    @classmethod
    def even(cls, uv: Pixels, sigma_px: float) -> PivotSweep:
        """Return a sweep whose frames all have one sigma."""
        return cls(uv, np.full(len(uv), sigma_px))

    @property
    def weights(self) -> Float:
        """Return the weights of the spots (n, C, L), 1/px; zero where not seen."""
        seen = np.isfinite(self.uv).all(axis=3)
        weights: Float = np.where(seen, 1.0 / self.sigma_px[:, None, None], 0.0)
        return weights

    def only(self, chosen: NDArray[np.bool_]) -> PivotSweep:
        """Return the chosen frames (n,)."""
        return replace(self, uv=self.uv[chosen], sigma_px=self.sigma_px[chosen])


@dataclass(frozen=True, slots=True)
class PivotLimits:
    """From where on a guard speaks.

    Attributes
    ----------
    least_attitudes
        Attitudes at least two degrees apart.
    weak_deg
        Range about the second axis below which the tip would be guessed: never accepted.
    small_deg, wanted_deg
        Range about the second axis that is refused and that is warned about (thesis: 90).
    roll_deg
        Range about the third axis that is warned about.
    moved_mm
        How far the ball may have moved between parts of the sweep.
    left_out
        Part of the frames that may be left out.
    shape_mm
        RMS distance of the LEDs from those of the probe's document.
    tip_change_mm
        How far the tip may be from that of the document unless a person says why.
    tip_sigma_mm
        Standard uncertainty of the tip (root of the sum over its axes).
    """

    least_attitudes: int = 50
    weak_deg: float = 8.0
    small_deg: float = 20.0
    wanted_deg: float = 40.0
    roll_deg: float = 10.0
    moved_mm: float = 0.02
    left_out: float = 0.1
    shape_mm: float = 0.5
    tip_change_mm: float = 0.5
    tip_sigma_mm: float = 0.02


@dataclass(frozen=True, slots=True)
class PivotOptions:
    """How a sweep is evaluated.

    Attributes
    ----------
    slack_mm
        Standard deviation of the ball's place in its cone, mm per axis; 0 where it rests.
    seed
        Of the random choices.
    resamples
        Draws of the bootstrap.
    pattern
        The sensors have the fixed pattern that the rig says, and its part of the uncertainty is
        computed; without it, spots scatter by their sigma alone, as in simulations of it.
    limits
        Of the guards.
    """

    slack_mm: float = 0.0
    seed: int = 1
    resamples: int = 500
    pattern: bool = False
    limits: PivotLimits = field(default_factory=PivotLimits)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A frame that was left out.

    Attributes
    ----------
    frame
        Index into the sweep.
    reason
        Why.
    size
        Reduced chi-square of its spots for "spots", mm for "tip", 0 for "few".
    """

    frame: int
    reason: Reason
    size: float


@dataclass(frozen=True, slots=True)
class SweepCoverage:
    """How far the probe was turned.

    Attributes
    ----------
    axes_probe
        (3, 3): rows are the axes of the probe about which it was turned most to least.
    ranges
        (3,), rad: from the 1st to the 99th percentile of the turn about each of them.
    attitudes
        Number of attitudes at least two degrees apart.
    directions_world
        (n, 3), unit: from the ball to the middle of the LEDs, for the sphere map.
    """

    axes_probe: Float
    ranges: Float
    attitudes: int
    directions_world: Points3


@dataclass(frozen=True, slots=True)
class PivotCalibration:
    """A probe as its sweep shows it.

    Attributes
    ----------
    leds_probe, tip_probe
        (L, 3) and (3,), mm: in the frame of the probe's document, into which the LEDs are laid.
    covariance
        (3 L + 3, 3 L + 3), mm^2: LEDs, then the tip, in that frame: noise of the sweep by block
        bootstrap and the uncertainty of the cameras.
    noise_covariance, formal_covariance
        Likewise: bootstrap alone, and what independent frames of the stated sigma would give.
    by_cameras
        (3 L + 3, 14 C): what a change of the cameras does to LEDs and tip.
    centre_world
        (3,), mm: where the ball rested.
    rotations
        (n, 3, 3), world from probe; NaN for frames that were left out.
    used
        (n,): frames that took part.
    left_out
        The others, in order.
    residuals_px
        (n, C, L, 2), observed minus predicted; NaN where not seen or left out.
    rms_px, chi2, dof
        Of the residuals of what took part.
    tips_world
        (n, 3), mm: the tip as each single frame shows it; NaN where it does not.
    block
        Frames that the bootstrap takes as one.
    coverage
        Of the frames that took part.
    thesis
        The thesis's method on the same frames.
    thesis_tip_probe
        (3,), mm: the tip by the thesis's method, in the same frame as `tip_probe`.
    warnings
        What speaks against this calibration and was not refused.
    iterations
        Steps of the adjustments.
    forced
        Whether a person overruled a guard.
    """

    leds_probe: Points3
    tip_probe: Float
    covariance: Float
    noise_covariance: Float
    formal_covariance: Float
    by_cameras: Float
    centre_world: Float
    rotations: Float
    used: NDArray[np.bool_]
    left_out: tuple[LeftOut, ...]
    residuals_px: Pixels
    rms_px: float
    chi2: float
    dof: int
    tips_world: Points3
    block: int
    coverage: SweepCoverage
    thesis: ThesisPivot
    thesis_tip_probe: Float
    warnings: tuple[Finding, ...]
    iterations: int
    forced: bool

    @property
    def tip_covariance(self) -> Float:
        """Return the covariance of the tip (3, 3), mm^2."""
        return self.covariance[-3:, -3:]

    @property
    def tip_sigma(self) -> float:
        """Return the root of the sum of the tip's variances, mm."""
        return float(np.sqrt(np.trace(self.tip_covariance)))

    def applied_to(self, body: ProbeBody, identity: str) -> ProbeBody:
        """Return the probe with this geometry; ``identity`` is that of the calibration's record."""
        return replace(
            body,
            leds_probe=self.leds_probe,
            tip_probe=self.tip_probe,
            geometry_covariance=self.covariance,
            identity=identity,
        )
