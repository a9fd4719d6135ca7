"""The session of a guided pivot calibration: its lines, and the poses of both sweeps."""

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
    """Name of the tip."""
    expected_tip: Vector3 | None
    """Where the tip should be, mm, in the frame of the document: by the calibration in force, or by
    the document; None where nothing is known of it."""
    cone: ArtefactUse | None
    """Where it has a name."""
    slack_mm: float
    """Standard deviation of the ball's place in the cone, per axis."""
    change_limit_mm: float
    """From this change of the tip on, a person must say why."""
    poses_wanted: int
    tip_sigma_mm: float
    """`poses_wanted`, `tip_sigma_mm`: A sweep is complete with so many poses and the tip known so
    well."""
    valid_days: int
    """For how long the calibration may be used."""
    again: bool | None = None
    """Whether the ball comes back into the first cone at the end: not where what was recorded lacks
    it. None in a session that an earlier version began, which did not ask for it."""

    def expected(self, body: ProbeBody) -> ProbeBody:
        """Return the probe with the tip where it should be."""
        if self.expected_tip is None:
            return body
        return replace(body, tip_probe=np.array(self.expected_tip))

    def limits(self) -> PivotLimits:
        """Return from where on the guards speak."""
        known = self.expected_tip is not None
        return PivotLimits() if known else PivotLimits(tip_change_mm=np.inf)

    def options(self) -> PivotOptions:
        """Return how the sweeps are evaluated."""
        return PivotOptions(slack_mm=self.slack_mm, pattern=True, limits=self.limits())


class PosesTaken(SessionEvent, frozen=True, kw_only=True):
    """Some poses of a sweep, in the order of time."""

    step: str
    """Which sweep."""
    poses: tuple[Spots, ...]
    """Spots (C, L) of each pose, px, by LED."""
    sigma_px: float
    """Standard deviation of a spot, per axis."""


class SweepDiscarded(SessionEvent, frozen=True, kw_only=True):
    """All poses of a sweep were thrown away, to begin it anew."""

    step: str


class ConeVisited(SessionEvent, frozen=True, kw_only=True):
    """The ball rests in the first cone again, at the end."""

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
        """Return the number of poses."""
        return sum(len(batch.uv) for batch in self.batches)

    def add(self, event: PosesTaken) -> None:
        """Take in a batch."""
        uv: Float = np.array([from_spots(pose) for pose in event.poses])
        self.batches.append(PivotSweep.even(uv, event.sigma_px))

    def sweep(self, rig: Rig, body: ProbeBody) -> PivotSweep:
        """Return all poses."""
        nothing = PivotSweep(np.empty((0, len(rig.cameras), body.n_leds, 2)), np.empty(0))
        parts = [nothing, *self.batches]
        return PivotSweep(
            np.concatenate([one.uv for one in parts]),
            np.concatenate([one.sigma_px for one in parts]),
        )
