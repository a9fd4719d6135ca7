"""Snapshots, result and session events of a guided pivot calibration: mm, rad, unit vectors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration import guided, pivot
from ocmm_core.calibration.records import ArtefactUse, Finding, ProbeRecord
from ocmm_core.camera import Rig, Vector3
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import ProbeBody


class SweepPhase(StrEnum):
    """State of a sweep, in order of occurrence."""

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
    """(3,), unit: from the ball to the middle of the LEDs. Cells are about `CELL_RAD` apart
    (`_progress`) and fixed during the sweep."""
    poses: int
    wanted: bool
    """Required for good coverage."""


@dataclass(frozen=True, slots=True)
class SweepView:
    """Snapshot of one sweep."""

    phase: SweepPhase
    poses: int
    poses_wanted: int
    """`poses`, `poses_wanted`: Recorded, and minimum for completion."""
    attitudes: int
    attitudes_wanted: int
    """`attitudes`, `attitudes_wanted`: Likewise attitudes at least two degrees apart."""
    ranges: Float
    ranges_wanted: Float
    """`ranges`, `ranges_wanted`: (3,), rad: about the probe's axes, descending, and targets."""
    tip_sigma_mm: float
    tip_sigma_wanted_mm: float
    """`tip_sigma_mm`, `tip_sigma_wanted_mm`: Predicted standard uncertainty of the tip if the sweep
    ended now (root of the sum over its axes), infinite if unavailable; and its target."""
    map_middle_world: Float
    """(3,), unit: centre of the map; NaN before the first pose."""
    cells: tuple[MapCell, ...]
    """Cells of the sphere map with a pose, and required ones."""
    centre_world: Float
    """(3,), mm: ball centre; NaN if undetermined."""
    good: bool
    """Complete: the sweep ends automatically."""
    missing: str
    """Missing or wrong part, in one sentence; empty when good."""
    may_end: bool = False
    """`PivotProcedure.end_sweep` would end it now: it is good, or guards were overruled and it
    meets the minimum that cannot be overruled."""

    @property
    def covered(self) -> float:
        """Return the fraction of required cells with poses, 0 to 1."""
        wanted = [cell for cell in self.cells if cell.wanted]
        return sum(cell.poses > 0 for cell in wanted) / max(len(wanted), 1)


@dataclass(frozen=True, slots=True)
class PivotChange:
    """Change from the calibration in force for the same tip."""

    previous: ProbeRecord
    tip_difference: Float
    """(3,), mm, probe frame: new less old."""
    led_differences: Points3
    """(L, 3), mm, likewise."""
    limit_mm: float
    """Distance of the tips from which the user must give a reason."""

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
        return self.tip_distance > self.limit_mm


@dataclass(frozen=True, slots=True)
class PivotOutcome:
    """The result of both sweeps; the thesis's method is in ``first.thesis``, ``second.thesis``."""

    record: ProbeRecord
    """To be stored; its ``change_reason`` is set on acceptance."""
    body: ProbeBody
    """The probe with this geometry; its ball is that of the document."""
    first: pivot.PivotCalibration
    second: pivot.PivotCalibration
    """`first`, `second`: One for each sweep; the first is the calibration."""
    validation: pivot.PivotValidation
    """Agreement with the second."""
    change: PivotChange | None
    """From the calibration in force; None for the first one of this tip."""
    findings: tuple[Finding, ...]
    """Findings of both sweeps and their comparison that did not refuse it."""

    @property
    def must_be_confirmed(self) -> bool:
        """Return whether the change of the tip requires a reason in `accept`."""
        return self.change is not None and self.change.must_be_confirmed


def led_paths(found: pivot.PivotCalibration) -> Float:
    """Return the LED paths, (n, L, 3), mm, world; NaN if excluded. On spheres about the centre."""
    arms = found.leds_probe - found.tip_probe
    paths: Float = np.einsum("nij,lj->nli", found.rotations, arms) + found.centre_world
    return paths


