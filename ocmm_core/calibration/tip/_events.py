"""Session file events of tip qualification and quick tip check."""

from __future__ import annotations

from typing import TypeAlias

from ocmm_core.calibration.guided import Begun, SessionEvent, Spots
from ocmm_core.calibration.records import ArtefactUse, Sphere
from ocmm_core.calibration.tip._qualification import TipLimits


class TouchBegun(Begun, frozen=True, kw_only=True):
    """Common first line of both procedures."""

    tip: str
    probe_identity: str
    sphere: Sphere
    cone: ArtefactUse | None
    nominal_mm: float


class TipBegun(TouchBegun, frozen=True, kw_only=True):
    """First line of a qualification, with its limits and validity."""

    limits: TipLimits
    valid_days: int


class TipCheckBegun(TouchBegun, frozen=True, kw_only=True):
    """First line of a check, with the hash of the checked qualification."""

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
    """Any one observation of a step was removed."""

    step: str
    point: int


TouchEvent: TypeAlias = TipBegun | TipCheckBegun | BallOnSphere | BallInCone | TakenBack
