"""Input and output of a pivot calibration: sweep, options, result, and the table of two sweeps.

::

    # ocmm sweeps
    # sigma: 0.0146
    sweep;frame;serial;led;u;v
    1;1;20330001;1;312.4471;1766.0312

One row for each spot. ``sweep`` is 1 for the calibrating sweep and 2 for the independent one, with
the cone in another place or the probe leaning to another side. ``frame`` numbers the poses of a
sweep in the order of time; rows may be in any order. ``led`` counts from 1 in the order of the
probe document. ``sigma`` is the standard deviation of a spot, px per axis. Separators and decimal
signs: `ocmm_core.tables`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.pivot._centre import ThesisPivot
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Pixels, Points3
from ocmm_core.tables import TableAccount, TableOptions, TextRow, TextTable, read_pixels
from ocmm_core.tracking import ProbeBody

Reason = Literal["few", "spots", "tip"]
"""Reason for exclusion of a frame: fewer than three LEDs seen by two cameras; spots inconsistent
with the probe; ball not at the common place."""


@dataclass(frozen=True, slots=True)
class PivotSweep:
    """Frames in time order of a probe swept with its ball in a cone."""

    uv: Pixels
    """(n, C, L, 2), px, by LED number; NaN if unseen."""
    sigma_px: Float
    """(n,), px per axis: standard deviation of a spot in each frame."""

    @classmethod
    def even(cls, uv: Pixels, sigma_px: float) -> PivotSweep:
        """Return a sweep whose frames all have one sigma."""
        return cls(uv, np.full(len(uv), sigma_px))

    @property
    def weights(self) -> Float:
        """Return the weights of the spots (n, C, L), 1/px; zero if unseen."""
        seen = np.isfinite(self.uv).all(axis=3)
        return np.where(seen, 1.0 / self.sigma_px[:, None, None], 0.0)

    def only(self, chosen: NDArray[np.bool_]) -> PivotSweep:
        return replace(self, uv=self.uv[chosen], sigma_px=self.sigma_px[chosen])


@dataclass(frozen=True, slots=True)
class PivotLimits:
    """Limits of the guards."""

    least_attitudes: int = 50
    """Attitudes at least two degrees apart."""
    weak_deg: float = 8.0
    """Range about the second axis below which the tip is undetermined: always refused."""
    small_deg: float = 20.0
    wanted_deg: float = 40.0
    """`small_deg`, `wanted_deg`: Range about the second axis to refuse, to warn (thesis: 90)."""
    roll_deg: float = 10.0
    """Range about the third axis below which to warn."""
    moved_mm: float = 0.02
    """Largest motion of the ball between parts of the sweep."""
    left_out: float = 0.1
    """Largest fraction of excluded frames."""
    shape_mm: float = 0.5
    """RMS distance of the LEDs from those of the probe's document."""
    tip_change_mm: float = 0.5
    """Largest unexplained distance of the tip from that of the document."""
    tip_sigma_mm: float = 0.02
    """Standard uncertainty of the tip (root of the sum over its axes)."""


@dataclass(frozen=True, slots=True)
class PivotOptions:
    """How a sweep is evaluated."""

    slack_mm: float = 0.0
    """Standard deviation of the ball's place in its cone, mm per axis; 0 if it rests."""
    seed: int = 1
    resamples: int = 500
    """Draws of the bootstrap."""
    pattern: bool = False
    """The sensors have the fixed pattern of the rig; its contribution is computed. False: spots
    scatter by their sigma alone, as in simulations."""
    limits: PivotLimits = field(default_factory=PivotLimits)


@dataclass(frozen=True, slots=True)
class ExcludedFrame:
    frame: int
    """Index into the sweep."""
    reason: Reason
    size: float
    """Reduced chi-square of its spots for "spots", mm for "tip", 0 for "few"."""


@dataclass(frozen=True, slots=True)
class SweepCoverage:
    """Rotation range of the probe."""

    ranges: Float
    """(3,), rad: from the 1st to the 99th percentile of the rotation about each axis of the probe,
    by decreasing range."""
    attitudes: int
    """Number of attitudes at least two degrees apart."""
    directions_world: Points3
    """(n, 3), unit: from the ball to the middle of the LEDs, for the sphere map."""


