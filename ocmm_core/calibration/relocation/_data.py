"""Input and output of a relocation: observations, options and the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.relocation._request import GeometryMode, LensMode
from ocmm_core.camera import CameraModel, Rig
from ocmm_core.geometry import Float, Int, Pixels, Points3


@dataclass(frozen=True, slots=True)
class ProbeFrames:
    """Simultaneous spots of the probe, by LED number."""

    uv: Pixels
    """(n, C, L, 2), px; NaN if unseen."""
    sigma_px: Float
    """(n,), px per axis: standard deviation of a spot in each frame, smaller for averages."""
    seats: Int
    """(n,): index into `Observations.seats` of the seat of the ball, -1 in the air."""

    @classmethod
    def waved(cls, uv: Pixels, sigma_px: float) -> ProbeFrames:
        """Return frames of a probe in the air, all with one sigma."""
        return cls(uv, np.full(len(uv), sigma_px), np.full(len(uv), -1, dtype=np.int64))


@dataclass(frozen=True, slots=True)
class BarDistance:
    """A certified distance between two LEDs, or between two seats of the ball."""

    name: str
    length: float
    sigma: float
    """`length`, `sigma`: mm, at the temperature of the observations; standard uncertainty (k = 1).
    The same true length holds in all placements, so its error does not average out."""
    per_k: float = 0.0
    """Growth by one kelvin, mm/K; the error of the thermometer is part of `sigma`."""


@dataclass(frozen=True, slots=True)
class ShownBar:
    """A bar with an LED at each end, in several placements."""

    bar: BarDistance
    uv: Pixels
    """(m, C, 2, 2), px: placement, camera, end; NaN if unseen."""
    sigma_px: Float
    """(m,), px per axis: standard deviation of a spot in each placement."""


@dataclass(frozen=True, slots=True)
class TouchedBar:
    """A bar with two seats touched by the ball of the probe, in several placements."""

    bar: BarDistance
    """Certified distance between the centres of a ball in both seats."""
    seats: tuple[tuple[str, str], ...]
    """Names of the end seats of each placement; every placement has its own."""


@dataclass(frozen=True, slots=True)
class Observations:
    frames: ProbeFrames
    """The probe, waved and seated."""
    shown_bars: tuple[ShownBar, ...] = ()
    touched_bars: tuple[TouchedBar, ...] = ()
    """`shown_bars`, `touched_bars`: Certified lengths; either kind gives the scale."""
    seats: tuple[str, ...] = ()
    """Fixed places in which the ball rested: nests, cones and seats of touched bars."""
    seat_sigma: float = 0.001
    """mm per axis: seating repeatability of the ball."""

    @property
    def bars(self) -> tuple[BarDistance, ...]:
        """Return all certified lengths, those of the shown bars first."""
        shown = tuple(one.bar for one in self.shown_bars)
        return shown + tuple(one.bar for one in self.touched_bars)


@dataclass(frozen=True, slots=True)
class KeptByCameras:
    """Cameras stay, on average, in place in the world; no other reference."""


@dataclass(frozen=True, slots=True)
class KeptByPoints:
    """World stays in place: at least three seats have reference coordinates."""

    positions_world: Mapping[str, Float]
    """(3,), mm, of the centre of the ball, by name of the seat."""
    sigma: float = 0.0
    """mm per axis."""


@dataclass(frozen=True, slots=True)
class SetByPoints:
    """Three touched seats define a new world."""

    origin: str
    """Seat at (0, 0, 0)."""
    on_x: str
    """Seat on the positive X axis."""
    in_xy: str
    """Seat in the XY plane, on the side of positive Y."""


WorldFrame: TypeAlias = KeptByCameras | KeptByPoints | SetByPoints


@dataclass(frozen=True, slots=True)
class RelocationOptions:
    """Unknowns and world frame of a relocation."""

    lens: LensMode = "prior"
    geometry: GeometryMode = "uncertain"
    """`lens`, `geometry`: See `LensMode` and `GeometryMode`."""
    world: WorldFrame = field(default_factory=KeptByCameras)
    thermometer_k: float = 0.0
    """Standard uncertainty, K, of the shared temperature; zero: lengths as observed."""


@dataclass(frozen=True, slots=True)
class WrongSpot:
    """A spot classified as outlier."""

    frame: int
    camera: int
    led: int
    """`frame`, `camera`, `led`: Indices into `ProbeFrames.uv`."""
    sigmas: float
    """Length of the residual in standard deviations."""


@dataclass(frozen=True, slots=True)
class BarResidual:
    """One placement of a bar."""

    bar: str
    placement: int
    """Index among the placements of that bar."""
    measured_mm: float
    """Distance of its ends from this placement alone, with the new cameras."""
    error_mm: float
    """Measured less certified."""
    sigma_mm: float
    """Standard deviation of the measured distance from the noise of its spots."""
    used: bool
    """False for outliers."""


@dataclass(frozen=True, slots=True)
class RelocationResult:
    """Relocated cameras with their evaluation."""

    cameras: tuple[CameraModel, ...]
    covariance: Float
    """(14 C, 14 C), in the order of `camera.model.PARAMETERS`, camera by camera, in the new world
    frame including its uncertainty; scaled by chi-square per degree of freedom if above one, never
    shrunk."""
    leds_probe: Points3
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3) and (3,), mm, from these frames."""
    geometry_covariance: Float
    """(3 L + 3, 3 L + 3), mm^2, of LEDs and tip."""
    rms_px: float
    chi2: float
    dof: int
    """`rms_px`, `chi2`, `dof`: Per coordinate of the used probe spots; of all residuals."""
    residuals_px: Pixels
    """(n, C, L, 2), observed minus predicted; NaN if unseen."""
    used: NDArray[np.bool_]
    """(n, C, L): False for unseen spots and outliers."""
    wrong_spots: tuple[WrongSpot, ...]
    frames_used: NDArray[np.bool_]
    """(n,): frames used."""
    bars: tuple[BarResidual, ...]
    """All placements."""
    seats_world: Mapping[str, Float]
    """(3,), mm, by name: ball centres in the seats."""
    hull_world: Points3
    """(h, 3), mm: corners of the convex hull of all LEDs seen by two cameras."""
    tips_world: Points3
    """(n, 3), mm; NaN for unused frames."""
    volume_world: Float
    """(2, 3), mm: box in which points are accepted, around the tips of the frames."""
    warnings: tuple[Finding, ...]
    """Findings that did not refuse it."""
    options: RelocationOptions
    thermal: tuple[float, Float] | None = None
    """Standard uncertainty of the thermometer's error after the adjustment, K, and derivative of
    the parameters (14 C,) by it; None without a thermometer."""

    def applied_to(self, rig: Rig, identity: str) -> Rig:
        """Return the rig with these cameras; ``identity`` is that of the calibration's record."""
        return replace(
            rig,
            cameras=self.cameras,
            volume_world=self.volume_world,
            parameter_covariance=self.covariance,
            identity=identity,
        )
