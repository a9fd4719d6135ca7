"""The measuring station: acquisition, reconstruction and session, run together.

Window and command line use the same station. Frames go from the ring through tracking to the
session on the reconstruction thread; all others pull snapshots. Signals carry changes of state only
and are emitted on the thread that made the change. Installed packages add servers that let other
programs measure with a running station.
"""

from __future__ import annotations

import inspect
import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from ocmm_core.acceptance import ThermometerLog
from ocmm_core.acquisition.bus_process import Acquisition, ChildProcess, RemoteObjects
from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.acquisition.recording import FrameHistory
from ocmm_core.calibration.records import CalibrationInUse, ProbeInUse
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import Plan
from ocmm_core.plugins import load
from ocmm_core.settings import Settings
from ocmm_core.station._bus_watch import BusWatch
from ocmm_core.station._calibration_watch import PAUSE, CalibrationWatch
from ocmm_core.station._faults import StationEvents, StationFaults
from ocmm_core.station._frame_loop import RECORDING, FrameLoop, FrameSink, Intent, TouchRecorder
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._job import Reports, StationJob
from ocmm_core.station._job_change import JobChange
from ocmm_core.station._live import LiveState
from ocmm_core.station._looks import Looks, StationMaintenance
from ocmm_core.station._name_watch import HISTORY, JOB, PROBE, NameWatch, RoomWatch
from ocmm_core.station._open_job import CurrentJob, Gear, PartLoader, PlanInUse, open_job
from ocmm_core.station.coaching import CoachWatch
from ocmm_core.station.stream import StreamOptions, StreamServer
from ocmm_core.storage import JobFile
from ocmm_core.tracking import SkewMeter, TrackingOptions


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
    frame_period_ns: int = 0
    """Of cameras without proof of a common exposure time."""


_log = logging.getLogger(__name__)

_STOP_S = 1.5