@dataclass(frozen=True, slots=True)
class PivotCalibration:
    """Result of a pivot calibration."""

    leds_probe: Points3
    tip_probe: Float
    """`leds_probe`, `tip_probe`: (L, 3), (3,), mm: frame of the document, fitted to its LEDs."""
    covariance: Float
    """(3 L + 3, 3 L + 3), mm^2: LEDs, then the tip: block bootstrap plus camera uncertainty."""
    noise_covariance: Float
    formal_covariance: Float
    """`noise_covariance`, `formal_covariance`: Likewise: bootstrap; independent frames."""
    by_cameras: Float
    """(3 L + 3, 14 C): derivatives of LEDs and tip by the camera parameters."""
    centre_world: Float
    """(3,), mm: ball centre."""
    rotations: Float
    """(n, 3, 3), world from probe; NaN for excluded frames."""
    used: NDArray[np.bool_]
    """(n,): frames used."""
    left_out: tuple[ExcludedFrame, ...]
    residuals_px: Pixels
    """(n, C, L, 2), observed minus predicted; NaN if unseen or excluded."""
    rms_px: float
    chi2: float
    dof: int
    """`rms_px`, `chi2`, `dof`: Of the residuals of used frames."""
    tips_world: Points3
    """(n, 3), mm: the tip from each single frame, or NaN."""
    coverage: SweepCoverage
    thesis: ThesisPivot
    """The thesis's method applied to the same frames."""
    thesis_tip_probe: Float
    """(3,), mm: the tip by the thesis's method, in the same frame as `tip_probe`."""
    warnings: tuple[Finding, ...]
    """Findings that did not refuse it."""
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
        """Return the probe with this geometry and the ``identity`` of the record."""
        return replace(
            body,
            leds_probe=self.leds_probe,
            tip_probe=self.tip_probe,
            geometry_covariance=self.covariance,
            identity=identity,
        )


_COLUMNS = ("sweep", "frame", "serial", "led", "u", "v")
_SWEEPS = 2


@dataclass(frozen=True, slots=True)
class SweepTable:
    """Recorded sweeps, the calibrating one first, and the account of the reader."""

    sweeps: tuple[PivotSweep, ...]
    account: TableAccount


def load_sweeps(
    path: Path | str, rig: Rig, n_leds: int, options: TableOptions | None = None
) -> SweepTable:
    """Return both sweeps of a table; InputError if one is missing, for unknown or double rows."""
    read = read_pixels(path, _COLUMNS, options)
    table = read.table
    cameras = {str(camera.serial): index for index, camera in enumerate(rig.cameras)}
    frames: tuple[dict[int, Float], ...] = tuple({} for _ in range(_SWEEPS))
    for row in table.rows:
        sweep = _count(table, row, "sweep", _SWEEPS)
        led = _count(table, row, "led", n_leds)
        number = _count(table, row, "frame", None)
        camera = cameras.get(row.cells["serial"])
        if camera is None:
            raise _wrong(
                table, row.line, f"rig '{rig.name}' has no camera {row.cells['serial']!r}",
                "Select the rig the sweeps were taken with.",
            )  # fmt: skip
        uv = frames[sweep].setdefault(number, np.full((len(rig.cameras), n_leds, 2), np.nan))
        if np.isfinite(uv[camera, led, 0]):
            raise _wrong(table, row.line, "this spot occurs already", "Keep one of the rows.")
        uv[camera, led] = read.uv(row)
    for number, own in enumerate(frames, start=1):
        if not own:
            raise InputError(
                "sweeps.missing",
                f"{table.path}: there is no sweep {number}.",
                "Give both sweeps: the one that calibrates, and an independent one.",
            )
    sweeps = tuple(
        PivotSweep.even(np.array([own[number] for number in sorted(own)]), read.sigma_px)
        for own in frames
    )
    return SweepTable(sweeps, read.account)


def _count(table: TextTable, row: TextRow, column: str, most: int | None) -> int:
    text = row.cells[column]
    if not text.isdecimal() or int(text) < 1 or (most is not None and int(text) > most):
        wanted = "a number from 1" if most is None else f"1 to {most}"
        raise _wrong(table, row.line, f"there is no {column} {text!r}", f"Write {wanted}.")
    return int(text) - 1


def _wrong(table: TextTable, line: int, what: str, remedy: str) -> InputError:
    return InputError("sweeps.row", f"{table.path}, line {line}: {what}.", remedy)
