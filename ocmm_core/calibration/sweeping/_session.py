"""Session events of a guided pivot calibration, and the poses of both sweeps."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration.guided import Begun, SessionEvent, Spots, from_spots
from ocmm_core.calibration.pivot import PivotLimits, PivotOptions, PivotSweep
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.camera import Rig, Vector3
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

PREPARE, FIRST, SECOND = "prepare", "first", "second"
AGAIN, RESULT = "again", "result"
SWEEPS = (FIRST, SECOND)


class PivotBegun(Begun, frozen=True, kw_only=True):
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

    def limits(self) -> PivotLimits:
        known = self.expected_tip is not None
        return PivotLimits() if known else PivotLimits(tip_change_mm=np.inf)

    def options(self) -> PivotOptions:
        return PivotOptions(slack_mm=self.slack_mm, pattern=True, limits=self.limits())


class PosesTaken(SessionEvent, frozen=True, kw_only=True):
    """Poses of a sweep in time order."""

    step: str
    poses: tuple[Spots, ...]
    """Spots (C, L) of each pose, px, by LED."""
    sigma_px: float
    """Standard deviation of a spot, per axis."""


class SweepDiscarded(SessionEvent, frozen=True, kw_only=True):
    """All poses of a sweep were discarded."""

    step: str


class ConeVisited(SessionEvent, frozen=True, kw_only=True):
    """The ball rests in the first cone at the end."""

    uv: Spots
    """Spots (C, L), px, by LED."""
    sigma_px: float
    """Standard deviation of a spot, per axis."""


PivotEvent: TypeAlias = PivotBegun | PosesTaken | SweepDiscarded | ConeVisited


@dataclass(slots=True)
class SweepPoses:
    """The poses of one sweep, batch by batch."""

    batches: list[PivotSweep] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(len(batch.uv) for batch in self.batches)

    def add(self, event: PosesTaken) -> None:
        uv: Float = np.array([from_spots(pose) for pose in event.poses])
        self.batches.append(PivotSweep.even(uv, event.sigma_px))

    def sweep(self, rig: Rig, body: ProbeBody) -> PivotSweep:
        nothing = PivotSweep(np.empty((0, len(rig.cameras), body.n_leds, 2)), np.empty(0))
        parts = [nothing, *self.batches]
        return PivotSweep(
            np.concatenate([one.uv for one in parts]),
            np.concatenate([one.sigma_px for one in parts]),
        )
