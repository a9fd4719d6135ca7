"""The measuring station: everything that runs while a job is measured.

In: a source, rig, probe, plan and records in force, and commands of the inspector.
Out: live snapshots, views of the job, the job file, and the live stream for other programs.

Read `_station` (what runs together), `_frame_loop` (the thread from ring to touches), `_live`
(what the machine sees now), `_faults` (a defect stays until a new start), `_jobs` and
`_plan_change`. The watches: `_calibration_watch`, `_change_watch`, `_probe_watch`,
`_reference_watch`, `_bus_watch`. `stream` is the room for other programs.
Numbers come from the rooms below. It must not know a screen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.station._bus_watch import (
        NO_BUS,
        NO_BUS_REMEDY,
        NO_REPORT,
        NO_REPORT_REMEDY,
        TREND_S,
        BusSample,
        BusView,
        BusWatch,
        bus_text,
    )
    from ocmm_core.station._jobs import free_path, give_back
    from ocmm_core.station._station import MeasuringStation, StationOptions
else:
    __getattr__ = door(
        __name__,
        _bus_watch=(
            "BusSample BusView BusWatch NO_BUS NO_BUS_REMEDY NO_REPORT NO_REPORT_REMEDY TREND_S "
            "bus_text"
        ),
        _jobs="free_path give_back",
        _station="MeasuringStation StationOptions",
    )

__all__ = [
    "NO_BUS",
    "NO_BUS_REMEDY",
    "NO_REPORT",
    "NO_REPORT_REMEDY",
    "TREND_S",
    "BusSample",
    "BusView",
    "BusWatch",
    "MeasuringStation",
    "StationOptions",
    "bus_text",
    "free_path",
    "give_back",
]
