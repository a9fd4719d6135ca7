"""What a relocation takes and what it gives: observations, choices and the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.records import Finding
from ocmm_core.camera import CameraModel, Rig
from ocmm_core.geometry import Float, Int, Pixels, Points3, RigidTransform

LensMode = Literal["fixed", "prior", "free"]
"""What happens to the lenses: kept as they are (their uncertainty stays in the covariance), free
with what is known of them from before, or found anew from these frames alone."""

GeometryMode = Literal["known", "uncertain", "unknown"]
"""How the LEDs of the probe are known: exactly; with the uncertainty of the probe body; not at all,
so that the bar alone gives the scale."""


@dataclass(frozen=True, slots=True)
class ProbeFrames:
    """Simultaneous spots of the probe, by LED number."""

    uv: Pixels
    """(n, C, L, 2), px; NaN where not seen."""
    sigma_px: Float
    """(n,), px per axis: standard deviation of a spot in each frame; smaller where exposures were
    averaged."""
    seats: Int
    """(n,): index into `Observations.seats` of the seat in which the ball rested, -1 where it was
    in the air."""

    @classmethod
    def waved(cls, uv: Pixels, sigma_px: float) -> ProbeFrames:
        """Return frames of a probe in the air, all with one sigma."""
        return cls(uv, np.full(len(uv), sigma_px), np.full(len(uv), -1, dtype=np.int64))

    def joined(self, other: ProbeFrames) -> ProbeFrames:
        """Return these frames and, after them, the others."""
        return ProbeFrames(
            np.concatenate([self.uv, other.uv]),
            np.concatenate([self.sigma_px, other.sigma_px]),
            np.concatenate([self.seats, other.seats]),
        )


@dataclass(frozen=True, slots=True)
class LengthBar:
    """A certified distance between two LEDs, or between two seats of the ball."""

    name: str
    length: float
    sigma: float
    """`length`, `sigma`: mm, at the temperature of the observations; standard uncertainty (k = 1).
    The true length is the same in all placements, so that its error does not average out."""


@dataclass(frozen=True, slots=True)
class ShownBar:
    """A bar with an LED at each end, in several placements."""

    bar: LengthBar
    uv: Pixels
    """(m, C, 2, 2), px: placement, camera, end; NaN where not seen."""
    sigma_px: Float
    """(m,), px per axis: standard deviation of a spot in each placement."""


@dataclass(frozen=True, slots=True)
class TouchedBar:
    """A bar with two seats, which the ball of the probe was put into, in several placements."""

    bar: LengthBar
    """Its certified length, between the centres of a ball in both seats."""
    seats: tuple[tuple[str, str], ...]
    """For each placement the names of the seats at its ends: every placement has its own."""


@dataclass(frozen=True, slots=True)
class Observations:
    """Everything that was seen."""

    frames: ProbeFrames
    """The probe, waved and seated."""
    shown_bars: tuple[ShownBar, ...] = ()
    touched_bars: tuple[TouchedBar, ...] = ()
    """`shown_bars`, `touched_bars`: Known lengths; either kind gives the scale."""
    seats: tuple[str, ...] = ()
    """Names of the places that did not move while the ball rested in them: nests, cones and the
    seats of touched bars."""
    seat_sigma: float = 0.001
    """mm per axis: how well the ball finds back into a seat."""

    @property
    def bars(self) -> tuple[LengthBar, ...]:
        """Return all known lengths, those of the shown bars first."""
        shown = tuple(one.bar for one in self.shown_bars)
        return shown + tuple(one.bar for one in self.touched_bars)


@dataclass(frozen=True, slots=True)
class KeptByCameras:
    """The cameras stay, on the average, where they were in the world: nothing else is known."""


@dataclass(frozen=True, slots=True)
class KeptByPoints:
    """The world stays where it was: at least three seats are known in it."""

    positions_world: Mapping[str, Float]
    """(3,), mm, of the centre of the ball, by name of the seat."""
    sigma: float = 0.0
    """mm per axis."""


@dataclass(frozen=True, slots=True)
class SetByPoints:
    """Three touched seats make a new world."""

    origin: str
    """Seat at (0, 0, 0)."""
    on_x: str
    """Seat on the positive X axis."""
    in_xy: str
    """Seat in the XY plane, on the side of positive Y."""


WorldFrame: TypeAlias = KeptByCameras | KeptByPoints | SetByPoints


@dataclass(frozen=True, slots=True)
class RelocationOptions:
    """What is found anew."""

    lens: LensMode = "prior"
    geometry: GeometryMode = "uncertain"
    """`lens`, `geometry`: See `LensMode` and `GeometryMode`."""
    world: WorldFrame = field(default_factory=KeptByCameras)
    """What the world frame hangs on."""


@dataclass(frozen=True, slots=True)
class WrongSpot:
    """A spot that was left out."""

    frame: int
    camera: int
    led: int
    """`frame`, `camera`, `led`: Indices into `ProbeFrames.uv`."""
    miss_px: Float
    """(2,), observed minus predicted."""
    sigmas: float
    """Its length in standard deviations."""


@dataclass(frozen=True, slots=True)
class BarResidual:
    """One placement of a bar."""

    bar: str
    """Name."""
    placement: int
    """Index among the placements of that bar."""
    measured_mm: float
    """Distance of its ends as this placement alone shows it, with the new cameras."""
    error_mm: float
    """Measured less certified."""
    sigma_mm: float
    """Standard deviation of the measured distance from the noise of its spots."""
    used: bool
    """False for a placement that was left out."""


@dataclass(frozen=True, slots=True)
class RelocationResult:
    """The cameras after a relocation and what may be said about them."""

    cameras: tuple[CameraModel, ...]
    """In the order of the rig."""
    covariance: Float
    """(14 C, 14 C), in the order of `camera.model.PARAMETERS`, camera by camera, in the new world
    frame and with the uncertainty of that frame; grown by chi-square per degree of freedom where
    that is above one, never shrunk."""
    T_world_from_start: RigidTransform
    """Motion from the world of the start rig to the new one as far as the frame was moved after the
    adjustment."""
    leds_probe: Points3
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3) and (3,), mm: LEDs and tip of the probe as these frames
    show them."""
    geometry_covariance: Float
    """(3 L + 3, 3 L + 3), mm^2, of LEDs and tip."""
    rms_px: float
    chi2: float
    dof: int
    """`rms_px`, `chi2`, `dof`: RMS residual per coordinate of the used spots of the probe, and how
    all residuals compare with their uncertainties."""
    residuals_px: Pixels
    """(n, C, L, 2), observed minus predicted; NaN where not seen."""
    used: NDArray[np.bool_]
    """(n, C, L): False for what was not seen or left out."""
    wrong_spots: tuple[WrongSpot, ...]
    frames_used: NDArray[np.bool_]
    """(n,): frames that took part."""
    bars: tuple[BarResidual, ...]
    """All placements."""
    seats_world: Mapping[str, Float]
    """(3,), mm, by name: where the balls in the seats are."""
    hull_world: Points3
    """(h, 3), mm: corners of the convex hull of all LEDs that two cameras saw."""
    tips_world: Points3
    """(n, 3), mm; NaN for frames that did not take part."""
    volume_world: Float
    """(2, 3), mm: box in which points are accepted; it holds the tips of the frames."""
    warnings: tuple[Finding, ...]
    """What speaks against this calibration and was not refused."""
    iterations: int
    """Steps that were tried."""
    options: RelocationOptions
    """How it was made."""
    forced: bool
    """Whether a person overruled a guard."""

    def applied_to(self, rig: Rig, identity: str) -> Rig:
        """Return the rig with these cameras; ``identity`` is that of the calibration's record."""
        return replace(
            rig,
            cameras=self.cameras,
            volume_world=self.volume_world,
            parameter_covariance=self.covariance,
            identity=identity,
        )
