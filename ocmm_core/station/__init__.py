"""The measuring station: everything that runs while a job is measured.

In: a source, rig, probe, plan and records in force, and commands of the inspector.
Out: live snapshots, views of the job, the job file, and the live stream for other programs.

Read `_station` first: it joins, starts and stops the services. These are ``job`` (`_job`: actions
of an inspector), ``jobs`` (`_job_change`: the next part, another plan), ``looks`` (live values,
bus), ``instruments`` (calibration and probe), ``maintenance``, ``reports``, ``events`` (signals)
and ``faults`` (permanent until restart). `_frame_loop` is the thread from ring to touches,
and the step after it, `_live` the current state of the machine. The watches:
`_calibration_watch` (and of the tip), `_bus_watch`. Package `stream` serves other programs, and
`_station` starts servers of other packages. Numbers come from lower packages. It must not know a
screen.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.station._bus_watch import (
        NO_BUS, NO_BUS_REMEDY, NO_REPORT, NO_REPORT_REMEDY, TREND_S, BusSample, BusView, BusWatch,
        bus_text,
    )  # fmt: skip
    from ocmm_core.station._faults import StationEvents, StationFaults
    from ocmm_core.station._instruments import Instruments
    from ocmm_core.station._job import (
        Reports, StationJob, drop_job_without_points, free_path, give_back,
    )  # fmt: skip
    from ocmm_core.station._job_change import JobChange
    from ocmm_core.station._looks import Looks, StationMaintenance
    from ocmm_core.station._station import (
        MeasuringStation, ServiceSpec, ServiceState, StationOptions, StationService, start_service,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "NO_BUS", "NO_BUS_REMEDY", "NO_REPORT", "NO_REPORT_REMEDY", "TREND_S", "BusSample", "BusView",
    "BusWatch", "Instruments", "JobChange", "Looks", "MeasuringStation", "Reports", "ServiceSpec",
    "ServiceState", "StationEvents", "StationFaults", "StationJob", "StationMaintenance",
    "StationOptions", "StationService", "bus_text", "drop_job_without_points", "free_path",
    "give_back", "start_service",
]  # fmt: skip