@dataclass(frozen=True, slots=True)
class PivotView:
    """Snapshot of the pivot calibration."""

    base: guided.ProcedureView
    """Its hint gives the present task, or what a guard would refuse."""
    probe: str
    tip: str
    countdown_s: float | None
    """Seconds until recording starts; None unless counting down."""
    direction_world: Float
    """(3,), unit: current probe direction, the mark on the sphere map; NaN while unseen."""
    first: SweepView
    second: SweepView
    place_distance_mm: float
    attitude_distance: float
    """`place_distance_mm`, `attitude_distance`: Distance of the second sweep from the first: ball
    positions, and mean attitudes, rad; NaN before it has poses."""
    place_wanted_mm: float
    attitude_wanted: float
    """`place_wanted_mm`, `attitude_wanted`: One of the two must be reached."""
    warnings: tuple[Finding, ...]
    """Current problems: hidden LEDs, a moving cone, another probe."""
    outcome: PivotOutcome | None
    """Result of `compute`; None before it, and after further recording."""

    @property
    def sweep(self) -> SweepView | None:
        """Return the current sweep; None in the other steps."""
        return {"first": self.first, "second": self.second}.get(self.base.step.name)


PREPARE, FIRST, SECOND = "prepare", "first", "second"
AGAIN, RESULT = "again", "result"
SWEEPS = (FIRST, SECOND)


class PivotBegun(guided.SessionHeader, frozen=True, kw_only=True):
    """First line."""

    probe: str
    probe_identity: str
    """`probe`, `probe_identity`: Name of the probe, and hash of its document."""
    tip: str
    expected_tip: Vector3 | None
    """mm, document frame, by the calibration in force or the document; None if unknown."""
    cone: ArtefactUse | None
    slack_mm: float
    """Standard deviation of the ball's place in the cone, per axis."""
    change_limit_mm: float
    """Change of the tip from which the user must give a reason."""
    poses_wanted: int
    tip_sigma_mm: float
    """`poses_wanted`, `tip_sigma_mm`: Targets of a complete sweep."""
    valid_days: int
    again: bool | None = None
    """The ball returns to the first cone; False: recording without, None: earlier version."""

    def expected(self, body: ProbeBody) -> ProbeBody:
        if self.expected_tip is None:
            return body
        return replace(body, tip_probe=np.array(self.expected_tip))

    def limits(self) -> pivot.PivotLimits:
        known = self.expected_tip is not None
        return pivot.PivotLimits() if known else pivot.PivotLimits(tip_change_mm=np.inf)

    def options(self) -> pivot.PivotOptions:
        return pivot.PivotOptions(slack_mm=self.slack_mm, pattern=True, limits=self.limits())


class PosesTaken(guided.SessionEvent, frozen=True, kw_only=True):
    """Poses of a sweep in time order."""

    step: str
    poses: tuple[guided.Spots, ...]
    """Spots (C, L) of each pose, px, by LED."""
    sigma_px: float
    """Standard deviation of a spot, per axis."""


class SweepDiscarded(guided.SessionEvent, frozen=True, kw_only=True):
    """All poses of a sweep were discarded."""

    step: str


class ConeVisited(guided.SessionEvent, frozen=True, kw_only=True):
    """The ball rests in the first cone at the end."""

    uv: guided.Spots
    """Spots (C, L), px, by LED."""
    sigma_px: float
    """Standard deviation of a spot, per axis."""


PivotEvent: TypeAlias = PivotBegun | PosesTaken | SweepDiscarded | ConeVisited


@dataclass(slots=True)
class SweepPoses:
    """The poses of one sweep, batch by batch."""

    batches: list[pivot.PivotSweep] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(len(batch.uv) for batch in self.batches)

    def add(self, event: PosesTaken) -> None:
        uv: Float = np.array([guided.from_spots(pose) for pose in event.poses])
        self.batches.append(pivot.PivotSweep.even(uv, event.sigma_px))

    def sweep(self, rig: Rig, body: ProbeBody) -> pivot.PivotSweep:
        nothing = pivot.PivotSweep(np.empty((0, len(rig.cameras), body.n_leds, 2)), np.empty(0))
        parts = [nothing, *self.batches]
        return pivot.PivotSweep(
            np.concatenate([one.uv for one in parts]),
            np.concatenate([one.sigma_px for one in parts]),
        )