class MeasuringStation:
    """Measure jobs one by one: join the services of a station, start and stop them.

    `job`, `recorder` (every raw frame): closed by `close`. `acquisition` fills ``ring``, both owned
    by the station. `history`: last frames in memory.
    """

    def __init__(
        self,
        plan: Plan,
        calibration: CalibrationInUse,
        probe: ProbeInUse,
        job: JobFile,
        acquisition: Acquisition,
        ring: FrameRing,
        options: StationOptions,
        recorder: FrameSink | None = None,
        history: FrameHistory | None = None,
    ) -> None:
        self.history = history
        """The last raw frames, or None."""
        self._acquisition, self._ring, self._recorder = acquisition, ring, recorder
        # Statements about results depend on the method of their poses.
        session = replace(options.session, method=options.tracking.method)
        gear = Gear(calibration, probe, session.reference, options.pause, options.released_only)
        use = PlanInUse(plan, session, options.plan_file)
        self._current = current = CurrentJob(open_job(job, use, gear))
        halt = threading.Event()
        self.faults = faults = StationFaults(halt, current)
        self.events = events = StationEvents(faults)
        job_name = {JOB: lambda: current.now.file.check_name(lambda error: faults.fail(error, JOB))}
        self._watches: list[NameWatch | RoomWatch] = [
            NameWatch(job_name, faults),
            NameWatch(self._checks(gear), faults),
        ]
        if options.room_log is not None:
            self._watches.append(
                RoomWatch(
                    options.room_log,
                    lambda: current.now.session,
                    lambda verb: self.job.change(verb),
                    faults,
                )
            )
        bus = BusWatch(ring) if options.live_source else None
        live = LiveState(gear.rig, gear.body, session.point, bus, gear.reference)
        objects = None
        if isinstance(acquisition, ChildProcess):
            objects = partial(RemoteObjects, acquisition)
        self._calibration = watch = CalibrationWatch(
            calibration,
            bus,
            objects,
            failed=lambda error: faults.fail(error, "Monitoring the calibration"),
        )
        self.instruments = instruments = Instruments(
            gear, watch, current, bus, faults, events, simulated=options.simulated
        )
        self.maintenance = StationMaintenance(
            current, watch, bus, gear.rig.name, faults, events, untimed=calibration.untimed
        )
        self.looks = looks = Looks(ring, live, bus, instruments, self.maintenance, faults)
        self.coach = CoachWatch(
            gear.rig, gear.body, looks, failed=lambda error: faults.note(error, "The coach")
        )
        """Turn of the probe that would improve its ball, or the remedy while it is lost."""
        step = TouchRecorder(
            current, live, instruments, self.maintenance, faults, events, options.intent,
            options.follow,
        )  # fmt: skip
        self._frames = frames = FrameLoop(
            ring,
            gear,
            options.tracking,
            session.point,
            home=current.now.session.reference_home,
            step=step,
            faults=faults,
            halt=halt,
            recorder=recorder,
            history=history,
            skew=(
                SkewMeter(gear.rig, gear.body, options.frame_period_ns)
                if calibration.untimed
                else None
            ),
        )
        self.job = StationJob(current, self.looks, frames, faults, events)
        self._parts = PartLoader(faults, events)
        self.jobs = JobChange(gear, current, instruments, frames, events, self._parts)
        self.reports = Reports(current, instruments)
        self.stream: StreamServer | None = None
        """The live stream for other programs, or None."""
        if options.stream is not None:
            self.stream = StreamServer(
                self, options.stream, lambda error: faults.note(error, "The live stream")
            )

    def start(self) -> None:
        """Start acquisition and reconstruction, and the stream if configured.

        MeasuringError: the address of the stream is unavailable; nothing runs then. InternalError:
        unexpected; the station is FAILED then, as after any other error.
        """
        # psygnal inspects all modules when a listener first fails: done here, that delays no frame;
        # in the reconstruction thread of a busy computer it takes 0.3 s.
        inspect.getmodule(inspect.currentframe())
        try:
            if self.stream is not None:
                self.stream.start()
            self.instruments.note_start(self._current.now)
            self._acquisition.start()
            self._calibration.start()
            self._frames.start()
            for watch in self._watches:
                watch.start()
            self._parts.start(self._current.now)
        except Exception as error:
            raise self.faults.fail(error, "The start", tell=False) from error

    def request_stop(self) -> None:
        """Request the end of acquisition and reconstruction; returns immediately."""
        self._acquisition.request_stop()
        self._frames.request_stop()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end of both within a common timeout; return whether it came."""
        until = time.monotonic() + timeout_s
        ended = self._acquisition.join(timeout_s)
        ended = self._frames.join(max(until - time.monotonic(), 0.0)) and ended
        return self._calibration.close(max(until - time.monotonic(), 0.0)) and ended

    def close(self) -> None:
        """Stop, and release ring, recorder and job file. May be called twice."""
        if self._current.ended:
            return
        self.request_stop()
        self._parts.close()
        if not self.coach.close(_STOP_S):
            _log.error("The coach did not end within %s s.", _STOP_S)
        if not self.join(_STOP_S):
            _log.error("The acquisition did not end within %s s.", _STOP_S)
        if self.stream is not None and not self.stream.close():
            _log.error("The stream did not end in time.")
        for watch in self._watches:
            watch.close()
        self._current.ended = True
        self.looks.close()
        self._ring.close()
        if self._recorder is not None:
            try:
                self._recorder.close()
            except Exception as error:
                # Points precede the recording: the job is closed in any case.
                self.faults.note(error, RECORDING)
        self._current.now.file.close()
        if self.history is not None:
            self.history.clear()

    def _checks(self, gear: Gear) -> Mapping[str, Callable[[], OcmmError | None]]:
        """Return the checks of the names of histories and recording."""
        stores = {HISTORY: gear.calibration.store, PROBE: gear.probe.store}
        checks: dict[str, Callable[[], OcmmError | None]] = {
            part: store.check_name for part, store in stores.items() if store is not None
        }
        if self._recorder is not None:
            checks[RECORDING] = self._recorder.check_name
        return checks

    def wait_finished(self, timeout_s: float) -> bool:
        """Wait until the source has ended and all its frames are measured; return whether so."""
        return self._frames.wait_drained(timeout_s)


GROUP = "ocmm.services"


@dataclass(frozen=True, slots=True)
class ServiceState:
    """What a server does now, for screens."""

    title: str
    """Protocol and edition."""
    address: str
    client: str = ""
    """Address of the connected program; empty: none."""
    command: str = ""
    answer: str = ""
    """`command`, `answer`: last lines of the program and to it."""
    sentence: str = ""
    """Last sentence for the operator."""
    page: str = ""
    """Address for a browser, with its token; empty: none."""
    open_pages: int = 0
    code: tuple[bytes, ...] = ()
    """QR code of that address: rows of modules, 1 for dark, with a light border."""


class StationService(Protocol):
    """A running server; its methods may be called on any thread."""

    def state(self) -> ServiceState: ...

    def operate(self, words: str) -> None:
        """Send a word of the operator, such as ``done``."""
        ...

    def close(self) -> bool:
        """Disconnect the program and release the station, which keeps running; False: too late."""
        ...


@dataclass(frozen=True, slots=True)
class ServiceSpec:
    """A server in the group `ocmm.services`."""

    start: Callable[[MeasuringStation, Any, Settings], StationService]
    """From a running station, its virtual hand or None, and settings; OcmmError if it cannot."""


def start_service(
    name: str, station: MeasuringStation, hand: Any, settings: Settings
) -> StationService:
    """Start an installed server on a running station; OcmmError if it cannot."""
    spec = load(GROUP, name, ServiceSpec)
    if spec is None:
        raise InputError(
            "service.not_installed",
            f"The server {name} is not installed.",
            "Install OCMM again, with all its packages.",
        )
    return spec.start(station, hand, settings)
