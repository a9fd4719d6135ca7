"""Snapshots of a guided pivot calibration, and its result: what a screen shows and a report says.

Everything is plain data: lengths in mm, angles in rad, directions as unit vectors.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ocmm_core.calibration.guided import ProcedureView
from ocmm_core.calibration.pivot import PivotCalibration, PivotValidation
from ocmm_core.calibration.records import Finding, ProbeRecord
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody


class SweepPhase(StrEnum):
    """What happens to a sweep now; the order in which it happens."""

    IDLE = "not its turn"
    WAITING = "the ball is not in the cone"
    COUNTDOWN = "the ball is in the cone"
    TAKING = "taking poses"
    LEFT = "the ball left its place"
    GOOD = "complete"


@dataclass(frozen=True, slots=True)
class MapCell:
    """One cell of the sphere map: the probe held in one direction."""

    direction_world: Float
    """(3,), unit: from the ball to the middle of the LEDs. Cells lie about `CELL_RAD` apart
    (`_map`) and stay where they are while the sweep goes on."""
    poses: int
    """That were taken in it."""
    wanted: bool
    """It belongs to what a good sweep covers."""


@dataclass(frozen=True, slots=True)
class SweepView:
    """One of the two sweeps as it stands."""

    phase: SweepPhase
    """What happens to it now."""
    poses: int
    poses_wanted: int
    """`poses`, `poses_wanted`: Taken, and the least for a good end."""
    attitudes: int
    attitudes_wanted: int
    """`attitudes`, `attitudes_wanted`: Likewise attitudes at least two degrees apart."""
    ranges: Float
    ranges_wanted: Float
    """`ranges`, `ranges_wanted`: (3,), rad: how far the probe was turned about the axis of most
    turn, of second most and of least, and how far it should be."""
    tip_sigma_mm: float
    tip_sigma_wanted_mm: float
    """`tip_sigma_mm`, `tip_sigma_wanted_mm`: Standard uncertainty of the tip that is predicted if
    the sweep ended now (root of the sum over its axes), infinite before it can be told; and what is
    good enough."""
    map_middle_world: Float
    """(3,), unit: about which the map is drawn; NaN before the first pose."""
    cells: tuple[MapCell, ...]
    """Of the sphere map: all with a pose, and all that are wanted."""
    centre_world: Float
    """(3,), mm: where the ball rests; NaN before it is known."""
    good: bool
    """Nothing is missing: the sweep ends by itself."""
    missing: str
    """What is missing or wrong, in one sentence; empty when good."""
    may_end: bool = False
    """`PivotProcedure.end_sweep` would end it now: it is good, or somebody overruled the guards and
    it holds at least what they never let go."""

    @property
    def covered(self) -> float:
        """Return which part of the wanted cells has poses, 0 to 1."""
        wanted = [cell for cell in self.cells if cell.wanted]
        return sum(cell.poses > 0 for cell in wanted) / max(len(wanted), 1)


@dataclass(frozen=True, slots=True)
class PivotChange:
    """How a calibration differs from the one in force for the same tip."""

    previous: ProbeRecord
    tip_difference: Float
    """(3,), mm, probe frame: new less old."""
    led_differences: Points3
    """(L, 3), mm, likewise."""
    limit_mm: float
    """From this distance of the tips on a person must say why."""

    @property
    def tip_distance(self) -> float:
        """Return the distance of both tips, mm."""
        return float(np.linalg.norm(self.tip_difference))

    @property
    def led_rms(self) -> float:
        """Return the RMS distance of the LEDs, mm."""
        return float(np.sqrt(np.mean(np.sum(self.led_differences**2, axis=1))))

    @property
    def must_be_confirmed(self) -> bool:
        """Return whether `accept` wants a reason."""
        return self.tip_distance > self.limit_mm


@dataclass(frozen=True, slots=True)
class PivotOutcome:
    """The result of both sweeps.

    The thesis's method on the same frames is in ``first.thesis`` and ``second.thesis``
    (`pivot.ThesisPivot`: centres of the spheres, spread, Table 4), residuals of the spots,
    frames left out and the tip of every frame are in the calibrations.
    """

    record: ProbeRecord
    """That would be stored; its ``change_reason`` is filled in when it is accepted."""
    body: ProbeBody
    """The probe with this geometry; its ball is that of the document."""
    first: PivotCalibration
    second: PivotCalibration
    """`first`, `second`: Of each sweep; the first one is the calibration."""
    validation: PivotValidation
    """How the second agrees with it."""
    change: PivotChange | None
    """To the calibration in force; None for the first one of this tip."""
    findings: tuple[Finding, ...]
    """What speaks against it without refusing it, of both sweeps and their comparison."""

    @property
    def must_be_confirmed(self) -> bool:
        """Return whether the tip changed so much that `accept` wants a reason."""
        return self.change is not None and self.change.must_be_confirmed


def led_paths(found: PivotCalibration) -> Float:
    """Return where the LEDs went in a sweep, (n, L, 3), mm, world; NaN for frames left out.

    For plots: each LED stays on a sphere about ``found.centre_world``.
    """
    arms = found.leds_probe - found.tip_probe
    paths: Float = np.einsum("nij,lj->nli", found.rotations, arms) + found.centre_world
    return paths


@dataclass(frozen=True, slots=True)
class PivotView:
    """Snapshot of the pivot calibration."""

    base: ProcedureView
    """What all procedures show. Its hint says what to do now, or what a guard would refuse."""
    probe: str
    tip: str
    """`probe`, `tip`: Names."""
    in_cone: bool
    """The ball rests in the cone now."""
    countdown_s: float | None
    """Seconds until poses are taken; None unless it runs."""
    direction_world: Float
    """(3,), unit: where the probe points now, the mark on the sphere map; NaN while not seen."""
    first: SweepView
    second: SweepView
    """`first`, `second`: The two sweeps."""
    place_distance_mm: float
    attitude_distance: float
    """`place_distance_mm`, `attitude_distance`: How far the second sweep is from the first: between
    the places of the ball, and between the middles of the attitudes, rad; NaN before it has poses.
    """
    place_wanted_mm: float
    attitude_wanted: float
    """`place_wanted_mm`, `attitude_wanted`: One of the two must be reached."""
    warnings: tuple[Finding, ...]
    """What is the matter now: hidden LEDs, a cone that moves, another probe."""
    outcome: PivotOutcome | None
    """Of `compute`; None before it, and after more was taken."""

    @property
    def sweep(self) -> SweepView | None:
        """Return the sweep that is being taken; None in the other steps."""
        return {"first": self.first, "second": self.second}.get(self.base.step.name)
