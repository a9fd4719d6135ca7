"""The lines of the session files of tip qualification and quick tip check."""

from __future__ import annotations

from typing import TypeAlias

from ocmm_core.calibration.guided import Begun, SessionEvent, Spots
from ocmm_core.calibration.records import ArtefactUse, Sphere
from ocmm_core.calibration.tip._qualification import TipLimits


class TouchBegun(Begun, frozen=True, kw_only=True):
    """What the first line of either procedure says."""

    tip: str
    """Name of the tip."""
    probe_identity: str
    """Hash of the probe's document."""
    sphere: Sphere
    """That is touched."""
    cone: ArtefactUse | None
    """Where it has a name."""
    nominal_mm: float
    """Diameter that the ball should have."""


class TipBegun(TouchBegun, frozen=True, kw_only=True):
    """First line of a qualification: `TouchBegun`, limits, and for how long it may be used."""

    limits: TipLimits
    valid_days: int


class TipCheckBegun(TouchBegun, frozen=True, kw_only=True):
    """First line of a check: `TouchBegun` and the hash of the qualification that is checked."""

    qualification: str


class BallOnSphere(SessionEvent, frozen=True, kw_only=True):
    """The ball at one point of the sphere: averaged spots (C, L), px, and their sigma."""

    uv: Spots
    sigma_px: float


class BallInCone(SessionEvent, frozen=True, kw_only=True):
    """The ball in the cone in one attitude; see `BallOnSphere`."""

    uv: Spots
    sigma_px: float


class TakenBack(SessionEvent, frozen=True, kw_only=True):
    """One observation of a step was taken back, wherever it stands."""

    step: str
    point: int


TouchEvent: TypeAlias = TipBegun | TipCheckBegun | BallOnSphere | BallInCone | TakenBack
