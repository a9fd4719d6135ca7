"""Options of a station."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

from ocmm_core.acceptance import ThermometerLog
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.station._probe_watch import PAUSE
from ocmm_core.station._touches import Intent
from ocmm_core.station.stream import StreamOptions
from ocmm_core.tracking import TrackingOptions


@dataclass(frozen=True, slots=True)
class StationOptions:
    session: SessionOptions
    tracking: TrackingOptions
    live_source: bool = False
    """Frames are pushed over a bus, so that silence is a fault."""
    intent: Intent | None = None
    """Of scripted operators: feature of a touch; None: the active feature gets every point."""
    follow: Callable[[int], None] | None = None
    """For scripted operators: receives the newest exposure once earlier touches are judged."""
    pause: timedelta = PAUSE
    """Time without a point or a check after which the tip must be checked."""
    stream: StreamOptions | None = None
    room_log: ThermometerLog | None = None
    """Thermometers logged in each job; None if none."""
    plan_file: Path | None = None
    """Path of the plan, next to its pictures; None if unknown."""
    released_only: bool = False
    simulated: bool = False
    """The frames come from a virtual rig, which the job states permanently."""
