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
    """Frames of a probe that is swept while its ball rests in a cone, in the order of time."""

    uv: Pixels
    """(n, C, L, 2), px, by LED number; NaN where not seen."""
    sigma_px: Float
    """(n,), px per axis: standard deviation of a spot in each frame."""

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
    """From where on a guard speaks."""

    least_attitudes: int = 50
    """Attitudes at least two degrees apart."""
    weak_deg: float = 8.0
    """Range about the second axis below which the tip would be guessed: never accepted."""
    small_deg: float = 20.0
    wanted_deg: float = 40.0
    """`small_deg`, `wanted_deg`: Range about the second axis that is refused and that is warned
    about (thesis: 90)."""
    roll_deg: float = 10.0
    """Range about the third axis that is warned about."""
    moved_mm: float = 0.02
    """How far the ball may have moved between parts of the sweep."""
    left_out: float = 0.1
    """Part of the frames that may be left out."""
    shape_mm: float = 0.5
    """RMS distance of the LEDs from those of the probe's document."""
    tip_change_mm: float = 0.5
    """How far the tip may be from that of the document unless a person says why."""
    tip_sigma_mm: float = 0.02
    """Standard uncertainty of the tip (root of the sum over its axes)."""


@dataclass(frozen=True, slots=True)
class PivotOptions:
    """How a sweep is evaluated."""

    slack_mm: float = 0.0
    """Standard deviation of the ball's place in its cone, mm per axis; 0 where it rests."""
    seed: int = 1
    resamples: int = 500
    """Draws of the bootstrap."""
    pattern: bool = False
    """The sensors have the fixed pattern that the rig says, and its part of the uncertainty is
    computed; without it, spots scatter by their sigma alone, as in simulations of it."""
    limits: PivotLimits = field(default_factory=PivotLimits)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A frame that was left out."""

    frame: int
    """Index into the sweep."""
    reason: Reason
    """Why."""
    size: float
    """Reduced chi-square of its spots for "spots", mm for "tip", 0 for "few"."""


@dataclass(frozen=True, slots=True)
class SweepCoverage:
    """How far the probe was turned."""

    axes_probe: Float
    """(3, 3): rows are the axes of the probe about which it was turned most to least."""
    ranges: Float
    """(3,), rad: from the 1st to the 99th percentile of the turn about each of them."""
    attitudes: int
    """Number of attitudes at least two degrees apart."""
    directions_world: Points3
    """(n, 3), unit: from the ball to the middle of the LEDs, for the sphere map."""


@dataclass(frozen=True, slots=True)
class PivotCalibration:
    """A probe as its sweep shows it."""

    leds_probe: Points3
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3) and (3,), mm: in the frame of the probe's document, into
    which the LEDs are laid."""
    covariance: Float
    """(3 L + 3, 3 L + 3), mm^2: LEDs, then the tip, in that frame: noise of the sweep by block
    bootstrap and the uncertainty of the cameras."""
    noise_covariance: Float
    formal_covariance: Float
    """`noise_covariance`, `formal_covariance`: Likewise: bootstrap alone, and what independent
    frames of the stated sigma would give."""
    by_cameras: Float
    """(3 L + 3, 14 C): what a change of the cameras does to LEDs and tip."""
    centre_world: Float
    """(3,), mm: where the ball rested."""
    rotations: Float
    """(n, 3, 3), world from probe; NaN for frames that were left out."""
    used: NDArray[np.bool_]
    """(n,): frames that took part."""
    left_out: tuple[LeftOut, ...]
    """The others, in order."""
    residuals_px: Pixels
    """(n, C, L, 2), observed minus predicted; NaN where not seen or left out."""
    rms_px: float
    chi2: float
    dof: int
    """`rms_px`, `chi2`, `dof`: Of the residuals of what took part."""
    tips_world: Points3
    """(n, 3), mm: the tip as each single frame shows it; NaN where it does not."""
    block: int
    """Frames that the bootstrap takes as one."""
    coverage: SweepCoverage
    thesis: ThesisPivot
    """The thesis's method on the same frames."""
    thesis_tip_probe: Float
    """(3,), mm: the tip by the thesis's method, in the same frame as `tip_probe`."""
    warnings: tuple[Finding, ...]
    """What speaks against this calibration and was not refused."""
    iterations: int
    """Steps of the adjustments."""
    forced: bool
    """Whether a person overruled a guard."""

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
