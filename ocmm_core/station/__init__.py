"""The measuring station: everything that runs while a job is measured.

In flow an acquisition with its ring, a plan, the calibration, the probe and an open job file; out
flow signals, snapshots, and the points in the file. `MeasuringStation` joins its services and
starts and stops them: ``job`` (the inspector's commands), ``jobs`` (the next part, another plan),
``looks`` (live values, bus), ``instruments`` (calibration and probe), ``maintenance``,
``reports``, ``events`` (signals) and ``faults``.
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
    from ocmm_core.station._faults import StationEvents, StationFaults
    from ocmm_core.station._instruments import Instruments
    from ocmm_core.station._job import StationJob
    from ocmm_core.station._job_change import JobChange
    from ocmm_core.station._jobs import free_path, give_back
    from ocmm_core.station._looks import Looks
    from ocmm_core.station._maintenance import StationMaintenance
    from ocmm_core.station._options import StationOptions
    from ocmm_core.station._reports import Reports
    from ocmm_core.station._station import MeasuringStation
else:
    __getattr__ = door(
        __name__,
        _bus_watch=(
            "BusSample BusView BusWatch NO_BUS NO_BUS_REMEDY NO_REPORT NO_REPORT_REMEDY TREND_S "
            "bus_text"
        ),
        _faults="StationEvents StationFaults",
        _instruments="Instruments",
        _job="StationJob",
        _job_change="JobChange",
        _jobs="free_path give_back",
        _looks="Looks",
        _maintenance="StationMaintenance",
        _options="StationOptions",
        _reports="Reports",
        _station="MeasuringStation",
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
    "Instruments",
    "JobChange",
    "Looks",
    "MeasuringStation",
    "Reports",
    "StationEvents",
    "StationFaults",
    "StationJob",
    "StationMaintenance",
    "StationOptions",
    "bus_text",
    "free_path",
    "give_back",
]
