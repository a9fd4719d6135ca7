"""How a station works."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.station._probe_watch import PAUSE
from ocmm_core.station._touches import Intent
from ocmm_core.station.stream import StreamOptions
from ocmm_core.tracking import TrackingOptions


@dataclass(frozen=True, slots=True)
class StationOptions:
    """How the station works."""

    session: SessionOptions
    tracking: TrackingOptions
    """`session`, `tracking`: Options of the session and of the tracking."""
    live_source: bool = False
    """Frames come by themselves, over a bus, so that silence means a fault."""
    intent: Intent | None = None
    """For scripted operators: which feature the touch that ends at an exposure is meant for; None
    where the active feature of the session takes every point."""
    pause: timedelta = PAUSE
    """After so long without a point or a check the tip must be checked."""
    stream: StreamOptions | None = None
    """How points and poses are given to other programs; None where they are not."""
    plan_file: Path | None = None
    """Where the plan is, with its pictures beside it; None where that is not known."""
    released_only: bool = False
    """Refuse plans that are not released."""
    simulated: bool = False
    """The frames come from a virtual rig; the job says so, for good."""
